"""Source points with zero weight do not affect how certain a pose is."""

import numpy as np
import pytest

from solvers import register
from solvers.scenes.rooms import room
from solvers.uncertainty import covariance


@pytest.mark.parametrize("method", ["icp", "point-to-plane"])
def test_rows_without_weight_leave_the_hessian_s_region_as_it_is(method):
    """Neither their number nor their places matter: the noise is estimated from the weighted residuals."""
    scene = room("noise", seed=40)
    p, q = scene.source, scene.target
    rows = np.vstack([p, p[:60] + 0.3])
    weights = np.append(np.ones(len(p)), np.zeros(60))
    plain = covariance(register(p, q, method, weights=np.ones(len(p))))
    estimate = covariance(register(rows, q, method, weights=weights))
    np.testing.assert_allclose(estimate.deviations, plain.deviations, rtol=1e-9)
