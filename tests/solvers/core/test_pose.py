"""Poses against their definitions: composition, inverse, matrices, angles and rotation vectors, and what is refused."""

import copy
import pickle
import re

import numpy as np
import pytest

from solvers import Pose
from solvers.core import validate
from solvers.drives import telecom_loop
from solvers.posegraph import Edges
from solvers.scenes import room


@pytest.mark.parametrize("d", [2, 3, 4])
def test_a_pose_followed_by_its_inverse_moves_nothing(d, rng, random_pose):
    """A pose followed by its inverse puts points back, in every dimension, with scale."""
    pose = random_pose(rng, d, (7,), scaled=True)
    points = rng.standard_normal((7, 9, d))
    assert np.allclose(pose.inverse().apply(pose.apply(points)), points, atol=1e-13)
    assert np.allclose(pose.compose(pose.inverse()).matrix, np.eye(d + 1), atol=1e-13)


@pytest.mark.parametrize("d", [2, 3])
def test_composing_poses_is_moving_points_twice(d, rng, random_pose):
    """`a.compose(b)` applies b first, then a: checked on large rotations, where the order matters."""
    a, b = random_pose(rng, d, (5,), scaled=True), random_pose(rng, d, (5,), scaled=True)
    points = rng.standard_normal((5, 4, d))
    assert np.allclose(a.compose(b).apply(points), a.apply(b.apply(points)), atol=1e-12)
    assert not np.allclose(a.compose(b).apply(points), b.apply(a.apply(points)), atol=1e-2)


@pytest.mark.parametrize("d", [2, 3])
def test_the_matrix_does_what_the_pose_does(d, rng, random_pose):
    """The homogeneous matrix moves homogeneous points exactly as the pose moves points."""
    pose = random_pose(rng, d, scaled=True)
    points = rng.standard_normal((6, d))
    moved = np.column_stack([points, np.ones(6)]) @ pose.matrix.T
    assert np.allclose(moved[:, :d], pose.apply(points), atol=1e-13)
    assert np.array_equal(moved[:, d], np.ones(6))


def test_a_planar_rotation_is_anticlockwise_and_comes_before_the_translation():
    """A quarter turn takes (1, 0) to (0, 1); the translation is added after the rotation about the origin."""
    pose = Pose.from_angle(np.pi / 2, (10.0, 0.0))
    assert np.allclose(pose.apply([[1.0, 0.0]]), [[10.0, 1.0]])


@pytest.mark.parametrize("theta", [0.0, 1e-12, -1e-12, 0.5, -2.0, np.pi - 1e-12, -np.pi + 1e-12])
def test_the_angle_is_read_back_to_rounding_even_near_180_degrees(theta):
    """The rotation angle survives conversion to a matrix, both at 0 and at 180°, in the plane and in space."""
    assert Pose.from_angle(theta).angle == pytest.approx(theta, abs=4e-16)
    c, s = np.cos(theta), np.sin(theta)
    about_z = Pose(np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]), np.zeros(3))
    assert about_z.angle == pytest.approx(abs(theta), abs=4e-16)


def test_angles_are_refused_where_a_rotation_has_several():
    with pytest.raises(ValueError, match="angle"):
        _ = Pose.identity(4).angle


def test_leading_axes_broadcast_and_index_like_arrays():
    poses = Pose.from_angle(np.linspace(0.0, 1.0, 6).reshape(2, 3), (1.0, 2.0))
    assert poses.batch == (2, 3)
    assert poses.t.shape == (2, 3, 2)
    assert poses[1, 2].batch == ()
    assert poses[1, 2].angle == pytest.approx(1.0)
    assert poses.apply(np.zeros((5, 2))).shape == (2, 3, 5, 2)
    with pytest.raises(TypeError, match="a single pose has no rows"):
        list(Pose.identity())
    assert [pose.batch for pose in Pose.identity(2, (3, 4))] == [(4,)] * 3
    with pytest.raises(TypeError, match="a single pose has no rows"):
        Pose.identity()[0]


def test_a_pose_cannot_be_changed():
    R = np.eye(2)
    pose = Pose(R, np.zeros(2))
    R[0, 0] = 5.0
    assert pose.R[0, 0] == 1.0
    with pytest.raises(ValueError, match="read-only"):
        pose.R[0, 0] = 2.0
    with pytest.raises(AttributeError):
        pose.t = np.ones(2)


