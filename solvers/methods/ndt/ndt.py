"""NDT registration.

Climb the score of the target's map by damped Newton steps, from coarse cells to fine.

One step solves for (tx, ty, φ) about the moved cloud's centroid, with the angle scaled
by the cloud's RMS radius so that one λ damps lengths and angle alike. The step is
capped by one common factor and halved until the score rises; otherwise it is rejected.
A level, one cell size, ends when no shorter step helps or the step has become small;
the next level starts from its pose, with another objective. Coarse cells reach farther,
fine ones resolve more; neither guarantees anything, and a run that has stopped is not
thereby aligned.

The score jumps at a cell's border, so a run often stalls there instead of ending where
the gradient vanishes.

The mixture of each Gaussian with a uniform part for outliers, which is part of the
score in [2]_, is an option here (`outliers`), off by default; it divides all
covariances by one number (`ndt.mixture`).

References
----------
.. [1] P. Biber, W. Straßer, "The normal distributions transform: a new approach to
   laser scan matching", 2003 (score and Newton's method). doi:10.1109/IROS.2003.1249285
.. [2] M. Magnusson, "The three-dimensional normal-distributions transform", doctoral
   thesis, Örebro University, 2009, ch. 6.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, cast

import numpy as np

from solvers.core import validate
from solvers.core.arrays import BoolArray, FloatArray, IntArray, ReasonArray, StatusArray
from solvers.core.brief import brief
from solvers.core.kinds import shown
from solvers.core.method import Method, Problem
from solvers.core.pose import Pose
from solvers.core.status import Status, mark, reasons, statuses
from solvers.core.tree import CONSTANT, SHARED, changed, put, take
from solvers.geometry.spectral import symmetric_eigen
from solvers.methods.ndt import d2d_score, mixture, ndt_map
from solvers.methods.ndt.ndt_map import NdtMap
from solvers.methods.ndt.score import Score, evaluate
from solvers.numerics import newton
from solvers.numerics.fits import about, weighted_centroid, weighted_radius
from solvers.numerics.gauss_newton import rotation, turned

OUTSIDE = "no moved point lies in a cell of the map"
TOGETHER = 4
"""How many halvings of a step are scored at once."""
FREE = 1e-9
"""At rest, an eigenvalue of the Hessian below this fraction of the largest leaves its direction free."""


@dataclass(frozen=True)
class NdtOptions:
    """Options of `ndt`.

    Parameters
    ----------
    cells : float or sequence of float, optional
        One cell size or several, coarse to fine, world units. None is twice the
        target's `ndt_map.default_size`, then that.
    grids : int, default 4
        The number of grids, 1 or 4.
    offset : sequence of two floats, default (0.0, 0.0)
        A corner of the first grid, world units. The grid does not move with the scene:
        if both clouds are shifted, the run may end at another pose, unless
        `offset=target.min(axis=0)`.
    max_shift : float, optional
        The longest step, world units. None is half the first cell size.
    max_turn : float, default 0.2
        The largest turn in a step, radians.
    halvings : int, default 4
        How many times a step is halved before the level ends.
    tolerance : float, default 1e-4
        A level also ends when a step's RMS motion of the source points is at most about
        this fraction of their RMS radius: converged if the full Newton step was that
        short, stalled if only its halvings were.
    outliers : float, optional
        The share of outliers, above 0 and below 1, that widens every Gaussian by one
        factor (`ndt.mixture`). None leaves them unchanged, which is the limit of a
        share of one.

    Raises
    ------
    ValueError
        If an option is out of its range.

    Examples
    --------
    >>> from solvers import options, register
    >>> from solvers.scenes import room
    >>> scene = room("clean")
    >>> fine = options.NdtOptions(cells=[1.6, 0.8])
    >>> register(scene.source, scene.target, "ndt", options=fine).detail("level")
    np.int64(1)
    """

    cells: float | Sequence[float] | FloatArray | None = None
    grids: int = 4
    offset: Sequence[float] | FloatArray = (0.0, 0.0)
    max_shift: float | None = None
    max_turn: float = 0.2
    halvings: int = 4
    tolerance: float = 1e-4
    outliers: float | None = None

    def __post_init__(self) -> None:
        # Store tuples, since the caller's array could change later.
        cells = sizes(self.cells)
        object.__setattr__(self, "cells", cells[0] if cells and not np.ndim(cast(Any, self.cells)) else cells)
        if validate.count(self.grids, "grids") not in (1, 4):
            raise ValueError(f"grids: expected 1 or 4, got {self.grids!r}")
        corner = validate.one_or_several(self.offset, "offset")
        if len(corner) != 2:
            raise ValueError(f"offset: expected two numbers, got {shown(self.offset)}")
        object.__setattr__(self, "offset", tuple(validate.number(value, "offset", -1e100, 1e100) for value in corner))
        if self.max_shift is not None:
            validate.number(self.max_shift, "max_shift", 1e-100, 1e100)
        validate.number(self.max_turn, "max_turn", 1e-100, 1e100)
        validate.count(self.halvings, "halvings")
        validate.number(self.tolerance, "tolerance", 0.0)
        mixture.check_share(self.outliers)


def sizes(cells: float | Sequence[float] | FloatArray | None) -> tuple[float, ...] | None:
    """The cell sizes as a tuple, in the given order; a ValueError for an invalid size."""
    if cells is None:
        return None
    return tuple(ndt_map.check_size(h, "cells") for h in validate.one_or_several(cells, "cells"))


@dataclass(frozen=True, eq=False)
class NdtState:
    """A pose and its score on the map of the current level; `objective` is −score.

    maps: one per level; sources: the same for the moving cloud if cells replace its points. level: (b,) the current
    one. centre: (b, 2) of the source without strays (`fits.about`), radius: (b,) its RMS radius. at: the score with
    cells, values, gradient and Hessian by (tx, ty, φ) about the moved centroid, at `pose`. Of the last step: damping
    (b,) λ; step (b, 3) as accepted or last tried; halved (b,) the number of halvings; accepted (b,). Of the Hessian at
    `pose`, with the angle scaled by the radius: condition (b,), its largest |eigenvalue| over its smallest; weak (b,
    3), the unit eigenvector (tx, ty, radius · φ) of the smallest, the direction that the score determines least.
    """

    problem: Problem = field(metadata=CONSTANT)
    maps: tuple[NdtMap, ...] = field(metadata=CONSTANT)
    sources: tuple[NdtMap, ...] | None = field(metadata=CONSTANT)
    centre: FloatArray = field(metadata=CONSTANT)
    radius: FloatArray = field(metadata=CONSTANT)
    max_shift: FloatArray = field(metadata=CONSTANT)
    options: NdtOptions = field(metadata=SHARED)
    pose: Pose
    objective: FloatArray
    status: StatusArray
    reason: ReasonArray
    level: IntArray
    at: Score
    damping: FloatArray
    step: FloatArray
    halved: IntArray
    accepted: BoolArray
    condition: FloatArray
    weak: FloatArray

    __repr__ = brief


def moved_by(pose: Pose, step: FloatArray, pivot: FloatArray) -> Pose:
    """The poses (b,) after a step (tx, ty, φ), (b, 3), about the pivots (b, 2)."""
    with np.errstate(over="ignore", under="ignore", invalid="ignore"):
        turn = rotation(step[:, 2:])
        return Pose.trusted(turn @ pose.R, pivot + turned(turn, pose.t - pivot) + step[:, :2], pose.scale)


def levels(problem: Problem, options: NdtOptions) -> list[FloatArray]:
    """The cell sizes of each level, (b,) each."""
    cell_sizes = sizes(options.cells)
    if cell_sizes is None:
        h = ndt_map.default_size(problem.target)
        return [2.0 * h, h]
    return [np.full(problem.size, h) for h in cell_sizes]


def start(problem: Problem, options: NdtOptions, sources: tuple[NdtMap, ...] | None = None) -> NdtState:
    """The state at the starting pose. sources: one map of the moving cloud per level, scored in its place."""
    b, steps = problem.size, levels(problem, options)
    offset = np.asarray(options.offset, dtype=np.float64)
    maps = tuple(ndt_map.build(problem.target, h, offset=offset, grids=options.grids) for h in steps)
    near = about(problem.start.apply(problem.source), problem.target)
    with np.errstate(over="ignore", under="ignore"):
        radius = weighted_radius(problem.source, near) * np.asarray(problem.start.scale)
    radius = np.where((radius > 0.0) & np.isfinite(radius), radius, 1.0)
    shift = 0.5 * steps[0] if options.max_shift is None else np.full(b, options.max_shift)
    level = np.zeros(b, dtype=np.int64)
    centre = weighted_centroid(problem.source, near)
    at = _score(problem, maps, sources, level, centre, problem.start, np.arange(b), options.outliers)
    status, reason = statuses((b,)), reasons((b,))
    for name, group in (("target", maps), ("source", sources or ())):
        for cells in group:
            for words in sorted(set(cells.reason) - {""}):
                message = f"{name}: {words}"
                status, reason = mark(status, reason, np.asarray(cells.reason == words), Status.DEGENERATE, message)
    outside = np.asarray((at.cells < 0).all(axis=(1, 2)))
    status, reason = mark(status, reason, outside, Status.DEGENERATE, OUTSIDE)
    condition, _, weak = _condition(at.hessian, radius)
    return NdtState(
        problem=problem, maps=maps, sources=sources, centre=centre, radius=radius, max_shift=shift, options=options,
        pose=problem.start, objective=-at.score, status=status, reason=reason, level=level, at=at,
        damping=np.zeros(b), step=np.zeros((b, 3)), halved=np.zeros(b, dtype=np.int64),
        accepted=np.zeros(b, dtype=np.bool_), condition=condition, weak=weak,
    )  # fmt: skip


def _score(
    problem: Problem,
    maps: tuple[NdtMap, ...],
    sources: tuple[NdtMap, ...] | None,
    level: IntArray,
    centre: FloatArray,
    pose: Pose,
    which: IntArray,
    outliers: float | None,
) -> Score:
    """The scores of the problems `which` (k,), each at its pose (k,) and on the map of its level (k,)."""
    with np.errstate(over="ignore", under="ignore", invalid="ignore"):
        moved, pivot = pose.apply(problem.source[which]), _pivot(pose, centre[which])
    k, m = moved.shape[:2]
    width = max(cells.mean.shape[1] for cells in sources) if sources else m
    shape = (k, 1 if sources else maps[0].table.shape[1], width)

    def of(at: int, rows: IntArray) -> Score:
        if sources:
            return d2d_score.evaluate(sources[at], maps[at], pose[rows], pivot[rows], which[rows], width, outliers)
        return evaluate(maps[at], moved[rows], pivot[rows], which[rows], outliers=outliers)

    out = Score(
        np.zeros(k), np.zeros((k, 3)), np.zeros((k, 3, 3)), np.zeros(shape, dtype=np.int64), np.zeros(shape)
    )
    for at in range(len(maps)):
        rows = np.flatnonzero(level == at)
        if len(rows) == k:
            return of(at, rows)
        if len(rows):
            out = put(out, rows, of(at, rows))
    return out


def _pivot(pose: Pose, centre: FloatArray) -> FloatArray:
    """The centres (b, 2) moved by the poses (b,)."""
    with np.errstate(over="ignore", under="ignore", invalid="ignore"):
        return turned(pose.R, centre * np.asarray(pose.scale)[:, None]) + pose.t


def scaled(gradient: FloatArray, hessian: FloatArray, radius: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Gradient and Hessian by (tx, ty, radius · φ), all in world units."""
    unit = np.stack([np.ones_like(radius), np.ones_like(radius), 1.0 / radius], axis=1)
    return gradient * unit, hessian * unit[:, :, None] * unit[:, None, :]


