"""Slices: a long replay, or one long action, is done piece by piece between other requests."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from typing import Any

from hypothesis import given, settings
from hypothesis import strategies as st

from tests.widgets.engine.test_host import SOLVE, record
from widgets.engine.contract import Action, Pieces
from widgets.engine.host import Host
from widgets.figures.kabsch import WIDGET


class _Clock:
    """A clock that advances by half a second at every start and act, and never otherwise."""

    def __init__(self) -> None:
        self.time = 0.0
        self.calls = 0

    def __call__(self) -> float:
        return self.time

    def host(self) -> Host:
        """A host over the Kabsch widget whose work takes time."""
        return Host({"kabsch": replace(WIDGET, start=self._taking(WIDGET.start), act=self._taking(WIDGET.act))}, self)

    def _taking(self, work: Callable[..., Any]) -> Callable[..., Any]:
        def taking(*arguments: Any) -> Any:
            self.time += 0.5
            self.calls += 1
            return work(*arguments)

        return taking


LONG = [["drag", "source", 0.5 * k, -0.25 * k] if k % 2 else SOLVE for k in range(6)]


def answer(host: Host, plain: dict[str, Any]) -> dict[str, Any]:
    """A host's answer: a frame, or how far the replay is."""
    frame: dict[str, Any] = json.loads(host.frame(json.dumps({"figure": "f", "record": plain, "slices": True})))
    return frame


def test_a_long_replay_is_answered_in_slices() -> None:
    """Each slice does one piece and reports progress, none repeats one, and the frame is that of one replay."""
    clock, plain = _Clock(), record(*LONG)
    host, answers, calls = clock.host(), [], []
    while not answers or "replayed" in answers[-1]:
        answers.append(answer(host, plain))
        calls.append(clock.calls)
    assert answers[:-1] == [{"replayed": k, "of": 6} for k in range(6)]
    assert calls == [1, 2, 3, 4, 5, 6, 7]
    assert answers[-1] == Host().render("f", plain)
    assert _Clock().host().render("f", plain) == answers[-1]  # without slices: all at once


def test_quick_work_is_one_slice_and_one_slow_action_too() -> None:
    """A request with time for the whole replay, and any single action on a cached state, are answered at once."""
    assert answer(Host({"kabsch": WIDGET}, lambda: 0.0), record(*LONG)) == Host().render("f", record(*LONG))
    host, log = _Clock().host(), []
    for action in ([], *LONG):
        log = [*log, action] if action else []
        assert answer(host, record(*log)) == Host().render("f", record(*log))


def test_a_replay_that_is_given_up_leaves_what_was_seen() -> None:
    """After some slices of another record, one more action on the last frame still costs one act; a newer record reuses
    what was replayed of an older one."""
    clock = _Clock()
    host = clock.host()
    while "replayed" in answer(host, record(*LONG)):
        pass
    for _ in range(3):
        assert "replayed" in answer(host, record(*LONG, noise=0.3))
    clock.calls = 0
    frame = answer(host, record(*LONG, SOLVE))
    assert (clock.calls, frame) == (1, Host().render("f", record(*LONG, SOLVE)))
    for k in range(4):
        assert answer(host, record(*LONG, noise=0.3)) == {"replayed": k, "of": 6}
    clock.calls = 0
    assert answer(host, record(*LONG[:3], SOLVE, noise=0.3)) == Host().render("f", record(*LONG[:3], SOLVE, noise=0.3))
    assert clock.calls == 1


@settings(max_examples=30, deadline=None)
@given(st.lists(st.tuples(st.integers(0, 6), st.booleans(), st.integers(1, 4)), min_size=1, max_size=8))
def test_slices_of_any_records_draw_what_a_fresh_host_draws(asked: list[tuple[int, bool, int]]) -> None:
    """Replays of records that share more or less are begun, abandoned and resumed: every frame byte for byte."""
    host = _Clock().host()
    for length, with_turn, patience in asked:
        log = [*LONG[: length // 2], ["drag", "turn", 1.0, 2.0], *LONG[length // 2 :]] if with_turn else LONG[:length]
        for _ in range(patience):
            frame = answer(host, record(*log))
            if "replayed" not in frame:
                assert frame == Host().render("f", record(*log))
                break


def test_a_long_action_is_answered_in_slices() -> None:
    """A widget that acts in pieces does one per slice here and none twice; a request without slices continues after the
    last piece; another action begins anew. The frame is that of `act`."""
    calls: list[str] = []

    def pieces(state: Any, action: Action) -> Pieces:
        for k in range(3):
            clock.time += 0.5
            calls.append(f"{action.name} {k}")
            yield
        return WIDGET.act(state, action)

    clock = _Clock()
    host = Host({"kabsch": replace(WIDGET, pieces=pieces)}, clock)
    assert answer(host, record()) == Host().render("f", record())
    # The clock that limits a slice advances only after a first piece.
    answers = [answer(host, record(SOLVE)) for _ in range(3)]
    assert answers == [{"replayed": 0, "of": 1}] * 3
    assert answer(host, record(SOLVE)) == Host().render("f", record(SOLVE))
    assert calls == ["solve 0", "solve 1", "solve 2"]
    calls.clear()
    drag = ["drag", "source", 1.0, 0.0]
    assert answer(host, record(SOLVE, drag)) == {"replayed": 1, "of": 2}
    assert answer(host, record(SOLVE, SOLVE)) == {"replayed": 1, "of": 2}
    assert calls == ["source 0", "solve 0"]
    assert host.render("f", record(SOLVE, SOLVE)) == Host().render("f", record(SOLVE, SOLVE))
    assert calls == ["source 0", "solve 0", "solve 1", "solve 2"]


def test_pieces_of_another_past_are_not_taken_up() -> None:
    """The same press, part-way done after other actions, begins anew."""
    clock = _Clock()

    def pieces(state: Any, action: Action) -> Pieces:
        for _ in range(3):
            clock.time += 0.5
            yield
        return WIDGET.act(state, action)

    host = Host({"kabsch": replace(WIDGET, pieces=pieces)}, clock)
    host.render("f", record(SOLVE))
    assert answer(host, record(SOLVE, SOLVE)) == {"replayed": 1, "of": 2}
    drag = ["drag", "source", 1.0, 0.0]
    assert answer(host, record(drag, SOLVE)) == {"replayed": 0, "of": 2}
    assert host.render("f", record(drag, SOLVE)) == Host().render("f", record(drag, SOLVE))


def test_a_long_replay_ends_though_another_was_under_way() -> None:
    host = _Clock().host()
    for _ in range(2):
        answer(host, record(*LONG[:1]))
    answers = [answer(host, record(["drag", "turn", 1.0, 2.0], *LONG)) for _ in range(7)]
    assert "panels" in answers[-1]
