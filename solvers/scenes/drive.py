"""A drive, as a robot's laser and wheels record it scan by scan, and a real one.

The real one is "2006-01ENE-21-SENA_Telecom Faculty_one_loop_only" of the Mobile Robot Programming Toolkit (J. L. Blanco
Claraco and contributors, BSD 3-Clause): 225 scans of a SICK laser on the robotic wheelchair Sena, recorded on 21
January 2006. Nobody has annotated it, and there is no truth to compare with.
"""

from __future__ import annotations

import os
from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from solvers.core import validate
from solvers.core.arrays import BoolArray, FloatArray, restored
from solvers.core.brief import brief
from solvers.core.edges import rigid
from solvers.core.kinds import of_kind
from solvers.core.numbers import copied, moderate
from solvers.core.pose import Pose
from solvers.core.poses import concatenated
from solvers.scenes.drive_packing import unpacked

FOLDER = os.path.join(os.path.dirname(__file__), "recorded")
MIRROR = 1.0 / 75.0
"""Seconds per turn of the mirror of a SICK LMS 200."""


@dataclass(frozen=True, eq=False)
class Drive:
    """n scans, and how far the wheels say that the robot went between them.

    The arrays are copied and read-only.

    Parameters
    ----------
    seconds : array_like of shape (n,)
        When each scan was made, in seconds since the first; never decreasing.
    motion : Pose or array_like of shape (n, 3, 3)
        n motions by odometry, or their homogeneous matrices: from the robot's
        coordinates at a scan to those at the scan before, in metres. The first scan has
        none before it: its motion is not used and becomes the identity.
    ranges : array_like of shape (n, k)
        Metres along each beam; 0, infinite or NaN where no echo came back. ROS writes
        −inf for what is too near to be measured (REP 117).
    bearings : array_like of shape (k,)
        The beams' angles in the laser's coordinates, radians from −2π to 2π,
        anticlockwise from ahead.
    mount : Pose or array_like of shape (3, 3)
        From the laser's coordinates to the robot's.
    delays : array_like of shape (k,), optional
        When each beam is sent, seconds after the moment of its scan. None: all at once.

    Raises
    ------
    ValueError
        If shapes do not fit, a number that should be finite is not, a range is
        negative, a bearing is beyond a whole turn, the seconds go backwards, or a pose
        is not a rigid motion of the plane.

    Examples
    --------
    >>> from solvers.drives import telecom_loop
    >>> drive = telecom_loop()
    >>> drive.ranges.shape, drive.heard(0).sum(), drive.points(0).shape
    ((225, 361), np.int64(309), (309, 2))
    """

    seconds: FloatArray
    motion: Pose
    ranges: FloatArray
    bearings: FloatArray
    mount: Pose
    delays: FloatArray | None = None

    __repr__ = brief
    __setstate__ = restored

    if TYPE_CHECKING:

        def __init__(
            self, seconds: ArrayLike, motion: Pose | ArrayLike, ranges: ArrayLike, bearings: ArrayLike,
            mount: Pose | ArrayLike, delays: ArrayLike | None = None,
        ) -> None: ...  # fmt: skip

    def __post_init__(self) -> None:
        ranges = copied(self.ranges, "ranges")
        if ranges.ndim != 2 or not ranges.size:
            raise ValueError(f"ranges: expected shape (n, k), one row per scan, got {ranges.shape}")
        negative = ranges[(ranges < 0.0) & (ranges > -np.inf)]
        if negative.size:
            hint = "; 0, inf or nan stands for no echo"
            raise ValueError(f"ranges: must not be negative, but the smallest is {negative.min():.6g}{hint}")
        moderate(ranges[np.isfinite(ranges)], "ranges")
        n, k = ranges.shape
        seconds = validate.row(self.seconds, "seconds", n, "scan")
        for later in np.flatnonzero(np.diff(seconds) < 0.0)[:1] + 1:
            previous, current = seconds[later - 1], seconds[later]
            raise ValueError(f"seconds: scan {later} is at {current:g}, before the scan before it, at {previous:g}")
        bearings = validate.row(self.bearings, "bearings", k, "beam")
        widest = np.abs(bearings).max()
        if widest > 2.0 * np.pi:
            hint = "; numpy.radians makes radians of degrees"
            raise ValueError(f"bearings: expected radians from −2π to 2π, but there is one of {widest:.6g}{hint}")
        delays = None if self.delays is None else validate.row(self.delays, "delays", k, "beam")
        motion, mount = (_rigid(getattr(self, name), name) for name in ("motion", "mount"))
        if motion.batch != (n,):
            raise ValueError(f"motion: expected motions of shape ({n},), one per scan, got {motion.batch}")
        motion = concatenated([Pose.identity(batch=(1,)), motion[1:]])
        if mount.batch:
            raise ValueError(f"mount: expected a single pose, got {mount.batch}")
        values = {"seconds": seconds, "motion": motion, "ranges": ranges, "bearings": bearings, "mount": mount,
                "delays": delays}  # fmt: skip
        for name, value in values.items():
            object.__setattr__(self, name, value)

    def heard(self, k: int, farthest: float = np.inf) -> BoolArray:
        """Which beams of one scan brought an echo.

        Parameters
        ----------
        k : int
            Which scan.
        farthest : float, default inf
            Metres beyond which an echo is left out.

        Returns
        -------
        ndarray of bool
            One per beam.

        Raises
        ------
        ValueError
            If there is no such scan, or `farthest` is not a number.
        """
        if validate.count(k, "k") >= len(self.ranges):
            raise ValueError(f"k: expected a scan from 0 to {len(self.ranges) - 1}, got {k}")
        validate.limit(farthest, "farthest")
        r = self.ranges[k]
        return np.asarray(np.isfinite(r) & (r > 0.0) & (r <= farthest))

    def points(self, k: int, farthest: float = np.inf) -> FloatArray:
        """The echoes of one scan, in the robot's coordinates, as if all beams were sent at once.

        Parameters
        ----------
        k : int
            Which scan.
        farthest : float, default inf
            Metres beyond which an echo is left out.

        Returns
        -------
        ndarray of shape (m, 2)
            Metres, in the order of the beams.

        Raises
        ------
        ValueError
            If there is no such scan, or `farthest` is not a number.
        """
        echo = self.heard(k, farthest)
        ahead = np.stack([np.cos(self.bearings[echo]), np.sin(self.bearings[echo])], axis=1)
        return self.mount.apply(self.ranges[k, echo, None] * ahead)