@pytest.mark.parametrize(
    ("R", "t", "scale", "name"),
    [
        (np.eye(2)[0], np.zeros(2), 1.0, "R"),
        (np.zeros((2, 3)), np.zeros(2), 1.0, "R"),
        (np.eye(2), np.zeros(3), 1.0, "t"),
        (np.eye(2), 0.0, 1.0, "t"),
        (np.zeros((4, 2, 2)), np.zeros((3, 2)), 1.0, "broadcast"),
    ],
)
def test_shapes_that_do_not_fit_are_refused_by_name(R, t, scale, name):
    with pytest.raises(ValueError, match=name):
        Pose(R, t, scale)


def test_a_pose_of_scale_zero_has_no_inverse():
    with pytest.raises(ValueError, match="scale"):
        Pose.trusted(np.eye(2), np.zeros(2), 0.0).inverse()


def test_a_pose_shows_itself_in_degrees():
    assert repr(Pose.from_angle(np.radians(30.0), (1.5, 0.0))) == "Pose(angle=30°, t=(1.5, 0), scale=1)"
    assert repr(Pose.identity(3, (4,))) == "Pose(batch=(4,), dim=3)"


@pytest.mark.parametrize("d", [2, 3, 4])
@pytest.mark.parametrize("scaled", [False, True])
def test_a_pose_comes_back_from_its_matrix(d, scaled, rng, random_pose):
    pose = random_pose(rng, d, (2, 5), scaled=scaled)
    result = Pose.from_matrix(pose.matrix)
    assert np.allclose(result.R, pose.R, atol=1e-13)
    assert np.array_equal(result.t, pose.t)
    assert np.allclose(result.scale, pose.scale, rtol=1e-12)
    if not scaled:
        assert np.array_equal(result.scale, pose.scale), "a rotation's determinant is 1 up to rounding"


@pytest.mark.parametrize(
    ("matrix", "message"),
    [
        (np.eye(3)[:2], "shape"),
        (np.eye(2), "at least 2"),
        (np.diag([1.0, 1.0, 2.0]), "last row"),
        (np.diag([1.0, -1.0, 1.0]), "a reflection"),
        (np.diag([0.0, 1.0, 1.0]), "singular"),
        (np.diag([2.0, 1.0, 1.0]), "differs from I"),
        (np.full((3, 3), np.nan), "not finite"),
    ],
)
def test_a_matrix_that_is_no_similarity_is_refused(matrix, message):
    with pytest.raises(ValueError, match=f"matrix: .*{message}") as refusal:
        Pose.from_matrix(matrix)
    assert "rounded" not in str(refusal.value)


@pytest.mark.parametrize("digits", [2, 4])
def test_what_to_pass_for_a_rotation_in_space_that_was_rounded_is_told(digits, rng, random_pose):
    pose = random_pose(rng, 3)
    matrix = pose.matrix.round(digits)
    R = matrix[:3, :3]
    advice = re.escape("; if R was rounded, U @ Vt of U, _, Vt = np.linalg.svd(R) is the nearest rotation") + "$"
    for refused in (lambda: Pose(R, pose.t), lambda: Pose.from_matrix(matrix), lambda: validate.start(matrix)):
        with pytest.raises(ValueError, match=advice):
            refused()
    U, _, Vt = np.linalg.svd(R)
    assert np.abs(Pose(U @ Vt, pose.t).R - pose.R).max() < 10.0**-digits


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("d", [2, 3])
@pytest.mark.parametrize("size", [1e-300, 1e-110, 1e-5, 1.0, 3.0, 1e110, 1e200, 1e307])
def test_a_scale_of_any_size_comes_out_of_a_matrix(d, size, rng, random_pose):
    """It does so although a small matrix's determinant underflows and a large one's overflows."""
    R = random_pose(rng, d).R
    for turn in (R, np.eye(d)):
        matrix = np.eye(d + 1)
        matrix[:d, :d] = size * turn
        pose = Pose.from_matrix(matrix)
        assert pose.scale == pytest.approx(size, rel=1e-14)
        assert np.allclose(pose.R, turn, rtol=0.0, atol=1e-14)


