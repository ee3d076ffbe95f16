"""What speaks for a match of two scans: how much it explains, and how well the walls determine it."""

from __future__ import annotations

import numpy as np

from solvers.core.arrays import FloatArray
from solvers.geometry import nearest
from solvers.geometry.normals import NEIGHBOURS
from solvers.methods.icp.surface_icp import SurfaceState


def explained(state: SurfaceState, reach: float) -> FloatArray:
    """The fraction of each source scan with a point of its target within `reach`, (b,)."""
    real = state.problem.weights > 0.0
    _, squares = state.index.nearest(state.pairing.moved)
    near = nearest.within(squares, reach) & real
    return np.asarray(near.sum(axis=1) / np.maximum(real.sum(axis=1), 1))


def determined(state: SurfaceState, margin: float) -> FloatArray:
    """The smallest eigenvalue over the largest, less `margin` times what the noise of the normals gives the weakest
    motion; at least 0, (b,).
    """
    values = state.system.eigenvalues
    top = np.where(values[:, -1] > 0.0, values[:, -1], 1.0)
    return np.maximum((values[:, 0] - margin * _by_noise(state)) / top, 0.0)


def _by_noise(state: SurfaceState) -> FloatArray:
    """What the noise of the normals adds to the information on the weakest motion, (b,).

    Along a straight wall every true normal is square to the motion, but the estimated ones are turned a little, and the
    squares of these turns add up to information that the wall does not give. A normal from k neighbours and the point
    itself, whose neighbourhood has the eigenvalues λ₁ and λ₂, turns with the variance λ₁ λ₂ / ((k − 1) (λ₂ − λ₁)²), and
    with at most ½, that of a direction drawn at random.
    """
    system, weights = state.system, state.pairing.weights
    n = nearest.picked(state.normals.vectors, state.pairing.rows)
    values = nearest.picked(state.normals.eigenvalues, state.pairing.rows)
    with np.errstate(over="ignore", under="ignore", invalid="ignore", divide="ignore"):
        thin = values[..., 0] / values[..., 1]
        variance = np.fmin(thin / np.square(1.0 - thin) / (NEIGHBOURS - 1), 0.5)  # NaN, without a normal, is ½
        # How a pair's distance along the normal, (n, lever × n), changes as the normal turns.
        tangent = np.stack([-n[..., 1], n[..., 0]], axis=-1)
        lever = (state.pairing.moved - system.centre[:, None]) / system.radius[:, None, None]
        turn = lever[..., 0] * tangent[..., 1] - lever[..., 1] * tangent[..., 0]
        weak = system.directions[:, None, :, 0]
        along = tangent[..., 0] * weak[..., 0] + tangent[..., 1] * weak[..., 1] + turn * weak[..., 2]
        share = np.where(weights > 0.0, weights * variance * np.square(along), 0.0).sum(axis=1)
    total = weights.sum(axis=1)
    return np.asarray(share / np.where(total > 0.0, total, 1.0))


def information(state: SurfaceState, sigma: float) -> FloatArray:
    """The information of the pairs on a small motion of the source in its own coordinates, (b, 3, 3): `Σ w g gᵀ / σ²`,
    with g the derivative of a pair's distance along the normal by (x, y, angle).
    """
    problems = np.arange(len(state.status))[:, None]
    n = state.normals.vectors[problems, state.pairing.rows] @ state.pose.R  # Rᵀ n, one per row
    p = state.problem.source
    g = np.concatenate([n, (n[..., 1] * p[..., 0] - n[..., 0] * p[..., 1])[..., None]], axis=-1)
    H = (g * state.pairing.weights[..., None]).swapaxes(1, 2) @ g / sigma**2
    matrix: FloatArray = 0.5 * (H + H.swapaxes(1, 2))
    return matrix
