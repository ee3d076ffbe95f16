"""Iterative closest point and its two descent variants.

Pair every point with its nearest neighbour, fit, repeat.

One step fits the pairs in closed form, then pairs again at the new pose, so a state's
pose, pairs and objective belong together. With r_i the distance of moved point i to its
nearest target point and w_i its weight:

- `icp` uses the pairs within `gate`, less the farthest fraction `trim` of them. Its
  objective is the sum over the pairs used. Without gate and trim,
  `E(T) = Σ w_i min_j ‖T p_i − q_j‖²` never rises; with them the set of pairs changes,
  and both the sum and the RMS may rise.
- `trimmed-icp` always uses the same number of pairs, the nearest: the sum of the
  `count` smallest r² never rises.
- `capped-icp` uses the pairs within `cap` and counts every other pair as if it lay at
  the cap: `Σ w_i min(r_i², cap²)` never rises.

With a robust weight (`solvers.numerics.robust`) the fit is reweighted and 2ρ(r) takes
the place of r². The descent then holds for a fixed `scale`; one re-estimated from the
distances at every step changes the objective as it goes.

It is the objective's value that converges, to a local optimum at best. Coming to rest
says nothing about the truth.

References
----------
.. [1] P. J. Besl, N. D. McKay, "A method for registration of 3-D shapes", 1992, sec. IV
   (the descent, with exact neighbours and fits). doi:10.1109/34.121791
.. [2] D. Chetverikov, D. Svirko, D. Stepanov, P. Krsek, "The trimmed iterative closest
   point algorithm", 2002, sec. 2 (left out: the search for the overlap).
   doi:10.1109/ICPR.2002.1047997
.. [3] S. Rusinkiewicz, M. Levoy, "Efficient variants of the ICP algorithm", 2001 (gate
   and trim as stages). doi:10.1109/IM.2001.924423
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from solvers.core.arrays import BoolArray, FloatArray, IntArray, ReasonArray, StatusArray
from solvers.core.brief import brief
from solvers.core.extent import at_one_place
from solvers.core.method import Method, Problem
from solvers.core.partners import chosen
from solvers.core.pose import Pose
from solvers.core.status import Status, mark, reasons, statuses
from solvers.core.tree import CONSTANT, SHARED, changed
from solvers.geometry import nearest
from solvers.geometry.nearest import Index, Known
from solvers.methods.icp.options import AnyOptions, CappedOptions, IcpOptions, TrimmedOptions
from solvers.numerics import robust
from solvers.numerics.fits import fit_pairs, rms_motion, typical_radius, weighted_radius

ONE_PARTNER = "every source point has the same partner: the rotation is undefined; are both clouds in one unit?"
"""The reason given when a fit has no rotation because all its pairs share one target point."""


@dataclass(frozen=True, eq=False)
class Pairing:
    """The pairs at a pose: every source point's nearest target point, and which of these pairs the next fit uses.

    moved: (b, m, d) the source points at the pose. rows: (b, m) the target row nearest to each. distances: (b, m).
    used: (b, m). weights: (b, m) of the pairs in the fit, zero where unused. threshold: (b,) of the robust weight.
    count: (b,) pairs used. rms: (b,) √(Σ w r² / Σ w) over them. objective: (b,). known: neighbours kept to spare the
    next pairing look-ups, None without trees.
    """

    moved: FloatArray
    rows: IntArray
    distances: FloatArray
    used: BoolArray
    weights: FloatArray
    threshold: FloatArray
    count: IntArray
    rms: FloatArray
    objective: FloatArray
    known: Known | None

    __repr__ = brief


@dataclass(frozen=True, eq=False)
class IcpState:
    """A pose and the pairs at it; the objective and the fields of `pairing` are at `pose`.

    reach: (b,) the gate or the cap, world units. scale: (b,) the fixed s of the robust weight, or None. radius: (b,)
    RMS radius of the source points in use. change: (b,) how far the last step moved them, root mean square, as a
    fraction of `radius`, infinite before the first. condition: (b,) of the last fit (`rigid.Fit`).
    """

    problem: Problem = field(metadata=CONSTANT)
    index: Index = field(metadata=CONSTANT)
    reach: FloatArray = field(metadata=CONSTANT)
    scale: FloatArray | None = field(metadata=CONSTANT)
    options: AnyOptions = field(metadata=SHARED)
    pose: Pose
    objective: FloatArray
    status: StatusArray
    reason: ReasonArray
    pairing: Pairing
    radius: FloatArray
    change: FloatArray
    condition: FloatArray

    __repr__ = brief


def finish(
    state: IcpState, pose: Pose, pairing: Pairing, reason: ReasonArray, condition: FloatArray
) -> IcpState:
    """The state after a step to `pose`, and whether the run stops there. `reason` says
    why the fit was degenerate, if it was; that ends the run only when the pose has come
    to rest.
    """
    options, old = state.options, state.pairing
    with np.errstate(over="ignore", under="ignore", invalid="ignore"):
        radius = weighted_radius(state.problem.source, pairing.weights)
        change = rms_motion(pairing.moved - old.moved, pairing.weights) / radius
        still = np.abs(pairing.rms - old.rms) <= options.rms_tolerance * old.rms
    at_rest = change <= options.tolerance
    steady = still & (pairing.count == old.count) & (options.rms_tolerance > 0.0)
    free = reason != ""
    status, why = mark(state.status, state.reason, pairing.count == 0, Status.DEGENERATE, _no_pairs(options))
    status, why = mark(status, why, free & at_rest, Status.DEGENERATE, reason)
    status, why = mark(status, why, at_rest, Status.CONVERGED, "the pose has come to rest")
    status, why = mark(status, why, steady & ~free, Status.CONVERGED, "the RMS has come to rest")
    return changed(
        state, pose=pose, objective=pairing.objective, status=status, reason=why, pairing=pairing, radius=radius,
        change=change, condition=condition,
    )  # fmt: skip


def _no_pairs(options: AnyOptions) -> str:
    if isinstance(options, IcpOptions) and np.isfinite(options.gate):
        return f"no pair with weight lies within the gate of {options.gate:g} u"
    if isinstance(options, CappedOptions):
        return "no pair with weight lies within the cap"
    return "no pair has a weight"


def pair(
    problem: Problem, index: Index, reach: FloatArray, scale: FloatArray | None, options: AnyOptions, pose: Pose,
    known: Known | None = None,
) -> Pairing:
    """The nearest neighbours at `pose` and which of them count. reach, scale: (b,) as in `IcpState`; known: from the
    previous pairing.
    """
    with np.errstate(over="ignore", under="ignore", invalid="ignore"):
        moved = pose.apply(problem.source)
        rows, squares, known = index.follow(moved, known)
        among = (problem.weights > 0.0) & nearest.within(squares, reach)
        if isinstance(options, IcpOptions):
            among = nearest.trimmed(squares, options.trim, among)
        elif isinstance(options, TrimmedOptions):
            among = nearest.smallest(squares, max(1, round(options.keep * squares.shape[1])), among)
        distances = np.sqrt(squares)
        kernel = options.weight
        floor = 0.0 if kernel == "none" or scale is not None else robust.least_scale(index.points)
        k = robust.threshold(kernel, distances, among, options.tuning, scale, floor)
        weights = np.where(among, problem.weights * robust.run_weights(kernel, distances, k), 0.0)
        total = weights.sum(axis=1)
        used = weights > 0.0
        rms = np.sqrt(np.where(used, weights * squares, 0.0).sum(axis=1) / np.where(total > 0.0, total, 1.0))
        losses = squares if kernel == "none" else 2.0 * robust.run_loss(kernel, distances, k)
        if isinstance(options, CappedOptions):
            top = np.square(reach) if kernel == "none" else 2.0 * robust.run_loss(kernel, reach[:, None], k)[:, 0]
            losses = np.where(among, losses, top[:, None])
            among = problem.weights > 0.0
        objective = np.where(among, problem.weights * losses, 0.0).sum(axis=1)
    return Pairing(moved, rows, distances, used, weights, k, used.sum(axis=1), rms, objective, known)


def start(problem: Problem, options: AnyOptions) -> IcpState:
    """The state at the starting pose; degenerate where no pair is used."""
    reach = np.full(problem.size, np.inf)
    if isinstance(options, IcpOptions):
        reach[:] = options.gate
    elif isinstance(options, CappedOptions):
        reach[:] = 0.5 * typical_radius(problem.target) if options.cap is None else options.cap
    scale = None if options.scale is None else np.full(problem.size, options.scale)
    return start_with(problem, options, reach, scale)


def start_with(problem: Problem, options: AnyOptions, reach: FloatArray, scale: FloatArray | None) -> IcpState:
    """`start` with a gate or cap and a scale for each problem, (b,) each."""
    b = problem.size
    index = nearest.build(problem.target)
    pairing = pair(problem, index, reach, scale, options, problem.start)
    status, reason = mark(statuses((b,)), reasons((b,)), pairing.count == 0, Status.DEGENERATE, _no_pairs(options))
    return IcpState(
        problem=problem, index=index, reach=reach, scale=scale, options=options, pose=problem.start,
        objective=pairing.objective, status=status, reason=reason, pairing=pairing,
        radius=weighted_radius(problem.source, pairing.weights), change=np.full(b, np.inf),
        condition=np.full(b, np.inf),
    )  # fmt: skip


def step(state: IcpState) -> IcpState:
    """Fit the pairs, then pair again."""
    at = state.pairing
    partners = nearest.picked(state.index.points, at.rows)
    pose, reason, condition = fit_pairs(state.pose, state.problem.source, partners, at.weights)
    pairing = pair(state.problem, state.index, state.reach, state.scale, state.options, pose, at.known)
    return finish(state, pose, pairing, one_partner(reason, state.index, at.rows, at.weights), condition)


def one_partner(reason: ReasonArray, index: Index, rows: IntArray, weights: FloatArray) -> ReasonArray:
    """The reasons, (b,), why fits are degenerate: `ONE_PARTNER` where all pairs share one target point although the
    target has others.
    """
    if not (reason != "").any():
        return reason
    updated = reason.copy()
    for i in np.flatnonzero(reason != ""):
        one = np.unique(rows[i][weights[i] > 0.0]).size == 1
        if one and reason[i].startswith("all target") and not at_one_place(index.points[i]):
            updated[i] = ONE_PARTNER
    return updated


def partners(state: Any) -> IntArray:
    """The target row of each source row with a weight, for a state with pairs."""
    return chosen(state.pairing.rows, state.pairing.weights > 0.0)


def _method(name: str, summary: str, source: str, options: type, weighted: bool) -> Method[IcpState]:
    return Method(name, summary, source, start, step, options, partners=partners, weighted=weighted, dims=None)


ICP = _method(
    "icp", "pairs of nearest points within a gate and after trimming, fitted in closed form, again and again",
    "Besl & McKay 1992", IcpOptions, True,
)  # fmt: skip
TRIMMED = _method(
    "trimmed-icp", "ICP on a fixed number of the nearest pairs", "Chetverikov et al. 2002", TrimmedOptions, False
)
CAPPED = _method(
    "capped-icp", "ICP on the pairs within a cap, descending on the sum of squared distances capped there",
    "Besl & McKay 1992, with a truncated loss", CappedOptions, True,
)  # fmt: skip
