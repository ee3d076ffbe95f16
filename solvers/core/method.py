"""What a method is, and what it must provide to run in the loop.

To add a method, write a module with:

1. Frozen dataclasses of options, whose `__post_init__` rejects bad values with
   `solvers.core.validate`, and of states, with the fields of `State` and whatever a figure
   should show. `problem` and what is precomputed are `field(metadata=CONSTANT)`, the options
   `field(metadata=SHARED)`; see `solvers.core.tree`.
2. `start`, which fills the state at `problem.start` and draws all random numbers of the
   run, by `numpy.random.default_rng(problem.seed[i])` for problem i. A hopeless problem
   gets `Status.DEGENERATE` and a reason (`status.mark`). For a cloud whose points are all
   equal the loop does so itself, whenever the run stops.
3. `step`, which returns `tree.changed(state, pose=…, objective=…, status=…, …)`; the
   status may become any `Status`. It must not raise for geometry and must not write into
   arrays. The loop itself counts the steps and caps them.
4. A `Method(...)`, added to the list in `solvers/core/registry.py`;
   tests/solvers/core/test_registry.py says where else its name belongs.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Generic, Protocol, TypeVar

from solvers.core.arrays import FloatArray, IntArray, ReasonArray, StatusArray
from solvers.core.brief import brief
from solvers.core.pose import Pose


@dataclass(frozen=True, eq=False)
class Problem:
    """b registration problems, already validated.

    Parameters
    ----------
    source : ndarray of shape (b, m, d)
        The clouds to move, in world units.
    target : ndarray of shape (b, n, d)
        The fixed clouds. Paired methods get m = n, with row i's partner in row i.
    weights : ndarray of shape (b, m)
        Weights of the source rows (of the pairs, if paired).
    start : Pose
        b starting poses.
    seed : ndarray of int64, shape (b,)
        The seed of each problem's random numbers.

    Examples
    --------
    >>> import numpy as np
    >>> from solvers import Pose
    >>> from solvers.stepper import Problem
    >>> p, q = np.zeros((1, 5, 2)), np.ones((1, 7, 2))
    >>> start, weights = Pose.identity(batch=(1,)), np.ones((1, 5))
    >>> problem = Problem(p, q, weights, start, np.array([40]))
    >>> problem.size, problem.dim
    (1, 2)
    """

    source: FloatArray
    target: FloatArray
    weights: FloatArray
    start: Pose
    seed: IntArray

    __repr__ = brief

    @property
    def size(self) -> int:
        """b, the number of problems."""
        return int(self.source.shape[0])

    @property
    def dim(self) -> int:
        """d, the number of coordinates of a point."""
        return int(self.source.shape[-1])


class State(Protocol):
    """The fields of every method's state, all with leading axis b.

    Examples
    --------
    >>> from solvers import register
    >>> (state,) = register([[0.0, 0.0], [2.0, 0.0]], [[1.0, 1.0], [1.0, 3.0]], "kabsch").states
    >>> state.problem.size, state.pose.batch, state.objective.round(6), state.status
    (1, (1,), array([0.]), array([1], dtype=int8))
    >>> state.reason[0]
    ''
    """

    @property
    def problem(self) -> Problem:
        """The b problems."""

    @property
    def pose(self) -> Pose:
        """The current poses, (b,)."""

    @property
    def objective(self) -> FloatArray:
        """The function that the method minimises, at `pose`, (b,)."""

    @property
    def status(self) -> StatusArray:
        """The status of each problem, (b,)."""

    @property
    def reason(self) -> ReasonArray:
        """The reason for each status in words, possibly empty, (b,)."""


S = TypeVar("S", bound=State)


@dataclass(frozen=True)
class NoOptions:
    """The options of a method that has none.

    Examples
    --------
    >>> from solvers import METHODS, options
    >>> METHODS["kabsch"].options is options.NoOptions
    True
    """


@dataclass(frozen=True, eq=False, repr=False)
class Method(Generic[S]):
    """A registration method, as `solvers.METHODS` lists it.

    Parameters
    ----------
    name : str
        Its name in `register(method=…)`.
    summary : str
        One line.
    source : str
        The paper it follows.
    start : callable
        `start(problem, options) -> state`, the state at the start.
    step : callable
        `step(state) -> state`, one step of every problem in the state.
    options : type
        The frozen dataclass of its own options, with defaults.
    partners : callable, or None
        `partners(state) -> (b, m)`, each source row's target row, −1 for none. None if
        source rows have no single partners, as in soft methods.
    paired : bool
        Whether it matches row i with row i, and takes `pairs`.
    weighted : bool
        Whether it takes `weights`.
    scaled : bool
        Whether it estimates a scale; otherwise its starts have scale 1.
    dims : tuple of int, or None
        The dimensions it works in; None for any.
    max_steps : int
        The default step limit.
    any_extent : bool
        Whether it copes with clouds so narrow that squared lengths underflow; if not, a
        run on such clouds is degenerate.

    Examples
    --------
    >>> from solvers import METHODS
    >>> icp = METHODS["icp"]
    >>> icp.source, icp.dims, icp.max_steps
    ('Besl & McKay 1992', None, 70)
    >>> icp.options(gate=2.6).gate
    2.6
    """

    name: str
    summary: str
    source: str
    start: Callable[[Problem, Any], S]
    step: Callable[[S], S]
    options: type = NoOptions
    partners: Callable[[S], IntArray] | None = None
    paired: bool = False
    weighted: bool = False
    scaled: bool = False
    dims: tuple[int, ...] | None = (2,)
    max_steps: int = 70
    any_extent: bool = False

    def __post_init__(self) -> None:
        # What `help(METHODS["icp"])` shows, in place of the class's docstring.
        first, *rest = (self.options.__doc__ or "").splitlines() or [""]  # python -OO strips docstrings
        margin = min((len(line) - len(line.lstrip()) for line in rest if line.strip()), default=0)  # 0 from Python 3.13
        text = "\n".join([first, *(line[margin:] for line in rest)]).rstrip()
        object.__setattr__(self, "__doc__", f"{self.summary} ({self.source}).\n\n{text}")

    def __repr__(self) -> str:
        return f"<method {self.name!r}: {self.summary}>"
