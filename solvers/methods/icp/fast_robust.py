"""Fast and robust ICP.

Welsch's loss with a threshold that shrinks in stages, and Anderson-accelerated steps.

For a fixed ν the energy `E_ν(T) = Σ w_i 2ν² (1 − exp(−r_i² / 2ν²))`, r_i the distance
of moved point i to its nearest target point, is lowered by majorisation: pair with the
nearest, weight by `exp(−r²/2ν²)`, fit. Call that step `G(x)`. It converges slowly, so
each step also proposes a pose extrapolated from the last `history` steps,

    f_k = G(x_k) − x_k,   θ = argmin ‖f_k − Σ_j θ_j (f_{k−j+1} − f_{k−j})‖,
    x = G(x_k) − Σ_j θ_j (G(x_{k−j+1}) − G(x_{k−j})),

which is kept only if its energy lies below that of x_k; otherwise the step is `G(x_k)`,
whose energy never lies above. After such a refusal the differences gathered so far are
dropped. In the code that the authors of [1]_ published they stay, and the next proposal
is made from them: `forget=False`. In the race's rooms that took more steps and found no
more poses. The pose's coordinates x are a rotation vector times the source's RMS radius
and the position of its moved centroid, both relative to `G(x_k)`: all are lengths,
comparable in any unit and about any origin, and far from any wrap-around.

ν begins at three times the median distance of the starting pairs and is halved whenever
a stage has come to rest, until it is the target's spacing over 3√3, the spacing being
the median, over its points, of the median distance to the six nearest others. A smaller
ν means a smaller energy for the same pose, so the objective never rises over the whole
run.

Left out: the point-to-plane variant. Difference: the paper takes the logarithm of the
whole matrix as coordinates.

References
----------
.. [1] J. Zhang, Y. Yao, B. Deng, "Fast and robust iterative closest point", 2021, secs.
   3.1 to 3.3 (energy, acceleration, ν). doi:10.1109/TPAMI.2021.3054619
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from solvers.core import validate
from solvers.core.arrays import BoolArray, FloatArray, IntArray, ReasonArray, StatusArray
from solvers.core.brief import brief
from solvers.core.method import Method, Problem
from solvers.core.pose import Pose
from solvers.core.status import Status, mark, reasons, statuses
from solvers.core.tree import CONSTANT, SHARED, changed, put, take
from solvers.geometry import nearest
from solvers.geometry.nearest import Index
from solvers.methods.icp.icp import one_partner, partners
from solvers.numerics import robust
from solvers.numerics.fits import fit_pairs, rms_motion, weighted_centroid, weighted_radius
from solvers.numerics.gauss_newton import rotation

NO_WEIGHT = "every pair's weight is zero"


@dataclass(frozen=True)
class FastRobustOptions:
    """Options of `fast-robust-icp`.

    Parameters
    ----------
    first : float, optional
        The first ν, world units. None is three times the median distance of the
        starting pairs.
    last : float, optional
        The last ν, world units. None is the target's spacing over 3√3: the median, over
        its points, of the median distance to the six nearest others. Equal points count
        as one.
    history : int, default 5
        The number of past steps that an extrapolation uses, 0 for none.
    forget : bool, default True
        Whether the past steps are dropped when an extrapolated pose is refused. False
        keeps them, as the authors' code does.
    tolerance : float, default 1e-6
        The last stage ends when a step's RMS motion of the source points is at most
        this fraction of their RMS radius.
    rough : float, default 1e-3
        The same fraction for the stages before the last.

    Raises
    ------
    ValueError
        If an option is out of its range.

    Examples
    --------
    >>> from solvers import options, register
    >>> from solvers.scenes import room
    >>> scene = room("clean")
    >>> coarse = options.FastRobustOptions(last=0.1)
    >>> register(scene.source, scene.target, "fast-robust-icp", options=coarse).detail("nu")
    np.float64(0.1)
    """

    first: float | None = None
    last: float | None = None
    history: int = 5
    forget: bool = True
    tolerance: float = 1e-6
    rough: float = 1e-3

    def __post_init__(self) -> None:
        validate.widths(self.first, self.last)
        validate.count(self.history, "history")
        validate.flag(self.forget, "forget")
        validate.number(self.tolerance, "tolerance", 0.0)
        validate.number(self.rough, "rough", 0.0)


@dataclass(frozen=True, eq=False)
class Welsch:
    """The pairs at a pose: moved (b, m, d), rows, distances and weights (b, m), energy (b,), weighted rms (b,)."""

    moved: FloatArray
    rows: IntArray
    distances: FloatArray
    weights: FloatArray
    energy: FloatArray
    rms: FloatArray

    __repr__ = brief


@dataclass(frozen=True, eq=False)
class FastRobustState:
    """A pose with its pairs and energy (the objective) for the threshold `nu` (b,).

    last: (b,) ν of the last stage. accelerated: (b,) whether the last step kept the extrapolated pose. past_x, past_g:
    the poses x_k and G(x_k) of the steps so far, newest first, (b, history + 1), of which `depth` (b,) count: those
    since the stage began or, with `forget`, since an extrapolation was refused. centre: (b, d) the source's centroid.
    radius, change, condition: as in `icp.IcpState`.
    """

    problem: Problem = field(metadata=CONSTANT)
    index: Index = field(metadata=CONSTANT)
    radius: FloatArray = field(metadata=CONSTANT)
    centre: FloatArray = field(metadata=CONSTANT)
    last: FloatArray = field(metadata=CONSTANT)
    options: FastRobustOptions = field(metadata=SHARED)
    pose: Pose
    objective: FloatArray
    status: StatusArray
    reason: ReasonArray
    pairing: Welsch
    nu: FloatArray
    accelerated: BoolArray
    past_x: Pose
    past_g: Pose
    depth: IntArray
    change: FloatArray
    condition: FloatArray

    __repr__ = brief


def _pair(problem: Problem, index: Index, nu: FloatArray, pose: Pose) -> Welsch:
    with np.errstate(over="ignore", under="ignore", invalid="ignore"):
        moved = pose.apply(problem.source)
        rows, squares = index.nearest(moved)
        return _weigh(problem, moved, rows, np.sqrt(squares), nu)


def _weigh(problem: Problem, moved: FloatArray, rows: IntArray, distances: FloatArray, nu: FloatArray) -> Welsch:
    with np.errstate(over="ignore", under="ignore", invalid="ignore"):
        weights = problem.weights * robust.run_weights("welsch", distances, nu)
        energy = (problem.weights * 2.0 * robust.run_loss("welsch", distances, nu)).sum(axis=1)
        total = weights.sum(axis=1)
        squares = np.where(weights > 0.0, weights * np.square(distances), 0.0).sum(axis=1)
        rms = np.sqrt(squares / np.where(total > 0.0, total, 1.0))
    return Welsch(moved, rows, distances, weights, energy, rms)


def spacing(index: Index, points: FloatArray) -> FloatArray:
    """The median, over the points (b, n, d) of an index, of the median distance to the
    six nearest others, (b,). Equal points count as one; it is 0 if all are equal.
    """
    k = min(7, points.shape[1])
    _, squares = index.nearest_k(points, k)
    others = np.sqrt(squares[..., 1:]) if k > 1 else np.zeros((*squares.shape[:2], 1))
    medians: FloatArray = np.median(np.median(others, axis=2), axis=1)
    for i in np.flatnonzero((others == 0.0).any(axis=(1, 2))):
        places = np.unique(points[i], axis=0)[None]
        if 1 < places.shape[1] < points.shape[1]:
            medians[i] = spacing(nearest.build(places), places)[0]
    return medians


def _start(problem: Problem, options: FastRobustOptions) -> FastRobustState:
    b, depth = problem.size, options.history + 1
    index = nearest.build(problem.target)
    with np.errstate(over="ignore", under="ignore"):
        _, squares = index.nearest(problem.start.apply(problem.source))
        weighted = (problem.weights > 0.0) & np.isfinite(squares)
        median = robust.mad_scale(np.sqrt(squares), weighted, 0.0) / 1.4826
        first = 3.0 * median if options.first is None else np.full(b, options.first)
        least = spacing(index, problem.target) / (3.0 * np.sqrt(3.0)) if options.last is None else options.last
        least = np.minimum(least, first) if options.first is not None and options.last is None else least
        # Repeated points have zero spacing and perfect pairs zero distance: keep the threshold above zero.
        last = np.maximum(least, np.maximum(1e-6 * first, 1e-100))
        nu = np.maximum(first, last)
    pairing = _pair(problem, index, nu, problem.start)
    weightless: BoolArray = pairing.weights.max(axis=1) <= 0.0
    status, reason = mark(statuses((b,)), reasons((b,)), weightless, Status.DEGENERATE, NO_WEIGHT)
    many = Pose.trusted(*(np.repeat(np.asarray(x)[:, None], depth, axis=1) for x in (problem.start.R, problem.start.t)))
    return FastRobustState(
        problem=problem, index=index, radius=weighted_radius(problem.source, problem.weights),
        centre=weighted_centroid(problem.source, problem.weights), last=last, options=options,
        pose=problem.start, objective=pairing.energy, status=status, reason=reason, pairing=pairing, nu=nu,
        accelerated=np.zeros(b, dtype=np.bool_), past_x=many, past_g=many, depth=np.zeros(b, dtype=np.int64),
        change=np.full(b, np.inf), condition=np.full(b, np.inf),
    )  # fmt: skip


def _step(state: FastRobustState) -> FastRobustState:
    problem, at, options = state.problem, state.pairing, state.options
    partners = nearest.picked(state.index.points, at.rows)
    plain, reason, condition = fit_pairs(state.pose, problem.source, partners, at.weights)
    free = one_partner(reason, state.index, at.rows, at.weights)
    past_x, past_g = _push(state.past_x, state.pose), _push(state.past_g, plain)
    depth = np.minimum(state.depth + 1, options.history + 1)

    # The proposal where there is a history, else the plain step; back to the plain step where the proposal did not
    # help.
    proposed = (depth > 1) & (free == "")
    pose = plain
    if proposed.any():
        ahead = _extrapolated(past_x, past_g, depth, state.radius, state.centre)
        pose = put(plain, proposed, ahead[proposed])
    pairing = _pair(problem, state.index, state.nu, pose)
    worse = proposed & ~(pairing.energy < at.energy)
    if worse.any():
        pose = put(pose, worse, plain[worse])
        pairing = put(
            pairing, worse, _pair(take(problem, worse), take(state.index, worse), state.nu[worse], pose[worse])
        )
    with np.errstate(over="ignore", under="ignore", invalid="ignore"):
        change = rms_motion(pairing.moved - at.moved, problem.weights) / state.radius

    final = state.nu <= state.last
    at_rest = change <= np.where(final, options.tolerance, max(options.rough, options.tolerance))
    weightless: BoolArray = pairing.weights.max(axis=1) <= 0.0
    status, reason = mark(state.status, state.reason, weightless, Status.DEGENERATE, NO_WEIGHT)
    status, reason = mark(status, reason, (free != "") & at_rest, Status.DEGENERATE, free)
    status, reason = mark(status, reason, at_rest & final, Status.CONVERGED, "the pose has come to rest at the last ν")
    nu = np.where(at_rest & ~final, np.maximum(0.5 * state.nu, state.last), state.nu)
    if (nu != state.nu).any():
        pairing = _weigh(problem, pairing.moved, pairing.rows, pairing.distances, nu)
    return changed(
        state, pose=pose, objective=pairing.energy, status=status, reason=reason, pairing=pairing, nu=nu,
        accelerated=proposed & ~worse, past_x=past_x, past_g=past_g,
        depth=np.where((worse & options.forget) | (nu != state.nu), 0, depth), change=change, condition=condition,
    )  # fmt: skip


def _push(past: Pose, pose: Pose) -> Pose:
    """The past poses with the new one in front and the oldest dropped."""
    return Pose.trusted(
        np.concatenate([pose.R[:, None], past.R[:, :-1]], axis=1),
        np.concatenate([pose.t[:, None], past.t[:, :-1]], axis=1),
    )


def _extrapolated(
    past_x: Pose, past_g: Pose, depth: IntArray, radius: FloatArray, centre: FloatArray
) -> Pose:
    """Anderson's extrapolation from the poses x_k and G(x_k), newest first, of which the first `depth` (b,) count."""
    origin = past_g[:, :1]
    x, g = (_coordinates(p, origin, radius[:, None], centre[:, None]) for p in (past_x, past_g))
    f = g - x
    valid = (np.arange(x.shape[1] - 1) + 1 < depth[:, None])[..., None]
    # Rows are differences of consecutive steps; a row of zeros takes no part.
    df, dg = (np.where(valid, a[:, :-1] - a[:, 1:], 0.0) for a in (f, g))
    # Beyond float64's range there is nothing to extrapolate, and the SVD would fail.
    df = np.where(np.isfinite(df), df, 0.0)
    theta = f[:, None, 0] @ np.linalg.pinv(df, rcond=1e-10)
    return _posed((g[:, None, 0] - theta @ dg)[:, 0], origin[:, 0], radius, centre)


