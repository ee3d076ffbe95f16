"""The residuals of a graph's poses against the measurements of its edges.

With a node's pose `T = (R, t)` from its own coordinates to those of the map, and an
edge's measured relative pose Z, the residual is the planar motion `E = Z⁻¹ Tᵢ⁻¹ Tⱼ`
written as (x, y, angle), the angle in [−π, π]:

    e = ( R_Zᵀ (Rᵢᵀ (tⱼ − tᵢ) − t_Z),  θⱼ − θᵢ − θ_Z )

It is the residual of g2o's EDGE_SE2, so that information matrices and χ² mean the same. It differs from the logarithm
of E in second order. Nodes are perturbed by `t + v, θ + ω`, with v along the axes of the map.

Source: Grisetti, Kümmerle, Stachniss & Burgard 2010, A tutorial on graph-based SLAM.
"""

from __future__ import annotations

import numpy as np

from solvers.core.arrays import FloatArray
from solvers.core.edges import Edges, graph
from solvers.core.pose import Pose


def residuals(poses: Pose, edges: Edges) -> FloatArray:
    """The errors of the edges at these poses.

    Parameters
    ----------
    poses : Pose of shape (n,)
        The nodes.
    edges : Edges
        The measurements between them; e edges.

    Returns
    -------
    ndarray of shape (e, 3)
        x and y in world units, along the axes of the measured node, and the angle in
        radians.

    Raises
    ------
    ValueError
        If the poses are not rigid motions of the plane, of shape (n,), if `edges` are
        not Edges, or an edge names a node that does not exist.

    Examples
    --------
    >>> import numpy as np
    >>> from solvers import Pose
    >>> from solvers.posegraph import Edges, residuals
    >>> poses = Pose.from_angle([0.0, 0.1], [[0.0, 0.0], [1.2, 0.0]])
    >>> one = Edges([0], [1], Pose.from_angle([0.0], [[1.0, 0.0]]), np.eye(3))
    >>> residuals(poses, one).round(6)
    array([[0.2, 0. , 0.1]])
    """
    graph(poses, edges)
    return offsets(poses, edges)


def offsets(poses: Pose, edges: Edges) -> FloatArray:
    """`residuals` for a graph already checked."""
    first, Z = poses[edges.i], edges.relative
    relative = _turned_back(first.R, poses.t[edges.j] - first.t)
    off = _turned_back(Z.R, relative - Z.t)
    turn = Pose.trusted(Z.R.swapaxes(1, 2) @ first.R.swapaxes(1, 2) @ poses.R[edges.j], np.zeros(2)).angle
    return np.concatenate([off, turn[:, None]], axis=1)


def jacobians(poses: Pose, edges: Edges) -> tuple[FloatArray, FloatArray]:
    """The derivatives of the residuals by the two nodes of each edge.

    Parameters
    ----------
    poses : Pose of shape (n,)
        The nodes.
    edges : Edges
        The measurements between them; e edges.

    Returns
    -------
    by_i, by_j : ndarray of shape (e, 3, 3)
        By (v, ω) of node i and of node j, with v along the axes of the map.

    Raises
    ------
    ValueError
        If the poses are not rigid motions of the plane, of shape (n,), if `edges` are
        not Edges, or an edge names a node that does not exist.

    Examples
    --------
    >>> import numpy as np
    >>> from solvers import Pose
    >>> from solvers.posegraph import Edges, jacobians
    >>> poses = Pose.from_angle([0.0, 0.1], [[0.0, 0.0], [1.2, 0.0]])
    >>> one = Edges([0], [1], Pose.from_angle([0.0], [[1.0, 0.0]]), np.eye(3))
    >>> jacobians(poses, one)[0][0].round(6)
    array([[-1. ,  0. ,  0. ],
           [ 0. , -1. , -1.2],
           [ 0. ,  0. , -1. ]])
    """
    graph(poses, edges)
    return derivatives(poses, edges)


def derivatives(poses: Pose, edges: Edges) -> tuple[FloatArray, FloatArray]:
    """`jacobians` for a graph already checked."""
    first = poses[edges.i]
    back = edges.relative.R.swapaxes(1, 2) @ first.R.swapaxes(1, 2)
    apart = poses.t[edges.j] - first.t
    by_j = np.zeros((len(edges), 3, 3))
    by_j[:, :2, :2] = back
    by_j[:, 2, 2] = 1.0
    by_i = 0.0 - by_j
    # d/dθ of R(−θ) a is R(−θ) (a_y, −a_x).
    by_i[:, :2, 2] = (back @ np.stack([apart[:, 1], -apart[:, 0]], axis=-1)[..., None])[..., 0]
    return by_i, by_j


def chi_squared(poses: Pose, edges: Edges) -> FloatArray:
    """χ² = eᵀ Ω e of each edge at these poses: its squared error in units of the expected one.

    Parameters
    ----------
    poses : Pose of shape (n,)
        The nodes.
    edges : Edges
        The measurements between them; e edges.

    Returns
    -------
    ndarray of shape (e,)
        Dimensionless; 3 on average for an edge whose information matches its noise, at
        the true poses. Infinite where the numbers overflow.

    Raises
    ------
    ValueError
        If the poses are not rigid motions of the plane, of shape (n,), if `edges` are
        not Edges, or an edge names a node that does not exist.

    Examples
    --------
    >>> import numpy as np
    >>> from solvers import Pose
    >>> from solvers.posegraph import Edges, chi_squared
    >>> poses = Pose.from_angle([0.0, 0.0], [[0.0, 0.0], [1.2, 0.0]])
    >>> one = Edges([0], [1], Pose.from_angle([0.0], [[1.0, 0.0]]), 100.0 * np.eye(3))
    >>> chi_squared(poses, one).round(6)
    array([4.])
    """
    graph(poses, edges)
    return squares(offsets(poses, edges), edges.information)


def squares(errors: FloatArray, information: FloatArray) -> FloatArray:
    """eᵀ Ω e for errors (e, 3); infinite where it overflows."""
    with np.errstate(over="ignore", invalid="ignore", under="ignore"):
        values = np.einsum("ea,eab,eb->e", errors, information, errors)
    return np.where(np.isfinite(values), np.maximum(values, 0.0), np.inf)


def moved(poses: Pose, step: FloatArray) -> Pose:
    """The poses after `t + v, θ + ω`, for a step (n, 3)."""
    return Pose.trusted(Pose.from_angle(step[:, 2]).R @ poses.R, poses.t + step[:, :2])


def _turned_back(R: FloatArray, v: FloatArray) -> FloatArray:
    back: FloatArray = (R.swapaxes(1, 2) @ v[..., None])[..., 0]
    return back
