"""The pairwise weights of the soft methods, for figures and tests, since no method stores these matrices.

Those of CPD and of the annealed soft targets are in their own modules (`cpd.responsibilities`, `annealed.weights`).
"""

from __future__ import annotations

import numpy as np

from solvers.core import validate
from solvers.core.arrays import FloatArray
from solvers.methods.soft.filterreg import FilterRegState
from solvers.methods.soft.gmmreg import GmmRegState
from solvers.numerics import gaussians
from solvers.numerics.fits import clutter_constant


def filterreg_shares(state: FilterRegState, i: int = 0) -> FloatArray:
    """FilterReg's shares of the fixed points in each moving point.

    Computed from exact sums, which the state's filter approximates.

    Parameters
    ----------
    state : FilterRegState
        A state of `filterreg`.
    i : int, default 0
        Which problem of the batch.

    Returns
    -------
    ndarray of shape (m, n)
        Moving points are rows, fixed points columns. A row sums to its weight W; the
        rest up to 1 is the clutter's share.

    Examples
    --------
    >>> from solvers import METHODS
    >>> from solvers.race import Controls, race_problem
    >>> from solvers.soft_shares import filterreg_shares
    >>> from solvers.stepper import begin
    >>> problem, truth = race_problem(Controls(), seeds=[40])
    >>> shares = filterreg_shares(begin(METHODS["filterreg"], problem).state())
    >>> shares.shape, bool((shares.sum(axis=1) < 1.0).all())
    ((132, 160), True)
    """
    options, sigma = state.options, float(state.sigma[i])
    n = state.problem.target.shape[1]
    c = np.clip(clutter_constant(options.clutter, n, state.volume[i], 2, sigma), 1e-300, 1e300)
    return gaussians.share_matrix(state.moved[i], state.problem.target[i], sigma, float(c))


def gmmreg_overlaps(state: GmmRegState, i: int = 0) -> FloatArray:
    """The terms of `k_xy`: exp(−‖T p − q‖² / 4σ²) for each pair.

    They are not normalised, so they are not shares: a point's terms have no fixed sum.

    Parameters
    ----------
    state : GmmRegState
        A state of `gmmreg`.
    i : int, default 0
        Which problem of the batch.

    Returns
    -------
    ndarray of shape (m, n)
        From 0 to 1; moving points are rows, fixed points columns.

    Examples
    --------
    >>> from solvers import METHODS
    >>> from solvers.race import Controls, race_problem
    >>> from solvers.soft_shares import gmmreg_overlaps
    >>> from solvers.stepper import begin
    >>> problem, truth = race_problem(Controls(), seeds=[40])
    >>> gmmreg_overlaps(begin(METHODS["gmmreg"], problem).state()).shape
    (132, 160)
    """
    apart = state.moved[i][:, None] - state.problem.target[i]
    overlaps: FloatArray = np.exp(np.maximum(np.square(apart).sum(axis=2) / (-4.0 * state.sigma[i] ** 2), -700.0))
    return overlaps


def clutter_weight(offset: float, sigma: float, count: int, volume: float, dim: int = 2) -> float:
    """The weight of a uniform part that is equivalent to a constant added to kernel sums.

    The uniform part has density 1/V, and the constant `offset` is added to unnormalised
    kernel sums over `count` components: `offset = (2πσ²)^{d/2} w count / ((1 − w) V)`,
    solved for w.

    Parameters
    ----------
    offset : float
        The constant.
    sigma : float
        σ of the components, in world units.
    count : int
        The number of components.
    volume : float
        V, in u² in the plane and u³ in space.
    dim : int, default 2
        d, the dimension of the points.

    Returns
    -------
    float
        w, from 0 to 1.

    Raises
    ------
    ValueError
        If one of the first four is not a positive number, or `dim` not a positive
        integer; the message names it.

    Examples
    --------
    >>> from solvers.soft_shares import clutter_weight
    >>> round(clutter_weight(1.0, 0.1, 100, 64.0), 3)
    0.911
    """
    for name, value in (("offset", offset), ("sigma", sigma), ("count", count), ("volume", volume)):
        if not validate.number(value, name, 0.0) > 0.0:
            raise ValueError(f"{name}: expected a positive number, got {value!r}")
    validate.count(dim, "dim", 1)
    with np.errstate(all="ignore"):
        share = np.float64(offset) * volume / ((2.0 * np.pi * np.float64(sigma) ** 2) ** (0.5 * dim) * count)
    if np.finfo(np.float64).tiny < share < np.inf:
        return float(share / (1.0 + share))
    # A factor is out of float64's range, but its logarithm is not.
    rise = np.log(offset) + np.log(volume) - np.log(count) - dim * (0.5 * np.log(2.0 * np.pi) + np.log(sigma))
    return float(np.exp(-np.logaddexp(0.0, -rise)))
