"""A reader's own clouds, read from files or drawn: projected onto the plane, thinned and fitted to the figure's window.

The figure draws in units of its window; the clouds and the pose keep those of their files. `Fit` converts.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import lru_cache

import numpy as np

from solvers import Pose
from solvers.core.amounts import amount
from solvers.geometry.downsample import slab, spacing, thinned
from solvers.io.clouds import CloudText, read
from solvers.scenes.drive import telecom_loop
from solvers.scenes.hall_3d import hall
from solvers.scenes.rooms import room
from widgets.drawing.picture import Array
from widgets.parts.drive_table import table
from widgets.parts.room import VIEW

LARGEST, LEAST = 1e15, 1e-9  # of a coordinate, of a cloud's width: readouts have nine decimals, a float64 16 digits
ROUNDING = 1e-12  # of the largest coordinate: places at most this far apart count as one
FINEST = 1e-15  # in the files' unit: the least such distance, however small the coordinates
EXAMPLES = {"room": "Room", "part": "Partly seen", "hall": "Hall in 3-D", "drive": "Real scans"}
SCANS = 225  # in the recorded drive
FARTHEST = 30.0  # m: farther echoes are too sparse to give a wall a normal


@dataclass(frozen=True, eq=False)
class Given:
    """One cloud that a reader supplied. name: its file's, or "" if it was drawn, in units of the window."""

    name: str
    text: CloudText

    @property
    def points(self) -> Array:
        """(n, 2) or (n, 3), in the file's unit."""
        return self.text.points

    @property
    def words(self) -> str:
        """A one-line description."""
        n, d = self.points.shape
        if not self.name:
            return f"Drawn by hand: {amount(n, 'point')}."
        notices = "".join(f"; {notice}" for notice in self.text.notices)
        return f"{amount(n, 'point')} in {d}-D, {self.text.format}{notices}."


def reads(name: str, data: bytes) -> Given:
    """Read a cloud from the name and the bytes of its file.

    Raises ValueError that names the faulty line, and for coordinates in a unit that the figure cannot show.
    """
    text = read(data)
    largest, width = float(np.abs(text.points).max()), float(np.ptp(text.points, axis=0).max())
    if largest > LARGEST:
        raise ValueError(f"a coordinate is {largest:.3g}; expected none beyond {LARGEST:g}. Write it in a larger unit")
    if 0.0 < width < LEAST:
        raise ValueError(f"the cloud is {width:.3g} wide; expected at least {LEAST:g}. Write it in a smaller unit")
    return Given(name, text)


@dataclass(frozen=True, eq=False)
class Raw:
    """Both clouds as supplied, (n, 2) or (n, 3); either may be missing. names: the files that a script reads them from;
    drawn: whether neither came from a file or an example. wheels, graph: for two scans of the drive, each in its
    robot's coordinates, the pose by odometry and that in the drive's closed graph."""

    source: Array | None
    target: Array | None
    names: tuple[str, str] = ("", "")
    drawn: bool = False
    wheels: Pose | None = None
    graph: Pose | None = None


@lru_cache(maxsize=8)
def example(name: str, seed: int) -> Raw:
    """One of `EXAMPLES`."""
    if name == "hall":
        scans = hall(seed)
        return Raw(scans.source, scans.target)
    scene = room("noise", seed=seed, overlap=0.6 if name == "part" else 1.0)
    moved = Pose.from_angle(np.radians(-25.0), (-0.6, 0.5)).apply(scene.source)
    return Raw(moved, scene.target)


@lru_cache(maxsize=8)
def driven(scan: int, onto: int) -> Raw:
    """Two scans of the recorded drive, 0 to 224, the source first, in metres."""
    drive, poses = telecom_loop(), table()
    wheels, graph = (poses.way(name, "cauchy", False) for name in ("odometry", "closed"))
    return Raw(
        drive.points(scan, FARTHEST),
        drive.points(onto, FARTHEST),
        wheels=wheels[onto].inverse().compose(wheels[scan]),
        graph=graph[onto].inverse().compose(graph[scan]),
    )


@lru_cache(maxsize=4)
def brought(source: Given | None, target: Given | None) -> Raw:
    """The clouds that a reader supplied: both, one or none."""
    clouds = [cloud for cloud in (source, target) if cloud is not None]
    return Raw(
        None if source is None else source.points,
        None if target is None else target.points,
        ("" if source is None else source.name, "" if target is None else target.name),
        not any(cloud.name for cloud in clouds),
    )


@dataclass(frozen=True)
class Fit:
    """The map from the clouds' plane to the window: F(p) = scale · (p − centre), from file units to window units."""

    centre: tuple[float, float] = (0.0, 0.0)
    scale: float = 1.0

    def put(self, points: Array) -> Array:
        """Points (n, 2) of the clouds' plane in window coordinates."""
        return np.asarray(self.scale * (points - np.array(self.centre)))

    def seen(self, pose: Pose) -> Pose:
        """A pose of the clouds in window coordinates: F ∘ T ∘ F⁻¹."""
        centre = np.array(self.centre)
        return Pose(pose.R, self.scale * (pose.scale * (pose.R @ centre) + pose.t - centre), pose.scale)

    def meant(self, pose: Pose) -> Pose:
        """The rigid pose of the clouds that is `pose` in window coordinates: F⁻¹ ∘ T ∘ F."""
        centre = np.array(self.centre)
        return Pose(pose.R, pose.t / self.scale - pose.R @ centre + centre)