def _rigid(value: Pose | ArrayLike, name: str) -> Pose:
    """Rigid motions of the plane, given as poses or as their matrices."""
    return rigid(of_kind(validate.start(value, name), Pose, name), name)


def chained(motion: Pose) -> Pose:
    """Where the robot stood at each scan, from the motions between them.

    Parameters
    ----------
    motion : Pose
        n motions, each from the coordinates at a scan to those at the scan before. The
        first is where the chain begins.

    Returns
    -------
    Pose
        n poses, each from the robot's coordinates at a scan to the map's.

    Raises
    ------
    ValueError
        If `motion` is not a Pose of shape (n,), or a scale is not 1.

    Examples
    --------
    >>> import numpy as np
    >>> from solvers import Pose
    >>> from solvers.drives import chained
    >>> square = Pose.from_angle(np.full(5, np.pi / 2), (1.0, 0.0))
    >>> bool(np.allclose(chained(square).t[4], chained(square).t[0]))
    True
    """
    if len(of_kind(motion, Pose, "motion").batch) != 1:
        raise ValueError(f"motion: expected motions of shape (n,), got {motion.batch}")
    validate.unscaled(motion, "motion", "a robot's motion has scale 1")
    R, t = np.array(motion.R), np.array(motion.t)
    for k in range(1, len(t)):
        t[k] = R[k - 1] @ t[k] + t[k - 1]
        R[k] = R[k - 1] @ R[k]
    return Pose.trusted(R, t)


def interlaced(beams: int, step: float, turns: int = 2, period: float = MIRROR) -> FloatArray:
    """When each beam is sent if the mirror turns several times per scan, and each turn sends every `turns`-th beam.

    Parameters
    ----------
    beams : int
        The number of beams.
    step : float
        Radians from one beam to the next.
    turns : int, default 2
        Turns of the mirror per scan: the first sends the beams 0, turns, 2 · turns …
    period : float, default 1/75
        Seconds per turn.

    Returns
    -------
    ndarray of shape (beams,)
        Seconds after their mean, for `Drive.delays`.

    Raises
    ------
    ValueError
        If the beams or the turns are not an integer of 1 or more, the step is not a
        finite number, or the period not a finite one of 0 or more.

    Examples
    --------
    >>> import numpy as np
    >>> from solvers.drives import interlaced
    >>> (1e3 * interlaced(5, np.pi / 4)).round(1)
    array([-8.7,  6.3, -5.3,  9.7, -2. ])
    """
    validate.count(turns, "turns", 1)
    step, period = validate.number(step, "step"), validate.number(period, "period", 0.0)
    k = np.arange(validate.count(beams, "beams", 1))
    seconds = period * (k % turns + k * step / (2.0 * np.pi))
    return np.asarray(seconds - seconds.mean(), dtype=np.float64)


@cache
def telecom_loop() -> Drive:
    """The real drive: 225 scans over half a circle, along one loop and a third.

    Ranges are known to the centimetre, the odometry to the millimetre. The laser sends
    its whole degrees in one turn of the mirror and the half degrees in the next. The
    file is read on the first call.

    Returns
    -------
    Drive
        225 scans with 361 beams each, half a degree apart.

    Examples
    --------
    >>> import numpy as np
    >>> from solvers.drives import telecom_loop
    >>> drive = telecom_loop()
    >>> round(float(drive.seconds[-1]), 1), round(float(np.linalg.norm(drive.motion.t, axis=1).sum()), 1)
    (59.1, 76.4)
    """
    with open(os.path.join(FOLDER, "telecom-loop.scans"), "rb") as file:
        data = file.read()
    n, k = (int(v) for v in np.frombuffer(data, "<u2", 2))
    table = np.frombuffer(data, "<i4", 4 * n, 4).reshape(n, 4)
    centimetres = unpacked(data[4 + 16 * n :], n, k)
    motion = Pose.from_angle(table[:, 3] * 1e-6, table[:, 1:3] * 1e-6)
    ranges = np.where(centimetres == 0, np.inf, centimetres / 100.0)
    bearings = np.radians(-90.0 + 0.5 * np.arange(k))
    delays = interlaced(k, np.radians(0.5))
    return Drive(table[:, 0] * 1e-3, motion, ranges, bearings, Pose.from_angle(0.0, (0.78, 0.0)), delays)