@pytest.mark.filterwarnings("error")
def test_a_scale_beyond_floating_point_is_refused():
    matrix = np.eye(3)
    matrix[:2, :2] = 1.7e308 * np.array([[1.0, -1.0], [1.0, 1.0]])
    with pytest.raises(ValueError, match=r"^matrix: .* beyond floating point"):
        Pose.from_matrix(matrix)


def test_half_a_turn_has_either_sign():
    """The sign comes from atan2 of a negative zero."""
    half = Pose.from_angle(np.pi)
    assert (half.angle, half.inverse().angle) == (np.pi, -np.pi)


def test_a_rotation_vector_is_the_exponential_of_its_skew_matrix(rng):
    """Agrees with the power series, even near no turn and near half a turn."""
    axis = rng.standard_normal((40, 3))
    axis /= np.linalg.norm(axis, axis=1, keepdims=True)
    theta = np.concatenate([[0.0, 1e-300, 1e-9, 1e-4, np.pi - 1e-9, np.pi], rng.uniform(0.0, np.pi, 34)])
    pose = Pose.from_rotvec(theta[:, None] * axis)
    for v, R in zip(theta[:, None] * axis, pose.R, strict=True):
        K = np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])
        series, term = np.eye(3), np.eye(3)
        for k in range(1, 40):
            term = term @ K / k
            series = series + term
        assert np.allclose(R, series, atol=1e-13)
    assert np.allclose(pose.angle, theta, atol=1e-14)
    with pytest.raises(ValueError, match="rotvec"):
        Pose.from_rotvec([1.0, 2.0])


@pytest.mark.parametrize("batch", [(), (5,), (2, 40)])
def test_a_rotation_vector_comes_back(rng, batch):
    """About any axis, including the coordinate axes, by no turn, a tiny one, and half a turn, where the vector and its
    opposite are the same rotation."""
    axis = rng.standard_normal((*batch, 3))
    axis[..., rng.integers(3)] = 0.0
    axis /= np.linalg.norm(axis, axis=-1, keepdims=True)
    for theta in (0.0, 1e-300, 1e-12, 1e-4, 0.5 * np.pi, 3.0, np.pi - 1e-9):
        v = Pose.from_rotvec(theta * axis).rotvec
        assert v.shape == axis.shape
        assert np.allclose(v, theta * axis, rtol=1e-9, atol=1e-15)
    half = Pose.from_rotvec(np.pi * axis)
    assert np.allclose(np.linalg.norm(half.rotvec, axis=-1), np.pi, rtol=1e-14)
    assert np.allclose(Pose.from_rotvec(half.rotvec).R, half.R, atol=1e-14)
    for k in range(3):
        assert np.allclose(np.abs(Pose.from_rotvec(np.pi * np.eye(3)[k]).rotvec), np.pi * np.eye(3)[k], atol=1e-15)
    with pytest.raises(ValueError, match="rotvec: defined in 3 dimensions, not in 2"):
        _ = Pose.from_angle(0.1).rotvec


def test_a_pose_is_a_function_a_factor_and_a_matrix(rng, random_pose):
    a, b = random_pose(rng, 2, (5,), scaled=True), random_pose(rng, 2, scaled=True)
    points = rng.standard_normal((5, 4, 2))
    assert np.array_equal(a(points), a.apply(points))
    assert np.array_equal((a @ b).matrix, a.compose(b).matrix)
    assert np.array_equal(np.asarray(a), a.matrix)
    assert np.asarray(b, dtype=np.float32).dtype == np.float32
    assert np.allclose(np.linalg.inv(b), b.inverse().matrix)


def test_a_pose_times_points_is_refused_since_three_points_would_pass_for_a_matrix():
    pose, points = Pose.identity(), np.ones((3, 3))
    with pytest.raises(TypeError, match=r"pose\(points\)"):
        pose @ points
    with pytest.raises(TypeError):
        points @ pose


def test_poses_that_do_not_fit_together_are_named():
    with pytest.raises(ValueError, match="first: moves points in 3"):
        Pose.identity(2).compose(Pose.identity(3))
    with pytest.raises(ValueError, match=r"first: leading axes \(2,\)"):
        Pose.identity(2, (3,)).compose(Pose.identity(2, (2,)))


