"""The marginal covariances of a graph's nodes."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress

import numpy as np
from numpy.typing import ArrayLike

from solvers.core import validate
from solvers.core.arrays import FloatArray, IntArray
from solvers.core.edges import Edges, row_numbers, within
from solvers.core.pose import Pose
from solvers.posegraph import checks, linear
from solvers.posegraph.errors import derivatives
from solvers.posegraph.linear import Solve

TOGETHER = 64  # nodes to solve for at once: memory grows with the square of their number


def marginals(
    poses: Pose,
    edges: Edges,
    nodes: ArrayLike,
    *,
    fixed: int | Sequence[int] = 0,
    weights: ArrayLike | None = None,
    sparse: bool | None = None,
) -> FloatArray:
    """The marginal covariances of nodes, given the fixed ones: blocks of (JᵀΩJ)⁻¹.

    They are of the perturbation `t + v, θ + ω`, with v along the axes of the map, to
    first order: right for errors that are small against the bends of the graph. They
    show how noise with the given information spreads, and do not account for wrong
    edges.

    Parameters
    ----------
    poses : Pose of shape (n,)
        The poses at which to take the covariances, such as those that `optimise` found.
    edges : Edges
        The measurements between them.
    nodes : array_like of int, shape (k,)
        The nodes whose covariances to return.
    fixed : int or sequence of int, default 0
        The nodes that are known; their covariance is zero.
    weights : array_like of shape (e,), optional
        Positive factors on the information matrices, such as a kernel's weights. None
        is 1 for all.
    sparse : bool, optional
        As for `optimise`.

    Returns
    -------
    ndarray of shape (k, 3, 3)
        Over (x, y, angle), in u², u rad and rad².

    Raises
    ------
    ValueError
        As `optimise` does, if a weight is not positive, or if the combined information
        of the edges is singular in floating point.

    Examples
    --------
    Along a straight chain the variances of the steps add up:

    >>> import numpy as np
    >>> from solvers import Pose
    >>> from solvers.posegraph import Edges, marginals
    >>> poses = Pose.from_angle(np.zeros(3), [[0.0, 0.0], [1.0, 0.0], [2.0, 0.0]])
    >>> edges = Edges.between(poses, [0, 1], [1, 2], np.diag([100.0, 100.0, 400.0]))
    >>> marginals(poses, edges, [1, 2])[:, 0, 0].round(6)
    array([0.01, 0.02])
    """
    held = checks.held(poses, edges, fixed)
    plan = linear.plan(len(held), edges.i, edges.j, held, sparse)
    rows = row_numbers(nodes, "nodes")
    if not rows.size:
        raise ValueError("nodes: is empty; at least one node is needed")
    n, k = len(held), rows.size
    within(rows, n, "nodes")
    share = validate.weights(weights, len(edges))
    if share.ndim != 1 or not (share > 0.0).all():
        raise ValueError("weights: expected one positive weight per edge")
    by_i, by_j = derivatives(poses, edges)
    parts = linear.blocks(by_i, by_j, share[:, None, None] * edges.information, np.zeros((len(edges), 3)))
    covariances = np.full((k, 3, 3), np.nan)
    with np.errstate(over="ignore", invalid="ignore", under="ignore", divide="ignore"), suppress(np.linalg.LinAlgError):
        solve = linear.factor(plan, edges.i, edges.j, *parts[:3], np.zeros((n, 3)))
        for first in range(0, k, TOGETHER):
            covariances[first : first + TOGETHER] = _blocks(solve, rows[first : first + TOGETHER], n)
    if not np.isfinite(covariances).all():
        raise ValueError("edges: their information differs beyond double precision: the sum is singular")
    return np.asarray(0.5 * (covariances + covariances.swapaxes(1, 2)))


def _blocks(solve: Solve, nodes: IntArray, n: int) -> FloatArray:
    """The diagonal blocks (k, 3, 3) of the inverse for these nodes."""
    k = len(nodes)
    unit = np.zeros((n, 3, k, 3))
    unit[nodes, :, np.arange(k)] = np.eye(3)
    columns = solve(unit.reshape(n, 3, 3 * k)).reshape(n, 3, k, 3)
    return np.asarray(columns[nodes, :, np.arange(k)])
