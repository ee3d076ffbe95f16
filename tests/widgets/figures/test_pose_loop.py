"""The figure of four poses: how solving spreads the loop's error, a false edge with and without a kernel, drags."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from solvers import Status
from solvers.posegraph import KERNELS, chi_squared, optimise
from tests.widgets.states import frame_after, readouts
from widgets.drawing.picture import Label, Path, Segments
from widgets.engine.contract import SEED, Action
from widgets.figures.pose_loop import (
    CORNERS,
    FALSE,
    JOINS,
    LEAST,
    LOOP,
    MOST,
    OFF,
    POSES,
    TRUTH,
    VIEW,
    WIDGET,
    Controls,
    State,
    act,
    draw,
    start,
)

SOLVE, STEP = Action("press", "solve"), Action("press", "step")
SEEDS = range(SEED, SEED + 25 * 13, 13)


def texts(*log: list[object], seed: int = SEED, **controls: object) -> dict[str, float | str]:
    return readouts(frame_after(WIDGET, *log, seed=seed, **controls))


def error(state: State) -> float:
    return float(np.sqrt(np.square(state.run.poses.t - TRUTH.t).sum(axis=1).mean()))


@pytest.mark.parametrize("seed", SEEDS)
def test_odometry_fits_itself_and_the_loop_takes_all(seed: int) -> None:
    state = start(Controls(), seed)
    np.testing.assert_allclose(state.run.chi2[:LOOP], 0.0, atol=1e-20)
    assert state.run.chi2[LOOP] > 0.1


@pytest.mark.parametrize("seed", SEEDS)
def test_solving_shares_the_error_and_closes_the_loop(seed: int) -> None:
    """In every draw the sum falls to less than a third, no edge keeps a quarter of the loop's initial error, and the
    gap almost closes."""
    before = start(Controls(), seed)
    after = act(before, SOLVE)
    assert after.run.status is Status.CONVERGED
    assert after.run.objective < before.run.objective / 3
    assert after.run.chi2.max() < 0.25 * before.run.chi2[LOOP]
    assert (after.run.chi2 > 0.0).all()
    assert act(after, SOLVE) is not None
    assert act(after, SOLVE).run is after.run


def test_without_drift_there_is_nothing_to_share() -> None:
    after = act(start(Controls(drift=0.0), SEED), SOLVE)
    assert after.run.objective < 1e-20
    assert error(after) < 1e-12


@pytest.mark.parametrize("seed", SEEDS)
def test_a_false_edge_bends_the_map_and_a_kernel_lets_go_of_it(seed: int) -> None:
    """In 25 draws: without a kernel the poses end at least 0.5 u farther from the true ones than without the false
    edge; with DCS within 0.1 u of where they are without it, with Cauchy within 0.2 u."""
    right = error(act(start(Controls(), seed), SOLVE))
    ends = {kernel: act(start(Controls(kernel, false=True), seed), SOLVE) for kernel in KERNELS}
    assert error(ends["none"]) > right + 0.5
    assert abs(error(ends["dcs"]) - right) < 0.1
    assert abs(error(ends["cauchy"]) - right) < 0.2
    assert ends["dcs"].run.weights[FALSE] < 0.01 < 0.05 < ends["huber"].run.weights[FALSE]
    assert ends["dcs"].run.weights[LOOP] > 0.9


def test_steps_come_to_where_solve_goes() -> None:
    state = start(Controls(false=True), SEED)
    for _ in range(40):
        state = act(state, STEP)
    solution = act(start(Controls(false=True), SEED), SOLVE)
    assert state.run.done
    assert np.array_equal(state.run.poses.t, solution.run.poses.t)
    result = optimise(solution.first.poses, solution.edges)
    np.testing.assert_allclose(result.poses.t, solution.run.poses.t, atol=1e-9)


@settings(deadline=None, max_examples=30)
@given(st.sampled_from(POSES), st.floats(-7.0, 7.0), st.floats(-5.0, 5.0))
def test_a_dragged_pose_goes_where_it_is_put_and_solving_takes_it_back(name: str, x: float, y: float) -> None:
    """Only the springs decide where a pose belongs: from any place, solving gives the same poses again."""
    solution = act(start(Controls(), SEED), SOLVE)
    pull = act(solution, Action("drag", name, x, y))
    assert pull.run.steps == 0
    node = POSES.index(name) + 1
    assert (np.abs(pull.run.poses.t[node]) >= LEAST[node] - 1e-12).all()
    assert (np.abs(pull.run.poses.t[node]) <= MOST).all()
    result = act(pull, SOLVE)
    np.testing.assert_allclose(result.run.poses.t, solution.run.poses.t, atol=1e-5)


def test_moving_the_loops_measurement_moves_the_map() -> None:
    """The handle is where the edge puts pose 1; χ² shown for it is that of the dragged measurement."""
    solution = act(start(Controls(), SEED), SOLVE)
    pull = act(solution, Action("drag", "loop", -3.6, -2.7))
    point = pull.run.poses[LOOP].apply(pull.edges.relative.t[LOOP][None])[0]
    np.testing.assert_allclose(point, [-3.6, -2.7], atol=1e-12)
    np.testing.assert_allclose(pull.run.chi2, chi_squared(solution.run.poses, pull.edges))
    assert pull.run.objective > 10 * solution.run.objective
    assert error(act(pull, SOLVE)) > 2 * error(solution)


@settings(deadline=None, max_examples=40)
@given(st.data())
def test_handles_never_cover_each_other(data: st.DataObject) -> None:
    """Whatever is dragged and solved, every handle stays in the window and in its own quarter."""
    kernel, false = data.draw(st.sampled_from(KERNELS)), data.draw(st.booleans())
    state = start(Controls(kernel, false, 2.0), data.draw(st.integers(0, 99)))
    for _ in range(data.draw(st.integers(0, 4))):
        name = data.draw(st.sampled_from([*POSES, "loop", "solve"]))
        point = data.draw(st.tuples(st.floats(-1e6, 1e6), st.floats(-1e6, 1e6)))
        state = act(state, SOLVE if name == "solve" else Action("drag", name, *point))
    handles = WIDGET.draw(state).handles
    for a, b in itertools.combinations(handles, 2):
        assert np.hypot(*np.subtract(a.xy, b.xy)) * 358 / (VIEW.x1 - VIEW.x0) >= 40.0
    for handle in handles:
        assert VIEW.x0 < handle.xy[0] < VIEW.x1
        assert VIEW.y0 < handle.xy[1] < VIEW.y1


def test_the_readouts_of_the_chapter() -> None:
    """The readouts that the chapter's prediction and text rely on."""
    first, solution = texts(), texts(["press", "solve"])
    assert first["largest"] == first["objective"] == "23.3"
    assert float(solution["objective"]) < 2.0
    assert float(solution["gap"]) < 0.1
    bent, robust = texts(["press", "solve"], false=True), texts(["press", "solve"], false=True, kernel="dcs")
    assert float(bent["apart"]) > 1.0 > 0.3 > float(robust["apart"])
    assert bent["stop"] == robust["stop"] == "converged"


