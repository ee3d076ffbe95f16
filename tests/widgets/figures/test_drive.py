"""The figure of the drive: what it draws is the table's, and its controls do what they say."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from solvers.scenes.drive import telecom_loop
from tests.widgets.states import readouts
from widgets.drawing.picture import Label, Path, Points, Segments
from widgets.drawing.svg import mark_svg
from widgets.engine.contract import Action, preset
from widgets.figures.drive import OPEN, PRESENT, WIDGET, State, act, draw, start
from widgets.parts.drive_map import SCANS, VIEW, chunk
from widgets.parts.drive_table import table

STEP, FINISH = Action("press", "step"), Action("press", "finish")


def texts(state: State) -> dict[str, str]:
    return readouts(draw(state))


def loop_lines(state: State) -> Segments:
    """The lines between the scans of the loops."""
    (lines,) = (m for m in draw(state).panels[0].marks if isinstance(m, Segments) and m.role == "inlier")
    return lines


def at_the_end(**controls: object) -> State:
    return act(start(preset(WIDGET, "default", controls).controls, 40), FINISH)


def test_pressing_on_shows_all_scans_in_the_end() -> None:
    state = start(preset(WIDGET, "default").controls, 40)
    counts = []
    while not draw(state).disabled:
        state = act(state, STEP)
        counts.append(state.seen)
    assert counts == sorted(set(counts))
    assert counts[-1] == SCANS
    assert act(state, STEP) == state


def test_each_kind_of_poses_misses_the_loops_by_less() -> None:
    misses = [float(texts(at_the_end(poses=poses))["apart"]) for poses in ("odometry", "matched", "closed")]
    assert misses[0] > 4.0
    assert 0.05 < misses[1] < 0.2
    assert misses[2] < 0.01


def test_what_has_been_drawn_is_drawn_again_as_the_same_mark() -> None:
    """So a step of the player renders only new scans."""
    state = at_the_end()
    assert draw(state).panels[0].marks[0] is draw(act(state, STEP)).panels[0].marks[0]
    assert chunk(0, 15, "matched", "none", False) is chunk(0, 15, "matched", "none", False)


@pytest.mark.parametrize("poses", ["odometry", "matched", "closed"])
def test_every_way_shows_the_loops_between_their_scans(poses: str) -> None:
    """They appear as soon as there is one loop; odometry leaves them metres long."""
    assert not len(np.asarray(loop_lines(start(preset(WIDGET, "default", {"poses": poses}).controls, 40)).a))
    state = at_the_end(poses=poses)
    mark = loop_lines(state)
    assert "inlier" in {getattr(mark, "role", "") for mark in draw(state).panels[0].marks}
    lengths = np.linalg.norm(np.asarray(mark.b) - np.asarray(mark.a), axis=1)
    assert len(lengths) == (19 if poses == "odometry" else 55)
    assert (np.median(lengths) > 4.0) == (poses == "odometry")


def test_the_map_has_a_bar_of_ten_metres() -> None:
    """A metre on the bar is a metre on the map."""
    bar, _, label = draw(at_the_end()).panels[0].marks[-3:]
    assert isinstance(bar, Segments)
    assert isinstance(label, Label)
    assert label.text == "10 m"
    assert np.linalg.norm(np.asarray(bar.b) - np.asarray(bar.a)) == pytest.approx(10.0)


@pytest.mark.native
def test_the_whole_map_is_light_enough_to_play() -> None:
    """The last frame is below 80 kB of markup, and each step adds less than 12 kB."""
    state = start(preset(WIDGET, "closed").controls, 40)
    before: set[str] = set()
    while not draw(state).disabled:
        state = act(state, STEP)
        panel = draw(state).panels[0]
        markup = [mark_svg(mark, panel.view, "") for mark in panel.marks]
        assert sum(len(text) for text in markup if text not in before) < 12_000
        before = set(markup)
    assert sum(map(len, before)) < 80_000


@pytest.mark.parametrize("poses", ["odometry", "matched", "closed"])
def test_the_picture_ends_at_the_scan_just_taken(poses: str) -> None:
    """The robot, its path and its scan; the odometry's path beside any other; the map from the scans drawn so far."""
    state = act(act(start(preset(WIDGET, "default", {"poses": poses}).controls, 40), STEP), STEP)
    n, way, marks = state.seen, state.way, draw(state).panels[0].marks
    paths = {(m.role, m.dotted): np.asarray(m.xy) for m in marks if isinstance(m, Path) and not m.closed}
    np.testing.assert_array_equal(paths["source", False], way.t[:n])
    odometry = table().way("odometry")
    assert (("ghost", True) in paths) == (poses != "odometry")
    if poses != "odometry":
        np.testing.assert_array_equal(paths["ghost", True], odometry.t[:n])
    (robot,) = (np.asarray(m.xy) for m in marks if isinstance(m, Path) and m.closed)
    ahead = way.R[n - 1] @ [1.0, 0.0]
    nose = robot[np.argmax((robot - way.t[n - 1]) @ ahead)] - way.t[n - 1]
    np.testing.assert_allclose(nose / np.linalg.norm(nose), ahead, atol=1e-9)
    (scan,) = (np.asarray(m.xy) for m in marks if isinstance(m, Points) and m.role == "source")
    own = way[n - 1].apply(telecom_loop().points(n - 1, 80.0))
    assert np.linalg.norm(scan[:, None] - own, axis=2).min(axis=1).max() < 1e-9
    assert len(scan) > 0.5 * len(own) / PRESENT
    assert (scan > [VIEW.x0, VIEW.y0]).all()
    assert (scan < [VIEW.x1, VIEW.y1]).all()


