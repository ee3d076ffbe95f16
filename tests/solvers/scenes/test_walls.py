"""The single wall, the corridor and the NDT room: what is drawn, from which numbers, and what solvers find in it."""

import numpy as np
import pytest

from solvers import Pose, Status, register
from solvers.metrics import rre, rte
from solvers.scenes.walls import CORRIDOR, NDT_ROOM, PILLAR, WALL, corridor, hall, ndt_room, sampled, single_wall
from solvers.studies.race import SEEDS
from solvers.studies.seeds import seeds

ALL = pytest.mark.parametrize("scene", [single_wall, corridor, ndt_room, hall])


def distances(points, outlines):
    """Each point's distance to the nearest of the polylines."""
    a = np.concatenate([o[:-1] for o in outlines])
    e = np.concatenate([np.diff(o, axis=0) for o in outlines])
    f = np.clip(((points[:, None] - a) * e).sum(-1) / (e**2).sum(-1), 0.0, 1.0)
    return np.linalg.norm(points[:, None] - a - f[..., None] * e, axis=2).min(axis=1)


@ALL
def test_without_noise_every_point_lies_on_an_outline(scene):
    clean = scene(noise=0.0)
    for cloud in (clean.source, clean.target):
        assert distances(cloud, clean.outline).max() < 1e-12


def test_a_polyline_is_sampled_by_its_length():
    corner = np.array([(0.0, 0.0), (1.0, 0.0), (1.0, 1.0)])
    np.testing.assert_allclose(sampled(corner, 0.5), [(0, 0), (0.5, 0), (1, 0), (1, 0.5), (1, 1)], atol=1e-15)
    np.testing.assert_allclose(sampled(corner, 0.5, 0.25, 0.75), [(0.5, 0), (1, 0), (1, 0.5)], atol=1e-15)


def test_the_rooms_are_as_large_as_they_are_said_to_be():
    assert np.ptp(NDT_ROOM, axis=0) == pytest.approx([9.2, 5.2])
    assert (NDT_ROOM[0] == NDT_ROOM[-1]).all()
    assert (PILLAR[0] == PILLAR[-1]).all()
    assert np.linalg.norm(WALL[1] - WALL[0]) == pytest.approx(8.48, abs=0.01)
    gaps = np.linalg.norm(np.diff(ndt_room(noise=0.0).target, axis=0), axis=1)
    assert np.median(gaps) == pytest.approx(0.13)


@ALL
def test_noise_stretches_one_draw_and_outliers_add_to_each_other(scene):
    clean, single, double = (scene(noise=s).source for s in (0.0, 0.1, 0.2))
    np.testing.assert_allclose(double - clean, 2.0 * (single - clean), atol=1e-12)
    few, many = scene(outliers=0.1), scene(outliers=0.3)
    assert (few.source_outlier <= many.source_outlier).all()
    assert many.target_outlier.sum() == round(0.3 * len(many.target))
    np.testing.assert_array_equal(few.source[~many.source_outlier], many.source[~many.source_outlier])
    assert not np.array_equal(scene(seed=41).source, scene().source)


@pytest.mark.parametrize("seed", seeds(5))
def test_one_wall_does_not_fix_the_slide(seed):
    """Point to plane turns the scan onto the wall; its position along the wall stays as started, and the system names
    the weak direction."""
    scene = single_wall(seed=seed)
    result = register(scene.source, scene.target, "point-to-plane", start=scene.start, free_below=0.05)
    assert result.status is Status.DEGENERATE
    assert "slide along (0.9" in result.reason
    along = (WALL[1] - WALL[0]) / np.linalg.norm(WALL[1] - WALL[0])
    weak = result.states[0].system.directions[0, :2, 0]
    assert abs(weak @ along) > 0.99 * np.linalg.norm(weak)
    assert distances(result.transform(scene.source), scene.outline).mean() < 0.05
    assert rte(result.pose, Pose.identity()) > 0.3


@pytest.mark.parametrize("seed", seeds(5))
def test_a_corridor_fixes_all_but_the_slide(seed):
    """Point to plane finds the turn and the place across from the walls on either side; along them it stays put."""
    scene = corridor(seed=seed)
    result = register(scene.source, scene.target, "point-to-plane", start=scene.start, free_below=0.05)
    assert result.status is Status.DEGENERATE
    assert "slide along (0.9" in result.reason
    assert rre(result.pose, Pose.identity()) < np.radians(1.0)
    along = (WALL[1] - WALL[0]) / np.linalg.norm(WALL[1] - WALL[0])
    error = (result.transform(scene.source) - scene.source).mean(axis=0)
    assert abs(along[0] * error[1] - along[1] * error[0]) < 0.05
    assert abs(along @ error) > 0.3
    assert np.linalg.norm(CORRIDOR[1] - CORRIDOR[0], axis=1) == pytest.approx([2.4, 2.4])


def test_ndt_finds_its_room_from_the_scenes_start():
    scenes = [ndt_room(seed=seed) for seed in SEEDS[:10]]
    result = register(
        np.stack([s.source for s in scenes]), np.stack([s.target for s in scenes]), "ndt", start=scenes[0].start,
        cells=(2.4, 1.2, 0.6),
    )  # fmt: skip
    assert (rre(result.pose, Pose.identity()) < np.radians(1.0)).sum() >= 8


@ALL
@pytest.mark.parametrize("wrong", [{"noise": -0.1}, {"outliers": 1.5}, {"seed": -1}])
def test_refusals_name_the_argument(scene, wrong):
    with pytest.raises(ValueError, match=next(iter(wrong))):
        scene(**wrong)
