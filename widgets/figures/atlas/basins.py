"""Runs from a lattice of starts, coarse first: where each ends, the kind of that end, and which ends are the same.

The starts lie at the centres of ROWS × COLUMNS tiles, the turn along the columns and the offset along the rows. Level 0
runs every fourth row and column; the later levels first add every second, then all, a few rows at a time. A tile whose
own start has not been run shows the end of a nearby start of a coarser lattice, so every level shows ends of the full
map. Results are kept, and no start is run twice.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Any

import numpy as np

from solvers import Pose
from solvers.api import register
from solvers.core.arrays import BoolArray, IntArray
from solvers.core.status import Status
from solvers.metrics import rre, rte
from solvers.scenes.rooms import ROOM_START_DIRECTION, Scene, room
from solvers.studies.benchmark import is_close
from widgets.drawing.picture import Array, Role

ROWS, COLUMNS = 48, 64
LOW, HIGH = -180.0, 180.0  # the starts' turn, degrees
FARTHEST = 3.0  # u, the starts' offset
THINNED = 2  # every second source point is used: a map is thousands of runs
HALVES, BANDS = 3, 12  # slices of the lattice of every second start, and of the full one: each takes as long as level 0
LEVELS = 1 + HALVES + BANDS

METHODS = {"icp": "Point to point", "point-to-plane": "Point to plane", "ndt": "NDT"}

TRUTH, SHIFTED, TURNED, QUARTER, HALF, NONE = range(6)
KINDS: tuple[Role, ...] = ("truth", "end-shifted", "end-turned", "end-quarter", "end-half", "end-none")
EDGES = (15.0, 75.0, 135.0)  # degrees, between the four kinds of a wrong end
NAMES = ("the truth", "shifted", "turned", "quarter turn", "half turn", "no fit")


@dataclass(frozen=True)
class Ask:
    """What to run from every start. gate: u, infinite for none; NDT has none. outliers: the fraction of each cloud."""

    method: str
    gate: float
    setting: str
    seed: int
    noise: float
    outliers: float

    @property
    def options(self) -> dict[str, Any]:
        """The solver's options that differ from its defaults."""
        return {"gate": self.gate} if np.isfinite(self.gate) and self.method != "ndt" else {}


@dataclass(frozen=True, eq=False)
class Ends:
    """Where runs ended: poses (…,), and the index of each end's kind in KINDS."""

    pose: Pose
    kind: IntArray


@dataclass(frozen=True, eq=False)
class Track:
    """One run: its poses (k + 1,), the RMS distance to the nearest target points at each, why it stopped, and its end's
    kind."""

    poses: Pose
    rms: Array
    status: Status
    reason: str
    kind: int

    @property
    def steps(self) -> int:
        """The number of steps it took."""
        return len(self.rms) - 1


def starts(turn: Array, offset: Array) -> Pose:
    """The poses turned by `turn` degrees about the room's origin, then moved by `offset` u; both of one shape."""
    return Pose.from_angle(np.radians(turn), np.asarray(offset)[..., None] * ROOM_START_DIRECTION)


def kinds(pose: Pose, truth: Pose, status: Any) -> IntArray:
    """The kinds of ends, by their errors against the truth and by whether the run was capped or degenerate."""
    turn = np.degrees(rre(pose, truth))
    failed = np.isin(status, (int(Status.CAPPED), int(Status.DEGENERATE)))
    near = is_close(turn, rte(pose, truth))
    return np.where(near, TRUTH, np.where(failed, NONE, SHIFTED + np.searchsorted(EDGES, turn, "right")))


def alike(a: Pose, b: Pose) -> BoolArray:
    """Which ends are the same: as close to each other as an end must be to the truth."""
    return is_close(np.degrees(rre(a, b)), rte(a, b))


