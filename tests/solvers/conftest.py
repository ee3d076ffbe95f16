"""Random poses and clouds for the solver tests: seeded, in any dimension."""

from collections.abc import Callable

import numpy as np
import pytest
from numpy.random import Generator

from solvers import Pose

RandomPose = Callable[..., Pose]


def _random_pose(rng: Generator, d: int, batch: tuple[int, ...] = (), scaled: bool = False) -> Pose:
    """A uniformly random rotation (QR of a Gaussian matrix, signs fixed) and a translation of a few units."""
    Q, upper = np.linalg.qr(rng.standard_normal((*batch, d, d)))
    Q = Q * np.sign(np.diagonal(upper, axis1=-2, axis2=-1))[..., None, :]
    Q[..., :, 0] *= np.sign(np.linalg.det(Q))[..., None]
    scale = rng.uniform(0.3, 3.0, batch) if scaled else np.ones(batch)
    return Pose(Q, 3.0 * rng.standard_normal((*batch, d)), scale)


@pytest.fixture
def random_pose() -> RandomPose:
    return _random_pose


@pytest.fixture
def rng() -> Generator:
    return np.random.default_rng(20240611)
