"""When a match of two scans is believed, and which pairs are loop candidates: small drives, each made for one sign."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from solvers import Pose
from solvers.drives import simulated_drive
from solvers.odometry import LoopOptions, MatchOptions, candidates, prepare, scan_to_map, scan_to_scan, verified
from solvers.scenes.drive import Drive
from tests.solvers.odometry.drives import simulation, without_echoes

BEARINGS = np.linspace(-np.pi, np.pi, 360, endpoint=False) + 1e-3


def drive_along(
    step: float, count: int = 4, ends: tuple[float, float] | None = None, noise: float = 0.0, slip: float = 0.0
) -> Drive:
    """A corridor 3 m wide, the scanner in its middle; `ends`: walls across it, metres behind and ahead of the first
    scan; `noise`: σ of a range, metres; `slip`: σ of the odometry's error, as a share of the step."""
    across, rng = 1.5 / np.abs(np.sin(BEARINGS)), np.random.default_rng(40)
    ranges = []
    for k in range(count):
        along = np.full(len(BEARINGS), np.inf)
        if ends is not None:
            behind, ahead = ends[0] + k * step, ends[1] - k * step
            along = np.where(np.cos(BEARINGS) > 0.0, ahead, behind) / np.abs(np.cos(BEARINGS))
        nearest = np.minimum(across, along) + noise * rng.standard_normal(len(BEARINGS))
        ranges.append(np.where(nearest < 12.0, nearest, np.inf))
    steps = step * (1.0 + slip * rng.standard_normal(count))
    motion = Pose.from_angle(np.zeros(count), np.stack([steps, np.zeros(count)], axis=1))
    return Drive(np.arange(float(count)), motion, ranges, BEARINGS, Pose.identity())


@pytest.mark.parametrize("chain", [scan_to_scan, scan_to_map])
def test_a_match_that_is_free_along_the_walls_is_not_believed(chain):
    """Two walls explain the echoes but leave the match free along them; end walls alone remove that freedom. A distant
    one removes it only weakly: whether that is enough depends on the smallest eigenvalue required."""
    open_ended, closed, nearly = (drive_along(0.2, ends=ends) for ends in (None, (6.0, 6.0), (50.0, 11.0)))
    result = chain(prepare(open_ended), open_ended.motion)
    assert (result.share[1:] > 0.8).all()
    assert not result.believed[1:].any()
    assert chain(prepare(closed), closed.motion).believed.all()
    for least, believed in ((0.0, True), (0.3, False)):
        links = chain(prepare(nearly), nearly.motion, MatchOptions(least_weakest=least))
        assert (links.believed[1:] == believed).all()


@pytest.mark.parametrize("chain", [scan_to_scan, scan_to_map])
@pytest.mark.parametrize("noise", [0.01, 0.02, 0.03])
def test_noise_does_not_hold_a_match_along_the_walls(chain, noise):
    """The normals of noisy walls are turned at random, which looks like information on the way along them. The links
    stay the odometry's. With end walls in sight every match is believed, whatever the noise."""
    open_ended = drive_along(0.2, 24, noise=noise, slip=0.3)
    result = chain(prepare(open_ended), open_ended.motion)
    assert (result.share[1:] > 0.5).all()
    assert not result.believed[1:].any()
    np.testing.assert_allclose(result.motion.t[1:], open_ended.motion.t[1:], atol=1e-12)
    closed = drive_along(0.2, 24, ends=(6.0, 10.0), noise=noise, slip=0.3)
    closed_result = chain(prepare(closed), closed.motion)
    assert closed_result.believed.all()
    if chain is scan_to_scan:
        without_margin = chain(prepare(open_ended), open_ended.motion, MatchOptions(margin=0.0))
        assert without_margin.believed[1:].any()
        assert without_margin.believed[1:].all() == (noise == 0.03)
    assert np.abs(closed_result.poses.t - 0.2 * np.arange(24.0)[:, None] * [1.0, 0.0]).max() < 0.1


