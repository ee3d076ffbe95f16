"""The pose that best aligns known partners: weighted rigid and similarity fits, in closed
form.

Row i of `source` and row i of `target` are partners. Both functions minimise
`Σ wᵢ ‖s R pᵢ + t − qᵢ‖²` over rotations R, translations t and, optionally, scales s. The
optimum needs no starting pose; it is only the optimum of that objective, which noise and
wrong pairs move away from the true motion.

Sources: Arun, Huang & Blostein 1987, Least-squares fitting of two 3-D point sets;
Umeyama 1991, Least-squares estimation of transformation parameters between two point
patterns, eqs. 39-43 (the determinant's correction and the scale); Kabsch 1976, A
solution for the best rotation to relate two sets of vectors.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from solvers.core import validate
from solvers.core.arrays import AnyArray, BoolArray, FloatArray, ReasonArray, StatusArray
from solvers.core.brief import brief
from solvers.core.pose import Pose
from solvers.core.status import Status, ended, reasons, statuses
from solvers.geometry.moments import Moments, checked, moments, why


@dataclass(frozen=True, eq=False)
class Fit:
    """The answer of a closed-form fit, one per problem of the batch.

    A single problem gives numpy scalars and a `Status`. Below, Λ, U and V are those of
    `H = U Λ Vᵀ`, the weighted correlation of the centred clouds (`fit_rigid`).

    Attributes
    ----------
    pose : Pose
        The optimum. If degenerate, the translation between the centroids with no
        rotation and scale 1 (the identity if all weights are zero).
    status : ndarray of int8, shape (...), or Status
        `Status.CONVERGED` or `Status.DEGENERATE`; a `Status` for a single problem.
    reason : ndarray of object, shape (...), or str
        Why it is degenerate, in words; empty otherwise.
    singular_values : ndarray of shape (..., d)
        The singular values of H, largest first, in squared world units.
    determinant : ndarray of int8, shape (...)
        det(V Uᵀ): +1; −1 if the best orthogonal matrix is a reflection; 0 if H is
        singular to rounding, so that a rotation and a reflection fit equally well.
    cost : ndarray of shape (...)
        The weighted sum of squared residuals at `pose`.
    condition : ndarray of shape (...)
        ‖H‖ / (λ_{d−1} ± λ_d): the relative error of H times this bounds the error of R
        in radians, up to a small factor. Infinite if degenerate. In the plane the
        denominator is hypot(S, C), see `fit_planar`.

    Examples
    --------
    >>> from solvers import Status, fit_rigid
    >>> fit = fit_rigid([[0.0, 0.0], [1.0, 0.0]], [[0.0, 0.0], [0.0, 2.0]], scale=True)
    >>> fit.pose.scale.round(6)
    np.float64(2.0)
    >>> fit.status is Status.CONVERGED, fit.ended
    (True, True)
    >>> fit.singular_values.round(6)
    array([1., 0.])
    """

    pose: Pose
    status: StatusArray | Status
    reason: ReasonArray | str
    singular_values: FloatArray
    determinant: AnyArray
    cost: FloatArray
    condition: FloatArray

    __repr__ = brief

    @property
    def ended(self) -> BoolArray | bool:
        """Whether the pairs determine the pose, (...): as `Result.ended`, true unless degenerate."""
        return ended(self.status)


def fit_rigid(
    source: ArrayLike, target: ArrayLike, weights: ArrayLike | None = None, *, scale: bool = False, proper: bool = True
) -> Fit:
    """The weighted least-squares pose of known partners, by singular value decomposition.

    With p̃, q̃ the clouds relative to their weighted centroids p̄, q̄:

        H = Σ wᵢ p̃ᵢ q̃ᵢᵀ = U Λ Vᵀ,   D = diag(1, …, 1, det(V Uᵀ)),
        R = V D Uᵀ,   s = tr(Λ D) / Σ wᵢ ‖p̃ᵢ‖²  (or 1),   t = q̄ − s R p̄.

    Parameters
    ----------
    source : array_like of shape (..., n, d)
        The points to move, in world units, d ≥ 2.
    target : array_like of shape (..., n, d)
        Their partners, row by row.
    weights : array_like of shape (..., n), optional
        Weights of the pairs, not negative. None means all ones.
    scale : bool, default False
        Whether to fit a scale too (Umeyama's similarity).
    proper : bool, default True
        Whether to keep det R = +1. False gives the best orthogonal matrix, which may be
        a reflection and then is not a rigid motion.

    Returns
    -------
    Fit
        The pose that minimises `Σ wᵢ ‖s R pᵢ + t − qᵢ‖²`, and how well it is
        determined.

    Raises
    ------
    ValueError
        If the clouds are not finite, not matched row by row, or do not broadcast, if a
        weight is negative, or if `scale` or `proper` is neither True nor False.

    Notes
    -----
    A fit is degenerate if all weights are zero, if the source or target points are
    equal, if the points span fewer than d − 1 dimensions (collinear in 3-D), or if H
    leaves the rotation undefined although the points spread. All are judged to
    rounding.

    References
    ----------
    .. [1] K. S. Arun, T. S. Huang, S. D. Blostein, "Least-squares fitting of two 3-D
       point sets", 1987. doi:10.1109/TPAMI.1987.4767965
    .. [2] S. Umeyama, "Least-squares estimation of transformation parameters between
       two point patterns", 1991, eqs. 39-43 (the determinant's correction and the
       scale). doi:10.1109/34.88573
    .. [3] W. Kabsch, "A solution for the best rotation to relate two sets of vectors",
       1976. doi:10.1107/S0567739476001873

    Examples
    --------
    >>> import numpy as np
    >>> from solvers import Pose, fit_rigid
    >>> source = np.array([[0.0, 0.0], [2.0, 0.0], [2.0, 1.0], [0.0, 1.0]])
    >>> truth = Pose.from_angle(np.radians(30.0), (1.0, -2.0), scale=1.5)
    >>> fit = fit_rigid(source, truth.apply(source), scale=True)
    >>> np.degrees(fit.pose.angle).round(6), fit.pose.scale.round(6)
    (np.float64(30.0), np.float64(1.5))
    >>> fit.pose.t.round(6)
    array([ 1., -2.])
    """
    scale, proper = validate.flag(scale, "scale"), validate.flag(proper, "proper")
    pairs = checked(source, target, weights)
    m = moments(*pairs)
    return _fit(pairs, m, _spatial(m, proper), scale)


def fit_planar(
    source: ArrayLike, target: ArrayLike, weights: ArrayLike | None = None, *, scale: bool = False
) -> Fit:
    """The fit of `fit_rigid` in the plane, with its angle in closed form: `θ = atan2(S, C)`.

    Here `S = Σ wᵢ p̃ᵢ × q̃ᵢ` and `C = Σ wᵢ p̃ᵢ · q̃ᵢ`, with `a × b = aₓ b_y − a_y bₓ`.
    The angle agrees with that of `fit_rigid` to `1e-14 ‖H‖ / hypot(S, C)`; degenerate
    cases are the same.

    Parameters
    ----------
    source : array_like of shape (..., n, 2)
        The points to move, in world units.
    target : array_like of shape (..., n, 2)
        Their partners, row by row.
    weights : array_like of shape (..., n), optional
        Weights of the pairs, not negative. None means all ones.
    scale : bool, default False
        Whether to fit a scale too.

    Returns
    -------
    Fit
        The pose that minimises `Σ wᵢ ‖s R pᵢ + t − qᵢ‖²`, and how well it is
        determined.

    Raises
    ------
    ValueError
        If the clouds are not planar, not finite, not matched row by row, or do not
        broadcast, if a weight is negative, or if `scale` is neither True nor False.

    References
    ----------
    .. [1] S. Umeyama, "Least-squares estimation of transformation parameters between
       two point patterns", 1991, eqs. 39-43, here for d = 2. doi:10.1109/34.88573

    Examples
    --------
    >>> import numpy as np
    >>> from solvers import fit_planar
    >>> fit = fit_planar([[1.0, 0.0], [-1.0, 0.0]], [[0.0, 1.0], [0.0, -1.0]])
    >>> np.degrees(fit.pose.angle).round(6)
    np.float64(90.0)
    >>> fit.condition.round(6)
    np.float64(1.0)
    """
    scale = validate.flag(scale, "scale")
    pairs = checked(source, target, weights, dim=2)
    m = moments(*pairs)
    return _fit(pairs, m, _planar(m), scale)


def best_rotation(H: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """The rotation R with the largest `tr(R H)`.

    The core of the fits above, for callers that already have H: they judge what is zero
    to rounding.

    Parameters
    ----------
    H : ndarray of shape (..., d, d)
        The correlation `Σ wᵢ p̃ᵢ q̃ᵢᵀ`.

    Returns
    -------
    R : ndarray of shape (..., d, d)
        The rotation; zero in the plane if H leaves it undetermined.
    trace : ndarray of shape (...)
        `tr(R H)`, which divided by `Σ wᵢ ‖p̃ᵢ‖²` is the best scale.
    gap : ndarray of shape (...)
        How well H determines R: zero if it does not.
    """
    if H.shape[-1] == 2:
        R, turn = _turn(H)
        return R, turn, turn
    V, values, Ut, sign = _signed_svd(H)
    return *_joined(V, values, Ut, sign), values[..., -2] + sign * values[..., -1]


def _joined(V: FloatArray, values: FloatArray, Ut: FloatArray, flip: AnyArray) -> tuple[FloatArray, FloatArray]:
    """`V D Uᵀ` and `tr(Λ D)`, with the last entry of D set to `flip`."""
    D = np.ones_like(values)
    D[..., -1] = flip
    return (V * D[..., None, :]) @ Ut, (values * D).sum(axis=-1)


def _turn(H: FloatArray) -> tuple[FloatArray, FloatArray]:
    """In the plane: the rotation by atan2(S, C), and hypot(S, C), the trace of R H.
    If S and C are both zero, so is R.
    """
    C, S = H[..., 0, 0] + H[..., 1, 1], H[..., 0, 1] - H[..., 1, 0]
    turn = np.hypot(S, C)
    safe = np.where(turn > 0.0, turn, 1.0)
    R = np.empty(H.shape)
    R[..., 0, 0] = R[..., 1, 1] = C / safe
    R[..., 1, 0] = S / safe
    R[..., 0, 1] = -R[..., 1, 0]
    return R, turn


def _signed_svd(H: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray, AnyArray]:
    """V, the singular values, Uᵀ and the sign of det(V Uᵀ) of `H = U Λ Vᵀ`."""
    U, values, Vt = np.linalg.svd(H)
    V, Ut = Vt.swapaxes(-1, -2), U.swapaxes(-1, -2)
    return V, values, Ut, np.where(np.linalg.det(V) * np.linalg.det(Ut) < 0.0, -1, 1).astype(np.int8)


def pair_cost(pose: Pose, source: FloatArray, target: FloatArray, weights: FloatArray) -> FloatArray:
    """The sum `Σ wᵢ ‖T pᵢ − qᵢ‖²` that the fits minimise.

    For arrays of the shapes that `fit_rigid` takes, which are not checked here. Infinite
    if the sum overflows, never NaN.
    """
    with np.errstate(over="ignore", under="ignore", invalid="ignore"):
        residuals = pose.apply(source) - target
        squares = np.einsum("...nd,...nd->...n", residuals, residuals)
        total: FloatArray = np.where(weights > 0.0, weights * squares, 0.0).sum(axis=-1)
        return np.where(np.isnan(total), np.inf, total)


def closed_form_step(
    source: FloatArray, target: FloatArray, weights: FloatArray
) -> tuple[Pose, BoolArray, ReasonArray, FloatArray]:
    """The rigid fit alone, for a step of a run: its pose, where it is degenerate and why, and
    its condition.

    The same numbers as those of `fit_planar` or `fit_rigid`, for clouds (b, n, d) and
    weights (b, n) that have already been checked.
    """
    m = moments(source, target, weights)
    if source.shape[-1] == 2:
        R, _, values, _, gap = _planar(m)
    else:
        R, _, values, _, gap = _spatial(m, proper=True)
    pose, bad = _pose(m, R, np.zeros(gap.shape), gap, scale=False)
    return pose, bad, _reasons(m, bad), _condition(values, gap, bad)


Turned = tuple[FloatArray, FloatArray, FloatArray, AnyArray, FloatArray]
"""R, tr(Λ D), the singular values, the determinant and how well H determines R."""


def _planar(m: Moments) -> Turned:
    H = m.H
    R, turn = _turn(H)
    # The trace for the best reflection; the two singular values are half the sum and half
    # the difference.
    mirror = np.hypot(H[..., 0, 0] - H[..., 1, 1], H[..., 0, 1] + H[..., 1, 0])
    values = np.stack([0.5 * (turn + mirror), 0.5 * np.abs(turn - mirror)], axis=-1)
    sign = np.where(values[..., 1] <= m.tolerance, 0, np.where(turn < mirror, -1, 1)).astype(np.int8)
    return R, turn, values, sign, turn


def _spatial(m: Moments, proper: bool) -> Turned:
    V, values, Ut, sign = _signed_svd(m.H)
    # If H is singular to rounding, the sign of its determinant is arbitrary, and the
    # rotation is as good as the reflection.
    tied = values[..., -1] <= m.tolerance
    flip = np.where(tied | proper, sign, np.int8(1))
    R, trace = _joined(V, values, Ut, flip)
    gap = values[..., -2] + (sign if proper else 1) * values[..., -1]
    return R, trace, values, np.where(tied, np.int8(0), sign), gap


def _pose(
    m: Moments, R: FloatArray, trace: FloatArray, gap: FloatArray, scale: bool
) -> tuple[Pose, BoolArray]:
    """The pose with this rotation, and where it is undefined."""
    ep, eq, _ = m.exponents
    bad = m.still_p | m.still_q | (gap <= m.tolerance) | m.weightless
    if bad.any():
        R = np.where(bad[..., None, None], np.eye(R.shape[-1]), R)
    s = np.ones(bad.shape)
    if scale:
        # The ratio for the divided clouds, multiplied back; a ratio beyond float64 is not
        # a scale either.
        with np.errstate(over="ignore", under="ignore"):
            s = np.ldexp(np.where(bad, 1.0, trace / np.where(bad, 1.0, m.square_p)), np.where(bad, 0, eq - ep))
    mean_p, mean_q = np.ldexp(m.mean_p, ep[..., None]), np.ldexp(m.mean_q, eq[..., None])
    return Pose.trusted(R, mean_q - s[..., None] * (R @ mean_p[..., None])[..., 0], s), bad


def _condition(values: FloatArray, gap: FloatArray, bad: BoolArray) -> FloatArray:
    with np.errstate(over="ignore", under="ignore"):
        return np.where(bad, np.inf, np.sqrt((values * values).sum(axis=-1)) / np.where(bad, 1.0, gap))


def _reasons(m: Moments, bad: BoolArray) -> ReasonArray:
    reason = reasons(bad.shape)
    for i in np.argwhere(bad):
        reason[tuple(i)] = why(m, tuple(i))
    return reason


def _fit(
    pairs: tuple[FloatArray, FloatArray, FloatArray], m: Moments, rotation: Turned, scale: bool
) -> Fit:
    """The complete `Fit` for a rotation."""
    R, trace, values, sign, gap = rotation
    pose, bad = _pose(m, R, trace, gap, scale)
    with np.errstate(over="ignore", under="ignore"):
        cost = pair_cost(pose, *pairs)
        ep, eq, ew = m.exponents
        singular = np.ldexp(values, (ep + eq + ew)[..., None])
    status = np.where(bad, np.int8(Status.DEGENERATE), statuses(bad.shape, Status.CONVERGED))
    condition = _condition(values, gap, bad)
    outcome = status if status.ndim else Status(int(status))
    return Fit(pose, outcome, _reasons(m, bad)[()], singular, sign[()], cost[()], condition[()])
