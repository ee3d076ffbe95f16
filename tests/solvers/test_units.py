"""Every method with its defaults, and every robust weight, gives the same pose in units, milliunits and kilounits."""

from dataclasses import fields

import numpy as np
import pytest

from solvers import METHODS, Pose, Status, fit_rigid, register
from solvers.numerics.robust import KERNELS
from solvers.scenes.rooms import room, room_start

pytestmark = pytest.mark.filterwarnings("error::RuntimeWarning")

WEIGHTED = ("icp", "trimmed-icp", "capped-icp", "point-to-plane", "gicp")
PATHS = [(method, {"weight": kernel}) for method in WEIGHTED for kernel in KERNELS]
PATHS += [("kiss-threshold-icp", {}), ("fast-robust-icp", {})]
LENGTHS = ("gate", "cap", "max_shift")
NETWORKS = ("flow", "flow-from-source")


def in_unit(options, unit):
    """The options with all lengths among them converted to the unit."""
    return {k: v * unit if k in LENGTHS else v for k, v in options.items()}


def clouds(method):
    """Three rooms with junk, to be started 20° and 0.6 u off. Methods of known pairs get the target twice, once turned,
    with two fifths of the pairs mixed up; the networks, whose steps are slow, get every seventh point."""
    scenes = [room("outliers", seed=s) for s in (40, 53, 66)]
    source, target = (np.stack([getattr(s, name) for s in scenes]) for name in ("source", "target"))
    if METHODS[method].paired:
        rng = np.random.default_rng(40)
        source = Pose.from_angle(2.0, (0.3, -4.0)).apply(target) + 0.02 * rng.standard_normal(target.shape)
        source[:, :64] = source[:, rng.permutation(64)]
    stride = 7 if method in NETWORKS else 1
    return source[:, ::stride], target[:, ::stride]


def in_units(method, *units, **options):
    """The method's runs, with its defaults and the given options, in each of the units."""
    source, target = clouds(method)
    start = room_start(20.0, 0.6)
    seeds = [40, 53, 66]
    return [
        register(u * source, u * target, method, start=Pose(start.R, u * start.t), seed=seeds, **options) for u in units
    ]


def assert_same(plain, result, unit, tolerance):
    """Check for equal statuses and steps, and poses within `tolerance` of each other, relative to the room's radius of
    3.3 u."""
    assert (result.status == plain.status).all()
    assert (result.steps == plain.steps).all()
    assert np.abs(result.pose.R - plain.pose.R).max() <= tolerance
    assert np.abs(result.pose.scale - plain.pose.scale).max() <= tolerance
    assert np.abs(result.pose.t / unit - plain.pose.t).max() <= 3.3 * tolerance


@pytest.mark.parametrize("method", METHODS)
def test_defaults_are_of_no_unit(method):
    """With default options, a unit 2¹⁰ times as large or as small changes the poses only by rounding in later steps,
    since scaling by a power of two is exact; and every run does move away from its start."""
    small, plain, large = in_units(method, 2.0**-10, 1.0, 2.0**10)
    assert_same(plain, small, 2.0**-10, 1e-12)
    assert_same(plain, large, 2.0**10, 1e-12)
    assert np.abs(plain.pose.matrix - room_start(20.0, 0.6).matrix).max(axis=(1, 2)).min() > 0.01


@pytest.mark.parametrize("method", METHODS)
def test_a_thousandth_and_a_thousand_units(method):
    """So does a factor of a thousand, which rounds every coordinate anew."""
    small, plain, large = in_units(method, 1e-3, 1.0, 1e3)
    assert_same(plain, small, 1e-3, 1e-6)
    assert_same(plain, large, 1e3, 1e-6)


@pytest.mark.parametrize("method", METHODS)
def test_units_a_million_times_as_small_and_as_large(method):
    """The poses also agree in units of 1e-6, 1e-4 and 1e6, after ten steps, or all of NDT's, whose cells were once kept
    or dropped by a variance with a unit."""
    units, options = (1e-6, 1e-4, 1e6), {} if method.startswith("ndt") else {"max_steps": 10}
    plain, *results = in_units(method, 1.0, *units, **options)
    for result, unit in zip(results, units, strict=True):
        assert_same(plain, result, unit, 1e-6)


def test_a_length_in_units_is_not_of_no_unit():
    """Conversely, options that are lengths or volumes have a unit: kept fixed, they make another unit another
    problem."""
    lengths = {"ransac": {"inlier": 0.05}, "ransac-congruent": {"inlier": 0.32}, "kiss-threshold-icp": {"initial": 2.0},
             "cpd-rigid": {"volume": 64.0}, "filterreg": {"volume": 64.0, "filter": "exact"}}  # fmt: skip
    for method, options in lengths.items():
        plain, large = in_units(method, 1.0, 2.0**10, **options)
        assert np.abs(large.pose.t / 2.0**10 - plain.pose.t).max() > 1e-4, method


