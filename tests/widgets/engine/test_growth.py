"""Memory does not grow with use: after many more drags or picks, Python holds as many blocks as before."""

from __future__ import annotations

import gc
import json
import sys
from collections.abc import Iterable
from itertools import pairwise
from math import cos, sin
from typing import Any

import pytest

from widgets.engine.contract import Widget, preset
from widgets.engine.host import Host
from widgets.engine.registry import WIDGETS

pytestmark = pytest.mark.native  # counts blocks handed out by this Python's allocator

FIGURES = ("icp", "kabsch", "ndt-climb", "pose-loop", "ransac")  # quick, with frames of nearly constant size
ROUNDS, ACTIONS = 4, 30  # caches fill in the first rounds; a leak grows in every round
SPARE = 60  # blocks per round, two for each action; a retained state takes more


def logs(widget: Widget, numbers: Iterable[int]) -> list[list[Any]]:
    """One log per number, a drag of the first handle or else a click on a circle; an empty log comes last."""
    aims = [*(["drag", handle] for handle in widget.handles), *(["click", panel] for panel in widget.clicks)]
    return [*([[*aims[0], 2 * cos(i), 2 * sin(i)]] for i in numbers), []]


def growth(host: Host, widget: Widget) -> int:
    """How many more blocks Python holds after a round of actions than before, in the round that adds least."""
    plain, blocks = preset(widget).plain(), list[int]()
    for first in range(0, ROUNDS * ACTIONS, ACTIONS):
        for log in logs(widget, range(first, first + ACTIONS)):
            host.frame(json.dumps({"figure": "fig-x", "record": {**plain, "log": log}, "detail": 0}))
        gc.collect()
        blocks.append(sys.getallocatedblocks())
    assert blocks[0] > 10_000, "this Python does not count its blocks"
    return min(after - before for before, after in pairwise(blocks))


@pytest.mark.parametrize("name", FIGURES)
def test_many_actions_leave_nothing_behind(name: str) -> None:
    """Neither in the host nor in anything that a figure remembers by itself."""
    assert growth(Host(), WIDGETS[name]) < SPARE


@pytest.mark.parametrize("name", FIGURES)
def test_states_that_are_kept_are_seen(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """With a host that retains every state."""
    states: list[Any] = []
    draw = Host._drawn

    def keeping(host: Host, figure: str, widget: Widget, record: Any, reached: list[Any], detail: int | None) -> Any:
        states.append(reached[-1])
        return draw(host, figure, widget, record, reached, detail)

    monkeypatch.setattr(Host, "_drawn", keeping)
    assert growth(Host(), WIDGETS[name]) > SPARE
