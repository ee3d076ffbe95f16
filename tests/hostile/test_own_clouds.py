"""A reader's own clouds in the figure, with every method and any settings: each state draws, or its file is refused."""

from __future__ import annotations

import itertools
import json
import random
import warnings
from typing import Any

import pytest

from tests.hostile.clouds import READABLE, UNITS, Array, pairs
from tests.hostile.tally import Tally
from tests.widgets.test_any_sequence import check_any_frame
from widgets.engine.contract import preset
from widgets.engine.host import Host
from widgets.figures.own_clouds.figure import WIDGET
from widgets.figures.own_clouds.methods import OWN

pytestmark = pytest.mark.hostile

LOGS: list[list[Any]] = [
    [],
    [["press", "step"], ["press", "step"]],
    [["press", "ten"]],
    [["drag", "turn", 2.0, 0.3], ["drag", "source", 999_999.0, -0.1], ["press", "step"]],
]


@pytest.mark.parametrize("units", [READABLE, UNITS], ids=["of a file's units", "of any unit"])
def test_any_clouds_are_drawn_or_refused(units: tuple[float, ...], tally: Tally, calls: int) -> None:
    draw = random.Random(14)
    for k, (source, target) in enumerate(itertools.islice(pairs(66, units), -(-calls // len(OWN) // 2))):
        host, given = Host(), {}

        def give(side: str, points: Array, host: Host = host, given: dict[str, str] = given) -> str:
            request = json.dumps({"widget": WIDGET.name, "name": f"{side}.csv"})
            given[side] = json.loads(host.give(request, text(points)))["key"]
            return "ok"

        for side, points in (("source", source), ("target", target)):
            tally.tries(f"pair {k}, {side}", lambda side=side, points=points: give(side, points[:, :3]))
        for method in OWN:
            record = state(draw, method, given)
            tally.tries(f"pair {k}, {record}", lambda record=record, host=host: outcome(host, record))
    tally.closes()


def text(points: Array) -> bytes:
    """The points as a CSV file."""
    return "\n".join(",".join(repr(float(v)) for v in row) for row in points).encode()


def state(draw: random.Random, method: str, given: dict[str, str]) -> dict[str, Any]:
    """A record of the method, either with its own settings or with some that may not suit it."""
    controls: dict[str, Any] = {"clouds": "own", "method": method, **OWN[method].brings()}
    if draw.random() < 0.5:
        controls |= {"length": draw.choice((0.5, 1.0, 8.0, 40.0)), "share": draw.choice((0.0, 30.0, 60.0))}
    if draw.random() < 0.5:
        controls |= {"thickness": draw.choice((2.0, 50.0)), "height": draw.choice((0.0, 50.0, 100.0))}
    controls["start"] = draw.choice(("as", "centred"))
    return {**preset(WIDGET, "default", controls).plain(), "log": draw.choice(LOGS), "given": given}


def outcome(host: Host, record: dict[str, Any]) -> str:
    """The outcome of drawing one state; a record that the page wrote must never be refused."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        try:
            frame = json.loads(host.frame(json.dumps({"figure": "fig-x", "record": record})))
        except ValueError as error:
            raise AssertionError("this is a state of the page") from error
    check_any_frame(record, frame)
    (stop,) = (r["value"] for r in frame["readouts"] if r["name"] == "stop")
    if stop == "not begun" and "files" in frame:  # both clouds are there; the method says why it cannot begin
        assert frame["note"].startswith("Stopped at step 0: ")
        return "refused"
    return "degenerate" if stop.startswith("degenerate") else "ok"
