"""The figure of branch and bound: regions shown as ruled out hold no better pose, and the numbers are the solver's."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from solvers import Pose
from solvers.methods.search.bounds import Boxes
from solvers.metrics import rre
from widgets.drawing.picture import Heat, Label, Path, Points, Ring, Segments
from widgets.engine.contract import Action, preset
from widgets.engine.host import Host
from widgets.figures.branch_and_bound import figure, marks
from widgets.parts.ring import place


def after(steps: int, name: str = "default", **changes: Any) -> figure.State:
    state = figure.start(preset(figure.WIDGET, name, changes).controls, 40)
    for _ in range(steps):
        state = figure.act(state, Action("press", "step"))
    return state


@pytest.mark.parametrize(("name", "gap", "below"), [("turns", 0.001, True), ("hall", 0.01, False)])
def test_the_line_at_which_the_search_ends_is_named(name: str, gap: float, below: bool) -> None:
    """Below it, away from the ceiling; above it where it is the axis."""
    state = figure.act(after(0, name, gap=gap), Action("press", "finish"))
    chart = figure.draw(state).panels[1]
    (label,) = [mark for mark in chart.marks if isinstance(mark, Label) and "ends" in mark.text]
    assert label.xy[1] == max(0.0, 1.0 - gap / state.course[-1][0])
    assert (label.dy > 0) == below
    assert state.course[-1][1] / state.course[-1][0] >= label.xy[1] - 1e-9


def test_headings_that_are_ruled_out_hold_nothing_better() -> None:
    """With the position known, four steps leave less than a fifth of the circle, and no excluded heading has a value
    lower than the ceiling by more than the gap."""
    state = after(4, "turns")
    mask = np.isinf(state.floors.headings)
    assert 0.8 < state.floors.share_gone < 1.0
    turns = (np.arange(marks.HEADINGS) + 0.5) / marks.HEADINGS * 2.0 * np.pi - np.pi
    mean = state.scene.source.mean(axis=0)
    R = Pose.from_angle(turns, np.zeros((marks.HEADINGS, 2))).R
    moved = Pose(R, mean - R @ mean).apply(state.scene.source)
    squares = np.square(moved[:, :, None] - state.scene.target).sum(axis=-1).min(axis=-1)
    values = np.minimum(squares, state.controls.cap**2).mean(axis=1)
    assert values[mask].min() > state.course[-1][0] - state.controls.gap
    floors = state.floors.headings[~mask]
    assert (floors <= values[~mask] + 1e-12).all()


def test_every_open_arc_has_a_tick_at_its_ends() -> None:
    """So that halving is visible while all floors are zero: one tick, then two, four and eight, equally spaced; later,
    ticks mark where the remaining arcs begin and end."""
    for steps, count in enumerate((1, 2, 4, 8)):
        ends = after(steps, "turns").floors.ends
        np.testing.assert_allclose(ends, np.arange(count) * 2.0 * np.pi / count - np.pi, atol=1e-12)
    state = after(6, "turns")
    boxes = state.ground.in_world(state.now.boxes[0])
    result = np.unique(np.concatenate([boxes.middle[:, 0] - boxes.half[:, 0], boxes.middle[:, 0] + boxes.half[:, 0]]))
    assert len(state.floors.ends) == len(np.unique(result.round(9)))
    np.testing.assert_allclose(state.floors.ends, np.unique(result.round(9)), atol=np.pi / marks.HEADINGS)


def test_the_ceiling_is_seen_to_fall() -> None:
    """After a step that lowers the ceiling, its rim lies inside the previous one by the same fraction of the ring;
    otherwise on the outer rim."""
    for steps in range(5):
        state = after(steps, "turns")
        top, before = state.course[-1][0], state.course[max(steps - 1, 0)][0]
        rims = [mark for mark in figure.draw(state).panels[0].marks if getattr(mark, "role", "") == "source"]
        (rim,) = (mark.reach for mark in rims if isinstance(mark, Ring))
        assert rim is not None
        assert (rim - marks.INNER) / (marks.OUTER - marks.INNER) == pytest.approx(top / before)
        labels = {mark.text for mark in figure.draw(state).panels[0].marks if isinstance(mark, Label)}
        assert labels == {"ceiling", f"{top:.4f} u²", *(["one step ago", f"{before:.4f} u²"] if top < before else [])}
    first, second = (after(steps, "turns").course[-1][0] for steps in (0, 1))
    assert second < 0.5 * first


def test_floors_of_the_raster_are_the_lowest_bounds() -> None:
    """Compared with evaluating every box at every heading and place, for boxes of all sizes within an unround root."""
    rng = np.random.default_rng(1)
    root = Boxes(np.array([[0.0, 1.3, -0.4]]), np.array([[np.pi, 9.7]]), np.zeros(1))
    level, depth = rng.integers(0, 9, 300), rng.integers(0, 8, 300)
    turn, side = np.pi / 2.0**level, 9.7 / 2.0**depth
    k = np.stack([rng.integers(0, 2**n, 300) for n in (level, depth, depth)], axis=1)
    low = np.array([-np.pi, 1.3 - 9.7, -0.4 - 9.7])
    middle = low + (2 * k + 1) * np.stack([turn, side, side], axis=1)
    boxes = Boxes(middle, np.stack([turn, side], axis=1), rng.random(300))
    visible = boxes.of(rng.random(300) < 0.1)
    result = marks.floors(root, visible, boxes, held=False)
    at = (np.arange(marks.HEADINGS) + 0.5) / marks.HEADINGS * 2.0 * np.pi - np.pi
    covers = np.abs(at[:, None] - visible.middle[:, 0]) < visible.half[:, 0] + np.pi / marks.HEADINGS - 1e-9
    np.testing.assert_array_equal(result.headings, np.where(covers, visible.bound, np.inf).min(axis=1))
    tile = 9.7 / marks.TILES
    x, y = (low[d] + (np.arange(marks.TILES) + 0.5) * 2.0 * tile for d in (1, 2))
    reach = visible.half[:, 1] + tile - 1e-9
    inside = (np.abs(x[None, :, None] - visible.middle[:, 1]) < reach) & (
        np.abs(y[:, None, None] - visible.middle[:, 2]) < reach
    )
    np.testing.assert_array_equal(result.places, np.where(inside, visible.bound, np.inf).min(axis=2))
    assert not (result.headings_gone & np.isfinite(result.headings)).any()


def test_the_end_is_a_proof_and_nothing_is_left_to_press() -> None:
    for name, changes in (("default", {}), ("turns", {}), ("hall", {})):
        plain = preset(figure.WIDGET, name, changes).plain()
        frame = Host().render("f", {**plain, "log": [["press", "finish"]]})
        readouts = {readout["name"]: readout["value"] for readout in frame["readouts"]}
        assert readouts["stop"].startswith("proved, step ")
        assert readouts["left"] == "0"
        assert readouts["headings"] == "100"
        assert float(readouts["gap"]) <= 0.001
        assert set(frame["disabled"]) == {"step", "finish"}


def test_not_all_headings_are_ruled_out_while_one_is_left() -> None:
    """255 of 256 are no 100 %."""
    state = after(9, "default", search="turns", cap=0.2)
    assert 0.995 < state.floors.share_gone < 1.0
    picture = figure.draw(state)
    assert picture.note == "Step 9: 99 % of the headings are ruled out; boxes left: 1."
    assert "Boxes examined: " in picture.description


@pytest.mark.parametrize(("name", "word"), [("turns", "heading"), ("default", "pose")])
def test_a_proof_over_headings_does_not_speak_of_poses(name: str, word: str) -> None:
    """With the position held at the truth, a pose elsewhere may be better than the floor, and in this room one is."""
    picture = figure.draw(figure.act(after(0, name), Action("press", "finish")))
    said = f"{picture.note} {picture.description}"
    assert f"no {word} is b" in said
    assert f"no {'pose' if word == 'heading' else 'heading'}" not in said
    assert "may still be" not in picture.description, "no box is left"
    floor, best = (float(figure.draw(figure.act(after(0, n), Action("press", "finish"))).readouts[k].value)
                   for n, k in (("turns", 1), ("default", 0)))
    assert best < floor


def test_steps_one_by_one_are_the_run_to_the_end() -> None:
    stepwise, whole = after(60, "turns"), figure.act(after(0, "turns"), Action("press", "finish"))
    assert stepwise.course == whole.course
    floor = [low for _, low in whole.course]
    assert floor == sorted(floor)


def test_thousands_of_boxes_have_a_comma() -> None:
    """In the readouts, the note and the description."""
    state = after(14)
    values = {readout.name: readout.value for readout in figure.draw(state).readouts}
    left, examined = int(state.now.left[0]), int(state.now.examined[0])
    assert left > 1000
    assert (values["left"], values["examined"]) == (f"{left:,}", f"{examined:,}")
    assert f"boxes left: {left:,}." in figure.draw(state).note
    assert f"Boxes examined: {examined:,}; left: {left:,}." in figure.draw(state).description


@pytest.mark.parametrize(("name", "steps"), [("turns", 0), ("turns", 5), ("default", 12)])
def test_the_chart_is_the_floor_in_shares_of_the_ceiling(name: str, steps: int) -> None:
    """One point for each step, the ceiling at 1; the status and the words count the same steps."""
    state = after(steps, name)
    ceiling, floor = state.course[-1]
    picture = figure.draw(state)
    lines = {m.role: np.asarray(m.xy) for m in picture.panels[1].marks if isinstance(m, Path) and m.thick}
    if steps:
        np.testing.assert_allclose(lines["accent"], [[k, low / ceiling] for k, (_, low) in enumerate(state.course)])
    np.testing.assert_array_equal(lines["source"][:, 1], 1.0)
    assert lines["source"][0, 0] == 0.0
    assert lines["source"][1, 0] >= steps
    assert {readout.name: readout.value for readout in picture.readouts}["stop"] == f"searching, step {steps}"
    off = float(np.degrees(rre(state.pose, state.scene.truth)))
    assert f"After {steps} step" in picture.description
    assert f"{off:.1f}° from the truth, with a mean of {ceiling:.4f} u²; no" in picture.description
    assert f" is below {floor:.4f} u²." in picture.description


@pytest.mark.parametrize(("name", "steps"), [("turns", 4), ("default", 14)])
def test_the_ring_is_as_high_as_each_heading_s_floor(name: str, steps: int) -> None:
    """Up to the ceiling where a heading is ruled out, and then in the colour of what went now or before."""
    state = after(steps, name)
    floors, (ceiling, _) = state.floors, state.course[-1]
    drawn = figure.draw(state).panels[0].marks
    at = (np.arange(marks.HEADINGS) + 0.5) / marks.HEADINGS * 2.0 * np.pi - np.pi
    seen = np.full(marks.HEADINGS, np.nan)
    roles = np.full(marks.HEADINGS, "", dtype=object)
    for mark in drawn:
        if isinstance(mark, Path) and mark.closed and mark.filled:
            xy = np.asarray(mark.xy)
            outer = xy[: 2 * (len(xy) - 1) // 3]  # two points for each heading, then one for each of their borders
            for k in range(len(outer) // 2):
                a, b = outer[2 * k], outer[2 * k + 1]
                middle = np.arctan2(-(a + b)[0], (a + b)[1])
                row = int(np.abs((at - middle + np.pi) % (2 * np.pi) - np.pi).argmin())
                assert np.linalg.norm(a) == pytest.approx(np.linalg.norm(b))
                seen[row], roles[row] = np.linalg.norm(a), mark.role
            np.testing.assert_allclose(np.linalg.norm(xy[len(outer) :], axis=1), marks.INNER)
    top = marks.INNER + (marks.OUTER - marks.INNER) * ceiling / state.before
    closed = np.isinf(floors.headings)
    expected = marks.INNER + (top - marks.INNER) * np.where(closed, 1.0, np.minimum(floors.headings / ceiling, 1.0))
    np.testing.assert_allclose(seen, expected)
    kinds = np.where(~closed, "accent", np.where(floors.headings_gone, "weak", "ghost"))
    np.testing.assert_array_equal(roles, kinds)
    (spot, cross) = (np.reshape(m.xy, 2) for m in drawn if isinstance(m, Points) and m.role == "source")
    heading = float(state.pose.angle)
    np.testing.assert_allclose(spot / np.linalg.norm(spot), place(heading, 1.0).reshape(2), atol=1e-9)
    np.testing.assert_allclose(cross, state.pose.apply(state.scene.source).mean(axis=0))
    (truth,) = (m for m in drawn if isinstance(m, Segments) and m.role == "truth")
    np.testing.assert_allclose(np.reshape([truth.a, truth.b], (2, 2))[:, 0], 0.0, atol=1e-12)


def test_the_field_is_the_stronger_the_lower_the_floor_of_a_place() -> None:
    """Within the ring, over the square of all places; a dot where the last step removed what was left."""
    state = after(14)
    root = state.ground.in_world(state.ground.root)
    heat, dots = marks.field(state.floors, root, state.course[-1][0])
    assert isinstance(heat, Heat)
    assert isinstance(dots, Points)
    (drawn,) = (m for m in figure.draw(state).panels[0].marks if isinstance(m, Heat))
    np.testing.assert_array_equal(drawn.values, heat.values)
    half, middle = float(root.half[0, 1]), root.middle[0, 1:]
    np.testing.assert_allclose(heat.window, np.ravel(np.stack([middle - half, middle + half], axis=1)))
    at = (np.arange(marks.TILES) + 0.5) * 2.0 * half / marks.TILES - half
    x, y = np.meshgrid(middle[0] + at, middle[1] + at)
    places, strong = state.floors.places, np.asarray(heat.values)
    shown = np.isfinite(places) & (np.hypot(x, y) < marks.ROUND)
    np.testing.assert_array_equal(np.isfinite(strong), shown)
    order = np.argsort(places[shown])
    assert (np.diff(strong[shown][order]) <= 1e-12).all()
    assert (strong[shown] > 0.0).all()
    gone = state.floors.places_gone & (np.hypot(x, y) < marks.ROUND)
    np.testing.assert_allclose(dots.xy, np.stack([x[gone], y[gone]], axis=1))
