"""Chains, loops and graphs on a simulated drive with known truth and on the recorded one without."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cache, partial

import numpy as np
import pytest

from solvers import Pose
from solvers.core.edges import Edges
from solvers.odometry import (
    Chain,
    LoopOptions,
    Matches,
    MatchOptions,
    Scans,
    candidates,
    close,
    edges_of,
    keyframes,
    match,
    missed,
    prepare,
    scan_to_map,
    scan_to_scan,
    straightened,
    verified,
)
from solvers.odometry.matching import TOGETHER, together
from solvers.posegraph import optimise
from solvers.scenes.drive import Drive, chained, interlaced, telecom_loop
from solvers.scenes.simulated_drive import simulated_drive
from tests.solvers.odometry.drives import matches_of, simulation, without_echoes


@cache
def recording() -> tuple[Drive, Scans, Chain, Matches]:
    drive = telecom_loop()
    scans = prepare(drive)
    chain = scan_to_scan(scans, drive.motion)
    return drive, scans, chain, verified(scans, chain.poses, *candidates(chain.poses))


def drift(poses: Pose, truth: Pose) -> float:
    """The largest distance of any pose from the truth, metres."""
    return float(np.linalg.norm(poses.t - truth.t, axis=1).max())


# A simulated drive.


def test_the_chain_stays_near_a_truth_that_the_odometry_leaves() -> None:
    drive, truth, _, chain = simulation()
    assert chain.believed.all()
    assert drift(chained(drive.motion), truth) > 0.8
    assert drift(chain.poses, truth) < 0.08


def test_a_graph_with_its_loops_is_nearer_to_the_truth_than_the_chain() -> None:
    _, truth, scans, chain = simulation()
    loops = verified(scans, chain.poses, *candidates(chain.poses))
    assert loops.believed.sum() >= 10
    result = close(chain, loops)
    assert drift(result.poses, truth) < 0.75 * drift(chain.poses, truth)


def test_a_map_of_several_keyframes_drifts_less_than_the_last_keyframe_alone() -> None:
    drive, truth, scans, _ = simulation()
    alone, several = (scan_to_map(scans, drive.motion, length=length) for length in (1, 8))
    assert alone.believed.all()
    assert several.believed.all()
    assert drift(several.poses, truth) < drift(alone.poses, truth)
    assert drift(several.poses, truth) < 0.05


def test_rounding_does_not_grow_with_the_keyframes() -> None:
    """Every pose of a chain against a map is a rotation to the last digits, however many keyframes came before."""
    drive, _, scans, _ = simulation()
    R = scan_to_map(scans, drive.motion, length=1, shift=0.1).poses.R
    assert np.abs(R @ R.swapaxes(1, 2) - np.eye(2)).max() < 1e-14


@pytest.mark.native
def test_without_odometry_the_last_match_predicts_the_next() -> None:
    drive, truth, scans, _ = simulation()
    identity = Pose.identity(batch=drive.motion.batch)
    assert drift(scan_to_scan(scans, identity, prediction="velocity").poses, truth) < 0.15


def test_a_link_that_is_not_believed_is_the_prediction() -> None:
    drive, _, scans, _ = simulation()
    chain = scan_to_scan(scans, drive.motion, MatchOptions(least_share=1.0))
    lost = ~chain.believed
    assert lost.any()
    assert np.array_equal(chain.motion.t[lost], drive.motion.t[lost])
    edges, robust = edges_of(chain, match(scans, [], [], Pose.identity(batch=(0,))))
    assert np.allclose(edges.information[lost[1:]], np.diag([100.0] * 3))
    assert not robust.any()


@pytest.mark.filterwarnings("error::RuntimeWarning")
@pytest.mark.parametrize("left", [0, 1, 2])
@pytest.mark.parametrize("way", [scan_to_scan, partial(scan_to_scan, prediction="velocity"), scan_to_map])
def test_a_scan_of_fewer_than_three_echoes_is_not_matched(way: Callable[..., Chain], left: int) -> None:
    """Its link is the prediction, and so is the next one's if scans are matched to scans. The drive goes on, even if
    its first or last scan is empty."""
    drive, truth = simulated_drive(scans=40)
    scans = prepare(without_echoes(drive, 0, 1, 20, 39, left=left))
    assert [len(scans.cloud(k)) for k in (0, 1, 20, 39)] == [0] * 4
    report: list[tuple[int, int]] = []
    chain = way(scans, drive.motion, progress=lambda *counts: report.append(counts))
    rows = {1, 2, 20, 39} if way is scan_to_map else {1, 2, 20, 21, 39}
    assert set(np.flatnonzero(~chain.believed)) == rows
    assert (report[-1], {links for _, links in report}) == ((39, 39), {39})
    assert (chain.share[[1, 2, 20, 39]] == 0.0).all()
    assert np.isfinite(chain.poses.matrix).all()
    if not isinstance(way, partial):
        assert np.allclose(chain.motion[[1, 2, 20, 39]].matrix, drive.motion[[1, 2, 20, 39]].matrix)
        assert drift(chain.poses, truth) < drift(chained(drive.motion), truth)


@pytest.mark.filterwarnings("error::RuntimeWarning")
@pytest.mark.parametrize("search", ["none", "correlative"])
def test_a_scan_without_echoes_is_in_no_loop(search: str) -> None:
    """With either search, and whether or not its neighbours are empty too, it is in none; the others are closed."""
    drive, truth, _, _ = simulation()
    scans = prepare(without_echoes(drive, 80, *range(7, 14)))
    chain = scan_to_scan(scans, drive.motion)
    options = LoopOptions(search=search)
    loops = verified(scans, chain.poses, [80, 80, 88], [1, 10, 10], options)
    assert not loops.believed.any()
    assert np.isfinite(loops.pose.matrix).all()
    assert not match(scans, [80, 10, 10], [79, 9, 14], drive.motion[[80, 10, 10]]).believed.any()
    result = close(chain, verified(scans, chain.poses, *candidates(chain.poses)))
    assert result.status
    assert drift(result.poses, truth) < drift(chained(drive.motion), truth)


@pytest.mark.parametrize("delays", [None, 1e-3 * np.arange(181.0)])
def test_a_drive_without_any_echo_says_so(delays: np.ndarray | None) -> None:
    drive = replace(without_echoes(simulation()[0], *range(90), left=2), delays=delays)
    with pytest.raises(ValueError, match=r"^drive: none of 90 scans has three echoes within 30 m$"):
        prepare(drive)


def test_a_pair_s_answer_does_not_depend_on_what_is_matched_with_it() -> None:
    drive, _, scans, chain = simulation()
    alone = match(scans, [7], [6], drive.motion[[7]])
    assert np.array_equal(alone.pose.t[0], chain.motion.t[7])
    assert np.array_equal(alone.information[0], chain.information[7])


def test_padding_plays_no_part() -> None:
    """A scan padded to the length of a longer one gives the same pose as it does by itself."""
    drive, _, scans, _ = simulation()
    short = int(np.argmin(scans.weights.sum(axis=1)[1:])) + 1
    two = Drive(drive.seconds[:2], drive.motion[short - 1 : short + 1], drive.ranges[short - 1 : short + 1],
                drive.bearings, drive.mount)  # fmt: skip
    narrow = prepare(two)
    assert narrow.points.shape[1] < scans.points.shape[1]
    a = match(narrow, [1], [0], drive.motion[[short]]).pose
    b = match(scans, [short], [short - 1], drive.motion[[short]]).pose
    assert np.allclose(a.t, b.t, atol=1e-4)


def test_the_information_is_the_second_derivative_of_what_is_minimised() -> None:
    """For fixed pairs, by finite differences of Σ w (nᵀ(T p − q))² / 2σ² over a motion in the source's coordinates."""
    drive, _, scans, _ = simulation()
    sigma, h = 0.1, 1e-4
    result = match(scans, [7], [6], drive.motion[[7]], MatchOptions(weight="none", gate=0.3, sigma=sigma))
    pose = result.pose[0]
    cloud, target = scans.cloud(7), scans.cloud(6)
    gap = np.linalg.norm(pose.apply(cloud)[:, None] - target[None], axis=2)
    rows = gap.argmin(axis=1)
    used = (gap.min(axis=1) <= 0.3) & ~scans.surface.flagged[6][rows]
    n = scans.surface.vectors[6][rows]

    def cost(x: np.ndarray) -> float:
        moved = pose.compose(Pose.from_angle(x[2], x[:2])).apply(cloud)
        r = ((moved - target[rows]) * n).sum(axis=1)[used]
        return float((r**2).sum() / (2 * sigma**2))

    e = h * np.eye(3)
    H = np.array([[(cost(a + b) - cost(a - b) - cost(b - a) + cost(-a - b)) / (4 * h * h) for a in e] for b in e])
    # The angle's own second derivative adds Σ r ∂²r/∂φ², which is small if the residuals are.
    scale = np.sqrt(np.outer(np.diag(H), np.diag(H)))
    assert np.abs(result.information[0] - H).max() <= 0.02 * scale.max()
    assert np.all(np.abs(result.information[0] - H) <= 0.02 * scale)