@pytest.mark.parametrize(
    ("R", "scale", "message"),
    [
        (5.0 * np.eye(2), 1.0, r"R: expected a rotation, but R Rᵀ differs from I by 24; Pose.from_matrix"),
        ([[1.0, 0.3], [0.0, 1.0]], 1.0, "R: expected a rotation, but R Rᵀ differs"),
        (np.diag([1.0, -1.0]), 1.0, "R: expected a rotation, but one is a reflection"),
        ([np.eye(3), np.diag([1.0, 1.0, -1.0])], 1.0, "but one is a reflection"),
        (np.eye(2), 0.0, "scale: must be positive, but the smallest is 0"),
        (np.eye(2), [1.0, -2.0], "scale: must be positive, but the smallest is -2"),
        (np.eye(2), np.nan, "scale: nan is not finite"),
        (np.eye(2), [1.0, np.inf], "scale: 1 of 2 numbers is not finite"),
        (np.nan * np.eye(2), 1.0, "R: 4 of 4 numbers are not finite"),
    ],
)
def test_what_is_no_rotation_and_no_scale_is_refused(R, scale, message):
    R = np.asarray(R)
    with pytest.raises(ValueError, match=message):
        Pose(R, np.zeros(R.shape[-1]), scale)
    assert Pose.trusted(R, np.zeros(R.shape[-1]), scale).dim == R.shape[-1]


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Pose(np.eye(2), [np.nan, 0.0]), "t: 1 of 2 numbers is not finite"),
        (lambda: Pose(np.eye(2), np.ma.masked_equal([1.0, 2.0], 2.0)), "t: a masked array hides 1 number;"),
        (lambda: Pose(np.ma.masked_equal(np.eye(2), 0.0), [0.0, 0.0]), "R: a masked array hides 2 numbers"),
        (lambda: Pose(np.eye(2), [0.0, 0.0], "one"), "scale: expected real numbers"),
        (lambda: Pose.from_angle(np.nan), "theta: nan is not finite"),
        (lambda: Pose.from_angle(0.0, (0.0, np.inf)), "t: 1 of 2 numbers is not finite"),
        (lambda: Pose.from_angle(0.0, scale=-1.0), "scale: must be positive, but the smallest is -1"),
        (lambda: Pose.from_rotvec([0.0, np.nan, 0.0]), "rotvec: 1 of 3 numbers is not finite"),
        (lambda: Pose.from_rotvec([1e200, 0.0, 0.0]), r"rotvec: beyond 1e\+150 squares overflow"),
        (lambda: Pose.from_rotvec([0.0, 0.0, 1.0], scale=-2.0), "scale: must be positive, but the smallest is -2"),
        (lambda: Pose.from_rotvec([0.0, 0.0, 1.0], scale=np.nan), "scale: nan is not finite"),
        (lambda: Pose.from_matrix(np.ma.masked_equal(np.eye(3), 0.0)), "matrix: a masked array hides 6 numbers"),
        (lambda: Pose.from_matrix("x"), "matrix: expected real numbers"),
        (lambda: Pose.identity(2, (3,)).apply(np.zeros((2, 5, 2))), r"points: leading axes \(2,\) do not broadcast"),
        (lambda: Pose.identity().apply("x"), "points: expected real numbers"),
        (lambda: Pose.identity(batch=3), r"batch: expected a sequence of sizes, such as \(3,\), got 3$"),
        (lambda: Pose.identity(batch=(2.5,)), r"batch: expected an integer of at least 0, got 2\.5$"),
        (lambda: Pose.identity(batch=(-1,)), "batch: expected an integer of at least 0, got -1$"),
        (lambda: Pose.identity((3,)), r"d: expected an integer of at least 1, got \(3,\)$"),
    ],
)
def test_what_is_no_number_is_refused_by_name(make, message):
    with pytest.raises(ValueError, match=f"^{message}"):
        make()


def test_only_a_pose_is_composed():
    with pytest.raises(ValueError, match=r"^first: expected a Pose, got ndarray; Pose\.from_matrix makes one"):
        Pose.identity().compose(np.eye(3))


def test_a_rotation_written_with_six_digits_is_one():
    assert Pose(np.round(Pose.from_angle(0.7).R, 7), np.zeros(2)).angle == pytest.approx(0.7, abs=1e-6)


