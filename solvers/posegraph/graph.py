"""Pose-graph optimisation: the poses that agree best with the measurements between them.

`F = Σ ρ(χ²)` over the edges, with χ² = eᵀ Ω e and the residuals of `solvers.posegraph.errors`, is minimised by
Levenberg–Marquardt on reweighted squares, with damping proportional to the diagonal, so that lengths and angles may
have any units. A step is taken only if it lowers F. Measurements are relative, so at least one node is held fixed.

Sources: Lu & Milios 1997, Globally consistent range scan alignment for environment mapping; Grisetti, Kümmerle,
Stachniss & Burgard 2010, A tutorial on graph-based SLAM; for the kernels see `solvers.posegraph.kernels`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from solvers.core import validate
from solvers.core.edges import Edges
from solvers.core.kinds import function, of_kind
from solvers.core.pose import Pose
from solvers.core.poses import stacked
from solvers.core.status import Status
from solvers.core.stepper import History
from solvers.posegraph import checks, kernels, linear
from solvers.posegraph.errors import derivatives, moved, offsets, squares
from solvers.posegraph.rest import at_rest
from solvers.posegraph.state import GraphResult, GraphRun, Setting

_LEAST, _SLIGHT, _MOST = 1e-12, 1e-3, 1e12  # of the damping
_WHY = {Status.STALLED: "no step lowers the objective", Status.DEGENERATE: "a step is beyond floating point"}


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
    """An optimisation at its start, before any step.

    Parameters
    ----------
    poses : Pose of shape (n,)
        The starting poses of the nodes.
    edges : Edges
        The measurements between nodes.
    fixed : int or sequence of int, default 0
        The nodes that stay fixed.
    kernel : {"none", "huber", "cauchy", "dcs"}, default "none"
        As for `optimise`.
    robust : array_like of bool, shape (e,), optional
        As for `optimise`.
    threshold : float, default 2.8
        As for `optimise`.
    max_steps : int, default 100
        As for `optimise`.
    tolerance : float, default 1e-9
        As for `optimise`.
    sparse : bool, optional
        As for `optimise`.

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
    held = checks.held(poses, edges, fixed)
    setting = Setting(
        validate.one_of(kernel, kernels.KERNELS, "kernel"),
        validate.number(threshold, "threshold", 1e-6, 1e6),
        checks.mask(robust, len(edges), "robust"),
        validate.count(max_steps, "max_steps"),
        validate.number(tolerance, "tolerance", 0.0, 1.0),
        linear.plan(len(held), edges.i, edges.j, held, sparse),
    )
    run = _judged(setting, edges, poses)
    if not np.isfinite(run.objective):
        return replace(run, status=Status.DEGENERATE, reason="the errors at the start leave the range of numbers")
    if not setting.plan.size:
        return replace(run, status=Status.CONVERGED, reason="every node is fixed")
    return _capped(run)