def test_progress_is_told_up_to_the_end() -> None:
    drive, _, scans, _ = simulation()
    report: list[tuple[int, int]] = []
    rows = np.resize(np.arange(1, len(scans)), TOGETHER + 3)
    result = match(scans, rows, rows - 1, drive.motion[rows], MatchOptions(max_steps=1), lambda *n: report.append(n))
    assert report == [(TOGETHER, TOGETHER + 3), (TOGETHER + 3, TOGETHER + 3)]
    assert np.array_equal(result.source, rows)


def test_candidates_lie_near_and_look_the_same_way_and_were_driven_between() -> None:
    _, _, _, chain = simulation()
    options = LoopOptions(radius=2.0, turn=0.3, apart=20.0)
    later, earlier = candidates(chain.poses, options)
    assert len(later)
    travel = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(chain.poses.t, axis=0), axis=1)))
    assert (np.linalg.norm(chain.poses.t[later] - chain.poses.t[earlier], axis=1) <= 2.0).all()
    assert (travel[later] - travel[earlier] >= 20.0).all()
    assert np.isin(later, keyframes(chain.poses)).all()
    heading = Pose(chain.poses.R[earlier] @ chain.poses.R[later].swapaxes(1, 2), np.zeros(2)).angle
    assert np.abs(heading).max() <= 0.3


