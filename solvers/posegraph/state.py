"""The state of an optimisation between two steps, and its result."""

from __future__ import annotations

from dataclasses import dataclass

from solvers.core.arrays import BoolArray, FloatArray
from solvers.core.edges import Edges
from solvers.core.pose import Pose
from solvers.core.status import Status
from solvers.core.stepper import History
from solvers.posegraph import words
from solvers.posegraph.linear import Plan

FIRST_DAMPING = 1e-6
"""The damping of a run's first step, as a fraction of the diagonal."""


@dataclass(frozen=True, eq=False)
class Setting:
    """The constants of a run: the options of `optimise` and the elimination order."""

    kernel: str
    threshold: float
    robust: BoolArray
    max_steps: int
    tolerance: float
    plan: Plan


@dataclass(frozen=True, eq=False)
class GraphRun:
    """The immutable state of an optimisation: begin it, advance it, drop it to stop.

    Attributes
    ----------
    setting : object
        The options given to `begin`.
    edges : Edges
        The measurements.
    poses : Pose of shape (n,)
        The nodes.
    chi2 : ndarray of shape (e,)
        χ² of each edge at `poses`, without the kernel.
    weights : ndarray of shape (e,)
        The kernel's factor on each edge's information, in [0, 1].
    objective : float
        F = Σ ρ(χ²); without a kernel the sum of χ².
    status : Status
        Whether the run is still going, or how it stopped.
    reason : str
        How it stopped, in words; may be empty.
    steps : int
        The steps taken.
    damping : float
        λ of the next step, as a fraction of the diagonal.

    Examples
    --------
    >>> import numpy as np
    >>> from solvers import Pose
    >>> from solvers.posegraph import Edges, advance, begin
    >>> poses = Pose.from_angle([0.0, 1.0], [[0.0, 0.0], [1.0, 0.0]])
    >>> edges = Edges.between(poses, [0], [1], np.eye(3))
    >>> run = begin(Pose.from_angle([0.0, 0.0], [[0.0, 0.0], [2.0, 0.0]]), edges)
    >>> while not run.done:
    ...     run = advance(run)
    >>> run.poses.angle.round(6)
    array([0., 1.])
    """

    setting: Setting
    edges: Edges
    poses: Pose
    chi2: FloatArray
    weights: FloatArray
    objective: float
    status: Status = Status.RUNNING
    reason: str = ""
    steps: int = 0
    damping: float = FIRST_DAMPING

    @property
    def done(self) -> bool:
        """Whether it has stopped."""
        return self.status != Status.RUNNING

    __repr__ = words.summary


@dataclass(frozen=True, eq=False)
class GraphResult:
    """The result of `optimise`.

    Attributes
    ----------
    poses : Pose of shape (n,)
        The nodes, from their own coordinates to those of the map.
    chi2 : ndarray of shape (e,)
        χ² of each edge, without the kernel.
    weights : ndarray of shape (e,)
        The kernel's factor on each edge's information, in [0, 1]; 1 where it does not
        apply.
    objective : float
        F = Σ ρ(χ²); without a kernel the sum of χ².
    status : Status
        How it stopped.
    reason : str
        How it stopped, in words; may be empty.
    steps : int
        The steps taken.
    history : History
        Poses (k + 1, n) and objective (k + 1,) from the start to the last of k steps.

    Examples
    --------
    >>> import numpy as np
    >>> from solvers import Pose
    >>> from solvers.posegraph import Edges, optimise
    >>> poses = Pose.from_angle([0.0, 0.0], [[0.0, 0.0], [2.0, 0.0]])
    >>> edges = Edges([0, 0], [1, 1], Pose.from_angle([0.0, 0.0], [[1.0, 0.0], [3.0, 0.0]]), np.eye(3))
    >>> result = optimise(poses, edges)
    >>> result, result.total
    (GraphResult(converged, steps=0, nodes=2, edges=2, total=2), 2.0)
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

    __repr__ = words.summary
