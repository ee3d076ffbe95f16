"""The poses that agree best with all that was measured between them.

Minimised is `F = Σ ρ(χ²)` over the edges, with χ² = eᵀ Ω e and the residuals of
`solvers.posegraph.residuals`, by Levenberg–Marquardt on reweighted squares: damping in
proportion to the diagonal, so that lengths and angles may have any units. A step is
taken only where it lowers F. Poses come from relative measurements alone, so at least
one node is held where it is.

Sources: Lu & Milios 1997, Globally consistent range scan alignment for environment
mapping; Grisetti, Kümmerle, Stachniss & Burgard 2010, A tutorial on graph-based SLAM;
for the kernels see `solvers.posegraph.kernels`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from solvers.core import validate
from solvers.core.arrays import BoolArray, FloatArray
from solvers.core.edges import Edges, rigid, within
from solvers.core.pose import Pose
from solvers.core.status import Status
from solvers.core.stepper import History
from solvers.posegraph import kernels, linear
from solvers.posegraph.linear import Plan
from solvers.posegraph.residuals import chi_squared, jacobians, moved, residuals

_ROUNDING = 1e-14
_FIRST, _LEAST, _MOST = 1e-6, 1e-12, 1e12


@dataclass(frozen=True, eq=False)
class GraphRun:
    """An optimisation as it stands, immutable: begin it, advance it, drop it to stop.

    Attributes
    ----------
    poses : Pose of shape (n,)
        The nodes.
    edges : Edges
        What was measured.
    chi2 : ndarray of shape (e,)
        χ² of each edge at `poses`.
    weights : ndarray of shape (e,)
        What the kernel leaves of each edge's information, in (0, 1].
    objective : float
        F = Σ ρ(χ²); without a kernel the sum of χ².
    status : Status
        How it stands.
    reason : str
        Words on how it stopped, possibly empty.
    steps : int
        The steps taken.
    damping : float
        λ of the next step, as a fraction of the diagonal.
    """

    poses: Pose
    edges: Edges
    chi2: FloatArray
    weights: FloatArray
    objective: float
    status: Status
    reason: str
    steps: int
    damping: float
    kernel: str
    threshold: float
    robust: BoolArray
    max_steps: int
    tolerance: float
    plan: Plan

    @property
    def done(self) -> bool:
        """Whether it has stopped."""
        return self.status != Status.RUNNING


@dataclass(frozen=True, eq=False)
class GraphResult:
    """What `optimise` found.

    Attributes
    ----------
    poses : Pose of shape (n,)
        The nodes, from their own coordinates to those of the map.
    chi2 : ndarray of shape (e,)
        χ² of each edge, without the kernel.
    weights : ndarray of shape (e,)
        What the kernel leaves of each edge's information, in (0, 1]; 1 where it does
        not apply.
    objective : float
        F = Σ ρ(χ²); without a kernel the sum of χ².
    status : Status
        How it stopped.
    reason : str
        Words on how it stopped, possibly empty.
    steps : int
        The steps taken.
    history : History
        Poses (k + 1, n) and objective (k + 1,) from the start to the last of k steps.
    """

    poses: Pose
    chi2: FloatArray
    weights: FloatArray
    objective: float
    status: Status
    reason: str
    steps: int
    history: History

    @property
    def total(self) -> float:
        """The sum of χ² over all edges, without the kernel."""
        return float(self.chi2.sum())

    def __repr__(self) -> str:
        said = f"{self.status}{f' ({self.reason})' if self.reason else ''}, steps={self.steps}"
        return f"GraphResult({said}, nodes={self.poses.batch[0]}, edges={len(self.chi2)}, total={self.total:.6g})"


def begin(
    poses: Pose,
    edges: Edges,
    *,
    fixed: int | Sequence[int] = 0,
    kernel: str = "none",
    robust: ArrayLike | None = None,
    threshold: float = kernels.THRESHOLD,
    max_steps: int = 100,
    tolerance: float = 1e-9,
    sparse: bool | None = None,
) -> GraphRun:
    """An optimisation at its start, no step taken; all as for `optimise`.

    Returns
    -------
    GraphRun
        The run at its beginning.

    Raises
    ------
    ValueError
        As `optimise` does.

    Examples
    --------
    >>> import numpy as np
    >>> from solvers import Pose
    >>> from solvers.posegraph import Edges, advance, begin
    >>> poses = Pose.from_angle(np.zeros(3), [[0.0, 0.0], [1.0, 0.0], [2.0, 0.0]])
    >>> edges = Edges.between(poses, [0, 1], [1, 2], np.eye(3))
    >>> run = begin(Pose.from_angle(np.zeros(3), [[0.0, 0.0], [3.0, 0.0], [0.0, 1.0]]), edges)
    >>> run.objective, advance(run).objective < 1e-9
    (21.0, True)
    """
    poses = rigid(poses, "poses")
    if len(poses.batch) != 1 or not poses.batch[0]:
        raise ValueError(f"poses: expected shape (n,) with at least one node, got {poses.batch}")
    if not isinstance(edges, Edges):
        raise ValueError(f"edges: expected Edges, got {type(edges).__name__}")
    n = poses.batch[0]
    for nodes, name in ((edges.i, "edges.i"), (edges.j, "edges.j")):
        within(nodes, n, name)
    still = _fixed(fixed, n)
    _joined(edges, still)
    validate.one_of(kernel, kernels.KERNELS, "kernel")
    validate.number(threshold, "threshold", 1e-6, 1e6)
    validate.count(max_steps, "max_steps")
    validate.number(tolerance, "tolerance", 0.0, 1.0)
    under = _mask(robust, len(edges))
    chi2 = chi_squared(poses, edges)
    run = GraphRun(
        poses, edges, chi2, np.ones(len(edges)), 0.0, Status.RUNNING, "", 0, _FIRST, kernel, threshold, under,
        max_steps, tolerance, linear.plan(n, edges.i, edges.j, still, sparse),
    )
    run = _judged(run, poses, chi2)
    if not np.isfinite(run.objective):
        return replace(run, status=Status.DEGENERATE, reason="the errors at the start leave the range of numbers")
    if not run.plan.size:
        return replace(run, status=Status.CONVERGED, reason="every node is fixed")
    return _capped(run)


def advance(run: GraphRun) -> GraphRun:
    """One step on: the first damped step that lowers the objective.

    Parameters
    ----------
    run : GraphRun
        The run so far. A finished one is returned as it is.

    Returns
    -------
    GraphRun
        The run one step on, or stopped.

    Examples
    --------
    >>> import numpy as np
    >>> from solvers import Pose
    >>> from solvers.posegraph import Edges, advance, begin
    >>> poses = Pose.from_angle([0.0, 1.0], [[0.0, 0.0], [1.0, 0.0]])
    >>> run = begin(poses, Edges.between(poses, [0], [1], np.eye(3)))
    >>> print(advance(run).status)
    converged
    """
    if run.done:
        return run
    with np.errstate(over="ignore", invalid="ignore", under="ignore", divide="ignore"):
        return _advanced(run)


def _advanced(run: GraphRun) -> GraphRun:
    edges, n = run.edges, run.poses.batch[0]
    by_i, by_j = jacobians(run.poses, edges)
    information = run.weights[:, None, None] * edges.information
    ii, ij, jj, at_i, at_j = linear.blocks(by_i, by_j, information, residuals(run.poses, edges))
    gradient = np.zeros((n, 3))
    np.add.at(gradient, edges.i, at_i)
    np.add.at(gradient, edges.j, at_j)
    diagonal = linear.diagonal(n, edges.i, edges.j, ii, jj)
    reach = max(float(np.abs(edges.relative.t).max(initial=0.0)), 1e-12)
    size = np.array([reach, reach, 1.0])
    damping = run.damping
    while damping <= _MOST:
        try:
            solve = linear.factor(run.plan, edges.i, edges.j, ii, ij, jj, damping * diagonal)
            step = -solve(gradient[..., None])[..., 0]
        except np.linalg.LinAlgError:
            step = np.full((n, 3), np.nan)
        if not np.isfinite(step).all():
            damping *= 10.0
            continue
        gain = -float((gradient * step).sum())
        small = bool((np.abs(step) <= run.tolerance * size).all()) or gain <= _ROUNDING * run.objective
        poses = moved(run.poses, step)
        after = _judged(run, poses, chi_squared(poses, edges))
        if after.objective < run.objective:
            status = Status.CONVERGED if small else Status.RUNNING
            after = replace(after, status=status, steps=run.steps + 1, damping=max(0.1 * damping, _LEAST))
            return _capped(after)
        if small:
            return replace(run, status=Status.CONVERGED, damping=damping)
        damping *= 10.0
    return replace(run, status=Status.STALLED, reason="no step lowers the objective", damping=damping)


def optimise(
    poses: Pose,
    edges: Edges,
    *,
    fixed: int | Sequence[int] = 0,
    kernel: str = "none",
    robust: ArrayLike | None = None,
    threshold: float = kernels.THRESHOLD,
    max_steps: int = 100,
    tolerance: float = 1e-9,
    sparse: bool | None = None,
) -> GraphResult:
    """The poses that agree best with the measurements between them.

    Parameters
    ----------
    poses : Pose of shape (n,)
        Where the nodes start: poses from each node's own coordinates to those of the
        map, such as those of odometry.
    edges : Edges
        What was measured between nodes.
    fixed : int or sequence of int, default 0
        The nodes that stay where they are. Each part of the graph needs one.
    kernel : {"none", "huber", "cauchy", "dcs"}, default "none"
        What becomes of large errors; see `solvers.posegraph.kernels`. With "cauchy" and
        "dcs" the end depends on the start.
    robust : array_like of bool, shape (e,), optional
        The edges that the kernel applies to, such as loops. None is all.
    threshold : float, default 2.8
        The χ from which on an error counts as large.
    max_steps : int, default 100
        The most steps.
    tolerance : float, default 1e-9
        It has converged where no node moves by more than this fraction of the longest
        measured translation, nor turns by more than this many radians.
    sparse : bool, optional
        Whether scipy solves the normal equations. None is scipy from 300 free nodes on,
        where it is installed.

    Returns
    -------
    GraphResult
        Poses, the edges' χ² and weights, and how it stopped.

    Raises
    ------
    ValueError
        If an argument is not what it should be, if an edge names a node that does not
        exist, or if edges join a node to no fixed one.

    Examples
    --------
    Two legs out along a corridor and two back, the last measured 0.4 u too short: the
    loop does not close, and each leg takes a quarter of the excess.

    >>> import numpy as np
    >>> from solvers import Pose
    >>> from solvers.posegraph import Edges, optimise
    >>> stops = Pose.from_angle(np.zeros(4), [[0.0, 0.0], [2.0, 0.0], [4.0, 0.0], [2.0, 0.0]])
    >>> legs = Pose.from_angle(np.zeros(4), [[2.0, 0.0], [2.0, 0.0], [-2.0, 0.0], [-1.6, 0.0]])
    >>> result = optimise(stops, Edges([0, 1, 2, 3], [1, 2, 3, 0], legs, 100.0 * np.eye(3)))
    >>> result.poses.t[:, 0].round(6)
    array([0. , 1.9, 3.8, 1.7])
    >>> print(result.status, round(result.total, 6))
    converged 4.0
    """
    run = begin(
        poses, edges, fixed=fixed, kernel=kernel, robust=robust, threshold=threshold, max_steps=max_steps,
        tolerance=tolerance, sparse=sparse,
    )
    course, objective = [run.poses], [run.objective]
    while not run.done:
        run = advance(run)
        if run.steps == len(course):
            course.append(run.poses)
            objective.append(run.objective)
    history = History(Pose(np.stack([p.R for p in course]), np.stack([p.t for p in course])), np.array(objective))
    return GraphResult(
        run.poses, run.chi2, run.weights, run.objective, run.status, run.reason, run.steps, history
    )


def _judged(run: GraphRun, poses: Pose, chi2: FloatArray) -> GraphRun:
    """The run at other poses: what its edges say there."""
    weights = np.where(run.robust, kernels.weights(run.kernel, chi2, run.threshold), 1.0)
    with np.errstate(over="ignore"):
        objective = float(np.where(run.robust, kernels.loss(run.kernel, chi2, run.threshold), chi2).sum())
    return replace(run, poses=poses, chi2=chi2, weights=weights, objective=objective)


def _capped(run: GraphRun) -> GraphRun:
    if run.steps < run.max_steps or run.done:
        return run
    return replace(run, status=Status.CAPPED, reason=f"the cap of {run.max_steps} steps was reached")


def _fixed(nodes: int | Sequence[int], count: int) -> BoolArray:
    held = np.atleast_1d(np.asarray(nodes))
    if held.ndim != 1 or held.dtype.kind not in "iu":
        raise ValueError(f"fixed: expected a node or a sequence of nodes, got {nodes!r}")
    if not held.size:
        raise ValueError("fixed: is empty; poses relative to each other leave the whole graph free to move")
    within(held.astype(np.int64), count, "fixed")
    still = np.zeros(count, dtype=np.bool_)
    still[held] = True
    return still


def _joined(edges: Edges, fixed: BoolArray) -> None:
    """A ValueError when the edges join some node to no fixed one."""
    reached = fixed.copy()
    while True:
        known = reached[edges.i] | reached[edges.j]
        before = int(reached.sum())
        reached[edges.i[known]] = True
        reached[edges.j[known]] = True
        if int(reached.sum()) == before:
            break
    alone = np.flatnonzero(~reached)
    if alone.size:
        count = "1 node is" if alone.size == 1 else f"{alone.size} nodes are"
        raise ValueError(f"edges: {count} joined to no fixed node, the first of them {alone[0]}")


def _mask(values: ArrayLike | None, count: int) -> BoolArray:
    if values is None:
        return np.ones(count, dtype=np.bool_)
    mask = np.asarray(values)
    if mask.dtype != np.bool_ or mask.shape != (count,):
        raise ValueError(f"robust: expected one bool an edge, shape ({count},), got {mask.dtype} of shape {mask.shape}")
    return mask.copy()
