"""The closed-form covariance of a registered pose, from the clouds at that pose."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, cast

import numpy as np
from numpy.typing import ArrayLike

from solvers.core import validate
from solvers.core.arrays import BoolArray, FloatArray, IntArray
from solvers.core.cloud_lists import one_by_one
from solvers.core.kinds import of_kind
from solvers.core.numbers import numbers
from solvers.core.result import Result
from solvers.core.status import Status
from solvers.geometry.nearest import Index
from solvers.geometry.spectral import symmetric_eigen
from solvers.numerics import gauss_newton
from solvers.uncertainty.matrices import from_scaled, stacked
from solvers.uncertainty.noise import covariances
from solvers.uncertainty.region import Covariance

POINT = ("icp", "trimmed-icp", "capped-icp", "kiss-threshold-icp")
HESSIAN = ("kabsch", *POINT, "point-to-plane", "gicp")
CENSI = ("kabsch", *POINT, "point-to-plane")
_ORDER = [2, 0, 1]  # from gauss_newton's (x, y, ρω) to this package's (ρω, x, y)


def covariance(
    result: Result,
    how: str = "hessian",
    *,
    sigma: ArrayLike | None = None,
    source_noise: ArrayLike | None = None,
    target_noise: ArrayLike | None = None,
    free_below: float = 1e-6,
) -> Covariance:
    """The covariance of registered poses, in closed form, from the pairs at those poses.

    Parameters
    ----------
    result : Result
        From `solvers.register`, in the plane: one problem, a batch or a list of clouds.
        For a list, each noise is one number for all or a list with one entry per cloud.
    how : str, default "hessian"
        "hessian", σ² (JᵀJ)⁻¹, for `kabsch`, `icp`, `trimmed-icp`, `capped-icp`,
        `kiss-threshold-icp`, `point-to-plane` and `gicp`; "censi", which carries the
        noise of every measured point through the minimum, for the same except `gicp`.
    sigma : array_like of shape (...), optional
        For "hessian": the standard deviation of a residual of weight 1, in world units,
        per coordinate if the residual is a vector; a residual of weight w is assumed to
        have σ/√w. For `gicp`, whose residuals are in units of its model, a
        dimensionless factor. None estimates it from the residuals.
    source_noise : array_like of shape (), (m,) or (..., m, 2, 2), optional
        For "censi": the source points' noise, as a standard deviation per coordinate in
        world units, one for all or one each, or as covariances in source coordinates,
        such as those of `range_bearing`. None treats the points as exact.
    target_noise : array_like of shape (), (n,) or (..., n, 2, 2), optional
        The same for the target points, in target coordinates. "censi" needs at least
        one of the two.
    free_below : float, default 1e-6
        The fraction of the Hessian's largest eigenvalue below which a direction is
        free.

    Returns
    -------
    Covariance
        In the frame "target", about the moved cloud's centre.

    Raises
    ------
    ValueError
        If `result` is not a Result, if its method has no such covariance, if it is not
        of the plane, if a noise is not finite, is negative or has a wrong shape, if it
        belongs to the other form, or if "censi" is given none.

    Notes
    -----
    Both hold to first order, at a minimum that the run has reached, for the pairs that
    it ended with: neither accounts for other pairs, or another start, leading
    elsewhere. "hessian" is exact to that order for `kabsch`, with isotropic noise whose
    variances are proportional to 1/w, if no two of the `pairs` share a point and
    `sigma` is given. With σ estimated from few residuals, its 95 % regions are too
    small: of 3 pairs they hold the truth in 77 % of draws, of 5 in 87 %, of 8 in 90 %,
    of 15 in 93 % and of 40 in 94 %. For the other methods it treats each point's
    partner and its normal as given and the residuals as independent, which makes it
    overconfident unless the points are precise. Of 100 redrawn pairs of scans of a
    room, with range noise of 0.04 u, its 95 % regions held the truth in about 89 with
    `point-to-plane`, 54 with `gicp`, 24 with `icp`, `capped-icp` and
    `kiss-threshold-icp`, and 10 with `trimmed-icp`; in a corridor in 51 with
    `point-to-plane`, 6 with `gicp` and none with `icp`.
    `solvers.uncertainty_study.coverage` counts this. The noisier the points are
    relative to their spacing, the less reliable the normals are: of 100 draws of
    `room("noise")`, σ = 0.11 u, the regions with `point-to-plane` held the truth in
    about 40, those of "censi" in
    92. Precise points turn the two round: what is left at corners counts as noise, and
    "censi" passes over it. Of 200
    pairs of scans of the room with a range noise of 0.01 u, the regions of "hessian"
    held the truth in 198, those of "censi" in 129; at 0.005 u in 200 and 48.

    "censi" differentiates the condition for the minimum, ∂E/∂x = 0, by pose and
    measurements: cov x = H⁻¹ (∂²E/∂x∂z) Σ_z (∂²E/∂x∂z)ᵀ H⁻¹, with H = ∂²E/∂x². A point
    that is the partner of several counts as one measurement (but not for given `pairs`,
    each of which counts as two points of its own), and with `point-to-plane` so do the
    neighbours that determine a normal. Weights are treated as constants. `gicp` is left
    out because its precisions, which depend on the pose, are frozen in each step.

    The deviation along a free direction is infinite. So is that of the turn where a
    degenerate run's partners cost the same at every angle, whatever `free_below` is.

    References
    ----------
    .. [1] A. Censi, "An accurate closed-form estimate of ICP's covariance", 2007.
       doi:10.1109/ROBOT.2007.363961
    .. [2] S. Bonnabel, M. Barczyk, F. Goulette, "On the covariance of ICP-based
       scan-matching techniques", 2014 (why pairs taken as given mislead point-to-point
       ICP). arXiv:1410.7632

    Examples
    --------
    >>> from solvers import register
    >>> from solvers.scenes import kabsch_scene
    >>> from solvers.uncertainty import covariance
    >>> scene = kabsch_scene("noisy")
    >>> found = register(scene.source, scene.target, "kabsch")
    >>> spread = covariance(found, sigma=0.12)
    >>> spread.deviations.round(3)
    array([0.033, 0.033, 0.033])
    >>> bool(spread.covers(scene.truth))
    True
    """
    methods = {"hessian": HESSIAN, "censi": CENSI}
    supported = methods[validate.one_of(how, methods, "how")]
    of_kind(result, Result, "result")
    if result.method not in supported:
        raise ValueError(
            f"result: {how!r} has no covariance for {result.method!r}; it has one for: {', '.join(supported)}"
        )
    if result.pose.dim != 2:
        raise ValueError(f"result: covariances are of the plane, the points have {result.pose.dim} coordinates")
    _noise_of_its_form(how, sigma, source_noise, target_noise)
    validate.number(free_below, "free_below", 0.0, 1.0)
    # For a list of one cloud, a noise may be a list of one entry; for a cloud of one point, that may also be the
    # point's.
    problem = result.states[0].problem
    alone = result.pose.batch == (1,) and any(
        isinstance(x, list | tuple) and len(x) == 1 and (np.ndim(cast(Any, x[0])) or cloud.shape[1] > 1)
        for x, cloud in ((source_noise, problem.source), (target_noise, problem.target))
    )
    if len(result.states) != 1 or alone:
        return _one_by_one(
            result, how, free_below, sigma=sigma, source_noise=source_noise, target_noise=target_noise
        )
    at = _pairs(result)
    J = gauss_newton.jacobian(at.moved - at.centre[:, None], at.radius)[..., _ORDER]
    with np.errstate(over="ignore", under="ignore", invalid="ignore"):
        if how == "hessian":
            matrix, free = _hessian(at, J, sigma, result.pose.batch, free_below, _any_angle(result))
        else:
            of_source, of_target = (0.0 if noise is None else noise for noise in (source_noise, target_noise))
            matrix, free = _censi(at, J, of_source, of_target, result.pose.batch, free_below)
    pose = result.pose
    shape = pose.batch
    return from_scaled(
        matrix.reshape(*shape, 3, 3), pose, at.centre.reshape(*shape, 2), at.radius.reshape(shape), "target", how,
        free.reshape(*shape, 3, 3),
    )  # fmt: skip


def _one_by_one(result: Result, how: str, below: float, **noises: ArrayLike | None) -> Covariance:
    """`covariance` of a list of clouds: computed one by one and stacked."""
    n = len(result.states)
    noise_entries: dict[str, Any] = {}
    for name, noise in noises.items():
        entries: Any = noise if isinstance(noise, list | tuple) or np.ndim(cast(Any, noise)) else [noise] * n
        if len(entries) != n:
            raise ValueError(f"{name}: expected one number, or an entry for each of {n} clouds, got {len(entries)}")
        noise_entries[name] = entries
    singles = one_by_one(
        n, lambda k: covariance(result[k], how, free_below=below, **{name: x[k] for name, x in noise_entries.items()})
    )
    return stacked(singles)


def _noise_of_its_form(how: str, sigma: Any, source_noise: Any, target_noise: Any) -> None:
    """Raise ValueError if a noise is given that the form would ignore, or if "censi" is given none."""
    if how == "censi" and sigma is not None:
        raise ValueError("sigma: 'censi' takes the points' noise instead: source_noise, target_noise or both")
    if how == "censi" and source_noise is None and target_noise is None:
        raise ValueError("source_noise: 'censi' needs it, or target_noise, or both")
    for name, noise in (("source_noise", source_noise), ("target_noise", target_noise)):
        if how == "hessian" and noise is not None:
            raise ValueError(f"{name}: 'hessian' takes sigma instead; how='censi' takes the points' noise")


def offered(result: Result) -> Covariance | None:
    """The value of `Result.covariance`: "hessian" with σ from the residuals, or None if there is none.

    Parameters
    ----------
    result : Result
        From `solvers.register`.

    Returns
    -------
    Covariance or None
        None for methods not in `HESSIAN`, in space, and for a pose with a scale.
    """
    planar = result.pose.dim == 2 and bool(np.all(np.abs(np.asarray(result.pose.scale) - 1.0) <= 1e-9))
    return covariance(result) if result.method in HESSIAN and planar else None


@dataclass(frozen=True, eq=False)
class _Pairs:
    """The pairs at b poses. moved, partners: (b, m, 2). precision: (b, m, 2, 2). weights: (b, m), 0 where unused.
    rows: (b, m) of the target. dims: of a residual. index, normals: of the target, (b, n, …), if normals matter;
    neighbours: how many determine a normal.
    """

    moved: FloatArray
    partners: FloatArray
    precision: FloatArray
    weights: FloatArray
    rows: IntArray
    turn: FloatArray
    count: int
    dims: int
    centre: FloatArray
    radius: FloatArray
    index: Index | None
    normals: FloatArray | None
    flagged: Any
    neighbours: int


def _pairs(result: Result) -> _Pairs:
    """The pairs that a run ended with. Points without a weight are placed at the centre."""
    state: Any = result.states[0]
    problem, pose = state.problem, state.pose
    if np.any(np.abs(np.asarray(pose.scale) - 1.0) > 1e-9):
        raise ValueError("result: covariances are of rigid motions, the pose has a scale")
    index, normals, flagged, dims, neighbours = None, None, None, 2, 0
    precision = np.broadcast_to(np.eye(2), (*problem.source.shape, 2))
    if result.method == "kabsch":
        moved, partners, weights = pose.apply(problem.source), problem.target, problem.weights
        rows = np.broadcast_to(np.arange(moved.shape[1]), moved.shape[:2])
    else:
        moved, rows, weights = state.pairing.moved, state.pairing.rows, state.pairing.weights
        partners = np.take_along_axis(state.index.points, rows[..., None], axis=1)
    if result.method in ("point-to-plane", "gicp"):
        precision = state.precision
    if result.method == "point-to-plane":
        dims, index, neighbours = 1, state.index, state.options.neighbours
        normals, flagged = state.normals.vectors, state.normals.flagged
    used = weights > 0.0
    total = np.maximum(used.sum(axis=1), 1)
    centre = np.where(used[..., None], moved, 0.0).sum(axis=1) / total[:, None]
    moved = np.where(used[..., None], moved, centre[:, None])
    partners = np.where(used[..., None], partners, centre[:, None])
    radius = np.sqrt(np.square(moved - centre[:, None]).sum(axis=(1, 2)) / total)
    radius = np.where(radius > 0.0, radius, 1.0)
    return _Pairs(
        moved, partners, precision, weights, rows, pose.R, problem.target.shape[1], dims, centre, radius,
        index, normals, flagged, neighbours,
    )  # fmt: skip


def _any_angle(result: Result) -> BoolArray:
    """Which runs are degenerate as their partners, at one place or mirrored, cost the same at every angle, (b,)."""
    state: Any = result.states[0]
    degenerate = np.asarray(state.status == Status.DEGENERATE)
    if result.method == "point-to-plane":  # its own system shows what is free
        return np.zeros_like(degenerate)
    return degenerate & ~state.system.free.any(axis=1) if result.method == "gicp" else degenerate


def _hessian(
    at: _Pairs, J: FloatArray, sigma: ArrayLike | None, batch: tuple[int, ...], below: float, any_angle: BoolArray
) -> tuple[FloatArray, FloatArray]:
    """σ² (JᵀMJ)⁻¹ and the free directions."""
    w = at.weights
    H = np.einsum("bm,bmip,bmij,bmjq->bpq", w, J, at.precision, J, optimize=True)
    if any_angle.any():
        # JᵀJ has the source's lever arms alone. Of the turn's entry, leave what the slides explain.
        slides = _inverse(H[:, 1:, 1:], below)[0]
        explained = (H[:, :1, 1:] @ slides @ H[:, 1:, :1])[:, 0, 0]
        H[:, 0, 0] = np.where(any_angle, explained, H[:, 0, 0])
    if sigma is not None:
        deviation = numbers(sigma, "sigma")
        try:
            s = np.broadcast_to(deviation, batch).reshape(-1)
        except ValueError:
            raise ValueError(f"sigma: expected one number, or shape {batch}, got {deviation.shape}") from None
        if not np.isfinite(s).all() or (s < 0.0).any():
            raise ValueError("sigma: expected a finite deviation that is not negative")
        variance = np.square(s)
    else:
        residuals = at.moved - at.partners
        # For a noiseless wall, rounding may leave the sum a little below zero.
        squares = np.maximum(np.einsum("bm,bmi,bmij,bmj->b", w, residuals, at.precision, residuals, optimize=True), 0.0)
        spare = at.dims * (w > 0.0).sum(axis=1) - 3
        # With as many unknowns as residuals, nothing is left to estimate the noise from.
        variance = np.where(spare > 0, squares / np.maximum(spare, 1), np.inf)
    inverse, free = _inverse(H, below)
    none = np.isinf(variance)
    free = np.where(none[:, None, None], np.eye(3), free)
    return np.where(none, 0.0, variance)[:, None, None] * np.where(none[:, None, None], 0.0, inverse), free


def _censi(
    at: _Pairs, J: FloatArray, source_noise: ArrayLike, target_noise: ArrayLike, batch: tuple[int, ...], below: float
) -> tuple[FloatArray, FloatArray]:
    """The noise carried through the minimum. E/2 = ½ Σ w (x − q)ᵀ M (x − q)."""
    b, m = at.weights.shape
    w = at.weights[..., None, None]
    pull = (at.precision @ (at.moved - at.partners)[..., None])[..., 0]
    arm = at.moved - at.centre[:, None]
    H = np.einsum("bm,bmip,bmij,bmjq->bpq", at.weights, J, at.precision, J, optimize=True)
    # The only second derivative of x = c + R(ω)(x − c) + v that is not zero: by the angle twice.
    H[:, 0, 0] -= (at.weights * np.einsum("bmi,bmi->bm", arm, pull)).sum(axis=1) / np.square(at.radius)
    by_target = -w * (J.swapaxes(-1, -2) @ at.precision)
    by_source = -by_target
    # The lever of the angle moves with its point.
    lever = np.stack([pull[..., 1], -pull[..., 0]], axis=-1) / at.radius[:, None, None]
    by_source[..., 0, :] += w[..., 0] * lever
    S = covariances(source_noise, "source_noise", batch, m)
    rotation = at.turn[:, None]
    noise_p = rotation @ S @ rotation.swapaxes(-1, -2)
    middle = np.einsum("bmpi,bmij,bmqj->bpq", by_source, noise_p, by_source, optimize=True)
    # Each target point counts once, however many pairs it is in.
    by_point = np.zeros((b, at.count, 3, 2))
    problems = np.arange(b)[:, None]
    np.add.at(by_point, (problems, at.rows), by_target)
    if at.index is not None:
        _add_normals(by_point, at, J)
    T = covariances(target_noise, "target_noise", batch, at.count)
    middle = middle + np.einsum("bnpi,bnij,bnqj->bpq", by_point, T, by_point, optimize=True)
    inverse, free = _inverse(H, below)
    return inverse @ middle @ inverse, free


def _add_normals(by_point: FloatArray, at: _Pairs, J: FloatArray) -> None:
    """Add the target points' effect through the normals: n turns by α when the points y of its neighbourhood move by
    dz, with α (λ₁ − λ₂) k = Σ (t·dz)(y·n) + (t·y)(n·dz), t across n.
    """
    assert at.index is not None
    assert at.normals is not None
    points = at.index.points
    b, n = points.shape[:2]
    problems = np.arange(b)[:, None]
    near, _ = at.index.nearest_k(points, min(at.neighbours + 1, n))
    y = points[problems[..., None], near]
    y = y - y.mean(axis=2, keepdims=True)
    values, _ = symmetric_eigen(y.swapaxes(-1, -2) @ y / y.shape[2])
    t = np.stack([-at.normals[..., 1], at.normals[..., 0]], axis=-1)
    gap = values[..., 0] - values[..., 1]
    across, along = (y @ at.normals[..., None]), (y @ t[..., None])
    turn = (across * t[:, :, None] + along * at.normals[:, :, None]) / y.shape[2]
    turn = np.where(at.flagged[..., None, None], 0.0, turn / np.where(gap < 0.0, gap, -1.0)[..., None, None])
    # For each pair, the derivative by the turn α of its normal: w Jᵀ [t (n·d) + n (t·d)].
    d = at.moved - at.partners
    n_i, t_i = at.normals[problems, at.rows], t[problems, at.rows]
    bent = t_i * (n_i * d).sum(-1, keepdims=True) + n_i * (t_i * d).sum(-1, keepdims=True)
    by_turn = at.weights[..., None] * (J.swapaxes(-1, -2) @ bent[..., None])[..., 0]
    of_point = np.zeros((b, n, 3))
    np.add.at(of_point, (problems, at.rows), by_turn)
    np.add.at(by_point, (problems[..., None], near), of_point[:, :, None, :, None] * turn[:, :, :, None, :])


def _inverse(H: FloatArray, below: float) -> tuple[FloatArray, FloatArray]:
    """The inverses of H (b, p, p) outside its free directions, and those directions (b, p, p), one per column, zero
    for the others.
    """
    size = np.abs(H).max(axis=(1, 2))
    sound = np.asarray((size > 1e-300) & (size < np.inf))  # eigh does not converge on subnormal numbers
    values, vectors = np.linalg.eigh(np.where(sound[:, None, None], H, 0.0))
    null: BoolArray = np.asarray(~(values > below * np.maximum(values[:, -1:], 0.0)))
    reciprocal = np.where(null, 0.0, 1.0 / np.where(null, 1.0, values))
    inverse = (vectors * reciprocal[:, None]) @ vectors.swapaxes(1, 2)
    return inverse, np.where(null[:, None], vectors, 0.0)
