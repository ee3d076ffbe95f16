"""Graduated non-convexity: a fit despite many wrong pairs, without random draws.

The pose sought minimises the truncated sum of squares `C(T) = Σ_i w_i min(r_i², c²)`,
r_i the residual distance of pair i under T and c the bound within which a right pair is
expected. C is replaced by a surrogate with a parameter μ: for small μ it grows with
every distance, ever more slowly, and for μ → ∞ it is the sum itself. μ grows by a
constant factor from step to step while a minimum is tracked.

One step is a weighted closed-form fit, then new weights for the pairs. By the duality
of Black and Rangarajan the surrogate is `min over v of Σ_i w_i (v_i r_i² + Φ(v_i))`
with `Φ(v) = c² μ (1 − v)/(μ + v)`, and its best v has a closed form (`tls_weights`).

As in [1]_, μ starts at `c²/(2 r_max² − c²)`, r_max the largest residual of the
least-squares fit of all pairs, and grows by 1.4. The authors' program ends when the
weighted sum of squares settles. Here a run ends when every v is 0 or 1 and equals the v
that the pose was fitted with: no larger μ then changes anything. The result is a local
minimum of C, with no proof that it is the lowest. The starting pose plays no part.

Left out: solvers for problems other than the rigid fit, and the surrogate of Geman and
McClure.

References
----------
.. [1] H. Yang, P. Antonante, V. Tzoumas, L. Carlone, "Graduated non-convexity for
   robust spatial perception: from non-minimal solvers to global outlier rejection",
   2020. doi:10.1109/LRA.2020.2965893
.. [2] M. J. Black, A. Rangarajan, "On the unification of line processes, outlier
   rejection, and robust statistics with applications in early vision", 1996.
   doi:10.1007/BF00131148
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from solvers.core import validate
from solvers.core.arrays import FloatArray, IntArray, ReasonArray, StatusArray
from solvers.core.brief import brief
from solvers.core.method import Method, Problem
from solvers.core.partners import own_rows
from solvers.core.pose import Pose
from solvers.core.status import Status, mark, reasons, statuses
from solvers.core.tree import CONSTANT, SHARED, changed, put
from solvers.geometry.rigid import fit_planar, fit_rigid
from solvers.numerics.fits import strays

_SHARE = 0.05  # the default bound, in RMS radii of the source
_LEAST_MU = 1e-20
_HARD_MU = 1e8  # from here on the surrogate is the truncated square up to 1e-8 c²


@dataclass(frozen=True)
class GraduatedOptions:
    """Options of `graduated-nonconvexity`.

    Parameters
    ----------
    inlier : float, optional
        c, the residual up to which a pair may be right, world units. None is a
        twentieth of the root mean square distance of the source points from their
        centroid, without strays, points more than 20 times as far out as the median
        point. That ignores the noise: give the bound if it is known.
    factor : float, default 1.4
        The factor by which μ grows in a step, 1.01 to 10.

    Raises
    ------
    ValueError
        If an option is out of its range.

    Examples
    --------
    >>> from solvers import options, register, scenes
    >>> scene = scenes.kabsch_scene("outliers")
    >>> bounded = options.GraduatedOptions(inlier=0.3)
    >>> register(scene.source, scene.target, "graduated-nonconvexity", options=bounded).detail("count")
    np.int64(10)
    """

    inlier: float | None = None
    factor: float = 1.4

    def __post_init__(self) -> None:
        if self.inlier is not None:
            validate.number(self.inlier, "inlier", 1e-100, 1e100)
        validate.number(self.factor, "factor", 1.01, 10.0)


@dataclass(frozen=True, eq=False)
class GraduatedState:
    """The pose fitted last; the objective is the truncated sum at `pose`, (b,).

    bound: (b,) c, world units. mu: (b,) the μ that the weights were computed with, 0 before the first step, infinite
    where no pair was in doubt. shares: (b, n) the weights v, 0 to 1, computed at `pose`. residuals: (b, n) at `pose`.
    count: (b,) pairs within c.
    """

    problem: Problem = field(metadata=CONSTANT)
    options: GraduatedOptions = field(metadata=SHARED)
    bound: FloatArray = field(metadata=CONSTANT)
    pose: Pose
    objective: FloatArray
    status: StatusArray
    reason: ReasonArray
    mu: FloatArray
    shares: FloatArray
    residuals: FloatArray
    count: IntArray

    __repr__ = brief


def tls_weights(ratio: FloatArray, mu: FloatArray) -> FloatArray:
    """The weights that minimise the surrogate of truncated least squares.

    ratio: (..., n) residuals over the bound, r/c. mu: (...) μ > 0, or infinite, where
    the surrogate is the truncated square. (..., n): 1 up to r² = μ/(μ + 1) c², 0 from
    r² = (μ + 1)/μ c² on, √(μ(μ + 1)) c/r − μ between (Yang et al. 2020).
    """
    hard = (ratio <= 1.0).astype(np.float64)
    soft = np.minimum(mu, _HARD_MU)[..., None]
    with np.errstate(divide="ignore", over="ignore", under="ignore"):
        between = np.sqrt(soft * (soft + 1.0)) / ratio - soft
    return np.where((mu >= _HARD_MU)[..., None], hard, np.clip(between, 0.0, 1.0))


def surrogate(ratio: FloatArray, mu: FloatArray) -> FloatArray:
    """The surrogate's value over c² at residuals r/c (..., n) and μ (...), (..., n)."""
    m = np.asarray(mu)[..., None]
    middle = 2.0 * ratio * np.sqrt(m * (m + 1.0)) - m * (1.0 + np.square(ratio))
    inner = np.square(ratio) <= m / (m + 1.0)
    outer = np.square(ratio) >= (m + 1.0) / m
    return np.where(inner, np.square(ratio), np.where(outer, 1.0, middle))


