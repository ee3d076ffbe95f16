"""A grid of rotations and translations and a blurred target that scores them, for `correlative`.

Rotations are about the source's centroid, translations by whole cells. A turned point keeps its position within its
cell under such translations, so its cell is computed once per angle, and a pose's score is a sum of look-ups in one
table.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from solvers.core.arrays import AnyArray, BoolArray, FloatArray, IntArray
from solvers.core.extent import EQUAL, at_one_place
from solvers.core.pose import Pose
from solvers.core.tree import changed
from solvers.geometry.downsample import spacing
from solvers.numerics.fits import strays

WORTH = 255
"""The worth of a cell with a target point at its centre. Worths are whole numbers, so that sums are exact."""
_ACROSS = 256  # the most cells across the whole field if the cell size is not given
_LEVELS = 4  # the largest window is 2⁴ × 2⁴ cells
_LONGEST = 2**16  # the most cells along a side
_MOST_CELLS = 2**22  # the most in a table
_MOST_SQUARES = 2**22  # the most to bound before the search
_MOST_PLACES = 2**24  # the most stored cells of turned points
_BLOCK = 2**18  # the look-ups done at a time


@dataclass(frozen=True, eq=False)
class Lattice:
    """The poses of one problem and the tables that score them.

    Lengths are world units over 2^exponent. angles: (k,) radians. columns, rows: the number of translations along x and
    y. places: (k, m) the cell of every turned source point at translation (0, 0), as an index into a table. tables: of
    level h = 0, 1, …, each (height · width,), the largest worth in the 2^h × 2^h cells to the right and above. width:
    of a table. margin: the table's cells on either side of `low`, (2,), the centroid's position at translation (0, 0).
    cell: a cell's side. near: (M,) which of the source's points these m are: strays are left out of both clouds.
    radius: of the source, root mean square. centroid: (2,) of the source, middle: (2,) of the target's box, both in
    world units. squares: (n, 3) angle, column and row of the largest squares of translations, ordered by falling
    bound. ceilings: (n,) those upper bounds of the sums.
    """

    angles: FloatArray
    columns: int
    rows: int
    places: AnyArray
    tables: tuple[AnyArray, ...]
    width: int
    margin: int
    low: FloatArray
    cell: float
    near: BoolArray
    radius: float
    centroid: FloatArray
    middle: FloatArray
    exponent: int
    squares: IntArray
    ceilings: IntArray

    @property
    def levels(self) -> int:
        """How many times the largest squares are cut."""
        return len(self.tables) - 1

    @property
    def poses(self) -> int:
        """The number of poses."""
        return len(self.angles) * self.columns * self.rows

    def bounds(self, level: int, squares: IntArray) -> IntArray:
        """The upper bounds, (n,), of the summed worth in each square (n, 3) of angle, column and row, 2^level
        translations wide; at level 0 the sums themselves.
        """
        table, m = self.tables[level], self.places.shape[1]
        away = (squares[:, 2] * self.width + squares[:, 1]).astype(np.int32)
        sums = np.empty(len(squares), dtype=np.int64)
        size = max(1, _BLOCK // m)
        for first in range(0, len(squares), size):
            part = slice(first, first + size)
            at = self.places[squares[part, 0]]
            at += away[part, None]
            sums[part] = table.take(at).sum(axis=1)
        return sums

    def pose(self, place: IntArray) -> tuple[FloatArray, FloatArray]:
        """R (2, 2) and t (2,), world units, at an angle, column and row."""
        R = _rotation(self.angles[place[0]])
        centre = self.middle + np.ldexp(self.low + self.cell * place[1:], self.exponent)
        return R, centre - R @ self.centroid

    def score(self, pose: Pose, source: FloatArray) -> float:
        """The score, 0 to 1, of the source (M, 2) at any pose, on the grid or off it."""
        moved = np.ldexp(pose.apply(source[self.near]) - self.middle, -self.exponent)
        at = np.floor((moved - self.low) / self.cell) + self.margin
        height = len(self.tables[0]) // self.width
        inside = ((at >= 0.0) & (at < [self.width, height])).all(axis=1)
        column, row = at[inside].astype(np.int64).T
        return float(self.tables[0][row * self.width + column].sum() / (WORTH * len(source)))

    def beside(self, squares: IntArray, place: IntArray, apart: float) -> BoolArray:
        """Whether each pose (n, 3) is a neighbour of the one at `place`, (n,)."""
        shift = self.cell * (squares[:, 1:] - place[1:])
        arc = 2.0 * self.radius * np.sin(0.5 * (self.angles[squares[:, 0]] - self.angles[place[0]]))
        near: BoolArray = np.square(shift).sum(axis=1) + np.square(arc) <= np.square(apart * self.radius)
        return near


def _rotation(angle: float) -> FloatArray:
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s], [s, c]])


def _tables(points: FloatArray, shape: tuple[int, int], blur: float, levels: int) -> tuple[AnyArray, ...]:
    """The tables of `Lattice` for target points (n, 2) in cells of a (height, width)
    grid.
    """
    reach = int(np.ceil(3.0 * blur))
    around = np.arange(-reach, reach + 1)
    home = np.floor(points)
    gap = home[:, :, None] + around + 0.5 - points[:, :, None]
    squares = np.square(gap[:, 1, :, None]) + np.square(gap[:, 0, None, :])
    worth = np.rint(WORTH * np.exp(-squares / (2.0 * blur**2)))
    cells = home.astype(np.int64)[:, :, None] + around
    y, x = np.broadcast_arrays(cells[:, 1, :, None], cells[:, 0, None, :])
    inside = (x >= 0) & (x < shape[1]) & (y >= 0) & (y < shape[0])
    table = np.zeros(shape, dtype=np.int32)
    np.maximum.at(table, (y[inside], x[inside]), worth[inside].astype(np.int32))
    tables = [table]
    for level in range(levels):
        half, wide = 2**level, tables[-1].copy()
        wide[:, :-half] = np.maximum(wide[:, :-half], wide[:, half:])
        wide[:-half] = np.maximum(wide[:-half], wide[half:])
        tables.append(wide)
    return tuple(t.ravel() for t in tables)


@dataclass(frozen=True)
class Window:
    """The poses to search. cell: its side, None for the default. blur: in cells. angle: the step, None for the
    default. shift, turn: the range about the start, None for everywhere.
    """

    cell: float | None
    blur: float
    angle: float | None
    shift: float | None
    turn: float | None


def build(source: FloatArray, target: FloatArray, start: Pose, window: Window) -> Lattice | str:
    """The lattice of one problem (m, 2), (n, 2), or the reason why there is none."""
    near = ~strays(source[None])[0]
    source, target = source[near], target[~strays(target[None])[0]]
    clouds = _centred(source, target)
    if isinstance(clouds, str):
        return clouds
    cell = _cell(clouds, window)
    if isinstance(cell, str):
        return cell
    shifts = _shifts(clouds, cell, start, window)
    if isinstance(shifts, str):
        return shifts
    angles = _angles(clouds, cell, start, window)
    columns, rows = shifts.columns, shifts.rows
    levels = 0
    while levels < _LEVELS and 2 ** (levels + 1) < max(columns, rows):
        levels += 1
    margin = int(np.ceil(clouds.farthest / cell)) + 1
    shape = rows + 2 * margin + 2**levels, columns + 2 * margin + 2**levels
    squares = len(angles) * -(-columns // 2**levels) * -(-rows // 2**levels)
    if shape[0] * shape[1] > _MOST_CELLS or squares > _MOST_SQUARES:
        return f"the cells are too small: {columns} by {rows} translations and {len(angles)} angles are too many"
    if len(angles) * len(source) > _MOST_PLACES:
        points = f"{len(source)} source points at {len(angles)} angles are too many"
        return f"{points}: thin the source, or give a larger cell or angle"
    at = np.floor(_turned(clouds.source, angles) / cell).astype(np.int32) + np.int32(margin)
    none = np.empty(0, dtype=np.int64)
    return _with_squares(Lattice(
        angles=angles, columns=columns, rows=rows, places=at[..., 1] * np.int32(shape[1]) + at[..., 0],
        tables=_tables((clouds.target - shifts.corner) / cell + margin, shape, window.blur, levels), width=shape[1],
        margin=margin, low=shifts.corner, cell=cell, near=near,
        radius=float(np.sqrt(np.square(clouds.lengths).mean())), centroid=clouds.centroid, middle=clouds.middle,
        exponent=clouds.exponent, squares=none, ceilings=none,
    ))  # fmt: skip


@dataclass(frozen=True, eq=False)
class _Clouds:
    """Both clouds, each about its own middle, divided by 2^exponent.

    source: (m, 2) about `centroid`, (2,) in world units. target: (n, 2) about `middle`, (2,), that of its box,
    likewise. half: (2,) half the sides of that box. lengths: (m,) each source point's distance from the centroid.
    """

    source: FloatArray
    target: FloatArray
    centroid: FloatArray
    middle: FloatArray
    half: FloatArray
    lengths: FloatArray
    exponent: int

    @property
    def farthest(self) -> float:
        """The largest distance of a source point from the centroid."""
        return float(self.lengths.max())


def _centred(source: FloatArray, target: FloatArray) -> _Clouds | str:
    """The clouds about their middles, or the reason why no rotation can be found."""
    centroid = source.min(axis=0) + (source - source.min(axis=0)).mean(axis=0)
    low, high = target.min(axis=0), target.max(axis=0)
    middle = low + 0.5 * (high - low)
    p, q = source - centroid, target - middle
    for name, points in (("source", source), ("target", target)):
        if at_one_place(points):
            return EQUAL.format(name)
    exponent = int(np.frexp(max(np.abs(p).max(), np.abs(q).max()))[1])
    p, q = np.ldexp(p, -exponent), np.ldexp(q, -exponent)
    half = 0.5 * np.ldexp(high - low, -exponent)
    return _Clouds(p, q, centroid, middle, half, np.hypot(p[:, 0], p[:, 1]), exponent)


def _cell(clouds: _Clouds, window: Window) -> float | str:
    """The side of a cell: as given, or the target's spacing, enlarged if there would be too many cells; or the reason
    why the cells do not suit the clouds.
    """
    across = float(clouds.half.max()) + clouds.farthest
    if window.cell is None:
        cell = max(spacing(clouds.target), 2.0 * across / _ACROSS)
    else:
        cell = float(np.ldexp(window.cell, -clouds.exponent))
    if cell <= 0.0 or (across + clouds.farthest) / cell > _LONGEST:
        return "the cells are too small for clouds so wide"
    for name, width in (("source", clouds.farthest), ("target", float(clouds.half.max()))):
        if width < 0.5 * cell:
            return f"all {name} points lie within one cell: the rotation is undefined"
    return cell


@dataclass(frozen=True, eq=False)
class _Shifts:
    """The translations: `columns` by `rows` of them, in whole cells from `corner`, (2,)."""

    corner: FloatArray
    columns: int
    rows: int


def _shifts(clouds: _Clouds, cell: float, start: Pose, window: Window) -> _Shifts | str:
    """The translations at which the clouds can overlap, or the reason why there are none."""
    reach = clouds.half + clouds.farthest
    if window.shift is None:
        centre, most = np.zeros(2), float(reach.max())
    else:
        centre = np.ldexp(start.apply(clouds.centroid[None])[0] - clouds.middle, -clouds.exponent)
        most = float(np.ldexp(window.shift, -clouds.exponent))
    first = np.maximum(-np.floor(most / cell), np.ceil((-reach - centre) / cell))
    last = np.minimum(np.floor(most / cell), np.floor((reach - centre) / cell))
    if np.any(last < first):
        return f"nothing overlaps within {window.shift:g} u of the start"
    columns, rows = (int(k) for k in last - first + 1)
    return _Shifts(centre + cell * first, columns, rows)


def _angles(clouds: _Clouds, cell: float, start: Pose, window: Window) -> FloatArray:
    """The angles (k,); the default step moves the farthest point by one cell."""
    step = window.angle or 2.0 * np.arcsin(0.5 * cell / clouds.farthest)
    if window.turn is None:
        count = np.ceil(2.0 * np.pi / step * (1.0 - 1e-12))
        return np.asarray(2.0 * np.pi / count * np.arange(count))
    count = np.floor(window.turn / step * (1.0 + 1e-12))
    return np.asarray(float(np.arctan2(start.R[1, 0], start.R[0, 0])) + step * np.arange(-count, count + 1.0))


def _turned(points: FloatArray, angles: FloatArray) -> FloatArray:
    """The points (m, 2) turned by each angle (k,), (k, m, 2)."""
    c, s = np.cos(angles), np.sin(angles)
    return np.asarray(np.einsum("kij,mj->kmi", np.stack([c, -s, s, c], axis=-1).reshape(-1, 2, 2), points))


def _with_squares(lattice: Lattice) -> Lattice:
    """The lattice with its largest squares, ordered by falling bound."""
    size = 2**lattice.levels
    counts = (len(lattice.angles), 1), (lattice.columns, size), (lattice.rows, size)
    axes = [np.arange(0, count, step, dtype=np.int64) for count, step in counts]
    squares = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    ceilings = lattice.bounds(lattice.levels, squares)
    order = np.argsort(-ceilings, kind="stable")
    return changed(lattice, squares=squares[order], ceilings=ceilings[order])