def test_scans_of_different_places_are_no_loop() -> None:
    assert not matches_of([(20, 0), (30, 0), (40, 5)]).believed.any()


def test_each_sign_alone_can_turn_a_loop_away() -> None:
    """If the two directions of a match, or the match and the chain, must agree exactly, no loop is believed; if every
    echo must be explained, only the believed loops that do so remain."""
    _, _, scans, chain = simulation()
    pairs = candidates(chain.poses)
    usual = verified(scans, chain.poses, *pairs)
    assert usual.believed.any()
    for sign in ("agree_shift", "agree_turn", "farthest"):
        assert not verified(scans, chain.poses, *pairs, LoopOptions(**{sign: 0.0})).believed.any(), sign
    whole = verified(scans, chain.poses, *pairs, LoopOptions(least_share=1.0)).believed
    assert 0 < whole.sum() < usual.believed.sum()
    assert (usual.believed & (usual.share == 1.0))[whole].all()


def test_corners_alike_pass_for_a_loop_and_the_kernel_lets_go_of_it() -> None:
    """Scans 50 and 11 see two corners of the hall that look alike: all four signs accept the false loop. Beside the
    true loops, Cauchy's kernel leaves it less than a thousandth of its weight and moves the poses by less than 0.02
    m."""
    _, truth, scans, chain = simulation()
    wrong = matches_of([(50, 11)])
    assert wrong.believed.all()
    right = verified(scans, chain.poses, *candidates(chain.poses))
    result = close(chain, together([right, wrong]))
    assert result.weights[-1] < 1e-3
    assert drift(result.poses, close(chain, right).poses) < 0.02
    assert drift(close(chain, together([right, wrong]), kernel="none").poses, truth) > 1.0


# Scans made on the move.


