"""Scans that match nothing, and what a graph makes of the matches beside them."""

from __future__ import annotations

import numpy as np
import pytest

from solvers import Pose
from solvers.core.poses import concatenated
from solvers.drives import simulated_drive
from solvers.metrics import rte
from solvers.odometry import LoopOptions, close, edges_of, prepare, scan_to_map, scan_to_scan, verified
from tests.solvers.odometry.drives import without_echoes

BLANK = 14


def test_a_match_to_a_map_across_a_gap_is_an_edge_across_it() -> None:
    """The odometry to the blank scan is wrong. The next scan is measured from the last that was matched: an edge from
    the blank one would carry that error with the information of a match."""
    drive, truth = simulated_drive(scans=30)
    off = Pose.from_angle(0.1, (0.3, 0.0))
    to_blank = drive.motion[BLANK : BLANK + 1].compose(off)
    motion = concatenated([drive.motion[:BLANK], to_blank, drive.motion[BLANK + 1 :]])
    scans = prepare(without_echoes(drive, BLANK))
    chain = scan_to_map(scans, motion)
    assert np.flatnonzero(~chain.believed).tolist() == [BLANK]
    assert chain.reference[[BLANK, BLANK + 1, BLANK + 2]].tolist() == [BLANK - 1, BLANK - 1, BLANK + 1]
    edges, robust = edges_of(chain, verified(scans, chain.poses, [], []))
    assert not robust.any()
    between = truth[edges.i].inverse().compose(truth[edges.j])
    gap = edges.relative.inverse().compose(between)
    errors = np.concatenate([gap.t, gap.angle[:, None]], axis=1)
    squares = np.einsum("ki,kij,kj->k", errors, edges.information, errors)
    matched = np.delete(np.arange(len(edges)), BLANK - 1)
    assert squares[matched].max() < 30.0


def test_after_a_kidnapping_a_new_map_is_measured_from_its_first_scan() -> None:
    """The robot was carried, says the odometry: scan 14 fits neither the map nor scan 13. Scan 15 fits scan 14 alone,
    and an edge from 13 would carry the error of the odometry."""
    drive, truth = simulated_drive(scans=30)
    carried = drive.motion[BLANK : BLANK + 1].compose(Pose.from_angle(2.0, (5.0, 5.0)))
    motion = concatenated([drive.motion[:BLANK], carried, drive.motion[BLANK + 1 :]])
    chain = scan_to_map(prepare(drive), motion)
    assert np.flatnonzero(~chain.believed).tolist() == [BLANK]
    assert chain.reference[BLANK : BLANK + 3].tolist() == [BLANK - 1, BLANK, BLANK + 1]
    later = truth[BLANK:-1].inverse().compose(truth[BLANK + 1 :])
    assert rte(chain.measured[BLANK + 1 :], later).max() < 0.05


def test_a_scan_is_not_matched_to_itself() -> None:
    """The scans around a loop's partner extend it, but not by the scan that is matched, which fits wherever it is: it
    stayed 0.14 m off."""
    drive, truth = simulated_drive(scans=30)
    scans = prepare(drive)
    shifted = truth.t + np.where(np.arange(30) >= 8, 0.1, 0.0)[:, None]
    loop = verified(scans, Pose(truth.R, shifted), [9], [7], LoopOptions(around=3))
    right = truth[[7]].inverse().compose(truth[[9]])
    assert rte(loop.pose, right)[0] < 0.05


@pytest.mark.parametrize(("later", "earlier", "used"), [(9, 4, {3, 4, 5, 6}), (12, 17, {15, 16, 17})])
def test_a_loop_is_matched_to_as_many_scans_on_either_side_as_it_says(later: int, earlier: int, used: set[int]) -> None:
    """With 2 around, to a map of scans 2 to 6, or 15 to 19. Of these, scan 2, 18 and 19 have no echo that becomes a
    partner; scans 7 and 14 would have, but do not belong to the map."""
    drive, truth = simulated_drive(scans=30)

    def pose(*silent: int) -> Pose:
        return verified(prepare(without_echoes(drive, *silent)), truth, [later], [earlier], LoopOptions(around=2)).pose

    whole = pose()
    assert {k for k in range(2, 20) if pose(k) != whole} == used | {later}


def test_a_loop_that_could_not_be_matched_is_not_used() -> None:
    drive, _ = simulated_drive(scans=30)
    scans = prepare(without_echoes(drive, BLANK))
    chain = scan_to_scan(scans, drive.motion)
    loops = verified(scans, chain.poses, [20, BLANK], [0, 0])
    for make in (edges_of, close):
        with pytest.raises(ValueError, match=r"^used: loop 1, of scans 14 and 0, could not be matched$"):
            make(chain, loops, np.array([False, True]))