class Runs:
    """The ends of the runs from all starts, as far as they have been requested."""

    def __init__(self, ask: Ask) -> None:
        self.ask = ask
        self.scene: Scene = room(ask.setting, seed=ask.seed, noise=ask.noise, outliers=ask.outliers)
        self.source = self.scene.source[::THINNED]
        self._pose = Pose.identity(batch=(ROWS, COLUMNS))
        self._kind: IntArray = np.full((ROWS, COLUMNS), NONE)
        self._level = -1
        self._shown: tuple[int, Ends] | None = None  # the last level that was requested
        self._tracks: dict[tuple[int, int], Track] = {}

    def ends(self, level: int) -> Ends:
        """What each tile shows at a level, (ROWS, COLUMNS), row 0 at no offset."""
        if level > self._level:
            self._compute(run_at(level) & ~run_at(self._level))
            self._level = level
        if self._shown is None or self._shown[0] != level:
            rows, columns = seen(level)
            self._shown = level, Ends(self._pose[rows, columns], self._kind[rows, columns])
        return self._shown[1]

    def track(self, row: int, column: int) -> Track:
        """The run from a tile's own start."""
        if (row, column) not in self._tracks:
            self._tracks[row, column] = self._track(start_of(row, column))
        return self._tracks[row, column]

    def _compute(self, mask: BoolArray) -> None:
        rows, columns = np.nonzero(mask)
        turn, offset = TURNS[columns], OFFSETS[rows]
        result = register(
            self.source, self.scene.target, self.ask.method, start=starts(turn, offset), **self.ask.options
        )
        R, t = self._pose.R.copy(), self._pose.t.copy()
        R[rows, columns], t[rows, columns] = result.pose.R, result.pose.t
        self._pose = Pose(R, t)
        self._kind[rows, columns] = kinds(result.pose, self.scene.truth, result.status)

    def _track(self, start: Pose) -> Track:
        result = register(self.source, self.scene.target, self.ask.method, start=start, **self.ask.options)
        poses = result.history.poses
        moved = poses.apply(self.source)
        squares = ((moved[:, :, None] - self.scene.target) ** 2).sum(axis=-1).min(axis=-1)
        status, reason = Status(int(result.status)), str(result.reason)
        kind = int(kinds(result.pose, self.scene.truth, status))
        return Track(poses, np.sqrt(squares.mean(axis=-1)), status, reason, kind)


@lru_cache(maxsize=8)
def runs(ask: Ask) -> Runs:
    """The cached runs of an Ask, so that returning to a recent gate runs nothing."""
    return Runs(ask)


class Atlas:
    """One figure's view of the runs. Its level of detail is its own, whatever other views have had computed, so no
    frame depends on what was drawn before.
    """

    def __init__(self, ask: Ask) -> None:
        self.ask = ask
        self._runs = runs(ask)
        self._level = 0

    @property
    def scene(self) -> Scene:
        """The two scans."""
        return self._runs.scene

    @property
    def source(self) -> Array:
        """The source points that are used, (m, 2)."""
        return self._runs.source

    @property
    def known(self) -> int:
        """The finest level drawn so far; 0 also if none was."""
        return self._level

    def ends(self, level: int) -> Ends:
        """What each tile shows at a level, (ROWS, COLUMNS), row 0 at no offset."""
        self._level = max(self._level, level)
        return self._runs.ends(level)

    def track(self, row: int, column: int) -> Track:
        """The run from a tile's own start."""
        return self._runs.track(row, column)


TURNS = LOW + (np.arange(COLUMNS) + 0.5) * (HIGH - LOW) / COLUMNS
OFFSETS = (np.arange(ROWS) + 0.5) * FARTHEST / ROWS
TURNS.flags.writeable = OFFSETS.flags.writeable = False


def start_of(row: int, column: int) -> Pose:
    """The start of one tile."""
    return starts(TURNS[column], OFFSETS[row])


def tile_at(turn: float, offset: float) -> tuple[int, int]:
    """Row and column of the tile at a place of the map; the nearest one if the place is off the map."""
    column = np.floor((turn - LOW) / (HIGH - LOW) * COLUMNS)
    row = np.floor(offset / FARTHEST * ROWS)
    return int(np.clip(row, 0, ROWS - 1)), int(np.clip(column, 0, COLUMNS - 1))


