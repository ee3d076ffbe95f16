"""Pair by pair, what the soft methods work with: for figures and for tests, since no
method stores these matrices.

CPD's and the annealed soft targets' own stand beside them
(`cpd.responsibilities`, `annealed.weights`).
"""

from __future__ import annotations

import numpy as np

from solvers.core import validate
from solvers.core.arrays import FloatArray
from solvers.methods.soft.filterreg import FilterRegState
from solvers.methods.soft.gmmreg import GmmRegState
from solvers.numerics import gaussians


def filterreg_shares(state: FilterRegState, i: int = 0) -> FloatArray:
    """The shares (m, n) of the fixed points, columns, in each moving point, rows, of
    problem i: by exact sums, which the state's filter approximates. A row adds up to
    its weight W; what is missing from 1 is the clutter's.
    """
    options, sigma = state.options, float(state.sigma[i])
    n = state.problem.target.shape[1]
    c = 2.0 * np.pi * sigma**2 * options.clutter * n / ((1.0 - options.clutter) * state.volume[i])
    return gaussians.share_matrix(state.moved[i], state.problem.target[i], sigma, float(np.clip(c, 1e-300, 1e300)))


def gmmreg_overlaps(state: GmmRegState, i: int = 0) -> FloatArray:
    """The terms (m, n) of k_xy of problem i: exp(−‖T p − q‖² / 4σ²), from 0 to 1. They
    are not normalised, so they are not shares: no point has a fixed amount to give away.
    """
    apart = state.moved[i][:, None] - state.problem.target[i]
    overlaps: FloatArray = np.exp(np.maximum(np.square(apart).sum(axis=2) / (-4.0 * state.sigma[i] ** 2), -700.0))
    return overlaps


def clutter_weight(offset: float, sigma: float, count: int, volume: float, dim: int = 2) -> float:
    """The weight w of a uniform part of density 1/V for which a constant `offset`
    beside unnormalised kernel sums over `count` components is that part's term:
    `offset = (2πσ²)^{d/2} w count / ((1 − w) V)`, solved for w.

    Raises ValueError for numbers that are not positive.
    """
    for name, value in (("offset", offset), ("sigma", sigma), ("count", count), ("volume", volume)):
        if not validate.number(value, name, 0.0) > 0.0:
            raise ValueError(f"{name}: expected a positive number, got {value!r}")
    share = offset * volume / ((2.0 * np.pi * sigma**2) ** (0.5 * dim) * count)
    return float(share / (1.0 + share))
