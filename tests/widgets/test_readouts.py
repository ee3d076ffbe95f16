"""A readout's name, label, unit and colour agree: in every figure and preset, initially and after a press."""

from __future__ import annotations

from typing import Any

import pytest

from widgets.engine.contract import preset
from widgets.engine.host import Host
from widgets.engine.registry import WIDGETS

pytestmark = pytest.mark.native  # the page's frames are the same bytes: tests/pyodide/test_frames.py

UNITS = {"rotation": "°", "translation": "u", "λ": "u²", "away": "u", "percent": "%"}
ROLES = {"truth": "truth", "ghost": "ghost"}
# The words that a part of a readout's name requires in its label.
WORDS = {
    "rotation": "rotation",
    "translation": "translation",
    "truth": "truth",
    "exact": "exact",
    "rms": "rms",
    "rises": "rose",
    "high": "large",
    "low": "small",
    "along": "along",
    "across": "across",
    "discarded": "discarded",
    "kept": "kept",
    "one": "one cell",
    "fine": "fine",
    "start": "start",
}


@pytest.mark.parametrize("name", WIDGETS)
def test_labels_units_and_roles_agree_with_names(name: str) -> None:
    """Rotations are in degrees, translations in u, the truth's values have its colour, a missing value no unit."""
    widget, host = WIDGETS[name], Host()
    presses = [["press", button.name] for button in widget.buttons if button.does == "press"]
    for start in widget.presets:
        plain = preset(widget, start).plain()
        # The drive's scans are in metres; GICP measures in its covariances' standard deviations.
        length = "m" if plain["controls"].get("clouds") == "drive" else "u"
        residual = "σ" if plain["controls"].get("residual") == "gicp" else length
        for log in ([], presses[:1]):
            for readout in host.render("fig-x", {**plain, "log": log})["readouts"]:
                check(name, readout, length, residual)


def check(figure: str, readout: dict[str, Any], length: str, residual: str) -> None:
    """Check one readout. `length` and `residual` are the units of lengths that UNITS gives in u, and of a residual."""
    case = f"{figure}: the readout {readout['name']} ({readout})"
    label, parts = readout["label"].lower(), readout["name"].split("_")
    number = readout["value"].lstrip("−").replace(".", "").isdigit()
    for part in parts:
        assert WORDS.get(part, "") in label, f"{case} is to have {WORDS.get(part)!r} in its label, as its name says"
        if part in ROLES:
            assert readout["role"] == ROLES[part], f"{case} is to have the role {ROLES[part]!r}, as its name says"
    for word, usual in UNITS.items():
        unit = length if usual == "u" else usual
        if number and (word in parts or (word in label and "<" not in label)):
            assert readout["unit"] == unit, f"{case} is to be in {unit}: its name or label says {word}"
    if number and "rms" in label:
        unit = "" if "rises" in parts else residual
        assert readout["unit"] == unit, f"{case} is to have the unit {unit!r}, as a residual"
    if "at the start" in label or "all pairs" in label:
        assert readout["role"] == "ghost", f"{case} is to have the role 'ghost': it is not of what is shown now"
    if readout["name"] == "rms":
        assert readout["role"] in ("source", ""), f"{case} is to have the role 'source' or none"
    if readout["value"] in ("–", "…"):
        assert readout["unit"] == "", f"{case} has no value, and so no unit"


@pytest.mark.parametrize(
    ("name", "figure", "log", "unit"),
    [("clutter", "soft-family", [["press", "step"]], "%"), ("share", "pipeline", [["press", "finish"]], "%")],
)
def test_a_share_in_percent_is_one(name: str, figure: str, log: list[Any], unit: str) -> None:
    """A share of many is a number of percent, not a fraction with a percent sign."""
    frame = Host().render("fig-x", {**preset(WIDGETS[figure]).plain(), "log": log})
    (readout,) = (r for r in frame["readouts"] if r["name"] == name)
    assert readout["unit"] == unit
    assert 1 < float(readout["value"]) <= 100
