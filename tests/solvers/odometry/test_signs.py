"""What the noise of the normals adds to the information on the weakest motion: by differences, and on bare walls."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from solvers import Pose
from solvers.geometry import nearest
from solvers.geometry.normals import NEIGHBOURS, Normals
from solvers.numerics import gauss_newton
from solvers.odometry import MatchOptions, prepare
from solvers.odometry.matching import matched
from solvers.odometry.signs import _by_noise
from solvers.scenes.drive import Drive

BEARINGS = np.linspace(-np.pi, np.pi, 360, endpoint=False) + 1e-3


def test_a_turned_normal_changes_the_weakest_motion_s_share_as_differences_say() -> None:
    """Turn each normal a little either way: the change of its pair's share in a weakest motion that is both a slide and
    a turn, squared, times the normal's variance. The shares are those of the solver's own Jacobian."""
    rng = np.random.default_rng(40)
    moved, angle, weights = rng.normal(size=(1, 9, 2)), rng.uniform(-3.0, 3.0, 9), rng.uniform(0.5, 1.0, (1, 9))
    centre, radius = np.array([[0.3, -0.2]]), np.array([1.7])
    directions = np.linalg.qr(rng.normal(size=(3, 3)))[0][None]
    small = rng.uniform(0.001, 0.01, 9)

    def vectors(turn: float) -> np.ndarray:
        return np.stack([np.cos(angle + turn), np.sin(angle + turn)], axis=-1)[None]

    def shares(turn: float) -> np.ndarray:
        jacobian = gauss_newton.jacobian(moved - centre[:, None], radius)
        return np.einsum("bmi,bmij,bj->bm", vectors(turn), jacobian, directions[..., 0])

    state = SimpleNamespace(
        pairing=SimpleNamespace(moved=moved, rows=np.arange(9)[None], weights=weights),
        normals=SimpleNamespace(vectors=vectors(0.0), eigenvalues=np.stack([small, np.ones(9)], axis=-1)[None]),
        system=SimpleNamespace(centre=centre, radius=radius, directions=directions),
    )
    change = (shares(1e-5) - shares(-1e-5)) / 2e-5
    variance = small / (1.0 - small) ** 2 / (NEIGHBOURS - 1)
    expected = (weights * variance * change**2).sum() / weights.sum()
    assert _by_noise(state)[0] == pytest.approx(expected, rel=1e-6)


@pytest.mark.parametrize("shape", ["corridor", "round"])
def test_all_information_on_a_free_motion_is_what_the_noise_is_said_to_add(shape: str) -> None:
    """Along bare walls, and for the turn in a round room, the scans say nothing: the smallest eigenvalue is the noise's
    alone, in the mean over 60 pairs of scans."""
    rng = np.random.default_rng(53)
    true = 1.5 / np.abs(np.sin(BEARINGS)) if shape == "corridor" else np.full(len(BEARINGS), 3.0)
    ranges = true + 0.02 * rng.standard_normal((61, len(BEARINGS)))
    still = Pose.from_angle(np.zeros(61), (0.0, 0.0))
    scans = prepare(Drive(np.arange(61.0), still, np.where(ranges < 6.0, ranges, np.inf), BEARINGS, Pose.identity()))
    target, start = np.arange(60), Pose.from_angle(np.zeros(60), (0.0, 0.0))
    whole = scans.surface
    surface = Normals(whole.vectors[target], whole.flagged[target], whole.eigenvalues[target])
    state = matched(scans, target + 1, nearest.build(scans.points[target]), surface, start, MatchOptions())
    assert _by_noise(state).mean() == pytest.approx(state.system.eigenvalues[:, 0].mean(), rel=0.15)
