"""Records that no page ever wrote, for every figure: each gives a frame that draws, or a reason."""

from __future__ import annotations

import json
import random
from typing import Any

import pytest

from tests.hostile.tally import Tally
from tests.widgets.test_any_sequence import check_any_frame
from widgets.engine.contract import Widget, parsed, preset
from widgets.engine.controls import specs
from widgets.engine.host import Host
from widgets.engine.registry import WIDGETS

pytestmark = pytest.mark.hostile

JUNK: tuple[Any, ...] = (
    *(None, True, False, 0, -1, 1, 40, 2**31, 2**63, -(2**70), 10**400, 0.5, -0.0, 1e-320, 1e15, 1e308),
    *(float("nan"), float("inf"), "", "x", "NaN", "a" * 5000, "\0", "\ud800", "½", "../..", "<script>", "__class__"),
    *([], [[]], {}, {"": {}}, ["press"], ["drag", "source", 0, 0], ["click", "main", 1e300, "1"], {"x": [1, {}]}),
)
FAR = 999_999.9


def test_records_of_every_figure(tally: Tally, calls: int) -> None:
    draw, hosts = random.Random(14), {name: Host() for name in WIDGETS}
    for k in range(calls):
        name = draw.choice(list(WIDGETS))
        record = sound(draw, WIDGETS[name])
        for _ in range(draw.choice((0, 1, 1, 1, 2, 3))):
            spoil(draw, record)
        text = json.dumps({"figure": "fig-x", "record": record})
        if draw.random() < 0.1:
            text = tear(draw, text)
        tally.tries(f"{k}: {text[:300]}", lambda text=text, host=hosts[name]: outcome(host, text))
    tally.closes()


def sound(draw: random.Random, widget: Widget) -> dict[str, Any]:
    """A valid record of the widget."""
    changes: dict[str, Any] = {}
    for name, spec in specs(widget.controls).items():
        if draw.random() < 0.3:
            options: list[Any] = list(spec.options) or [spec.low, spec.high, draw.uniform(spec.low, spec.high)]
            changes[name] = draw.choice([True, False] if spec.kind == "toggle" else options)
    aims = [*(("drag", h) for h in widget.handles), *(("click", c) for c in widget.clicks)]
    aims += [("hover", c) for c in widget.hovers]
    possible: list[list[Any]] = [["press", b.name] for b in widget.buttons if b.does == "press"]
    possible += [[*aim, draw.choice((0.0, 1e-300, FAR, draw.uniform(-6, 6))), draw.uniform(-FAR, FAR)] for aim in aims]
    log = [draw.choice(possible) for _ in range(draw.randrange(4))] if possible else []
    record = preset(widget, draw.choice(list(widget.presets)), changes).plain()
    return {**record, "seed": draw.choice((40, 53, 0, 2**31 - 1)), "log": log}


def spoil(draw: random.Random, record: dict[str, Any]) -> None:
    """Replace, remove or duplicate one item of the record, at any depth."""
    at: Any = record
    while True:
        keys = list(at) if isinstance(at, dict) else list(range(len(at)))
        if not keys:
            return
        key = draw.choice(keys)
        if isinstance(at[key], (dict, list)) and draw.random() < 0.8:
            at = at[key]
            continue
        chance = draw.random()
        if chance < 0.7:
            at[key] = draw.choice(JUNK)
        elif chance < 0.85:
            del at[key]
        elif isinstance(at, dict):
            at[f"{key} "] = at[key]
        else:
            at.append(at[key])
        return


def tear(draw: random.Random, text: str) -> str:
    """The text with a piece cut out, and sometimes another put in, such as thousands of opening brackets."""
    at = draw.randrange(len(text))
    end = draw.randrange(at, min(len(text), at + 9) + 1)
    piece = draw.choice(("", "{", "}", "[" * 3000, '"', ",", "1e999", "-", "null", "\\ud800", "\0"))
    return text[:at] + piece + text[end:]


def outcome(host: Host, text: str) -> str:
    host.frame(text)
    request = json.loads(text)
    record = request["record"]
    frame = json.loads(host.frame(json.dumps({**request, "figure": "fig-x"})))  # under the name that the checks use
    check_any_frame(parsed(WIDGETS[record["widget"]], record).plain(), frame)
    return "ok"
