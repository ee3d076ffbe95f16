"""The grid of the NDT: its position, and which cell sizes are allowed."""

import numpy as np
import pytest

from solvers import Pose, register
from solvers.methods.ndt import ndt_map
from solvers.methods.ndt.score import evaluate, score_map
from solvers.scenes.rooms import room, room_start

CLOUD = np.random.default_rng(2).standard_normal((1, 9, 2))


@pytest.mark.parametrize("method", ["ndt", "ndt-d2d"])
def test_a_grid_that_begins_at_the_target_moves_with_it(method):
    """The default grid is tied to the origin: the same scene elsewhere ends at another pose."""
    scene, start = room("clean"), room_start(20.0, 0.8)
    ends = {"origin": [], "target": []}
    for shift in ((0.0, 0.0), (0.3, 0.18), (64.0, -32.0)):
        target, moved = scene.target + shift, Pose(start.R, start.t + shift)
        for name, options in (("origin", {}), ("target", {"offset": target.min(axis=0)})):
            pose = register(scene.source, target, method, start=moved, **options).pose
            ends[name].append(np.append(pose.t - shift, pose.angle))
    assert np.ptp(ends["target"], axis=0).max() < 1e-6
    assert np.ptp(ends["origin"], axis=0).max() > 1e-2


@pytest.mark.parametrize("method", ["ndt", "ndt-d2d"])
def test_a_scene_that_is_elsewhere_as_a_whole_needs_the_source_s_grid_to_move_as_well(method):
    """With both clouds shifted, starting the target's grid at its corner is enough for points, but not for a source
    that is cut into cells; moving the source's corner to its origin as well is."""
    scene, start = room("clean"), room_start(20.0, 0.8)
    ends, corner_ends = [], []
    for shift in ((0.0, 0.0), (0.3, 0.18), (64.0, -32.0)):
        origin = Pose.from_angle(0.0, shift)
        source, target, moved = scene.source + shift, scene.target + shift, origin @ start @ origin.inverse()
        offset, corner = target.min(axis=0), Pose.from_angle(0.0, source.min(axis=0))
        whole = register(source, target, method, start=moved, offset=offset).pose
        own = register(source - corner.t, target, method, start=moved @ corner, offset=offset).pose @ corner.inverse()
        for result, pose in ((ends, whole), (corner_ends, own)):
            home = origin.inverse() @ pose @ origin
            result.append(np.append(home.t, home.angle))
    assert np.ptp(corner_ends, axis=0).max() < 1e-6
    assert (np.ptp(ends, axis=0).max() < 1e-6) == (method == "ndt")


@pytest.mark.parametrize("size", [-1, 0.0, np.nan, np.array([1.0, -1.0])])
def test_a_cell_has_a_positive_side(size):
    clouds = np.stack([room("clean").target] * 2)
    with pytest.raises(ValueError, match=r"^size: expected a positive number, got "):
        ndt_map.build(clouds, size)


@pytest.mark.parametrize("axis", [0, 1])
def test_at_a_border_two_of_the_four_cells_change(axis):
    """Grids that are not shifted against each other along an axis share their borders across it."""
    rng = np.random.default_rng(5)
    cells = ndt_map.build(rng.uniform(-4.0, 4.0, (1, 4000, 2)), 1.0, grids=4)
    points, step = rng.uniform(-3.0, 3.0, (1, 2000, 2)), np.eye(2)[axis] * 0.05
    before, after = (cells.lookup(p, np.zeros(1, dtype=np.int64)) for p in (points, points + step))
    assert (before >= 0).all()
    changes = (before != after).sum(axis=1)
    assert set(np.unique(changes).tolist()) == {0, 2}
    assert 100 < (changes == 2).sum() < 300


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"points": CLOUD[0]}, r"points: expected shape \(b, n, 2\), got \(9, 2\); pass points\[None\] for one cloud"),
        ({"points": np.zeros((1, 9, 3))}, "points: expected 2 coordinates"),
        ({"points": np.where(CLOUD.max() == CLOUD, np.nan, CLOUD)}, "points: 1 of 18 numbers is not finite"),
        ({"points": "cloud"}, "points: expected real numbers, got str"),
        ({"grids": True}, "grids: expected an integer, got True"),
        ({"grids": 2}, "grids: expected 1 or 4, got 2"),
        ({"size": "a"}, "size: expected real numbers"),
        ({"size": np.ones(3)}, r"size: expected one number, or one for each of 1 clouds, got shape \(3,\)"),
        ({"offset": np.zeros(3)}, r"offset: expected shape \(2,\), got \(3,\)"),
        ({"offset": [np.nan, 0.0]}, "offset: 1 of 2 numbers is not finite"),
    ],
)
def test_what_makes_no_map_is_refused_by_name(arguments, message):
    with pytest.raises(ValueError, match=f"^{message}"):
        ndt_map.build(**{"points": CLOUD, "size": 1.0, **arguments})


def test_a_list_of_clouds_of_one_size_makes_their_map():
    assert np.array_equal(ndt_map.build(CLOUD.tolist(), 1.0).mean, ndt_map.build(CLOUD, 1.0).mean)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"pivot": np.zeros(2)}, r"pivot: expected shape \(1, 2\), got \(2,\)"),
        ({"moved": CLOUD[0]}, r"moved: expected shape \(k, m, 2\), got \(9, 2\)"),
        ({"which": np.zeros(2, dtype=np.int64)}, r"which: expected shape \(1,\), got \(2,\)"),
    ],
)
def test_what_has_no_score_is_refused_by_name(arguments, message):
    cells = ndt_map.build(CLOUD, 1.0)
    with pytest.raises(ValueError, match=f"^{message}"):
        evaluate(cells, **{"moved": CLOUD, "pivot": np.zeros((1, 2)), **arguments})


@pytest.mark.parametrize(
    ("name", "value"), [("points", CLOUD), ("points", np.zeros((9, 3))), ("x", 0.0), ("y", np.zeros((2, 2)))]
)
def test_what_has_no_map_of_scores_is_refused_by_name(name, value):
    cells = ndt_map.build(CLOUD, 1.0)
    with pytest.raises(ValueError, match=f"^{name}: expected "):
        score_map(cells, **{"points": CLOUD[0], "x": np.zeros(1), "y": np.zeros(1), name: value})