def _coordinates(poses: Pose, origin: Pose, radius: FloatArray, centre: FloatArray) -> FloatArray:
    """Rotation vector (one number in the plane) times `radius` (…) and moved `centre`
    (…, d), relative to `origin`: (…, 1 + 2) or (…, 3 + 3).
    """
    relative = Pose.trusted(poses.R @ origin.R.swapaxes(-1, -2), np.zeros(poses.dim))
    vector = relative.rotvec if poses.dim == 3 else np.asarray(relative.angle)[..., None]
    shift = ((poses.R - origin.R) @ centre[..., None])[..., 0] + poses.t - origin.t
    return np.concatenate([radius[..., None] * vector, shift], axis=-1)


def _posed(x: FloatArray, origin: Pose, radius: FloatArray, centre: FloatArray) -> Pose:
    """The poses (b,) at the coordinates x."""
    d = origin.dim
    vector = x[:, :-d] / radius[:, None]
    R = rotation(vector) @ origin.R
    return Pose.trusted(R, origin.t + x[:, -d:] - ((R - origin.R) @ centre[..., None])[..., 0])


FAST_ROBUST = Method(
    name="fast-robust-icp",
    summary="ICP on Welsch's loss, its threshold shrinking in stages, its steps extrapolated where that lowers it",
    source="Zhang, Yao & Deng 2021",
    start=_start,
    step=_step,
    partners=partners,
    options=FastRobustOptions,
    weighted=True,
    dims=(2, 3),
)
