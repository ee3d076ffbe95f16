"""Correlative scan matching: the best pose of a grid of poses, and the runner-up.

The target is drawn on a grid of square cells and blurred: a cell is worth
`exp(−d²/2σ²)`, d the distance of its centre from the nearest target point, in 255
steps. A pose scores the mean worth of the cells that the moved source points fall in, 0
to 1. The poses form a grid: angles so close that no point moves by more than a cell
from one to the next, and translations by whole cells, wherever the clouds can overlap.
The starting pose plays no part unless a window about it is given.

Not every pose of the grid is scored. For one angle, no translation in a square of 2^h ×
2^h can score more than if each point took the best cell of its own window of 2^h × 2^h
cells, and these maxima are computed beforehand, one grid per h. Squares whose bound
does not exceed the best score so far are dropped; the others are cut in four ([2]_,
here the largest bounds first, many at a time). The result is therefore the same as from
trying every pose of the grid. It is the grid's best pose, not polished: that is left to
a local method started from it.

A second search gives the *runner-up*, the best pose of the grid that is not a neighbour
of the best: the RMS distance of the source points between the two exceeds `apart`. Two
nearly equal scores are a sign of a scene that looks the same from two poses.

Left out: the covariance of [1]_, and its choice of two resolutions.

References
----------
.. [1] E. B. Olson, "Real-time correlative scan matching", 2009 (the blurred table, the
   angular step). doi:10.1109/ROBOT.2009.5152375
.. [2] W. Hess, D. Kohler, H. Rapp, D. Andor, "Real-time loop closure in 2D LIDAR SLAM",
   2016, sec. V (windows of doubling size as bounds). doi:10.1109/ICRA.2016.7487258
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from solvers.core import validate
from solvers.core.arrays import AnyArray, BoolArray, FloatArray, IntArray, ReasonArray, StatusArray
from solvers.core.brief import brief
from solvers.core.method import Method, Problem
from solvers.core.pose import Pose
from solvers.core.status import Status, mark, reasons, statuses
from solvers.core.tree import CONSTANT, SHARED, changed
from solvers.methods.search.lattice import WORTH, Lattice, Window, build


@dataclass(frozen=True)
class CorrelativeOptions:
    """Options of `correlative`.

    Points more than 20 times as far out as their cloud's median point are left out of
    the search, so that they do not widen the field; those of the source score nothing.

    Parameters
    ----------
    cell : float, optional
        The side of a cell and the step in translation, world units. None is the median
        distance of a target point to its neighbour, or larger if more than 256 cells
        would lie across the field searched.
    blur : float, default 1.0
        σ of the blur, in cells, 0.3 to 8.
    angle : float, optional
        The angular step, radians, 1e-5 to π. None is the one that moves the farthest
        source point by one cell. Where the whole circle is searched, a step that does
        not divide it is made a little smaller.
    shift : float, optional
        How far to search along x and y from where the start puts the source's centroid,
        world units. None is wherever the clouds can overlap.
    turn : float, optional
        How far to search to either side of the start's angle, radians. None is the
        whole circle.
    apart : float, default 0.25
        The RMS distance of the source points between two poses beyond which these are
        not neighbours, in RMS radii of the source.
    per_step : int, default 64
        The number of squares to cut up in a step.

    Raises
    ------
    ValueError
        If an option is out of its range.

    Examples
    --------
    >>> from solvers import options, register, scenes
    >>> scene = scenes.room("clean")
    >>> result = register(scene.source, scene.target, "correlative", options=options.CorrelativeOptions(turn=0.2))
    >>> bool(abs(result.pose.angle) <= 0.2)
    True
    """

    cell: float | None = None
    blur: float = 1.0
    angle: float | None = None
    shift: float | None = None
    turn: float | None = None
    apart: float = 0.25
    per_step: int = 64

    def __post_init__(self) -> None:
        if self.cell is not None:
            validate.number(self.cell, "cell", 1e-100, 1e100)
        validate.number(self.blur, "blur", 0.3, 8.0)
        if self.angle is not None:
            validate.number(self.angle, "angle", 1e-5, np.pi)
        if self.shift is not None:
            validate.number(self.shift, "shift", 0.0, 1e100)
        if self.turn is not None:
            validate.number(self.turn, "turn", 0.0, np.pi)
        validate.number(self.apart, "apart", 0.0, 100.0)
        validate.count(self.per_step, "per_step", 1)


@dataclass(frozen=True, eq=False)
class CorrelativeState:
    """The best pose so far; the objective is 1 − its score, (b,).

    lattice: (b,) a `Lattice` each, None where there is none. poses: (b,) their number in the grid. score: (b,) of the
    best, 0 to 1. runner_up: the best other pose that is not a neighbour, runner_score: (b,); the start and 0 until one
    is found. nodes: (b,) squares and poses scored so far. place, runner_place: (b, 3) angle, column and row of both, −1
    until found. second: (b,) whether the runner-up is being sought. cut: (b,) squares that the current search has cut
    up or dropped.
    """

    problem: Problem = field(metadata=CONSTANT)
    options: CorrelativeOptions = field(metadata=SHARED)
    lattice: AnyArray = field(metadata=CONSTANT)
    poses: IntArray = field(metadata=CONSTANT)
    pose: Pose
    objective: FloatArray
    status: StatusArray
    reason: ReasonArray
    score: FloatArray
    runner_up: Pose
    runner_score: FloatArray
    nodes: IntArray
    place: IntArray
    runner_place: IntArray
    second: BoolArray
    cut: IntArray

    __repr__ = brief


def _start(problem: Problem, options: CorrelativeOptions) -> CorrelativeState:
    b = problem.size
    lattice = np.full(b, None, dtype=object)
    status, reason = statuses((b,)), reasons((b,))
    poses, nodes, score = np.zeros(b, dtype=np.int64), np.zeros(b, dtype=np.int64), np.zeros(b)
    window = Window(options.cell, options.blur, options.angle, options.shift, options.turn)
    with np.errstate(over="ignore", under="ignore", invalid="ignore"):
        for i in range(b):
            result = build(problem.source[i], problem.target[i], problem.start[i], window)
            if isinstance(result, str):
                status, reason = mark(status, reason, np.arange(b) == i, Status.DEGENERATE, result)
                continue
            lattice[i], poses[i], nodes[i] = result, result.poses, len(result.ceilings)
            score[i] = result.score(problem.start[i], problem.source[i])
    none, zero = np.full((b, 3), -1, dtype=np.int64), np.zeros(b, dtype=np.int64)
    return CorrelativeState(
        problem=problem, options=options, lattice=lattice, poses=poses, pose=problem.start, objective=1.0 - score,
        status=status, reason=reason, score=score, runner_up=problem.start, runner_score=np.zeros(b), nodes=nodes,
        place=none, runner_place=none, second=np.zeros(b, dtype=np.bool_), cut=zero,
    )  # fmt: skip


@dataclass(frozen=True, eq=False)
class _Best:
    """The best place (3,) of a search so far and its sum, −1 until one is found."""

    place: IntArray
    total: int


def _cut_up(
    lattice: Lattice, squares: IntArray, best: _Best, beside: IntArray | None, apart: float
) -> tuple[_Best, int]:
    """Cut squares of the largest size down to poses, dropping those that cannot exceed the best sum and ignoring
    neighbours of the pose at `beside`. Return the best and how many squares were scored.
    """
    sums, count = np.full(len(squares), best.total + 1), 0
    for level in reversed(range(lattice.levels)):
        quarters = np.array([(0, 0, 0), (0, 1, 0), (0, 0, 1), (0, 1, 1)], dtype=np.int64) * 2**level
        squares = (squares[:, None] + quarters).reshape(-1, 3)
        squares = squares[(squares[:, 1] < lattice.columns) & (squares[:, 2] < lattice.rows)]
        sums, count = lattice.bounds(level, squares), count + len(squares)
        squares, sums = squares[sums > best.total], sums[sums > best.total]
    if not lattice.levels:  # squares of one translation: scored before the search
        sums = lattice.bounds(0, squares)
    if beside is not None:
        far = ~lattice.beside(squares, beside, apart)
        squares, sums = squares[far], sums[far]
    if not len(sums):
        return best, count
    first = int(sums.argmax())
    return _Best(squares[first], int(sums[first])), count


def _step(state: CorrelativeState) -> CorrelativeState:
    """Cut up the next squares of each problem; when none is left that may hold a better pose, go on to the runner-up,
    then stop.
    """
    problem, options = state.problem, state.options
    b, m = problem.source.shape[:2]
    # Index 0 is the best, index 1 the runner-up.
    R, t = np.stack([state.pose.R, state.runner_up.R]), np.stack([state.pose.t, state.runner_up.t])
    scale = np.stack([state.pose.scale, state.runner_up.scale])
    place, score = np.stack([state.place, state.runner_place]), np.stack([state.score, state.runner_score])
    second, cut, nodes, done = state.second.copy(), state.cut.copy(), state.nodes.copy(), np.zeros(b, dtype=np.bool_)
    for i in range(b):
        lattice: Lattice = state.lattice[i]
        k, block = int(second[i]), slice(int(cut[i]), int(cut[i]) + options.per_step)
        before = round(score[k, i] * WORTH * m) if place[k, i, 0] >= 0 else -1
        squares = lattice.squares[block][lattice.ceilings[block] > before]
        best, count = _cut_up(
            lattice, squares, _Best(place[k, i], before), place[0, i] if k else None, options.apart
        )
        nodes[i] += count
        cut[i] += options.per_step
        if best.total > before:
            place[k, i], score[k, i], scale[k, i] = best.place, best.total / (WORTH * m), 1.0
            R[k, i], t[k, i] = lattice.pose(best.place)
        if cut[i] >= len(lattice.ceilings) or lattice.ceilings[cut[i]] <= best.total:
            done[i], second[i], cut[i] = k, True, 0
    words = "no pose of the grid scores higher"
    status, reason = mark(state.status, state.reason, done, Status.CONVERGED, words)
    return changed(
        state, pose=Pose.trusted(R[0], t[0], scale[0]), objective=1.0 - score[0], status=status, reason=reason,
        score=score[0], runner_up=Pose.trusted(R[1], t[1], scale[1]), runner_score=score[1], nodes=nodes,
        place=place[0], runner_place=place[1], second=second, cut=cut,
    )  # fmt: skip


CORRELATIVE = Method(
    name="correlative",
    summary="the best pose of a grid over all rotations and translations on a blurred target, and its runner-up",
    source="Olson 2009; Hess, Kohler, Rapp & Andor 2016",
    start=_start,
    step=_step,
    options=CorrelativeOptions,
    dims=(2,),
    max_steps=1000,
    any_extent=True,
)