def test_a_scan_made_on_the_move_is_as_from_a_robot_that_stands() -> None:
    """A room of four walls, with each beam cast from where the robot is when it is sent, at 2 m/s and 0.5 rad/s:
    straightened echoes lie on the walls, those as recorded lie up to centimetres off."""
    speed, turn, step = np.array([2.0, 0.1]), 0.5, 0.2
    bearings, delays = np.radians(np.linspace(-90, 90, 361)), interlaced(361, np.radians(0.5))
    mount = Pose.from_angle(0.0, (0.5, 0.0))
    walls = np.array([4.0, -3.0, 5.0, -4.0])
    ranges: list[float] = []
    for delay in delays:  # the same for every scan: each robot sees the room from its own place
        at = Pose.from_angle(turn * delay, speed * delay).compose(mount)
        heading = bearings[len(ranges)] + at.angle
        way = np.array([np.cos(heading), np.sin(heading)])
        with np.errstate(divide="ignore"):
            hits = (walls - np.repeat(at.t, 2)) / np.repeat(way, 2)
        ranges.append(hits[hits > 0.0].min())
    motion = Pose.from_angle(np.r_[0.0, np.full(4, turn * step)], np.r_[[[0.0, 0.0]], np.tile(speed * step, (4, 1))])
    drive = Drive(step * np.arange(5.0), motion, np.tile(ranges, (5, 1)), bearings, mount, delays)

    def off_the_walls(cloud: np.ndarray) -> float:
        return float(np.abs(np.repeat(cloud, 2, axis=1) - walls).min(axis=1).max())

    assert off_the_walls(straightened(drive)[2]) < 1e-9
    assert off_the_walls(drive.points(2)) > 0.02
    plain = replace(drive, delays=None)
    assert np.array_equal(straightened(plain)[2], plain.points(2))


def test_a_drive_without_a_clock_is_left_as_it_is() -> None:
    """If no time passes, no speed is known."""
    drive, _ = simulated_drive(scans=3)
    clockless = replace(drive, seconds=np.zeros(3), delays=interlaced(181, np.radians(1.0)))
    assert np.array_equal(straightened(clockless)[1], drive.points(1))


# The recorded drive.


@pytest.mark.native
def test_every_recorded_scan_is_matched_and_both_ways_agree() -> None:
    """Matched forwards and backwards, pairs agree to 1 cm and 0.05° in the median, and all of them to 8 cm and 1.5°."""
    drive, scans, chain, _ = recording()
    assert chain.believed.all()
    rows = np.arange(1, 225)
    reverse = match(scans, rows - 1, rows, drive.motion[1:].inverse())
    gap = chain.motion[1:].compose(reverse.pose)
    shift, turn = np.linalg.norm(gap.t, axis=1), np.degrees(np.abs(gap.angle))
    assert np.median(shift) < 0.01
    assert shift.max() < 0.08
    assert np.median(turn) < 0.05
    assert turn.max() < 1.5


@pytest.mark.native
@pytest.mark.parametrize("half", [0, 1])
def test_half_of_the_loops_close_the_other_half(half: int) -> None:
    """Every second loop is an edge; those in between were missed by more than 0.09 m in the median, and afterwards each
    by less than 3 cm and 0.2°. Either half closes the other."""
    _, _, chain, loops = recording()
    rows = np.flatnonzero(loops.believed)
    used = np.zeros(len(loops.believed), dtype=np.bool_)
    used[rows[half::2]] = True
    rest = rows[1 - half :: 2]
    before, _ = missed(chain.poses, loops)
    shift, turn = missed(close(chain, loops, used).poses, loops)
    assert np.median(before[rest]) > 0.09
    assert shift[rest].max() < 0.03
    assert np.degrees(turn[rest].max()) < 0.2