def test_no_handle_covers_a_number() -> None:
    """On a phone a knob covers 25 nominal px about its middle. At the start, after a solve, and with the handles at the
    limits of their reach, each pose's number and the loop's name are beside the knobs and inside the panel."""
    states = [start(Controls(), SEED)]
    states += [act(start(Controls(false=false), SEED), SOLVE) for false in (False, True)]
    for x, y in ((LEAST[0], LEAST[0]), (MOST[0], MOST[1]), (3.0, 3.0)):
        state = states[0]
        for name, corner in zip(("loop", *POSES), CORNERS, strict=True):
            state = act(state, Action("drag", name, *(corner * [x, y])))
        states.append(state)
    for state in states:
        picture = draw(state)
        labels = {mark.text: mark for mark in picture.panels[0].marks if isinstance(mark, Label)}
        knobs = VIEW.px([handle.xy for handle in picture.handles])
        for name in ("1", "2", "3", "4", "loop"):
            label = labels[name]
            at = VIEW.px(label.xy)[0] + [label.dx, label.dy - 6.0]
            assert np.linalg.norm(knobs - at, axis=1).min() > 30.0, name
            assert (at > 8.0).all(), name
            assert (at < np.array(VIEW.size) - 8.0).all(), name


PHONE = 350 / 640  # px per nominal px