def test_the_way_driven_is_the_sum_of_its_steps() -> None:
    """And the turns add up to the heading, which winds more than once round the block."""
    state = at_the_end(poses="closed")
    text, t = texts(state), state.way.t
    steps = [float(np.hypot(*(b - a))) for a, b in pairwise(t)]
    assert float(text["driven"]) == pytest.approx(sum(steps), abs=0.06)
    headings = np.unwrap(state.way.angle)
    turned = float(text["turned"].replace("−", "-"))
    assert turned == pytest.approx(np.degrees(headings[-1] - headings[0]), abs=0.6)
    assert abs(turned) > 360.0
    assert texts(start(state.controls, 40))["driven"] == "0.0"


def test_the_loop_errors_are_those_of_the_loops_seen_so_far() -> None:
    """Between the two scans of each loop by the poses and by the measurement; as many as the note counts, and lines."""
    state = at_the_end(poses="matched")
    data, way = table(), state.way
    shifts, turns = [], []
    for k, (later, earlier) in enumerate(zip(data.later, data.earlier, strict=True)):
        off = data.loops[k].inverse().compose(way[int(earlier)].inverse().compose(way[int(later)]))
        shifts.append(float(np.hypot(*off.t)))
        turns.append(abs(float(np.degrees(off.angle))))
    text, picture = texts(state), draw(state)
    assert text["apart"] == f"{np.median(shifts):.3f}"
    assert text["worst"] == f"{max(shifts):.3f}"
    assert text["turn"] == f"{np.median(turns):.2f}"
    assert picture.note == f"Median error of the {len(shifts)} loops: {np.median(shifts):.3f} m."
    lines = loop_lines(state)
    np.testing.assert_array_equal(lines.a, way.t[data.earlier])
    np.testing.assert_array_equal(lines.b, way.t[data.later])
    open_ = at_the_end(poses="odometry")
    np.testing.assert_array_equal(loop_lines(open_).b, open_.way.t[data.later[::OPEN]])
    begun = start(state.controls, 40)
    while not (data.later < begun.seen).any():
        assert texts(begun)["apart"] == texts(begun)["turn"] == texts(begun)["worst"] == "–"
        begun = act(begun, STEP)
    assert texts(begun)["apart"] != "–"
