"""Graphs far from the origin, whose coordinates are coarser than the steps are measured."""

from __future__ import annotations

import numpy as np
import pytest

from solvers import Pose, Status
from solvers.posegraph import optimise
from tests.solvers.posegraph.graphs import noisy_streets


@pytest.mark.parametrize("far", [1e7, 1e8, 1e9, 1e10])
def test_far_from_the_origin_a_graph_comes_to_rest_where_its_coordinates_let_it(far):
    """The nodes are then known to `numpy.spacing(far)`; the run ends near that, and does not go on with steps that only
    round them another way."""
    _, start, edges, _ = noisy_streets()
    start = Pose(start.R, start.t - start.t[0])
    moved_result, result = optimise(Pose(start.R, start.t + far), edges), optimise(start, edges)
    assert moved_result.status == Status.CONVERGED
    assert moved_result.steps <= result.steps
    assert np.abs(moved_result.poses.t - far - result.poses.t).max() < 20.0 * np.spacing(far)