def _condition(hessian: FloatArray, radius: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """The condition number (b,), its inverse (b,) (zero for a zero Hessian), and the weak direction (b, 3)."""
    with np.errstate(over="ignore", under="ignore", invalid="ignore"):
        values, vectors = symmetric_eigen(scaled(hessian[:, 0], hessian, radius)[1])
        size = np.abs(values)
        weak = np.take_along_axis(vectors, size.argmin(axis=1)[:, None, None], axis=2)[..., 0]
        low, high = size.min(axis=1), size.max(axis=1)
        safe = np.where(high > 0.0, high, 1.0)
        condition = np.where(low > 0.0, high / np.where(low > 0.0, low, 1.0), np.inf)
        return np.where(np.isfinite(condition), condition, np.inf), np.where(high > 0.0, low / safe, 0.0), weak


def newton_step(
    gradient: FloatArray, hessian: FloatArray, radius: FloatArray, max_shift: FloatArray, max_turn: float
) -> tuple[FloatArray, FloatArray]:
    """The damped and capped step (tx, ty, φ), (b, 3), and λ, (b,)."""
    with np.errstate(over="ignore", under="ignore", invalid="ignore"):
        step, damping = newton.damped_step(*scaled(gradient, hessian, radius))
        step = step / np.stack([np.ones_like(radius), np.ones_like(radius), radius], axis=1)
        shift, turn = np.linalg.norm(step[:, :2], axis=1) / max_shift, np.abs(step[:, 2]) / max_turn
        return newton.capped(step, (shift, turn)), damping


def step(state: NdtState) -> NdtState:
    """Take one damped Newton step, halved until the score rises; at a level's end, score it on the next level."""
    options, old, radius = state.options, state.at, state.radius
    full, damping = newton_step(old.gradient, old.hessian, radius, state.max_shift, options.max_turn)
    search = _shortened(state, full)
    ended = ~search.better | (_size(search.move, radius) <= options.tolerance)
    last = state.level == len(state.maps) - 1
    up = ended & ~last
    level, at = state.level + up, search.at
    if up.any():
        rows = np.flatnonzero(up)
        at = put(at, rows, _scored(state, level[rows], search.pose[rows], rows))
    condition, ratio, weak = _condition(at.hessian, radius)
    at_end, still = ended & last, _size(full, radius) <= options.tolerance
    status, reason = _stopped(state, at, at_end, still, ratio)
    return changed(
        state, pose=search.pose, objective=-at.score, status=status, reason=reason, level=level, at=at, damping=damping,
        step=search.move, halved=search.halved, accepted=search.better, condition=condition, weak=weak,
    )  # fmt: skip


def _scored(state: NdtState, level: IntArray, pose: Pose, which: IntArray) -> Score:
    """The scores of a state's problems `which` (k,) at the given levels and poses, (k,) each."""
    return _score(
        state.problem, state.maps, state.sources, level, state.centre, pose, which, state.options.outliers
    )


@dataclass(frozen=True, eq=False)
class _Search:
    """The outcome of a step. move: (b, 3) as accepted or last tried; halved: (b,) the number of halvings. better: (b,)
    whether the score rose. pose, at: after the move where the score rose, else unchanged.
    """

    move: FloatArray
    halved: IntArray
    better: BoolArray
    pose: Pose
    at: Score


def _shortened(state: NdtState, full: FloatArray) -> _Search:
    """Take the full step (b, 3), or the longest of its halves, quarters … that raises the score."""
    options, old, move = state.options, state.at, full.copy()
    pivot = _pivot(state.pose, state.centre)
    pose = moved_by(state.pose, move, pivot)
    at = _scored(state, state.level, pose, np.arange(len(move)))
    better = at.score > old.score
    halved = np.zeros(len(better), dtype=np.int64)
    for first in range(0, options.halvings, TOGETHER):
        rows = np.flatnonzero(~better)
        if not rows.size:
            break
        # Score several halvings of every such problem in one evaluation and take the longest step that helps.
        count = min(TOGETHER, options.halvings - first)
        repeated = np.repeat(rows, count)
        shorter = move[repeated] * np.tile(0.5 ** np.arange(1, count + 1), len(rows))[:, None]
        trials = moved_by(state.pose[repeated], shorter, pivot[repeated])
        scores = _scored(state, state.level[repeated], trials, repeated)
        good = (scores.score > old.score[repeated]).reshape(len(rows), count)
        helped = good.any(axis=1)
        longest = np.where(helped, good.argmax(axis=1), count - 1)
        move[rows] = shorter.reshape(len(rows), count, 3)[np.arange(len(rows)), longest]
        halved[rows] += longest + 1
        if helped.any():
            winners, best = rows[helped], (np.arange(len(rows)) * count + longest)[helped]
            pose, at = put(pose, winners, trials[best]), put(at, winners, take(scores, best))
            better[winners] = True
    if not better.all():
        pose, at = put(pose, ~better, state.pose[~better]), put(at, ~better, take(old, ~better))
    return _Search(move, halved, better, pose, at)


def _stopped(
    state: NdtState, at: Score, at_end: BoolArray, still: BoolArray, ratio: FloatArray
) -> tuple[StatusArray, ReasonArray]:
    """The status and reason of the runs. at_end: (b,) whether the last level has ended; still: (b,) whether the full
    step was tiny; ratio: (b,) the Hessian's smallest |eigenvalue| over its largest.
    """
    outside = np.asarray((at.cells < 0).all(axis=(1, 2)))
    status, reason = mark(state.status, state.reason, outside, Status.DEGENERATE, OUTSIDE)
    free = "the score does not change along some direction of motion"
    status, reason = mark(status, reason, at_end & (ratio <= FREE), Status.DEGENERATE, free)
    status, reason = mark(status, reason, at_end & still, Status.CONVERGED, "the pose has come to rest")
    jump = "at most a tiny part of the step raises the score on these cells"
    return mark(status, reason, at_end, Status.STALLED, jump)


def _size(move: FloatArray, radius: FloatArray) -> FloatArray:
    """Roughly how far a step (b, 3) moves the points, as a fraction of the radius."""
    with np.errstate(over="ignore", under="ignore", invalid="ignore"):
        return np.hypot(np.hypot(move[:, 0], move[:, 1]) / radius, move[:, 2])


NDT = Method(
    name="ndt",
    summary="climbs the score of Gaussians in the target's grid cells by damped Newton steps, coarse to fine",
    source="Biber & Straßer 2003",
    start=start,
    step=step,
    options=NdtOptions,
)