def test_pairs_mixed_up_are_mixed_up():
    """In the pairs given to methods of known pairs, least squares over all pairs misses the pose of the right ones."""
    source, target = clouds("ransac")
    right = fit_rigid(source[:, 64:], target[:, 64:]).pose
    assert np.abs(fit_rigid(source, target).pose.t - right.t).max() > 0.05
    assert np.abs(in_units("ransac", 1.0)[0].pose.t - right.t).max() < 0.02


def with_junk(seed):
    """A room and a turned part of it, with a known pose: all true pairs are exact, a quarter of the source is junk."""
    rng, target = np.random.default_rng(seed), room("clean", seed=seed).target
    truth = Pose.from_angle(0.2, (0.3, -0.1))
    source = truth.inverse().apply(target[10:130:2])
    junk = rng.uniform(-1.0, 1.0, (len(source) // 3, 2)) * (5.0, 3.2)
    return np.concatenate([source, junk]), target, truth


def test_no_robust_path_is_forgotten():
    """The methods with a `weight` option are exactly those tested here."""
    names = {name for name in METHODS if "weight" in {f.name for f in fields(METHODS[name].options)}}
    assert names == set(WEIGHTED)


@pytest.mark.parametrize(("method", "options"), PATHS, ids=[f"{m} {o.get('weight', '')}".strip() for m, o in PATHS])
def test_the_pose_does_not_depend_on_the_unit(method, options):
    """For rooms with junk from 20°, and rooms whose true pairs coincide at the end, where the scale is at its floor,
    the status is the same in every unit, and so is the pose, to 1e-6 of the room."""
    noisy = [room("outliers", seed=s) for s in (40, 53, 66)]
    perfect = [with_junk(s) for s in (1, 2)]
    cases = [
        (np.stack([s.source for s in noisy]), np.stack([s.target for s in noisy]), room_start(20.0, 0.6)),
        (np.stack([s[0] for s in perfect]), np.stack([s[1] for s in perfect]), Pose.identity(2)),
    ]
    for source, target, start in cases:
        kilo, plain, milli = (
            register(
                unit * source, unit * target, method, start=Pose(start.R, unit * start.t), max_steps=200,
                **in_unit(options, unit),
            )
            for unit in (1e-3, 1.0, 1e3)
        )  # fmt: skip
        assert (plain.steps > 2).all()
        for result, unit in ((kilo, 1e-3), (milli, 1e3)):
            assert (result.status == plain.status).all()
            assert np.abs(result.pose.R - plain.pose.R).max() < 1e-6
            assert np.abs(result.pose.t / unit - plain.pose.t).max() < 3e-6


@pytest.mark.parametrize("unit", [1e-4, 1e-3, 1.0, 1e3])
def test_junk_is_refused_in_every_unit(unit):
    """In every unit, point to point with Tukey's weight on exact true pairs reduces the error to less than a hundredth
    of that without a weight. An absolute floor once disabled the weights in kilounits."""
    for seed in (1, 2, 3):
        source, target, truth = with_junk(seed)
        errors = []
        for weight in ("none", "tukey"):
            result = register(unit * source, unit * target, "icp", weight=weight, max_steps=300)
            assert result.status == Status.CONVERGED
            errors.append(np.abs(result.pose.apply(unit * source[:60]) - unit * truth.apply(source[:60])).max() / unit)
        assert errors[1] < 0.01 * errors[0]


def test_the_kiss_threshold_is_of_the_origin_and_the_others_of_the_clouds():
    """If the origin is kilometres from the scanner, the KISS threshold excludes no pair, so the run ends where plain
    `icp` does; `icp` itself ends at the same pose wherever the origin is."""
    scene, start = room("outliers", seed=40), room_start(20.0, 0.5)
    shift = Pose(np.eye(2), (5e5, 5e6))
    moved = shift.apply(scene.source), shift.apply(scene.target)
    moved_start = shift @ start @ shift.inverse()
    poses = {}
    for method in ("icp", "kiss-threshold-icp"):
        pose = register(scene.source, scene.target, method, start=start).pose
        moved_pose = register(*moved, method, start=moved_start).pose
        poses[method] = pose.apply(scene.source), moved_pose.apply(moved[0]) - shift.t
    assert np.abs(poses["icp"][1] - poses["icp"][0]).max() < 1e-6
    assert np.abs(poses["kiss-threshold-icp"][1] - poses["icp"][0]).max() < 1e-6
    assert np.abs(poses["kiss-threshold-icp"][0] - poses["icp"][0]).max() > 0.02
