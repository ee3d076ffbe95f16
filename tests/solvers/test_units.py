"""Every method with a robust weight, in units, milliunits and kilounits: one problem, one pose."""

from dataclasses import fields

import numpy as np
import pytest

from solvers import METHODS, Pose, Status, register
from solvers.numerics.robust import KERNELS
from solvers.scenes.rooms import room, room_start

pytestmark = pytest.mark.filterwarnings("error::RuntimeWarning")

WEIGHTED = ("icp", "trimmed-icp", "capped-icp", "point-to-plane", "gicp")
PATHS = [(method, {"weight": kernel}) for method in WEIGHTED for kernel in KERNELS]
PATHS += [("kiss-threshold-icp", {"initial": 2.0, "least": 0.1}), ("fast-robust-icp", {})]
LENGTHS = ("gate", "cap", "max_shift", "initial", "least")


def in_unit(options, unit):
    """The options with every length among them in the unit."""
    return {k: v * unit if k in LENGTHS else v for k, v in options.items()}


def with_junk(seed):
    """A room against itself, turned: every true pair is perfect, a quarter of the source is junk. The pose is known."""
    rng, target = np.random.default_rng(seed), room("clean", seed=seed).target
    truth = Pose.from_angle(0.2, (0.3, -0.1))
    source = truth.inverse().apply(target[10:130:2])
    junk = rng.uniform(-1.0, 1.0, (len(source) // 3, 2)) * (5.0, 3.2)
    return np.concatenate([source, junk]), target, truth


def test_no_robust_path_is_forgotten():
    """The methods with an option `weight` are those tried here."""
    found = {name for name in METHODS if "weight" in {f.name for f in fields(METHODS[name].options)}}
    assert found == set(WEIGHTED)


@pytest.mark.parametrize(("method", "options"), PATHS, ids=[f"{m} {o.get('weight', '')}".strip() for m, o in PATHS])
def test_the_pose_does_not_depend_on_the_unit(method, options):
    """Rooms with junk from 20°, and rooms whose true pairs come to lie on each other, where the scale is at its floor:
    the same status, and the same pose to 1e-6 of the room."""
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
        for other, unit in ((kilo, 1e-3), (milli, 1e3)):
            assert (other.status == plain.status).all()
            assert np.abs(other.pose.R - plain.pose.R).max() < 1e-6
            assert np.abs(other.pose.t / unit - plain.pose.t).max() < 3e-6


@pytest.mark.parametrize("unit", [1e-3, 1.0, 1e3])
def test_junk_is_refused_in_every_unit(unit):
    """Point to point with Tukey's weight reaches the pose of perfect pairs to a hundredth of what it misses by without
    a weight, whatever the unit: an absolute floor gave the weights up in kilounits."""
    for seed in (1, 2, 3):
        source, target, truth = with_junk(seed)
        off = []
        for weight in ("none", "tukey"):
            result = register(unit * source, unit * target, "icp", weight=weight, max_steps=300)
            assert result.status == Status.CONVERGED
            off.append(np.abs(result.pose.apply(unit * source[:60]) - unit * truth.apply(source[:60])).max() / unit)
        assert off[1] < 0.01 * off[0]
