"""What a number is called, its unit and its colour say the same: in every figure and preset, at first and pressed."""

from __future__ import annotations

from typing import Any

import pytest

from widgets.contract import preset
from widgets.host import Host
from widgets.registry import WIDGETS

UNITS = {"rotation": "°", "translation": "u", "λ": "u²", "away": "u", "percent": "%"}
ROLES = {"truth": "truth", "ghost": "ghost"}
# What a part of a readout's name promises of its label.
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
    """A rotation is in degrees and a translation in u, what is of the truth has its colour, no unit stands alone."""
    widget, host = WIDGETS[name], Host()
    presses = [["press", button.name] for button in widget.buttons if button.does == "press"]
    for start in widget.presets:
        plain = preset(widget, start).plain()
        # GICP measures in its covariances' standard deviations.
        length = "σ" if plain["controls"].get("residual") == "gicp" else "u"
        for log in ([], presses[:1]):
            for readout in host.render("fig-x", {**plain, "log": log})["readouts"]:
                check(readout, length)


def check(readout: dict[str, Any], length: str) -> None:
    """length: the unit of a residual."""
    label, parts = readout["label"].lower(), readout["name"].split("_")
    number = readout["value"].lstrip("−").replace(".", "").isdigit()
    for part in parts:
        assert WORDS.get(part, "") in label, readout
        if part in ROLES:
            assert readout["role"] == ROLES[part], readout
    for word, unit in UNITS.items():
        if number and (word in parts or (word in label and "<" not in label)):
            assert readout["unit"] == unit, readout
    if number and "rms" in label:
        assert readout["unit"] == ("" if "rises" in parts else length), readout
    if "at the start" in label or "all pairs" in label:
        assert readout["role"] == "ghost", readout
    if readout["name"] == "rms":
        assert readout["role"] in ("source", ""), readout
    if readout["value"] in ("–", "…"):
        assert readout["unit"] == "", readout


@pytest.mark.parametrize(
    ("name", "figure", "log", "unit"),
    [("clutter", "soft-family", [["press", "step"]], "%"), ("share", "pipeline", [["press", "finish"]], "%")],
)
def test_a_share_in_percent_is_one(name: str, figure: str, log: list[Any], unit: str) -> None:
    """Parts of a whole that the figure draws as many are not told as a fraction with a percent sign."""
    frame = Host().render("fig-x", {**preset(WIDGETS[figure]).plain(), "log": log})
    (readout,) = (each for each in frame["readouts"] if each["name"] == name)
    assert readout["unit"] == unit
    assert 1 < float(readout["value"]) <= 100