def run_at(level: int) -> BoolArray:
    """The tiles whose starts have been run at a level, (ROWS, COLUMNS); none before level 0. The larger offsets come
    first, since the map is most fragmented there."""
    if level < 0:
        return np.zeros((ROWS, COLUMNS), dtype=np.bool_)
    rows, columns = np.arange(ROWS)[:, None], np.arange(COLUMNS)
    quarter, half = ((rows % s == 1) & (columns % s == 1) for s in (4, 2))
    halves, bands = min(level, HALVES), max(level - HALVES, 0)
    half &= rows >= ROWS - ROWS * halves // HALVES
    return np.asarray(quarter | half | (rows >= ROWS - ROWS * bands // BANDS))


def seen(level: int) -> tuple[IntArray, IntArray]:
    """Row and column of the start whose end each tile shows, (ROWS, COLUMNS) each: its own, else that of the finest
    lattice that has been run there."""
    has = run_at(level)
    rows, columns = np.broadcast_arrays(np.arange(ROWS)[:, None], np.arange(COLUMNS))
    row, column = rows // 4 * 4 + 1, columns // 4 * 4 + 1
    second = rows // 2 * 2 + 1, columns // 2 * 2 + 1
    has_second = has[second]
    row, column = np.where(has_second, second[0], row), np.where(has_second, second[1], column)
    return np.where(has, rows, row), np.where(has, columns, column)


@dataclass(frozen=True)
class Count:
    """The outcome of all runs at a level, each counted once. by_kind: how many of each of KINDS."""

    starts: int
    by_kind: tuple[int, ...]

    @cached_property
    def reached(self) -> float:
        """The percentage of starts that reach the truth."""
        return 100.0 * self.by_kind[TRUTH] / self.starts


def count(ends: Ends, level: int) -> Count:
    """Count the starts that have been run at a level, not the tiles that show them."""
    own = ends.kind[run_at(level)]
    return Count(len(own), tuple(np.bincount(own, minlength=len(KINDS)).tolist()))


def borders(differ_across: BoolArray, differ_up: BoolArray) -> tuple[Array, Array]:
    """Both ends (k, 2), in degrees and u, of the lines between tiles that differ from their neighbours.

    differ_across: (ROWS, COLUMNS − 1), differ_up: (ROWS − 1, COLUMNS). Consecutive pieces are joined.
    """
    x, y = np.linspace(LOW, HIGH, COLUMNS + 1), np.linspace(0.0, FARTHEST, ROWS + 1)
    column, first, last = _pieces(differ_across.T)
    upright = [np.stack([x[column + 1], y[edge]], axis=1) for edge in (first, last)]
    row, first, last = _pieces(differ_up)
    level = [np.stack([x[edge], y[row + 1]], axis=1) for edge in (first, last)]
    return np.concatenate([upright[0], level[0]]), np.concatenate([upright[1], level[1]])


def _pieces(marked: BoolArray) -> tuple[IntArray, IntArray, IntArray]:
    """The runs of true values along the rows of an array: row, first column, column after the last."""
    padded = np.pad(marked, ((0, 0), (1, 1))).astype(np.int8)
    row, first = np.nonzero(np.diff(padded, axis=1) == 1)
    _, last = np.nonzero(np.diff(padded, axis=1) == -1)
    return row, first, last


def between(ends: Ends) -> tuple[Array, Array]:
    """The borders between tiles whose runs end in different places."""
    p = ends.pose
    return borders(~alike(p[:, 1:], p[:, :-1]), ~alike(p[1:], p[:-1]))


def around(inside: BoolArray) -> tuple[Array, Array]:
    """The rim of a set of tiles, without the map's edge."""
    return borders(inside[:, 1:] != inside[:, :-1], inside[1:] != inside[:-1])
