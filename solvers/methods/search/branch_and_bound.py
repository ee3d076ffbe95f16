"""Branch and bound in the plane: the globally best pose, with a proof that none is better by more than a gap.

The objective is the mean of `min(r_i², cap²)` over the source points, r_i the distance
to the nearest target point: that of `capped-icp`, divided by the number of points.
Poses are kept as boxes (`solvers.methods.search.bounds`), each with a lower bound of
the objective within it. A step takes the boxes with the lowest bounds, splits them,
bounds the parts, and drops every part that cannot hold a pose better by more than `gap`
than the best one found. That pose's objective is an upper bound of the optimum; the
lowest bound of any box, dropped or left, is a lower bound. When no box is left, the two
are within `gap`.

Upper bounds ("ceilings" in the code) come from capped ICP: in the first step from the
start and from the best of a coarse sweep over all poses, later whenever the middle of a
promising box beats the best pose. The start plays no other part, unless `turn` or
`shift` confine the search to its neighbourhood.

The proof concerns the objective, computed in floating point: the coarse bound is
lowered by more than float32 can lose, and the fine one is right to about 1e-12. It says
nothing about the truth. The time grows with the number of source points; thin large
clouds first (`solvers.thinning`).

References
----------
.. [1] J. Yang, H. Li, D. Campbell, Y. Jia, "Go-ICP: a globally optimal solution to 3D
   ICP point-set registration", 2016 (bounds and the ICP in between; left out: its two
   nested searches, its trimming). doi:10.1109/TPAMI.2015.2513405
.. [2] T. M. Breuel, "Implementation techniques for geometric branch-and-bound matching
   methods", 2003 (planar motions). doi:10.1016/S1077-3142(03)00026-2
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from solvers.core import validate
from solvers.core.arrays import AnyArray, FloatArray, IntArray, ReasonArray, StatusArray
from solvers.core.brief import brief
from solvers.core.extent import EQUAL, at_one_place
from solvers.core.method import Method, Problem
from solvers.core.pose import Pose
from solvers.core.poses import concatenated, stacked
from solvers.core.status import Status, mark, reasons, statuses
from solvers.core.tree import CONSTANT, SHARED, changed
from solvers.geometry import nearest
from solvers.geometry.nearest import Index
from solvers.methods.search.bounds import Boxes, coarse, fine, joined, split
from solvers.methods.search.distance_grid import DistanceGrid, build
from solvers.numerics.fits import fit_pairs, typical_radius

CELLS_PER_CAP = 20
"""The grid's cells per cap."""
_FINE = 0.15  # of the cap: boxes that move points by less get the second-order bound
_SWEEP_TURNS, _SWEEP_PLACES, _DESCENTS, _DESCENT_STEPS = 72, 5, 12, 60
FARTHEST = 1e4
"""The most caps that a cloud may span; beyond it, boxes small enough to bound are too small a part of the search."""
_TRIED = 16  # middles whose objective is evaluated in a step


@dataclass(frozen=True)
class BranchAndBoundOptions:
    """Options of `branch-and-bound`.

    The objective is the mean over the source points of min(d, cap)², d the distance to
    the nearest target point.

    Parameters
    ----------
    cap : float, optional
        The distance at which a point's loss stops growing, world units. None is an
        eighth of the target's RMS radius, the root mean square distance of its points
        from their mean, without strays, points more than 20 times as far out as the
        median point. `result.detail("ground").cap` is the one used; `ground` is None if
        the clouds could not be searched.
    gap : float, optional
        The most by which another pose's objective may lie below the result's, in
        squared world units. None is the square of a hundredth of that radius.
    turn : float, default π
        How far to search to either side of the start's heading, radians; π is the whole
        circle.
    shift : float, optional
        How far to search along x and along y from where the start puts the source's
        centroid, world units; 0 treats the translation as known. None is wherever any
        source point can come within the cap of the target, and so is a shift that
        reaches beyond that on all sides.
    boxes : int, default 2048
        The most boxes that a step splits.
    most : int, default 500000
        The search ends, capped, when more boxes than this are left.

    Raises
    ------
    ValueError
        If an option is out of its range.

    Examples
    --------
    >>> from solvers import options, register, scenes
    >>> scene = scenes.room("clean")
    >>> coarse = options.BranchAndBoundOptions(gap=0.01)
    >>> bool(register(scene.source, scene.target, "branch-and-bound", options=coarse).gap <= 0.01)
    True
    """

    cap: float | None = None
    gap: float | None = None
    turn: float = np.pi
    shift: float | None = None
    boxes: int = 2048
    most: int = 500_000

    def __post_init__(self) -> None:
        for name in ("cap", "gap"):
            value = getattr(self, name)
            if value is not None and not validate.number(value, name, high=1e100) > 0.0:
                raise ValueError(f"{name}: expected a number above 0, got {value!r}")
        validate.number(self.turn, "turn", 0.0, np.pi)
        if self.shift is not None:
            validate.number(self.shift, "shift", 0.0, 1e100)
        validate.count(self.boxes, "boxes", 1)
        validate.count(self.most, "most", 1)


