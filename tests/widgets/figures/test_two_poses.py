"""The figure of two scans: the reader aligns them by hand, and the answer is the robot's motion."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from solvers import register
from tests.widgets.states import frame_after, readouts
from widgets.drawing.picture import Arrow, Group, Path, Points, Segments
from widgets.engine.contract import SEED, Action, preset
from widgets.engine.host import Host
from widgets.figures.two_poses import PLACING, WIDGET, Controls, act, draw, motion, nearest, start

ANSWER = Action("press", "answer")
PLAIN = preset(WIDGET).plain()


def texts(*log: list[object], **controls: float) -> dict[str, str]:
    return readouts(frame_after(WIDGET, *log, **controls))


def test_at_first_both_scans_have_the_robot_at_the_origin() -> None:
    """The errors of doing nothing are the motion itself."""
    state = start(Controls(), SEED)
    np.testing.assert_array_equal(state.pose.matrix, np.eye(3))
    result = texts(turn=-65.0, distance=1.7)
    assert (result["rotation_error"], result["translation_error"]) == ("65.0", "1.70")


def test_the_answer_is_where_the_robot_stood() -> None:
    """Once shown, the errors are zero and the source's robot has its pose as seen from the target's."""
    state = act(start(Controls(), SEED), ANSWER)
    scans = state.scans
    np.testing.assert_allclose(scans.target_pose.apply(state.pose.t[None])[0], scans.source_pose.t, atol=1e-12)
    np.testing.assert_allclose(scans.target_pose.R @ state.pose.R, scans.source_pose.R, atol=1e-12)
    result = texts(["press", "answer"])
    assert (result["rotation_error"], result["translation_error"]) == ("0.0", "0.00")


@pytest.mark.parametrize("seed", range(SEED, SEED + 25 * 13, 13))
def test_the_answer_is_nearer_than_the_start(seed: int) -> None:
    """In every draw the truth brings the clouds nearer, though not to zero: each scan has its own corners."""
    before = start(Controls(), seed)
    assert 0.0 < nearest(act(before, ANSWER)) < 0.6 * nearest(before)


@settings(deadline=None)
@given(st.floats(-4.4, 4.4), st.floats(-2.9, 2.9), st.floats(-3, 3))
def test_the_hand_puts_the_robot_where_it_says(x: float, y: float, angle: float) -> None:
    """One drag places the robot, the other turns it in place; a drag after the answer takes the answer back."""
    state = act(start(Controls(), SEED), Action("drag", "source", x, y))
    state = act(state, Action("drag", "turn", x + np.cos(angle), y + np.sin(angle)))
    np.testing.assert_allclose(state.pose.t, [x, y], atol=1e-12)
    assert float(state.pose.angle) == pytest.approx(angle)
    result = act(state, ANSWER)
    assert act(result, ANSWER) is result
    assert act(result, Action("drag", "source", x, y)).by_hand is None


def test_the_motion_leads_to_the_answer() -> None:
    """Turned about its old robot and shifted, the source scan is where the answer puts it."""
    before = act(start(Controls(), SEED), Action("drag", "source", 2, 1))
    after = act(before, ANSWER)
    moved = motion(before, after)
    assert moved is not None
    c, s = np.cos(moved.turn), np.sin(moved.turn)
    old = before.pose.apply(before.scans.source) - moved.about
    new = old @ np.array([[c, -s], [s, c]]).T + moved.about + moved.shift
    np.testing.assert_allclose(new, after.pose.apply(after.scans.source), atol=1e-12)
    frame = Host().render("fig-by-hand", {**PLAIN, "log": [["press", "answer"]]})
    assert [moved["group"] for moved in frame["motions"]] == ["fig-by-hand-robot-source"]


def test_only_what_was_moved_was_moved_by_hand() -> None:
    """The answer after no drag mentions the start instead."""
    notes = [
        Host().render("f", {**PLAIN, "log": [*moves, ["press", "answer"]]})["note"]
        for moves in ([], [["drag", "source", 2, 1]])
    ]
    assert notes[0] == "The answer. The start was 50.0° and 2.00 u from here."
    assert notes[1].startswith("The answer. By hand it was 50.0°")


def drag_log(degrees: float, x: float, y: float) -> list[list[object]]:
    """The drags that put the source this far from the truth."""
    truth = start(Controls(), SEED).scans.truth
    (a, b), angle = np.add(truth.t, (x, y)), float(truth.angle) + np.radians(degrees)
    return [["drag", "source", a, b], ["drag", "turn", a + 3.2 * np.cos(angle), b + 3.2 * np.sin(angle)]]


def test_a_hand_that_has_found_it_is_told_so() -> None:
    """Within 3° and 0.1 u, and not beyond."""
    places = (2.5, 0.0, 0.05), (3.5, 0.0, 0.0), (0.0, 0.2, 0.0)
    notes = [Host().render("f", {**PLAIN, "log": drag_log(*offset)})["note"] for offset in places]
    assert notes == ["Aligned: 2.5° and 0.05 u from the truth.", "", ""]


def test_icp_goes_on_from_the_hand_s_place() -> None:
    """It ends where the package's method stops from that pose: at the truth from 20° and 0.5 u off, elsewhere from the
    start. It can be pressed once, and the answer after it."""
    truth = start(Controls(), SEED).scans.truth
    for log, note in ((drag_log(20.0, 0.5, 0.0), "began 20.0° and 0.50 u from the truth and stopped 0."),
                      ([], "stopped in the wrong place, 4")):  # fmt: skip
        frame = Host().render("f", {**PLAIN, "log": [*log, ["press", "icp"]]})
        assert note in frame["note"]
        second = Host().render("f", {**PLAIN, "log": [*log, ["press", "icp"], ["press", "icp"]]})
        assert second["panels"] == frame["panels"]
        answer = Host().render("f", {**PLAIN, "log": [*log, ["press", "icp"], ["press", "answer"]]})
        assert answer["note"].startswith("The answer.")
    state = start(Controls(), SEED)
    for action in (Action("drag", "source", *np.add(truth.t, (0.4, 0.0))), Action("press", "icp")):
        state = act(state, action)
    assert state.by_hand is not None
    result = register(state.scans.source, state.scans.target, "capped-icp", start=state.by_hand)
    np.testing.assert_array_equal(state.pose.matrix, result.pose.matrix)
    assert act(state, Action("drag", "source", 0.0, 0.0)).shown == ""


def test_the_turning_handle_stays_apart_where_the_border_leaves_no_room() -> None:
    """A solution may lie where no drag can put a cloud: the turning handle then lies outside, not on the other."""
    for x, distance in ((0.0, PLACING.reach), (7.5, PLACING.least)):
        grip = PLACING.grip(np.array([x, 0.0]), 0.0)
        assert np.hypot(*(grip - [x, 0.0])) == pytest.approx(distance)


@pytest.mark.parametrize("distance", [0.8, 2.0, 3.5])
def test_the_room_shows_each_scan_from_its_robot(distance: float) -> None:
    """Rays from the robot's place to its points, the target's as squares; an arrow between the robots, from the source
    to the target and off both, if they stand apart."""
    state = start(Controls(distance=distance), SEED)
    scans, marks = state.scans, draw(state).panels[0].marks
    for role, pose, cloud in (("target", scans.target_pose, scans.target), ("source", scans.source_pose, scans.source)):
        (points,) = (m for m in marks if isinstance(m, Points) and m.role == role)
        assert points.shape == ("square" if role == "target" else "dot")
        np.testing.assert_allclose(points.xy, pose.apply(cloud))
        (rays,) = (m for m in marks if isinstance(m, Segments) and m.role == role)
        np.testing.assert_allclose(rays.a, np.broadcast_to(pose.t, np.shape(rays.a)))
        np.testing.assert_allclose(rays.b, pose.apply(cloud)[::2])
        (robot,) = (np.asarray(m.xy) for m in marks if isinstance(m, Path) and m.role == role)
        assert np.linalg.norm(robot - pose.t, axis=1).max() < 0.7
    arrows = [m for m in marks if isinstance(m, Arrow)]
    assert len(arrows) == (distance > 1.2)
    travel = scans.target_pose.t - scans.source_pose.t
    for arrow in arrows:
        shares = (np.array([arrow.a, arrow.b]) - scans.source_pose.t) @ travel / (travel @ travel)
        assert 0.0 < shares[0] < shares[1] < 1.0
        np.testing.assert_allclose(shares.sum(), 1.0)
        np.testing.assert_allclose(scans.source_pose.t + shares[:, None] * travel, [arrow.a, arrow.b], atol=1e-12)


def test_the_robots_own_picture_has_the_source_where_the_pose_puts_it() -> None:
    state = act(start(Controls(), SEED), Action("drag", "source", 1.5, -0.5))
    marks = draw(state).panels[1].marks
    (target,) = (m for m in marks if isinstance(m, Points))
    (group,) = (m for m in marks if isinstance(m, Group))
    (moved,) = (m for m in group.marks if isinstance(m, Points))
    np.testing.assert_array_equal(target.xy, state.scans.target)
    np.testing.assert_array_equal(moved.xy, state.pose.apply(state.scans.source))
