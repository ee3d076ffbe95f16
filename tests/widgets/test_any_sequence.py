"""Whatever a reader sets and does, in any order, every figure draws, reads and describes it, from the record alone.

LADDER_EXAMPLES=2000 searches at random through that many sequences per figure; by default the same few are tried.
"""

from __future__ import annotations

import json
import os
import re
from collections.abc import Mapping
from itertools import combinations
from math import dist
from typing import Any
from xml.etree import ElementTree

import pytest
from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import strategies as st

from tests.widgets.any_record import FAR, records
from tests.widgets.test_every_widget import at, check_frame
from widgets.engine.contract import parsed, preset
from widgets.engine.host import Host
from widgets.engine.registry import WIDGETS

pytestmark = pytest.mark.native  # minutes in the page's Python, whose frames are compared elsewhere
EXAMPLES = int(os.environ.get("LADDER_EXAMPLES", "0"))
SEARCH = settings(
    max_examples=EXAMPLES or 12,
    derandomize=not EXAMPLES,
    deadline=None,
    database=None,
    phases=[Phase.generate],  # records are short already, and shrinking one takes minutes
    suppress_health_check=list(HealthCheck),
)


@pytest.mark.parametrize("name", WIDGETS)
def test_any_actions_in_any_order(name: str) -> None:
    """Every frame along the log is sound; a fresh host, and one that steps back, give the same bytes."""
    layouts = set()

    @SEARCH
    @given(records(WIDGETS[name]), st.data())
    def follow(record: dict[str, Any], data: st.DataObject) -> None:
        host = Host()
        prefixes = [{**record, "log": record["log"][:k]} for k in range(len(record["log"]) + 1)]
        frames = [host.frame(request(plain)) for plain in prefixes]
        for plain, frame in zip(prefixes, frames, strict=True):
            check_any_frame(plain, json.loads(frame))
            layouts.add(layout(json.loads(frame)))
        assert len(layouts) == 1, f"{name}: readouts or panels come, go or change size: {sorted(layouts)}"
        index = data.draw(st.integers(0, len(frames) - 1))
        reason = f"{at(record)}: the same record draws two pictures; start, act and draw may keep nothing between calls"
        assert host.frame(request(prefixes[index])) == frames[index], reason
        assert Host().frame(request(record)) == frames[-1], reason

    follow()


def request(plain: Mapping[str, Any]) -> str:
    return json.dumps({"figure": "fig-x", "record": plain})


def check_any_frame(plain: dict[str, Any], frame: dict[str, Any]) -> None:
    """The rules for recorded frames, and also: no NaN or None in any text, markup that parses, handles within reach."""
    widget = WIDGETS[plain["widget"]]
    check_frame(plain, frame)
    assert parsed(widget, parsed(widget, plain).plain()) == parsed(widget, plain)
    json.dumps(frame, allow_nan=False)
    ids: list[str] = []
    for panel in frame["panels"]:
        tree = ElementTree.fromstring(panel["svg"])
        ids += [node.attrib["id"] for node in tree.iter() if "id" in node.attrib]
        words = " ".join([*tree.itertext(), panel["caption"], tree.attrib["aria-label"]])
        wrong = re.search(r"\b(nan|inf|None)\b", words)
        assert not wrong, f"{at(plain)}: {wrong[0]!r} is written in the panel {panel['name']}: {words!r}"
    assert len(set(ids)) == len(ids), f"{at(plain)}: two Groups of one panel have one name: {sorted(ids)}"
    check_handles(widget.name, frame)
    words = [frame["description"], frame["note"]]
    plainly = re.search(r"(?<!\w)-\d", " ".join(words))
    assert not plainly, f"{at(plain)}: write negative numbers by picture.number or worded, with a minus sign: {words}"
    assert "None" not in [readout["value"] for readout in frame["readouts"]], f'{at(plain)}: show "–" in place of None'


def check_handles(name: str, frame: dict[str, Any]) -> None:
    """Each handle belongs to the figure, lies within its panel, and says what it is and where."""
    panels = {panel["name"] for panel in frame["panels"]}
    for handle in frame["handles"]:
        grip = f"{name}, {handle}"
        is_named = handle["name"] in WIDGETS[name].handles
        assert is_named or "sets" in handle, f"{grip}: WIDGET.handles does not name it"
        assert handle["panel"] in panels, f"{grip}: the picture has no such panel"
        assert set(handle["also"]) <= panels, f"{grip}: `also` names a panel that the picture does not have"
        assert 0 <= handle["left"] <= 100, f"{grip}: outside its panel's window; limit where it can be put"
        assert 0 <= handle["top"] <= 100, f"{grip}: outside its panel's window; limit where it can be put"
        assert handle["label"], f"{grip}: without a label"
        assert handle["value"], f"{grip}: without a value in words"
        assert not re.search(r"\b(nan|inf|None)\b", handle["value"]), f"{grip}: its value is no number"


def layout(frame: dict[str, Any]) -> str:
    """What a page lays out once: readouts by name and label, panels by name, size and padding (axes may grow)."""
    readouts = [(r["name"], r["label"]) for r in frame["readouts"]]
    return json.dumps([readouts, [(p["name"], p["view"][4:]) for p in frame["panels"]]])


@pytest.mark.parametrize("name", [name for name in WIDGETS if WIDGETS[name].handles])
def test_handles_stay_within_reach(name: str) -> None:
    """Dragged beyond each corner and turned every way, a cloud has its handles in view, 40 px apart on a phone."""
    widget, host = WIDGETS[name], Host()
    pairs = [(h, h.replace("source", "turn")) for h in widget.handles if "turn" not in h]
    corners = [(FAR, FAR), (-FAR, 0.0), (0.5, -FAR)]
    for moving, turning in pairs:
        for corner in corners:
            flung = [["drag", moving, *corner]]
            turns = [["drag", turning, *to] for to in corners] if turning in widget.handles else []
            for log in (flung, *([*flung, turn] for turn in turns)):
                frame = host.render("f", {**preset(widget).plain(), "log": log})
                check_handles(name, frame)
                views = {panel["name"]: panel["view"] for panel in frame["panels"]}
                for a, b in combinations(frame["handles"], 2):
                    if a["panel"] == b["panel"]:
                        x0, x1, *_ = views[a["panel"]]
                        px = dist(a["world"], b["world"]) * 358 / (x1 - x0)
                        message = f"{name}: {a['name']} and {b['name']} are {px:.0f} px apart on a phone after {log}"
                        assert px >= 40, f"{message}; keep them 40 px apart, as Placing's `least` does"