@pytest.mark.parametrize("kernel", KERNELS)
@pytest.mark.parametrize("false", [False, True])
@pytest.mark.parametrize("actions", [(), (STEP,), (SOLVE,)])
def test_no_error_lies_over_another_on_a_phone(actions: tuple[Action, ...], false: bool, kernel: str) -> None:
    """Checked by bounding boxes, with 11 px letters about 5.2 px wide."""
    state = start(Controls(kernel=kernel, false=false), SEED)
    for action in actions:
        state = act(state, action)
    errors = [m for m in draw(state).panels[0].marks if isinstance(m, Label) and m.text.startswith("χ²")]
    assert len(errors) == 4 + false
    boxes = []
    for label in errors:
        x, y = PHONE * (VIEW.px([label.xy])[0] + [label.dx, label.dy])
        width = 5.2 * len(label.text)
        left = x - {"start": 0.0, "middle": 0.5, "end": 1.0}[label.anchor] * width
        assert left >= 0.0
        assert left + width <= 350.0
        boxes.append((left, left + width, y - 9.0, y + 2.0))
    for a, b in itertools.combinations(boxes, 2):
        beside = a[1] <= b[0] or b[1] <= a[0]
        assert beside or a[3] <= b[2] or b[3] <= a[2]


@pytest.mark.parametrize("kernel", KERNELS)
def test_an_edge_is_a_spring_unless_its_kernel_leaves_less_than_half(kernel: str) -> None:
    """Each joins its two poses; where a loop's edge puts its far end is joined to that pose by a dotted line."""
    state = act(start(Controls(kernel, false=True), SEED), SOLVE)
    t, marks = state.run.poses.t, draw(state).panels[0].marks
    roles = ("pair", "pair", "pair", "accent", "outlier")
    springs = [mark for mark in marks if isinstance(mark, Path) and mark.role in roles and not mark.dotted]
    straight = [mark for mark in marks if isinstance(mark, Segments) and mark.role in roles]
    kept = [edge for edge in range(5) if state.run.weights[edge] >= 0.5]
    assert (FALSE in kept) == (kernel == "none")
    assert [mark.role for mark in springs] == [roles[edge] for edge in kept]
    for edge, mark in zip(kept, springs, strict=True):
        np.testing.assert_allclose(np.asarray(mark.xy)[[0, -1]], t[list(JOINS[edge])], atol=1e-12)
    for edge, mark in zip([edge for edge in range(5) if edge not in kept], straight, strict=True):
        assert mark.dashed
        np.testing.assert_allclose([mark.a, mark.b], t[list(JOINS[edge])], atol=1e-12)
    gaps = [mark for mark in marks if isinstance(mark, Segments) and mark.role == "ghost"]
    for edge, gap in zip((LOOP, FALSE), gaps, strict=True):
        i, j = JOINS[edge]
        assert gap.dashed
        np.testing.assert_allclose(gap.a, state.run.poses[i].apply(state.edges.relative.t[edge][None])[0], atol=1e-12)
        np.testing.assert_allclose(gap.b, t[j], atol=1e-12)


def test_the_wrong_loop_is_wrong_by_what_its_switch_says() -> None:
    """Without drift the measured place of pose 3 from pose 1 differs from the true one by 3.9 u, and only that one."""
    edges = start(Controls(false=True, drift=0.0), SEED).edges
    wrong = [edges.relative.t[k] - TRUTH[i].inverse().apply(TRUTH[j].t[None])[0] for k, (i, j) in enumerate(JOINS)]
    np.testing.assert_allclose(wrong, [[0.0, 0.0]] * FALSE + [OFF], atol=1e-12)
    assert round(float(np.hypot(*OFF)), 1) == 3.9


def test_the_words_say_how_far_the_optimisation_has_come() -> None:
    state = start(Controls(), SEED)
    assert "The optimisation has not begun." in draw(state).description
    state = act(state, STEP)
    assert "The optimisation is running after 1 step." in draw(state).description
    state = act(state, SOLVE)
    assert f"The optimisation is converged after {state.run.steps} steps." in draw(state).description
    assert f"from {state.first.objective:.1f}." in draw(state).note
