"""The figure of the climb: two runs of one solver from one start, with marks that agree with its steps."""

from __future__ import annotations

import re
from functools import partial
from itertools import pairwise
from typing import Any

import numpy as np
import pytest

from solvers import register
from tests.widgets.states import state_after
from widgets.engine.contract import Action
from widgets.figures.ndt_climb import climb as climbing
from widgets.figures.ndt_climb.figure import COARSER, MAX_STEPS, WIDGET, State, act, draw

STEP = Action("press", "step")


run = partial(state_after, WIDGET)


def end_state(**controls: Any) -> State:
    return run(*[STEP] * MAX_STEPS, **controls)


@pytest.mark.parametrize("controls", [{}, {"four": False, "cell": 1.2}, {"max_turn": 0.04, "max_shift": 0.1}])
def test_both_runs_are_the_solvers_own(controls: dict[str, Any]) -> None:
    """Stepwise or all at once, at one cell size or coarse to fine, dragged or not: the poses of `register`."""
    drag = Action("drag", "turn", 4.0, 1.5)
    for state in (end_state(**controls), run(drag, *[STEP] * MAX_STEPS, **controls)):
        check(state)


def test_a_large_damping_has_thousands_apart() -> None:
    """As the site writes large numbers."""
    note = draw(run(*[STEP] * 4, four=False, cell=1.2, turn=5.0, shift=0.2)).note
    assert re.search(r"λ = \d{1,3},\d{3}[,.]", note), note


def check(state: State) -> None:
    c = state.controls
    for sizes, climb in (((c.cell,), state.one), (tuple(k * c.cell for k in COARSER), state.fine)):
        result = register(
            state.scene.source, state.scene.target, "ndt", start=state.placed, cells=sizes,
            grids=4 if c.four else 1, max_shift=c.max_shift, max_turn=c.max_turn, max_steps=MAX_STEPS,
        )  # fmt: skip
        np.testing.assert_allclose(climb.pose.matrix, result.pose.matrix, atol=1e-9)
        assert (climb.steps, climb.status) == (result.steps, result.status)


def test_marks_say_what_the_steps_did() -> None:
    """A capped step is exactly as long as its cap, halved as often as marked; an uncapped one is within both caps."""
    end = end_state(max_turn=0.1, max_shift=0.3)
    kinds = set()
    for climb in end.runs.values():
        for state, cap, halved in zip(climb.states[1:], climb.caps[1:], climb.halved[1:], strict=True):
            shift, turn = np.linalg.norm(state.step[0, :2]) * 2.0**halved, abs(state.step[0, 2]) * 2.0**halved
            assert shift <= 0.3 + 1e-12
            assert turn <= 0.1 + 1e-12
            if cap:
                assert (shift, turn)[cap == "turn"] == pytest.approx((0.3, 0.1)[cap == "turn"], rel=1e-12)
            kinds |= {cap, "halved" if halved else ""}
    assert kinds == {"", "shift", "turn", "halved"}


def test_the_score_rises_within_a_level_and_jumps_between_levels() -> None:
    """Each level has its own objective, so jumps are marked where the cells change."""
    climb = end_state().fine
    scores = [-float(state.objective[0]) for state in climb.states]
    assert len(climb.rises) == len(COARSER) - 1
    for k, (a, b) in enumerate(pairwise(scores), start=1):
        assert k in climb.rises or b >= a
    assert climb.levels == sorted(climb.levels)


def test_the_scores_beside_each_other_are_of_the_same_cells() -> None:
    """The truth and both poses are scored on cells of size h, even while the second run uses coarser ones."""
    texts = {r.name: r.value for r in draw(run()).readouts}
    assert texts["score_one"] == texts["score_fine"]
    state = end_state()
    assert climbing.score(state.fine.now, 2, state.scene.truth) == pytest.approx(state.one.truth[0])
    assert climbing.score(state.fine.now, 2, state.fine.pose) == pytest.approx(-float(state.fine.now.objective[0]))


def test_a_score_can_exceed_that_of_the_truth() -> None:
    """In the preset "exceeds", a pose away from the truth scores higher than the truth."""
    state = end_state(name="exceeds")
    assert state.fine.relative[-1] > 1.1
    values = {r.name: float(r.value) for r in draw(state).readouts if r.name.startswith(("score", "rotation_f"))}
    assert values["score_fine"] > values["score_truth"]
    assert values["rotation_fine"] > 1.0


@pytest.mark.parametrize(
    ("name", "value"),
    [("turn", -10.0), ("shift", 0.6), ("cell", 1.1), ("noise", 0.1), ("max_shift", 0.1), ("max_turn", 0.04),
     ("four", False)],
)  # fmt: skip
def test_every_control_changes_the_climb(name: str, value: float | bool) -> None:
    """Each slider and the switch change where three steps lead."""
    before, after = (run(*[STEP] * 3, **change).fine for change in ({}, {name: value}))
    assert np.abs(before.pose.matrix - after.pose.matrix).max() > 1e-6


def test_a_drag_starts_both_anew() -> None:
    """Whenever the start is moved, both runs return to it."""
    state = run(STEP, STEP, Action("drag", "source", 1.0, 0.5))
    for climb in state.runs.values():
        assert climb.steps == 0
        np.testing.assert_array_equal(climb.pose.matrix, state.placed.matrix)
    np.testing.assert_allclose(state.placed.apply(state.anchor[None])[0], [1.0, 0.5], atol=1e-12)


def test_run_ends_and_stays_ended() -> None:
    """When both have stopped, the buttons are disabled and another step changes nothing."""
    state = end_state()
    assert draw(state).disabled == {"step", "run"}
    assert act(state, STEP).fine is state.fine
    assert draw(run(STEP)).disabled == frozenset()