@pytest.mark.native
def test_scans_as_recorded_miss_what_straightened_ones_meet() -> None:
    """With all beams taken as sent at once, or loops matched to single scans, some miss by 3 cm or 0.2° and more."""
    drive, scans, chain, _ = recording()
    raw = prepare(replace(drive, delays=None))
    for scan_set, options in ((raw, LoopOptions(around=0)), (raw, LoopOptions()), (scans, LoopOptions(around=0))):
        links = chain if scan_set is scans else scan_to_scan(scan_set, drive.motion)
        loops = verified(scan_set, links.poses, *candidates(links.poses), options)
        rows = np.flatnonzero(loops.believed)
        worst = []
        for half in (0, 1):
            used = np.zeros(len(loops.believed), dtype=np.bool_)
            used[rows[half::2]] = True
            shift, turn = missed(close(links, loops, used).poses, loops)
            rest = rows[1 - half :: 2]
            worst.append(((shift[rest] >= 0.03) | (np.degrees(turn[rest]) >= 0.2)).sum())
        assert sum(worst) > 0, options


@pytest.mark.native
def test_a_search_finds_a_loop_that_no_chain_foretells() -> None:
    """The second round is moved by 36 m and turned by 2 rad, so the chain no longer tells where its scans are. A search
    finds poses within 3 cm and 0.3° of the closed graph's; a scan of another place is not accepted as a loop."""
    _, scans, chain, loops = recording()
    R, t = np.array(chain.poses.R), np.array(chain.poses.t)
    tail = Pose.from_angle(2.0, (30.0, -20.0)).compose(chain.poses[120:])
    R[120:], t[120:] = tail.R, tail.t
    later, earlier = [200, 200, 192, 150], [40, 51, 42, 20]
    blind = LoopOptions(farthest=np.inf)
    assert not verified(scans, Pose(R, t), later, earlier, blind).believed.any()
    result = verified(scans, Pose(R, t), later, earlier, replace(blind, search="correlative"))
    assert result.believed[1:].tolist() == [True, True, False]
    shift, turn = missed(close(chain, loops).poses, result)
    assert shift[:3].max() < 0.03
    assert np.degrees(turn[:3].max()) < 0.3
    assert not verified(scans, Pose(R, t), later, earlier, LoopOptions(search="correlative")).believed.any()


@pytest.mark.native
def test_a_map_drifts_less_than_the_last_scan_on_the_recorded_drive() -> None:
    drive, _, chain, loops = recording()
    map_chain = scan_to_map(prepare(drive, every=2), drive.motion)  # half of the echoes do as well, in half the time
    assert map_chain.believed.all()
    (by_scan, _), (by_map, _) = (missed(poses, loops) for poses in (chain.poses, map_chain.poses))
    assert np.median(by_map[loops.believed]) < 0.5 * np.median(by_scan[loops.believed])


@pytest.mark.native
def test_one_wrong_loop_bends_the_map_and_a_kernel_lets_go_of_it() -> None:
    """A false loop of scans 150 and 20 moves poses by metres, and with Cauchy's kernel by centimetres."""
    _, _, chain, loops = recording()
    edges, robust = edges_of(chain, loops)
    right = optimise(chain.poses, edges).poses
    wrong = Edges(
        np.append(edges.i, 20), np.append(edges.j, 150),
        Pose(np.concatenate([edges.relative.R, np.eye(2)[None]]), np.concatenate([edges.relative.t, np.zeros((1, 2))])),
        np.concatenate([edges.information, np.median(loops.information, axis=0)[None]]),
    )  # fmt: skip
    robust = np.append(robust, True)
    bent = optimise(chain.poses, wrong)
    result = optimise(chain.poses, wrong, kernel="cauchy", robust=robust)
    assert drift(bent.poses, right) > 3.0
    assert drift(result.poses, right) < 0.1
    assert result.weights[-1] < 1e-4


@pytest.mark.native
def test_the_information_tells_how_far_loops_and_chain_disagree() -> None:
    """χ² per degree of freedom of the closed graph is close to 1: between a half and two."""
    _, _, chain, loops = recording()
    edges, _ = edges_of(chain, loops)
    result = optimise(chain.poses, edges)
    freedom = 3 * (len(edges) - 224)
    assert 0.5 < result.total / freedom < 2.0


@pytest.mark.native
def test_a_loop_that_was_accepted_may_be_taken_away() -> None:
    _, _, chain, loops = recording()
    empty = replace(loops, believed=np.zeros(len(loops.believed), dtype=np.bool_))
    assert np.allclose(close(chain, empty).poses.t, chain.poses.t, atol=1e-6)
