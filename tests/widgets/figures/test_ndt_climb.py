"""The figure of the climb: two runs of one solver from one start, with marks that agree with its steps."""

from __future__ import annotations

import re
from functools import partial
from itertools import pairwise
from typing import Any

import numpy as np
import pytest

from solvers import register
from solvers.methods.ndt.floor import floored
from tests.widgets.states import state_after
from widgets.drawing.picture import Ellipses, Label, Path, Points, Ring, Segments
from widgets.engine.contract import Action
from widgets.figures.ndt_climb import climb as climbing
from widgets.figures.ndt_climb.figure import COARSER, MAX_STEPS, TRACED, WIDGET, State, act, draw

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


def test_the_maps_show_each_step_of_three_points() -> None:
    """From the start to now, one run dashed; a mark where a step was capped or halved or the cells changed; the
    Gaussians of the first grid of the cells in use."""
    state, kinds = run(*[STEP] * 25, max_turn=0.1, max_shift=0.3), set()
    for (name, climb), panel in zip(state.runs.items(), draw(state).panels[:2], strict=True):
        places = np.stack([s.pose[0].apply(TRACED) for s in climb.states])
        paths = [mark for mark in panel.marks if isinstance(mark, Path)]
        np.testing.assert_allclose([np.asarray(path.xy) for path in paths], places.swapaxes(0, 1))
        assert all(path.dashed == (name == "one") for path in paths)
        dots = {(m.role, m.shape): np.reshape(m.xy, (-1, 2)) for m in panel.marks if isinstance(m, Points)}
        role = paths[0].role
        steps = {
            "dot": range(len(places)),
            "diamond": [k for k, cap in enumerate(climb.caps) if cap],
            "cross": [k for k, state in enumerate(climb.states) if state.halved[0] > 0],
            "ring": [k for k in range(1, len(places)) if climb.states[k].level[0] != climb.states[k - 1].level[0]],
        }
        for shape, chosen in steps.items():
            drawn = dots.get((role, shape), np.zeros((0, 2)))
            np.testing.assert_allclose(drawn, places[list(chosen)].reshape(-1, 2), err_msg=f"{name} {shape}")
            kinds |= {shape} if chosen else set()
        np.testing.assert_allclose(dots["source", "dot"], climb.pose.apply(state.scene.source))
        rings = [np.reshape(mark.xy, 2) for mark in panel.marks if isinstance(mark, Ring) and mark.role == "truth"]
        np.testing.assert_allclose(rings, state.scene.truth.apply(TRACED))
        (gaussians,) = (mark for mark in panel.marks if isinstance(mark, Ellipses))
        cells = climb.now.maps[climb.levels[-1]]
        first = cells.kept[0] & (cells.grid[0] == 0)
        np.testing.assert_array_equal(gaussians.centre, cells.mean[0, first])
        np.testing.assert_array_equal(gaussians.covariance, floored(cells.covariance[0, first]))
        (title,) = (mark.text for mark in panel.marks if isinstance(mark, Label))
        assert f"h = {cells.size[0]:.1f} u" in title
    assert kinds == {"dot", "diamond", "cross", "ring"}


def test_the_charts_show_each_step_of_both_runs() -> None:
    """The share of the truth's score, with a line at 1; the gradient's norm and λ by powers of ten, no λ as a gap; and
    a dashed line where the cells changed."""
    state = run(*[STEP] * 12)
    charts = {panel.name: panel for panel in draw(state).panels[2:]}
    for name, climb in state.runs.items():
        share = [-s.objective[0] / climb.truth[s.level[0]] for s in climb.states]
        slope = [np.linalg.norm(s.at.gradient[0] / [1.0, 1.0, s.radius[0]]) for s in climb.states]
        damping = [np.nan, *(s.damping[0] if s.damping[0] > 0.0 else np.nan for s in climb.states[1:])]
        expected = {"score": share, "gradient": np.log10(slope), "damping": np.log10(np.clip(damping, 1e1, 1e5))}
        for panel, values in expected.items():
            y = np.asarray(values)
            series = [m for m in charts[panel].marks if isinstance(m, Points)]
            drawn = {mark.role: np.asarray(mark.xy) for mark in series}
            xy = drawn["ink" if name == "one" else "accent"]
            k = np.flatnonzero(~np.isnan(y))
            np.testing.assert_allclose(xy, np.stack([k, y[k]], axis=1), err_msg=f"{name} {panel}")
    for panel in charts.values():
        lines = [m for m in panel.marks if isinstance(m, Segments) and m.role == "accent"]
        assert [np.reshape([m.a, m.b], (2, 2))[:, 0].tolist() for m in lines] == [[k, k] for k in state.fine.rises]
        assert all(line.dashed for line in lines)
    (truth,) = (m for m in charts["score"].marks if isinstance(m, Segments) and m.role == "truth")
    np.testing.assert_array_equal(np.reshape([truth.a, truth.b], (2, 2))[:, 1], 1.0)