@pytest.mark.parametrize("batch", [(), (4,), (2, 3)])
def test_poses_of_equal_numbers_are_equal(batch, rng, random_pose):
    """Comparison gives a single bool, for a batch too; another number, shape, dimension or type makes it unequal."""
    pose = random_pose(rng, 3, batch, scaled=True)
    twin = Pose(pose.R, pose.t, pose.scale)
    assert (pose == twin) is True
    assert (pose != twin) is False
    assert hash(pose) == hash(twin)
    assert len({pose, twin, pose.inverse()}) == 2
    assert pose != Pose(pose.R, pose.t + 1e-9, pose.scale)
    assert pose != Pose(pose.R, pose.t, 2.0 * np.asarray(pose.scale))
    assert pose != Pose.identity(3, (1, *batch))
    for value in (pose.matrix, None, "pose", 1.0):
        assert (pose == value) is False
        assert (value == pose) is False


def test_equal_poses_count_as_one_whatever_the_sign_of_zero():
    assert Pose.identity() == Pose.identity()
    assert Pose.identity() != Pose.identity(3)
    minus = Pose(np.eye(2), [-0.0, 0.0])
    assert minus == Pose.identity()
    assert hash(minus) == hash(Pose.identity())


def test_a_batch_has_the_length_of_its_first_axis_and_a_single_pose_none():
    """A pose is always true, whatever its length."""
    for batch in ((3,), (2, 5), (0,)):
        poses = Pose.identity(2, batch)
        assert len(poses) == len(list(poses)) == batch[0]
        assert bool(poses)
    with pytest.raises(TypeError, match="a single pose has no rows"):
        len(Pose.identity())
    assert bool(Pose.identity())


def test_the_order_in_memory_of_what_it_is_made_of_changes_no_bit(rng):
    """Products of arrays with another memory order can round differently, so a pose always stores one order."""
    R = Pose.from_angle(rng.uniform(-3, 3, 40)).R
    fortran = np.asfortranarray(R)
    assert not fortran.flags.c_contiguous
    first = Pose(R, rng.normal(size=(40, 2)))
    second = Pose(fortran, np.asfortranarray(first.t))
    assert all(getattr(second, name).flags.c_contiguous for name in ("R", "t", "scale"))
    points = rng.normal(size=(40, 30, 2))
    np.testing.assert_array_equal(first.apply(points), second.apply(points))


@pytest.mark.parametrize("copier", [copy.copy, copy.deepcopy, lambda record: pickle.loads(pickle.dumps(record))])
def test_what_cannot_be_written_to_comes_back_so_from_a_copy_and_from_a_pickle(copier):
    """Poses are used in sets, where one that changed could no longer be found."""
    poses = Pose.from_angle([0.1, 0.2], [[0.0, 0.0], [1.0, 0.0]])
    assert copier(poses) == poses
    assert hash(copier(poses)) == hash(poses)
    edges, drive = copier(Edges.between(poses, [0], [1], np.eye(3))), copier(telecom_loop())
    scene = copier(room("noise", seed=40))
    own = (edges.i, edges.j, edges.information, edges.relative.t, drive.ranges, scene.source, *scene.outline)
    for array in (*vars(copier(poses)).values(), *own):
        assert not array.flags.writeable


@pytest.mark.parametrize("rounding", [lambda R: R.round(6), lambda R: R.astype(np.float32)])
def test_a_rotation_of_few_digits_is_taken_and_put_right(rounding):
    """It is made orthogonal, so that the inverse undoes the pose even in a national grid's coordinates."""
    exact = Pose.from_rotvec(np.random.default_rng(4).normal(size=(500, 3)), (5e5, 5e6, 100.0))
    matrix = exact.matrix
    matrix[:, :3, :3] = rounding(exact.R)
    points = np.array([[5e5, 5e6, 100.0]])
    for pose in (Pose.from_matrix(matrix), Pose(rounding(exact.R), exact.t)):
        assert np.abs(pose.R - exact.R).max() < 1e-6
        assert np.abs(pose.R @ pose.R.swapaxes(1, 2) - np.eye(3)).max() < 1e-14
        assert np.abs(pose.inverse().apply(pose.apply(points)) - points).max() < 1e-7
        assert not pose.R.flags.writeable


def test_a_rotation_without_rounding_stays_as_it_is():
    exact = Pose.from_rotvec(np.random.default_rng(4).normal(size=(500, 3)))
    assert np.array_equal(Pose(exact.R, exact.t).R, exact.R)
    assert np.array_equal(Pose.from_matrix(exact.matrix).R, exact.R)