def advance(run: GraphRun) -> GraphRun:
    """Advance a run by one step: the first damped step that lowers the objective.

    Parameters
    ----------
    run : GraphRun
        The run so far. A finished run is returned unchanged.

    Returns
    -------
    GraphRun
        The run one step on, or stopped.

    Raises
    ------
    ValueError
        If `run` is not a GraphRun.

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
    if of_kind(run, GraphRun, "run").done:
        return run
    with np.errstate(over="ignore", invalid="ignore", under="ignore", divide="ignore"):
        return _advanced(run)


def _advanced(run: GraphRun) -> GraphRun:
    edges, n = run.edges, run.poses.batch[0]
    by_i, by_j = derivatives(run.poses, edges)
    information = run.weights[:, None, None] * edges.information
    ii, ij, jj, at_i, at_j = linear.blocks(by_i, by_j, information, offsets(run.poses, edges))
    gradient = np.zeros((n, 3))
    np.add.at(gradient, edges.i, at_i)
    np.add.at(gradient, edges.j, at_j)
    diagonal = linear.diagonal(n, edges.i, edges.j, ii, jj)
    reach = max(float(np.abs(edges.relative.t).max(initial=0.0)), 1e-12)
    far = float(np.abs(run.poses.t).max(initial=0.0))
    damping, status = run.damping, Status.STALLED
    while damping <= _MOST:
        try:
            solve = linear.factor(run.setting.plan, edges.i, edges.j, ii, ij, jj, damping * diagonal)
            step = -solve(gradient[..., None])[..., 0]
        except np.linalg.LinAlgError:
            step = np.full((n, 3), np.nan)
        if not np.isfinite(step).all():
            damping, status = 10.0 * damping, Status.DEGENERATE
            continue
        gain = -float((gradient * step).sum())
        small = at_rest(step, gain, run.objective, at_i, ii, run.setting.tolerance, far, reach)
        if small and damping <= _SLIGHT:  # otherwise the damping may be what makes it small
            return replace(run, status=Status.CONVERGED, damping=damping)
        after = _judged(run.setting, edges, moved(run.poses, step))
        if after.objective < run.objective:
            return _capped(replace(after, steps=run.steps + 1, damping=max(0.1 * damping, _LEAST)))
        damping *= 10.0
    return replace(run, status=status, reason=_WHY[status], damping=damping)


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
    progress: Callable[[int, int], Any] | None = None,
) -> GraphResult:
    """The poses that agree best with the measurements between them.

    Parameters
    ----------
    poses : Pose of shape (n,)
        The starting poses of the nodes, from their own coordinates to those of the map,
        such as odometry's.
    edges : Edges
        The measurements between nodes.
    fixed : int or sequence of int, default 0
        The nodes that stay fixed. Each part of the graph needs one.
    kernel : {"none", "huber", "cauchy", "dcs"}, default "none"
        The kernel for large errors (`solvers.posegraph.kernels`). The start matters
        most with "cauchy" and "dcs".
    robust : array_like of bool, shape (e,), optional
        The edges that the kernel applies to, such as loops; no effect with "none". None
        is all.
    threshold : float, default 2.8
        The χ above which an error counts as large.
    max_steps : int, default 100
        The most steps.
    tolerance : float, default 1e-9
        Converged when a step moves no node by more than this fraction of the longest
        measured translation and turns none by more than this many radians, or 1e-6 of
        either if rounding hides the gain.
    sparse : bool, optional
        Whether scipy solves the normal equations. None uses scipy, if installed, from
        300 free nodes on. Without scipy, at most 3000 nodes may be free.
    progress : callable, optional
        Called as `progress(steps, max_steps)` after every step, and once more with the
        same number if the run ends without another step.

    Returns
    -------
    GraphResult
        Poses at a minimum near the start, not necessarily the global one, the edges' χ²
        and weights, and how it stopped.

    Raises
    ------
    ValueError
        If an argument is invalid, if an edge names a node that does not exist, if the
        edges do not join every node to a fixed one, or if more than 3000 nodes are free
        without scipy.

    Examples
    --------
    Two legs out along a corridor and two back, the last measured 0.4 u too short: the
    loop does not close, and each leg takes a quarter of the gap.

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
    function(progress, "progress")
    run = begin(
        poses, edges, fixed=fixed, kernel=kernel, robust=robust, threshold=threshold, max_steps=max_steps,
        tolerance=tolerance, sparse=sparse,
    )
    course, sums = [run.poses], [run.objective]
    while not run.done:
        run = advance(run)
        if progress is not None:
            progress(run.steps, max_steps)
        if run.steps == len(course):
            course.append(run.poses)
            sums.append(run.objective)
    final = run.poses, run.chi2, run.weights, run.objective, run.status, run.reason, run.steps
    return GraphResult(*final, History(stacked(course), np.array(sums)))


def _judged(setting: Setting, edges: Edges, poses: Pose) -> GraphRun:
    """A run at these poses, with its edges evaluated there."""
    chi2 = squares(offsets(poses, edges), edges.information)
    under, kernel, threshold = setting.robust, setting.kernel, setting.threshold
    weights = np.where(under, kernels.weights(kernel, chi2, threshold), 1.0)
    with np.errstate(over="ignore"):
        objective = float(np.where(under, kernels.loss(kernel, chi2, threshold), chi2).sum())
    return GraphRun(setting, edges, poses, chi2, weights, objective)


def _capped(run: GraphRun) -> GraphRun:
    cap = run.setting.max_steps
    over = run.steps >= cap and not run.done
    return replace(run, status=Status.CAPPED, reason=f"the cap of {cap} steps was reached") if over else run