@dataclass(frozen=True, eq=False)
class Ground:
    """The fixed data of one problem's search; lengths other than `cap`, `middle` and `mean` are in caps.

    middle: (2,) the target's, the origin of places. mean: (2,) the source's centroid. arms: (m, 2) the source relative
    to it. reach: their RMS length. root: the box of all poses searched. gap: in squared caps.
    """

    grid: DistanceGrid
    index: Index
    middle: FloatArray
    mean: FloatArray
    arms: FloatArray
    reach: float
    cap: float
    gap: float
    root: Boxes

    def in_world(self, boxes: Boxes) -> Boxes:
        """The boxes with lengths and bounds in world units."""
        unit = self.cap
        middle = np.column_stack([boxes.middle[:, 0], boxes.middle[:, 1:] * unit + self.middle])
        return Boxes(middle, boxes.half * (1.0, unit), boxes.bound * unit**2)

    def pose(self, turn: FloatArray, position: FloatArray) -> Pose:
        """The poses that turn the source by `turn` (k,) and put its centroid at `position` (k, 2), in caps."""
        still = Pose.from_angle(turn, np.zeros((len(turn), 2)))
        return Pose.trusted(still.R, position * self.cap + self.middle - still.R @ self.mean)


@dataclass(frozen=True, eq=False)
class BranchAndBoundState:
    """The boxes left and the best pose found; `objective` is the mean capped squared distance at `pose`.

    Attributes
    ----------
    ground : ndarray of object, shape (b,)
        The fixed data of each problem's search, a `Ground`.
    boxes : ndarray of object, shape (b,)
        The boxes left, `Boxes` in caps from the target's middle; `Ground.in_world`
        converts them to world units.
    discarded : ndarray of object, shape (b,)
        The boxes that the last step dropped.
    lower : ndarray of shape (b,)
        No pose searched has a smaller objective.
    dropped : ndarray of shape (b,)
        The lowest bound of any box dropped.
    examined, left : ndarray of int, shape (b,)
        How many boxes have been bounded, and how many are left.
    """

    problem: Problem = field(metadata=CONSTANT)
    ground: AnyArray = field(metadata=CONSTANT)
    options: BranchAndBoundOptions = field(metadata=SHARED)
    pose: Pose
    objective: FloatArray
    lower: FloatArray
    dropped: FloatArray
    boxes: AnyArray
    discarded: AnyArray
    examined: IntArray
    left: IntArray
    status: StatusArray
    reason: ReasonArray

    __repr__ = brief


def start(problem: Problem, options: BranchAndBoundOptions) -> BranchAndBoundState:
    """The state with all poses in one box; degenerate where all points of a cloud coincide."""
    b = problem.size
    ground, boxes, discarded = (np.empty(b, dtype=object) for _ in range(3))
    status, reason = statuses((b,)), reasons((b,))
    for name, points in (("source", problem.source), ("target", problem.target)):
        status, reason = mark(status, reason, at_one_place(points), Status.DEGENERATE, EQUAL.format(name))
    radius, index = typical_radius(problem.target), nearest.build(problem.target)
    cap = radius / 8.0 if options.cap is None else np.full(b, options.cap)
    with np.errstate(over="ignore"):
        span = np.abs(problem.source - problem.source[:, :1]).max(axis=(1, 2)) / cap
        wide = np.abs(problem.target - problem.target[:, :1]).max(axis=(1, 2)) / cap
        _, squares = index.nearest(problem.start.apply(problem.source))
        objective = np.minimum(squares, np.square(cap)[:, None]).mean(axis=1)
    far = np.maximum(span, wide) > FARTHEST
    words = f"a cloud is more than {FARTHEST:g} caps wide: leave out its far points, or give a larger cap"
    status, reason = mark(status, reason, far, Status.DEGENERATE, words)
    for i in range(b):
        none = Boxes(np.empty((0, 3)), np.empty((0, 2)), np.empty(0))
        boxes[i] = discarded[i] = none
        if status[i] == Status.RUNNING:
            ground[i] = _ground(problem, options, i, float(radius[i]), float(cap[i]))
            boxes[i] = ground[i].root
    return BranchAndBoundState(
        problem=problem, ground=ground, options=options, pose=problem.start, objective=objective, lower=np.zeros(b),
        dropped=np.full(b, np.inf), boxes=boxes, discarded=discarded, examined=np.zeros(b, dtype=np.int64),
        left=np.array([len(x) for x in boxes], dtype=np.int64), status=status, reason=reason,
    )  # fmt: skip


