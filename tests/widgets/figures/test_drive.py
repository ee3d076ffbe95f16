"""The figure of the drive: its table holds the solvers' results, and its controls do what they say."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from solvers.scenes.drive import telecom_loop
from tests.widgets.states import readouts
from widgets.drawing.picture import Label, Path, Points, Ring, Segments
from widgets.drawing.svg import mark_svg
from widgets.engine.contract import Action, preset
from widgets.figures.drive.figure import (
    OPEN,
    PRESENT,
    SCANS,
    VIEW,
    WIDGET,
    State,
    act,
    chunk,
    draw,
    drawn_scans,
    loops,
    start,
)
from widgets.parts import drive_solved
from widgets.parts import drive_table as table

STEP, FINISH = Action("press", "step"), Action("press", "finish")


def texts(state: State) -> dict[str, str]:
    return readouts(draw(state))


def at_the_end(**controls: object) -> State:
    return act(start(preset(WIDGET, "default", controls).controls, 40), FINISH)


@pytest.mark.native
def test_the_table_is_what_the_solvers_find() -> None:
    """Recomputed from the scans, every pose agrees to half a centimetre, with the same loops
    and the same weights left to the wrong one.

    To write the file again: python -c "from widgets.parts import drive_solved; drive_solved.write()".
    """
    cached, result = table.table(), table.read(drive_solved.made())
    assert np.array_equal(cached.later, result.later)
    assert np.array_equal(cached.earlier, result.earlier)
    assert cached.ways.keys() == result.ways.keys()
    for name, way in result.ways.items():
        assert np.abs(way.t - cached.ways[name].t).max() < 0.005, name
        assert np.abs(way.R - cached.ways[name].R).max() < 0.001, name
    assert np.abs(result.loops.t - cached.loops.t).max() < 0.005
    assert cached.kept == pytest.approx(result.kept, abs=0.001)


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


def test_the_wrong_loop_bends_what_no_kernel_holds() -> None:
    bent = [float(texts(at_the_end(poses="closed", wrong=True, kernel=k))["bent"]) for k in table.KERNELS]
    assert bent[0] > 5.0
    assert 0.1 < bent[1] < 1.0
    assert bent[2] < 0.05
    assert texts(at_the_end(poses="closed"))["bent"] == "0.00"


def test_readout_and_description_tell_one_shift_by_the_wrong_loop() -> None:
    """That of the scans drawn, not of those to come."""
    state = start(preset(WIDGET, "closed", {"wrong": True}).controls, 40)
    told = set[str]()
    for _ in range(12):
        picture = draw(state)
        shift = readouts(picture)["bent"]
        assert f"moves a pose by at most {shift} m" in picture.description
        told.add(shift)
        state = act(state, STEP)
    assert len(told) > 3


def test_the_wrong_loop_is_drawn_where_the_graph_has_it() -> None:
    """Only among closed poses, and only once both of its scans have been made."""

    def roles(state: State) -> set[str]:
        return {mark.role for mark in draw(state).panels[0].marks if hasattr(mark, "role")}

    assert "outlier" in roles(at_the_end(poses="closed", wrong=True))
    assert "outlier" not in roles(at_the_end(poses="matched", wrong=True))
    state = start(preset(WIDGET, "wrong").controls, 40)
    assert "outlier" not in roles(state)


@pytest.mark.parametrize("kernel", table.KERNELS)
def test_the_wrong_loop_is_found_with_every_kernel(kernel: str) -> None:
    """Each of its scans has a ring, in two sizes, and the loop is labelled even where it has no visible length."""
    state = at_the_end(poses="closed", wrong=True, kernel=kernel)
    marks = draw(state).panels[0].marks
    rings = {mark.radius: np.asarray(mark.xy) for mark in marks if isinstance(mark, Ring)}
    assert len(rings) == 2
    for (_, xy), scan in zip(sorted(rings.items()), sorted(table.WRONG), strict=True):
        np.testing.assert_array_equal(xy, state.way.t[scan])
    assert "wrong loop" in [mark.text for mark in marks if isinstance(mark, Label)]


def test_each_scan_of_the_wrong_loop_is_ringed_once_it_has_been_made() -> None:
    state = start(preset(WIDGET, "wrong").controls, 40)
    while state.seen < SCANS:
        marks = draw(state).panels[0].marks
        assert sum(isinstance(mark, Ring) for mark in marks) == sum(state.seen > scan for scan in table.WRONG)
        has_label = "wrong loop" in [mark.text for mark in marks if isinstance(mark, Label)]
        assert has_label is (state.seen > max(table.WRONG))
        state = act(state, STEP)


def test_what_has_been_drawn_is_drawn_again_as_the_same_mark() -> None:
    """So a step of the player renders only new scans."""
    state = at_the_end()
    assert draw(state).panels[0].marks[0] is draw(act(state, STEP)).panels[0].marks[0]
    assert chunk("matched", "", False, 0, 15) is chunk("matched", "", False, 0, 15)


@pytest.mark.parametrize("controls", [{"wrong": True}, {"kernel": "cauchy"}])
@pytest.mark.parametrize(("poses", "is_told"), [("odometry", True), ("matched", True), ("closed", False)])
def test_what_has_no_effect_says_so(controls: dict[str, object], poses: str, is_told: bool) -> None:
    """Loops affect only the closed poses."""
    assert ("only on closed poses" in draw(at_the_end(poses=poses, **controls)).note) == is_told


@pytest.mark.parametrize("poses", ["odometry", "matched", "closed"])
def test_every_way_shows_the_loops_between_their_scans(poses: str) -> None:
    """They appear as soon as there is one loop; odometry leaves them metres long."""
    assert not len(np.asarray(loops(start(preset(WIDGET, "default", {"poses": poses}).controls, 40)).a))
    state = at_the_end(poses=poses)
    mark = loops(state)
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


def test_the_scans_drawn_lie_apart() -> None:
    t = table.table().ways["matched", "", False].t[list(drawn_scans())]
    assert np.linalg.norm(np.diff(t, axis=0), axis=1).min() >= 0.35
    assert len(t) > 100


def test_a_table_of_another_shape_is_refused() -> None:
    with open(table.FILE, "rb") as file:
        data = file.read()
    with pytest.raises(ValueError, match="reshape"):
        table.read(data[:-4])


@pytest.mark.parametrize("poses", ["odometry", "matched", "closed"])
def test_the_picture_ends_at_the_scan_just_taken(poses: str) -> None:
    """The robot, its path and its scan; the odometry's path beside any other; the map from the scans drawn so far."""
    state = act(act(start(preset(WIDGET, "default", {"poses": poses}).controls, 40), STEP), STEP)
    n, way, marks = state.seen, state.way, draw(state).panels[0].marks
    paths = {(m.role, m.dotted): np.asarray(m.xy) for m in marks if isinstance(m, Path) and not m.closed}
    np.testing.assert_array_equal(paths["source", False], way.t[:n])
    odometry = table.table().ways["odometry", "", False]
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
    data, way = table.table(), state.way
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
    lines = loops(state)
    np.testing.assert_array_equal(lines.a, way.t[data.earlier])
    np.testing.assert_array_equal(lines.b, way.t[data.later])
    open_ = at_the_end(poses="odometry")
    np.testing.assert_array_equal(loops(open_).b, open_.way.t[data.later[::OPEN]])
    begun = start(state.controls, 40)
    while not (data.later < begun.seen).any():
        assert texts(begun)["apart"] == texts(begun)["turn"] == texts(begun)["worst"] == "–"
        begun = act(begun, STEP)
    assert texts(begun)["apart"] != "–"
