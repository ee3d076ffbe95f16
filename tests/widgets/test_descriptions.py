"""What a figure says in words: a reader who sees no picture learns from it what is shown, and that it has changed."""

from __future__ import annotations

import re

import pytest

from tests.widgets.test_every_widget import at, taped
from widgets.drawing.picture import number
from widgets.engine.contract import preset
from widgets.engine.controls import specs
from widgets.engine.host import Host
from widgets.engine.registry import WIDGETS

pytestmark = pytest.mark.native  # the page's frames are the same bytes: tests/pyodide/test_frames.py


@pytest.mark.parametrize("name", WIDGETS)
def test_the_words_follow_the_state(name: str) -> None:
    """Every state's words are whole sentences with numbers in them; those after the tape's presses are others."""
    first: dict[str, str] = {}
    for plain, frame in taped(name):
        words = frame["description"]
        whole = re.fullmatch(r"[A-Z0-9].*\d.*\.", words, re.DOTALL)
        assert whole, f"{at(plain)}: a description is whole sentences with a number in them, not {words!r}"
        slip = re.search(r"[^.] None\b|\b1 points?\b give\b|\d%|\.\.|\{|\}", words)
        assert not slip, f"{at(plain)}: {slip[0]!r} in the description: {words!r}"
        key = repr((plain["preset"], plain["controls"], plain["seed"]))
        if not plain["log"]:
            first[key] = words
        elif key in first:
            assert words != first[key], f"{at(plain)}: the description is as before; tell what the presses changed"


@pytest.mark.parametrize("name", [name for name in WIDGETS if "noise" in specs(WIDGETS[name].controls)])
def test_the_words_tell_the_settings(name: str) -> None:
    """The noise, and the share put elsewhere, are in the words as they are set, and not as something else is."""
    host, known = Host(), specs(WIDGETS[name].controls)
    for control in ("noise", "outliers"):
        if control not in known or (name == "ransac" and control == "outliers"):  # a share that is told as a count
            continue
        spec = known[control]
        for part in (0.4, 0.8):
            value = round(spec.low + spec.step * round(part * (spec.high - spec.low) / spec.step), spec.decimals)
            frame = host.render("fig-x", preset(WIDGETS[name], "default", {control: value}).plain())
            told = " ".join([frame["description"], *(panel["caption"] for panel in frame["panels"])])
            share = value if spec.unit == "%" else 100 * value
            shown = f"{number(value, spec.decimals)} u" if control == "noise" else f"{number(share, 0)} %"
            found = re.search(rf"(?<![\d.]){re.escape(shown)}(?!\d)", told)
            assert found, f"{name}: {control} is {value}; say {shown!r} in the description or a caption, not {told!r}"


@pytest.mark.parametrize("name", WIDGETS)
def test_every_panel_and_handle_has_a_name_of_its_own(name: str) -> None:
    """In a figure no two pictures, and in a panel no two handles, are called the same; names say more than one word."""
    for _, frame in taped(name):
        labels = [re.search(r'aria-label="([^"]*)"', panel["svg"]).group(1) for panel in frame["panels"]]  # type: ignore[union-attr]
        assert len(set(labels)) == len(labels), f"{name}: give each Panel a label of its own, not {labels}"
        worded = all(len(label.split()) > 1 for label in labels)
        assert worded, f"{name}: label each Panel by two words or more, not {labels}"
        handles = [(handle["panel"], handle["label"]) for handle in frame["handles"]]
        assert len(set(handles)) == len(handles), f"{name}: give each Handle of a panel its own label, not {handles}"
        for handle in frame["handles"]:
            least, most, now = handle["slider"]
            assert least <= now <= most, f"{name}: the handle {handle['name']} is at {now}, beyond {least} … {most}"
            assert handle["value"].strip(), f"{name}: the handle {handle['name']} has no value in words"