@pytest.mark.parametrize("chain", [scan_to_scan, scan_to_map])
def test_a_degenerate_match_is_not_believed_whatever_is_asked_of_it(chain):
    """Each scan lies beyond the other's gate, with no share and no eigenvalue required."""
    drive = drive_along(0.2, count=2, ends=(6.0, 6.0))
    ranges = np.array(drive.ranges)
    ranges[1] *= 8.0
    far_drive = Drive(drive.seconds, drive.motion, ranges, drive.bearings, drive.mount)
    result = chain(prepare(far_drive), far_drive.motion, MatchOptions(gate=0.01, least_weakest=0.0, least_share=0.0))
    assert not result.believed[1]


def test_a_chain_by_its_velocity_goes_on_as_before_where_a_match_is_not_believed():
    """In a small room matches find each step of 0.1 m. If the required eigenvalue is out of reach, the chain keeps its
    first guess, standing still."""
    drive = drive_along(0.1, ends=(1.2, 1.2))
    for least, step in ((0.0, 0.1), (0.99, 0.0)):
        result = scan_to_scan(prepare(drive), drive.motion, MatchOptions(least_weakest=least), prediction="velocity")
        assert result.believed[1:].all() == (least == 0.0)
        np.testing.assert_allclose(np.diff(result.poses.t[:, 0]), step, atol=2e-3)


def test_after_a_gap_a_new_map_begins():
    """Twenty scans without an echo, 13 m on: nothing there is near the old map, but the scans fit one another."""
    drive, truth, _, _ = simulation()
    chain = scan_to_map(prepare(without_echoes(drive, *range(30, 50))), drive.motion)
    assert np.flatnonzero(~chain.believed).tolist() == list(range(30, 51))
    since = chain.poses[50].inverse().compose(chain.poses[51:])
    expected = truth[50].inverse().compose(truth[51:])
    assert np.linalg.norm(since.t - expected.t, axis=1).max() < 0.05


def test_candidates_are_near_alike_in_heading_and_the_nearest_of_all():
    """Out along a line and back beside it, turned half round or with the heading kept; at least 15 m are driven
    between."""
    x = np.append(np.arange(0.0, 20.5, 0.5), np.arange(19.5, -0.5, -0.5))
    y = np.append(np.zeros(41), np.full(40, 0.7))
    path = np.stack([x, y], axis=1)
    poses = Pose.from_angle(np.append(np.zeros(41), np.full(40, np.pi)), path)
    assert candidates(poses)[0].size == 0
    assert candidates(poses, LoopOptions(turn=np.pi))[0].size > 0
    straight = Pose.from_angle(np.zeros(81), path)
    later, earlier = candidates(straight, LoopOptions(most=1))
    assert later.size > 5
    travel = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(path, axis=0), axis=1)))
    for b, a in zip(later, earlier, strict=True):
        gaps = np.linalg.norm(path - path[b], axis=1)
        assert gaps[a] == gaps[travel[b] - travel >= 15.0].min()


def test_a_scan_is_no_candidate_of_itself():
    """This holds even if no distance need be driven in between."""
    line = Pose.from_angle(np.zeros(6), np.stack([np.arange(6.0), np.zeros(6)], axis=1))
    later, earlier = candidates(line, LoopOptions(apart=0.0, most=9))
    assert later.size > 0
    assert (later > earlier).all()


def test_a_loop_that_the_echoes_hardly_hold_is_not_believed():
    """Where seven of ten beams bring no echo, a scan slides along the walls of a map that fits it: a few such loops are
    0.3 to 2 m off, and all other signs accept them. Their weakest motion gives them away; most right loops
    pass."""
    errors: dict[float, list[float]] = {0.0: [], 0.05: []}
    for seed in (41, 43):
        drive, truth = simulated_drive(seed=seed)
        ranges = np.where(np.random.default_rng(seed).random(drive.ranges.shape) < 0.7, np.inf, drive.ranges)
        scans = prepare(replace(drive, ranges=ranges))
        chain = scan_to_scan(scans, drive.motion)
        for least, values in errors.items():
            loops = verified(scans, chain.poses, *candidates(chain.poses), LoopOptions(least_weakest=least))
            relative = truth[loops.target].inverse().compose(truth[loops.source])
            gaps = np.linalg.norm(loops.pose.inverse().compose(relative).t, axis=1)
            values += gaps[loops.believed].tolist()
    assert max(errors[0.0]) > 0.8
    assert max(errors[LoopOptions().least_weakest]) < 0.2
    assert len(errors[0.05]) > 0.8 * len(errors[0.0])