@dataclass(frozen=True, eq=False)
class Clouds:
    """Both clouds as they are registered: source (m, 2) and target (n, 2), in the files' unit, either possibly empty.

    raw: what they were made from. slice: the heights between which 3-D clouds are used, or None for all of them.
    seen: the numbers of points before thinning. first: the start pose. spacing: the target's, or 0. anchor: (2,) the
    source's centroid. fit: the map to a window around both, with the source at `first`.
    """

    raw: Raw
    source: Array
    target: Array
    slice: tuple[float, float] | None
    seen: tuple[int, int]
    first: Pose
    fit: Fit
    spacing: float
    anchor: Array = field(default_factory=lambda: np.zeros(2))

    @property
    def whole(self) -> bool:
        """Whether there are two clouds to register."""
        return bool(len(self.source) and len(self.target))

    @property
    def unit(self) -> str:
        """The unit of lengths: the drive's scans are in metres; the unit of a file is unknown."""
        return "u" if self.raw.wheels is None else "m"

    @property
    def area(self) -> float:
        """The area of the target's bounding box, squared units; never 0: for a single place, it depends on the unit of
        the window."""
        width, height = np.ptp(self.target, axis=0).tolist()
        longest = max(width, height)
        if longest <= _blur(self.target):
            longest = 1.0 / self.fit.scale
        return _steady(max(width * height, 1e-3 * longest * longest))

    @property
    def decimals(self) -> int:
        """How many decimals give lengths to a hundredth of the spacing, or else of a hundredth of a window unit."""
        least = self.spacing or 1e-2 / self.fit.scale
        return int(np.clip(2 - np.floor(np.log10(least) + 1e-9), 0, 9))


@lru_cache(maxsize=4)
def prepared(raw: Raw, height: float, thickness: float, points: int, start: str) -> Clouds:
    """The clouds seen from above, at most `points` of each. height, thickness: those of the slice, as fractions of the
    height of both clouds together; a thickness of 1 keeps everything. start: 'as' they lie, 'centred' on each other, or
    by the 'wheels' if there is odometry."""
    solid = [p[:, 2] for p in (raw.source, raw.target) if p is not None and p.shape[1] == 3]
    heights = np.concatenate([np.zeros(0), *solid])
    cut = None
    if len(heights) and thickness < 1.0:
        low, high = float(heights.min()), float(heights.max())
        middle, half = low + height * (high - low), thickness * (high - low) / 2
        cut = round(middle - half, 9), round(middle + half, 9)
    planar = [_planar(p, cut) for p in (raw.source, raw.target)]
    source, target = (thinned(p, points) if len(p) else p for p in planar)
    first, anchor = Pose.identity(), source.mean(axis=0) if len(source) else np.zeros(2)
    if start == "wheels" and raw.wheels is not None:
        first = raw.wheels
    if start == "centred" and len(source) and len(target):
        first = Pose(np.eye(2), target.mean(axis=0) - anchor)
    points_of_both = np.concatenate([target, first.apply(source)])
    fit = Fit() if raw.drawn or not len(points_of_both) else about(points_of_both)
    gap = _steady(spacing(target)) if len(target) else 0.0
    if len(target) and gap <= _blur(target):
        gap = 0.0
    return Clouds(raw, source, target, cut, (len(planar[0]), len(planar[1])), first, fit, gap, anchor)


def _steady(length: float) -> float:
    """The length to nine digits: a cosine's last one differs between processors, and the script contains lengths."""
    return float(f"{length:.9g}")


def _blur(points: Array) -> float:
    """How far apart places may be and still count as one."""
    return max(ROUNDING * float(np.abs(points).max()), FINEST)


def _planar(points: Array | None, cut: tuple[float, float] | None) -> Array:
    if points is None:
        return np.zeros((0, 2))
    if points.shape[1] == 2:
        return points
    return np.ascontiguousarray(points[:, :2]) if cut is None else slab(points, *cut)


def about(points: Array) -> Fit:
    """The fit that leaves a border around the points, so that handles and turned clouds have room."""
    low, high = points.min(axis=0), points.max(axis=0)
    width, height = np.maximum(high - low, 0.0).tolist()
    room_x, room_y = 0.82 * (VIEW.x1 - VIEW.x0), 0.82 * (VIEW.y1 - VIEW.y0)
    across = max(width / room_x, height / room_y)
    x, y = ((low + high) / 2).tolist()
    blur = _blur(points)
    return Fit((x, y), 1.0 / (across if across > blur else max(1.0, blur)))
