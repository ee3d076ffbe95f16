"""The checkable claims on the map of starts in the chapter 'Correspondences unknown', against the solvers."""

from functools import cache

import numpy as np
import pytest

import solvers
from solvers import Pose, metrics
from solvers.scenes.rooms import ROOM_START_DIRECTION, room

SEEDS = range(40, 40 + 13 * 25, 13)
TURNS, OFFSETS = -180.0 + (np.arange(16) + 0.5) * 22.5, (np.arange(12) + 0.5) * 0.25


def starts():
    """12 × 16 starts: an offset for each row, an angle for each column."""
    turn, offset = np.meshgrid(np.radians(TURNS), OFFSETS)
    return Pose.from_angle(turn, offset[..., None] * ROOM_START_DIRECTION)


@cache
def maps(seed, **options):
    """Which of the starts reach the truth, (12, 16), every second source point used as in the figure."""
    scene = room("clean", seed=seed)
    run = solvers.register(scene.source[::2], scene.target, "icp", start=starts(), **options)
    return (metrics.rre(run.pose, scene.truth) < np.radians(5.0)) & (metrics.rte(run.pose, scene.truth) < 0.2)


@pytest.mark.parametrize("seed", SEEDS)
def test_without_a_gate_the_angle_decides(seed):
    """Of 16 angles at least 14 arrive from all offsets or from none; some arrive and some do not."""
    right = maps(seed)
    alike = right.all(axis=0) | ~right.any(axis=0)
    assert alike.sum() >= 14
    assert right.all(axis=0).any()
    assert (~right.any(axis=0)).any()


def test_all_pairs_bring_moved_starts_together(why):
    """How far apart starts of one angle lie after ten steps, over how far they did: about a third, with a narrow gate
    not less than before."""
    spread = {"none": [], "narrow": []}
    for seed in SEEDS:
        scene = room("clean", seed=seed)
        for name, options in (("none", {}), ("narrow", {"gate": 0.5})):
            run = solvers.register(scene.source[::2], scene.target, "icp", start=starts(), max_steps=10, **options)
            middle = scene.source.mean(axis=0)
            apart = [middle @ pose.R.swapaxes(-1, -2) + pose.t for pose in (run.history.poses[0], run.pose)]
            before, after = (np.linalg.norm(p - p.mean(axis=0), axis=-1).max(axis=0) for p in apart)
            spread[name].append(after / before)
    none, narrow = (float(np.median(each)) for each in spread.values())
    why("the gate", {"none": f"{none:.2f} of the distance is left", "0.5 u": f"{narrow:.2f} of it"})
    assert 0.28 < none < 0.38
    assert narrow >= 1.0


def test_a_wide_gate_widens_the_basin_and_a_narrow_one_closes_it():
    """A gate of 1.5 u lets more of the starts arrive than none in 22 draws or more, one of 0.5 u fewer than half as
    many in each."""
    none, wide, narrow = (np.array([maps(s, **o).sum() for s in SEEDS]) for o in ({}, {"gate": 1.5}, {"gate": 0.5}))
    assert (wide > none).sum() >= 22
    assert (narrow < 0.5 * none).all()


def test_neighbours_end_apart_with_ndt():
    """Of a lattice of 64 angles and 48 offsets in the first draw: neighbours end in different places, more than 5° or
    0.2 u apart, in three of four cases with NDT and in fewer than one of five with point to point."""
    scene = room("clean", seed=SEEDS[0])
    turn, offset = np.meshgrid(np.radians(-180.0 + (np.arange(64) + 0.5) * 5.625), (np.arange(48) + 0.5) * 0.0625)
    many = Pose.from_angle(turn, offset[..., None] * ROOM_START_DIRECTION)
    share = {}
    for method in ("icp", "ndt"):
        ends = solvers.register(scene.source[::2], scene.target, method, start=many).pose
        pairs = (ends[:, 1:], ends[:, :-1]), (ends[1:], ends[:-1])
        apart = [(metrics.rre(a, b) > np.radians(5.0)) | (metrics.rte(a, b) > 0.2) for a, b in pairs]
        share[method] = np.concatenate([each.ravel() for each in apart]).mean()
    assert share["icp"] < 0.2
    assert 0.7 < share["ndt"] < 0.8