def step(state: BranchAndBoundState) -> BranchAndBoundState:
    """Split the boxes with the lowest bounds; drop the parts that cannot hold a better pose."""
    b = state.problem.size
    R, t, scale = np.array(state.pose.R), np.array(state.pose.t), np.array(state.pose.scale)
    objective, lower, dropped = state.objective.copy(), state.lower.copy(), state.dropped.copy()
    boxes, discarded = state.boxes.copy(), state.discarded.copy()
    examined, left = state.examined.copy(), state.left.copy()
    for i in range(b):
        ground: Ground = state.ground[i]
        unit = ground.cap**2
        first = state.examined[i] == 0
        # The start may be scaled or lie outside the search, so its objective is not yet a ceiling.
        ceiling = np.inf if first else objective[i] / unit
        best = _sweep(ground, state.problem.start[i], state.problem.source[i]) if first else None
        if best is not None:
            ceiling = best[1]
        lowest, rest = _lowest(boxes[i], state.options.boxes)
        parts = _bounded(ground, split(lowest, ground.reach), ceiling)
        trial = _try_middles(ground, parts, state.problem.source[i], ceiling)
        best = best if trial is None else trial
        if best is not None:
            pose, ceiling = best
            R[i], t[i], scale[i], objective[i] = pose.R, pose.t, 1.0, ceiling * unit
        union = joined(rest, parts)
        hopeful = union.bound < ceiling - ground.gap
        discarded[i], boxes[i] = union.of(~hopeful), union.of(hopeful)
        dropped[i] = min(dropped[i], unit * discarded[i].bound.min(initial=np.inf))
        lower[i] = min(dropped[i], unit * boxes[i].bound.min(initial=np.inf), objective[i])
        examined[i] += len(parts)
        left[i] = len(boxes[i])
    status, reason = mark(state.status, state.reason, left == 0, Status.PROVED, "no box is left")
    many = left > state.options.most
    status, reason = mark(status, reason, many, Status.CAPPED, f"more than {state.options.most} boxes are left")
    return changed(
        state, pose=Pose.trusted(R, t, scale), objective=objective, lower=lower, dropped=dropped, boxes=boxes,
        discarded=discarded, examined=examined, left=left, status=status, reason=reason,
    )  # fmt: skip


def _ground(problem: Problem, options: BranchAndBoundOptions, i: int, radius: float, cap: float) -> Ground:
    source, target, start = problem.source[i], problem.target[i], problem.start[i]
    gap = (radius / 100.0) ** 2 if options.gap is None else options.gap
    low, high = target.min(axis=0), target.max(axis=0)
    middle, mean = 0.5 * low + 0.5 * high, source.mean(axis=0)
    arms = (source - mean) / cap
    lengths = np.hypot(arms[:, 0], arms[:, 1])
    position, heading = np.zeros(2), 0.0
    half = float(0.5 * (high - low).max() / cap + lengths.max() + 1.0)
    if options.shift is not None:
        at, reach = (start.apply(mean[None])[0] - middle) / cap, options.shift / cap
        if np.abs(at).max() + half > reach:  # otherwise it only adds places where every point is beyond the cap
            position, half = at, reach
    if options.turn < np.pi:
        heading = float(np.arctan2(start.R[1, 0], start.R[0, 0]))
    root = Boxes(np.array([[heading, *position]]), np.array([[options.turn, half]]), np.zeros(1))
    return Ground(
        grid=build((target - middle) / cap, 1.0 / CELLS_PER_CAP, 2.0), index=nearest.build(target[None]),
        middle=middle, mean=mean, arms=arms, reach=float(np.sqrt(np.square(lengths).mean())), cap=cap,
        gap=gap / cap / cap, root=root,
    )  # fmt: skip


def _lowest(boxes: Boxes, count: int) -> tuple[Boxes, Boxes]:
    """The `count` boxes with the lowest bounds, and the rest."""
    if len(boxes) <= count:
        return boxes, boxes.of(slice(0, 0))
    order = np.argsort(boxes.bound, kind="stable")
    return boxes.of(order[:count]), boxes.of(order[count:])


def _bounded(ground: Ground, parts: Boxes, ceiling: float) -> Boxes:
    """The boxes with their own bounds: the coarse one, or the fine one for small boxes that the coarse one does not
    settle.

    Bounds are rounded down to multiples of 2⁻⁴⁰ cap², so that boxes that a symmetric scene makes equally good compare
    equal on every machine.
    """
    bound = np.maximum(parts.bound, coarse(ground.grid, ground.arms, parts.middle, parts.half))
    moves = 2.0 * ground.reach * np.sin(0.5 * np.minimum(parts.half[:, 0], np.pi)) + np.sqrt(2.0) * parts.half[:, 1]
    small = np.flatnonzero((bound < ceiling - ground.gap) & (moves < _FINE))
    if small.size:
        bound[small] = np.maximum(
            bound[small], fine(ground.grid, ground.arms, parts.middle[small], parts.half[small])
        )
    return changed(parts, bound=np.floor(bound * 2.0**40) / 2.0**40)


