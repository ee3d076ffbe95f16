"""Invalid scans, motions, loops and options are refused with a ValueError that names them."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from solvers import Pose
from solvers.odometry import (
    LoopOptions,
    MatchOptions,
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
from tests.solvers.odometry.drives import matches_of, simulation


def test_what_cannot_be_matched_is_refused() -> None:
    drive, _, scans, _ = simulation()
    with pytest.raises(ValueError, match="expected one of each per pair"):
        match(scans, [1, 2], [0], drive.motion[:1])
    with pytest.raises(ValueError, match="source: entry 0 names scan 90, but the scans go from 0 to 89"):
        match(scans, [90], [0], drive.motion[:1])
    with pytest.raises(ValueError, match="expected one per scan"):
        scan_to_scan(scans, drive.motion[:5])
    with pytest.raises(ValueError, match="prediction"):
        scan_to_scan(scans, drive.motion, prediction="luck")
    with pytest.raises(ValueError, match="length"):
        scan_to_map(scans, drive.motion, length=0)
    with pytest.raises(ValueError, match=r"^drive: none of 90 scans has three echoes within 0\.1 m"):
        prepare(drive, 0.1)
    for name, wrong in (
        ("gate", 0.0), ("reach", 0.0), ("sigma", 0.0), ("least_share", 2.0), ("least_weakest", 2.0), ("margin", -1.0),
        ("max_steps", 0),
    ):  # fmt: skip
        with pytest.raises(ValueError, match=rf"^{name}: "):
            MatchOptions(**{name: wrong})
    with pytest.raises(ValueError, match="most"):
        LoopOptions(most=0)
    with pytest.raises(ValueError, match="search: 'corelative' is unknown"):
        LoopOptions(search="corelative")
    with pytest.raises(ValueError, match="around"):
        LoopOptions(around=-1)
    for look in (keyframes, candidates):
        with pytest.raises(ValueError, match=r"^poses: expected shape \(n,\), got \(\)"):
            look(Pose.identity())
        with pytest.raises(ValueError, match=r"^poses: is empty"):
            look(Pose.identity(batch=(0,)))
        with pytest.raises(ValueError, match=r"^poses: expected a Pose, got ndarray"):
            look(np.eye(3)[None])


def test_a_motion_is_rigid_and_in_the_plane() -> None:
    drive, _, scans, chain = simulation()
    motion = drive.motion
    calls = {
        "motion": lambda poses: (scan_to_scan(scans, poses), scan_to_map(scans, poses)),
        "start": lambda poses: match(scans, [1], [0], poses),
        "poses": lambda poses: (verified(scans, poses, [1], [0]), missed(poses, matches_of([(50, 10)]))),
    }
    for name, call in calls.items():
        for text, wrong in (
            (".scale: expected rigid motions", Pose(motion.R, motion.t, 3.0)),
            (": moves points in 3 dimensions", Pose.identity(3, (90,))),
            (": expected a Pose, got ndarray", motion.matrix),
            (": expected a Pose, got NoneType", None),
        ):
            with pytest.raises(ValueError, match=f"^{name}{text}"):
                call(wrong)
    with pytest.raises(ValueError, match=r"^poses: expected one per scan, shape \(90,\), got \(5,\)"):
        verified(scans, chain.poses[:5], [1], [0])
    with pytest.raises(ValueError, match=r"^loops\.source: entry 0 names scan 50, but the scans go from 0 to 19"):
        missed(chain.poses[:20], matches_of([(50, 10)]))


def test_what_is_of_another_kind_is_refused() -> None:
    drive, _, scans, chain = simulation()
    motion, poses, loops = drive.motion, chain.poses, matches_of([(50, 10)])
    message = "scans: expected Scans, got Drive; solvers.odometry.prepare makes them of a drive"
    reason = "poses: expected a Pose, got Chain; pass chain.poses"
    matching, looking = MatchOptions(), LoopOptions()
    calls: list[tuple[str, Callable[[], object]]] = [
        ("drive: expected a Drive, got str", lambda: prepare("x")),
        ("drive: expected a Drive, got Scans", lambda: straightened(scans)),
        ("farthest: expected a number, got 'x'", lambda: prepare(drive, "x")),
        ("farthest: expected a number of at least 0", lambda: straightened(drive, np.nan)),
        (message, lambda: match(drive, [1], [0], motion[:1])),
        (message, lambda: scan_to_scan(drive, motion)),
        (message, lambda: scan_to_map(drive, motion)),
        (message, lambda: verified(drive, poses, [50], [10])),
        ("motion: expected a Pose, got Drive; pass drive.motion", lambda: scan_to_scan(scans, drive)),
        (reason, lambda: verified(scans, chain, [50], [10])),
        ("later, earlier: a candidate joins a scan to itself", lambda: verified(scans, poses, [50, 7], [10, 7])),
        (reason, lambda: keyframes(chain)),
        (reason, lambda: candidates(chain)),
        (reason, lambda: missed(chain, loops)),
        ("options: expected MatchOptions, got LoopOptions", lambda: match(scans, [1], [0], motion[:1], looking)),
        ("options: expected MatchOptions, got LoopOptions", lambda: scan_to_scan(scans, motion, looking)),
        ("options: expected MatchOptions, got int", lambda: scan_to_map(scans, motion, 0)),
        ("options: expected LoopOptions, got MatchOptions", lambda: candidates(poses, matching)),
        ("options: expected LoopOptions, got MatchOptions", lambda: verified(scans, poses, [50], [10], matching)),
        ("matching: expected MatchOptions, got LoopOptions", lambda: verified(scans, poses, [50], [10], None, looking)),
        ("k: expected a scan from 0 to 89, got 90", lambda: scans.cloud(90)),
        ("k: must be at least 0, got -1", lambda: scans.cloud(-1)),
        ("k: expected an integer, got 1.0", lambda: scans.cloud(1.0)),
        ("chain: expected a Chain, got Matches", lambda: close(loops, chain)),
        ("chain: expected a Chain, got Matches", lambda: edges_of(loops, chain)),
        ("loops: expected Matches, got NoneType", lambda: edges_of(chain, None)),
        ("loops: expected Matches, got Chain", lambda: missed(poses, chain)),
        ("shift: expected a number, got 'x'", lambda: keyframes(poses, "x")),
        ("turn: expected a number of at least 0", lambda: keyframes(poses, turn=np.nan)),
        ("shift: expected a number of at least 0", lambda: scan_to_map(scans, motion, shift=-1.0)),
        ("turn: expected a number, got None", lambda: scan_to_map(scans, motion, turn=None)),
        ("progress: expected a function, got 3", lambda: match(scans, [], [], motion[:0], progress=3)),
        ("progress: expected a function, got 3", lambda: scan_to_scan(scans, motion, progress=3)),
        ("progress: expected a function, got 3", lambda: scan_to_map(scans, motion, progress=3)),
        ("progress: expected a function, got 3", lambda: verified(scans, poses, [], [], progress=3)),
        ("progress: expected a function, got 3", lambda: close(chain, loops, progress=3)),
    ]
    for text, call in calls:
        with pytest.raises(ValueError, match=f"^{text}"):
            call()
    assert keyframes(poses, np.inf, np.inf).tolist() == [0]


@pytest.mark.parametrize(
    ("rows", "message"),
    [
        ([1.9], "expected integers of shape"),
        ([True], "expected integers of shape"),
        (5, "expected integers of shape"),
        ([-1], "expected non-negative integers"),
        ([90], "entry 0 names scan 90, but the scans go from 0 to 89"),
        ([[1], [2, 3]], "rows of unequal length"),
    ],
)
def test_a_scan_is_called_by_its_number(rows: object, message: str) -> None:
    drive, _, scans, chain = simulation()
    start = drive.motion[:1]
    for name, call in {
        "source": lambda: match(scans, rows, [0], start),
        "target": lambda: match(scans, [0], rows, start),
        "later": lambda: verified(scans, chain.poses, rows, [0]),
        "earlier": lambda: verified(scans, chain.poses, [0], rows),
    }.items():
        with pytest.raises(ValueError, match=f"^{name}: {message}"):
            call()


def test_loops_are_paired_and_chosen_one_by_one() -> None:
    _, _, scans, chain = simulation()
    with pytest.raises(ValueError, match=r"^later, earlier: expected one of each per candidate, got 2 and 1"):
        verified(scans, chain.poses, [50, 51], [10])
    loops = matches_of([(50, 10), (60, 20), (70, 30)])
    for used in ([0, 2], [True, False], [1, 0, 1], True):
        for call in (edges_of, close):
            with pytest.raises(ValueError, match=r"^used: expected one bool a loop, shape \(3,\)"):
                call(chain, loops, used)
    edges, robust = edges_of(chain, loops, [True, False, True])
    assert edges.i[robust].tolist() == [10, 30]
    assert len(edges_of(chain, matches_of([]), [])[0]) == 89