def _default_bound(problem: Problem) -> FloatArray:
    """The default bound, a share of the source's weighted RMS radius without strays, (b,)."""
    near = problem.weights > 0.0
    for cloud, row in zip(problem.source, near, strict=True):  # rows of zero weight must not shift the medians
        if row.any():
            row[row] = ~strays(cloud[None, row])[0]
    points, weights = np.where(near[..., None], problem.source, 0.0), np.where(near, problem.weights, 0.0)
    largest = np.abs(points).max(axis=(1, 2))
    most = weights.max(axis=1)
    share = weights / np.where(most > 0.0, most, 1.0)[:, None]
    share = share / np.maximum(share.sum(axis=1), 1.0)[:, None]
    unit = points / np.where(largest > 0.0, largest, 1.0)[:, None, None]
    centred = unit - (share[..., None] * unit).sum(axis=1)[:, None]
    mean = (share * np.square(centred).sum(axis=2)).sum(axis=1)
    bound: FloatArray = _SHARE * largest * np.sqrt(mean)
    return bound


def _measure(state: GraduatedState, pose: Pose) -> tuple[FloatArray, FloatArray, FloatArray]:
    """The residuals (b, n), the same divided by the bound, and the truncated sum (b,)."""
    problem, bound = state.problem, state.bound
    gaps = pose.apply(problem.source) - problem.target
    largest = np.abs(gaps).max(axis=2)
    # Divide first: a distance may fit a float64 where its square does not.
    unit = gaps / np.where(largest > 0.0, largest, 1.0)[..., None]
    residuals = largest * np.sqrt(np.square(unit).sum(axis=2))
    ratio = residuals / np.where(bound > 0.0, bound, 1.0)[:, None]
    truncated = np.square(np.minimum(residuals, bound[:, None]))
    return residuals, ratio, (problem.weights * truncated).sum(axis=1)


def _start(problem: Problem, options: GraduatedOptions) -> GraduatedState:
    b, n, _ = problem.source.shape
    with np.errstate(over="ignore", under="ignore"):
        bound = _default_bound(problem) if options.inlier is None else np.full(b, float(options.inlier))
    state = GraduatedState(
        problem=problem, options=options, bound=bound, pose=problem.start, objective=np.zeros(b),
        status=statuses((b,)), reason=reasons((b,)), mu=np.zeros(b), shares=np.ones((b, n)),
        residuals=np.zeros((b, n)), count=np.zeros(b, dtype=np.int64),
    )  # fmt: skip
    with np.errstate(over="ignore", under="ignore"):
        residuals, ratio, cost = _measure(state, problem.start)
    return changed(state, residuals=residuals, objective=cost, count=(ratio <= 1.0).sum(axis=1))


def _step(state: GraduatedState) -> GraduatedState:
    """Fit with the current weights, then update μ and the weights."""
    problem = state.problem
    fit = (fit_planar if problem.dim == 2 else fit_rigid)(
        problem.source, problem.target, problem.weights * state.shares
    )
    with np.errstate(over="ignore", under="ignore", divide="ignore"):
        residuals, ratio, cost = _measure(state, fit.pose)
        worst = np.where(problem.weights > 0.0, ratio, 0.0).max(axis=1)
        doubt = 2.0 * np.square(worst) - 1.0
        first = np.where(doubt > 0.0, np.maximum(1.0 / doubt, _LEAST_MU), np.inf)
        mu = np.where(state.mu > 0.0, state.options.factor * state.mu, first)
    shares = tls_weights(ratio, mu)

    open_ = fit.status == Status.DEGENERATE
    begun = state.mu > 0.0
    status, reason = state.status, state.reason
    for i in np.flatnonzero(open_):
        words = str(fit.reason[i])
        if begun[i]:
            words = f"the pairs left within {state.bound[i]:.3g} u do not determine a pose: {words}"
        status, reason = mark(status, reason, np.arange(problem.size) == i, Status.DEGENERATE, words)
    decided = ((shares == 0.0) | (shares == 1.0)) & (shares == state.shares)
    settled = (decided | (problem.weights == 0.0)).all(axis=1)
    status, reason = mark(status, reason, settled, Status.CONVERGED, "every pair is wholly in or wholly out")
    new = ~(open_ & begun)
    return changed(
        state,
        pose=put(state.pose, new, fit.pose[new]),
        objective=np.where(new, cost, state.objective),
        status=status,
        reason=reason,
        mu=np.where(new, mu, state.mu),
        shares=np.where(new[:, None], shares, state.shares),
        residuals=np.where(new[:, None], residuals, state.residuals),
        count=np.where(new, (ratio <= 1.0).sum(axis=1), state.count),
    )


GRADUATED = Method(
    name="graduated-nonconvexity",
    summary="the pose of the pairs that lie within a bound, found by a truncated square that is introduced gradually",
    source="Yang, Antonante, Tzoumas & Carlone 2020",
    start=_start,
    step=_step,
    options=GraduatedOptions,
    partners=lambda state: own_rows(state.shares * state.problem.weights > 0.0),
    paired=True,
    any_extent=True,
    weighted=True,
    dims=None,
    max_steps=200,
)