def _sweep(ground: Ground, begin: Pose, source: FloatArray) -> tuple[Pose, float]:
    """The best result of capped ICP from the start and from the best poses of a coarse sweep over the root box."""
    (turn, x, y), (delta, half) = ground.root.middle[0], ground.root.half[0]
    # A centroid outside the target's own extent is seldom right, and the sweep need only give a first ceiling.
    half = min(half, float(-ground.grid.low.min()))
    turns = turn + delta * (2.0 * (np.arange(_SWEEP_TURNS) + 0.5) / _SWEEP_TURNS - 1.0)
    along = half * np.linspace(-0.8, 0.8, _SWEEP_PLACES)
    middle = np.stack([a.ravel() for a in np.meshgrid(turns, x + along, y + along, indexing="ij")], axis=1)
    rough = coarse(ground.grid, ground.arms, middle, np.zeros((len(middle), 2)))
    starts = middle[np.argsort(rough, kind="stable")[:_DESCENTS]]
    swept = ground.pose(starts[:, 0], starts[:, 1:])
    return _descended(ground, concatenated([stacked([begin]), swept]), source)


def _try_middles(ground: Ground, parts: Boxes, source: FloatArray, ceiling: float) -> tuple[Pose, float] | None:
    """The result of capped ICP from the best middle of the most promising boxes, if it beats the ceiling."""
    candidates = parts.of(np.argsort(parts.bound, kind="stable")[:_TRIED])
    poses = ground.pose(candidates.middle[:, 0], candidates.middle[:, 1:])
    _, values = _mean_capped(ground, poses.apply(source))
    k = int(values.argmin())
    if not values[k] < ceiling:
        return None
    return _descended(ground, poses[k : k + 1], source)


def _mean_capped(ground: Ground, moved: FloatArray) -> tuple[tuple[IntArray, FloatArray], FloatArray]:
    """The nearest rows and distances in caps, (k, m) each, of `moved` (k, m, 2), and the objectives (k,) in squared
    caps.
    """
    rows, squares = ground.index.nearest(moved.reshape(1, -1, 2))
    shape = moved.shape[:2]
    distances = np.sqrt(squares.reshape(shape)) / ground.cap
    return (rows.reshape(shape), distances), np.square(np.minimum(distances, 1.0)).mean(axis=1)


def _descended(ground: Ground, poses: Pose, source: FloatArray) -> tuple[Pose, float]:
    """The best pose within the root box that capped ICP finds from any of `poses` (k,), and its objective."""
    target = ground.index.points[0]
    best: tuple[Pose, float] | None = None
    inside = _confined(ground, poses)
    sources = np.broadcast_to(source, (len(inside.t), *source.shape))
    (rows, distances), values = _mean_capped(ground, inside.apply(source))
    for _ in range(_DESCENT_STEPS):
        k = int(values.argmin())
        if best is None or values[k] < best[1]:
            best = inside[k], float(values[k])
        near = (distances <= 1.0).astype(np.float64)
        fitted, _, _ = fit_pairs(inside, sources, target[rows], near)
        inside = _confined(ground, fitted)
        old = values
        (rows, distances), values = _mean_capped(ground, inside.apply(source))
        if not (values < old * (1.0 - 1e-12)).any():
            break
    k = int(values.argmin())
    assert best is not None
    return (inside[k], float(values[k])) if values[k] < best[1] else best


def _confined(ground: Ground, poses: Pose) -> Pose:
    """The poses without scale, moved into the root box where they lie outside it."""
    (turn, *position), (delta, half) = ground.root.middle[0], ground.root.half[0]
    at = (poses.R @ ground.mean + poses.t - ground.middle) / ground.cap
    angle = np.arctan2(poses.R[:, 1, 0], poses.R[:, 0, 0])
    off = np.remainder(angle - turn + np.pi, 2.0 * np.pi) - np.pi
    outside = (np.abs(off) > delta) | (np.abs(at - position) > half).any(axis=1)
    if not outside.any():
        return Pose.trusted(poses.R, poses.t)
    clipped = ground.pose(turn + np.clip(off, -delta, delta), position + np.clip(at - position, -half, half))
    return Pose.trusted(
        np.where(outside[:, None, None], clipped.R, poses.R), np.where(outside[:, None], clipped.t, poses.t)
    )


BRANCH_AND_BOUND = Method(
    "branch-and-bound", "all poses in boxes, those dropped that cannot hold the best: an optimum with a proof",
    "Yang, Li, Campbell & Jia 2016, in the plane", start, step, BranchAndBoundOptions, max_steps=400,
)  # fmt: skip
