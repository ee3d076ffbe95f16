"""Reading drives from files: a CSV of ranges and odometry, or a CARMEN log.

CSV: a first line that names the columns `seconds, dx_m, dy_m, dphi_rad, r0, r1, …`, then one line per scan: the time,
the odometry's motion since the previous scan in the frame of the previous pose, and the ranges in centimetres; 0, inf
or nan for no echo. The first scan's motion is not used. The beams are spread evenly over the field of view, the first
on the right.

CARMEN: the lines of a log that begin with FLASER, `FLASER n r₁ … rₙ x y θ odom_x odom_y odom_θ time host logger_time`,
in metres and radians. The first pose is the laser's, the second the robot's, by odometry. The second is used, so
`ahead` must give the laser's distance ahead of the robot; in a raw log that is the distance between the two poses.
Ranges of `LONGEST` or more, inf and nan are not echoes. A SICK has 181 or 361 beams over half a circle, 1° or 0.5°
apart; a log with 180 or 360 lacks the last of them, which is how CARMEN reads it too.

The functions take bytes and open no files.
"""

from __future__ import annotations

import numpy as np

from solvers.core import validate
from solvers.core.amounts import amount
from solvers.core.arrays import FloatArray
from solvers.core.pose import Pose
from solvers.core.poses import concatenated
from solvers.io.text import check_size, file_bytes, is_number, lines_of, numbers, told
from solvers.scenes.drive import Drive, interlaced

MOST_BYTES = 64_000_000
MOST_SCANS = 20_000
LONGEST = 80.0
"""Metres; lasers of the time report more than this when no echo comes back."""
LAST_LOST = (180, 360)
"""Numbers of beams in a CARMEN log with which the last beam of the half circle, 90° to the left, is missing."""
_NAMES = ("seconds", "dx_m", "dy_m", "dphi_rad")


def read_drive(
    data: bytes, *, view: float | None = None, ahead: float = 0.0, turns: int = 0, hertz: float = 75.0
) -> Drive:
    r"""Read a drive from a file's bytes.

    Parameters
    ----------
    data : bytes
        CSV or a CARMEN log, at most 64 MB and 20,000 scans.
    view : float, optional
        The angle from the first beam to the last, degrees, above 0, at most 360, half
        of it on either side of straight ahead. None is 180, except that the 180 or 360
        beams of a CARMEN log are then 1° or 0.5° apart, the first 90° to the right.
    ahead : float, default 0.0
        How far the laser sits ahead of the robot's reference point, metres. It applies
        to CARMEN logs too, since the poses read from them are the robot's.
    turns : int, default 0
        Turns of the laser's mirror per scan: each turn sends every `turns`-th beam.
        With 0, all beams are assumed to be sent at once.
    hertz : float, default 75.0
        Turns of the mirror per second.

    Returns
    -------
    Drive
        The drive, with at least two scans.

    Raises
    ------
    ValueError
        If the data are not bytes or cannot be read; if a line is at fault, the message
        says which, what was found there and what was expected.

    Examples
    --------
    >>> from solvers.odometry import read_drive
    >>> head = b"seconds,dx_m,dy_m,dphi_rad,r0,r1,r2\n"
    >>> drive = read_drive(head + b"0,0,0,0,100,200,0\n0.5,0.1,0,0,90,190,0\n")
    >>> drive.ranges[0].tolist(), drive.motion.t[1].tolist()
    ([1.0, 2.0, inf], [0.1, 0.0])
    """
    data = file_bytes(data)
    check_size(len(data), MOST_BYTES)
    if view is not None and not 0.0 < validate.number(view, "view") <= 360.0:
        raise ValueError(f"view: expected degrees above 0, up to 360, got {view!r}")
    validate.count(turns, "turns")
    validate.number(hertz, "hertz", 1e-3, 1e6)
    mount = Pose.from_angle(0.0, (validate.number(ahead, "ahead", -100.0, 100.0), 0.0))
    lines = lines_of(data.decode("utf-8-sig", "replace"))
    rows = [k for k, line in enumerate(lines) if (bare := line.strip()) and not bare.startswith("#")]
    if not rows:
        raise ValueError("line 1: no line was found; expected columns of ranges, or a CARMEN log")
    table = lines[rows[0]].strip().lstrip('"').lower().startswith("seconds")
    seconds, motion, ranges = (_table if table else _carmen)(lines, rows)
    if len(seconds) < 2:
        raise ValueError(f"line {rows[-1] + 1}: the drive ends after {amount(len(seconds), 'scan')}; two are the least")
    if len(seconds) > MOST_SCANS:
        raise ValueError(f"{len(seconds)} scans are more than the limit of {MOST_SCANS}")
    bearings = np.radians(_degrees(ranges.shape[1], view, logged=not table))
    step = float(bearings[1] - bearings[0])
    delays = interlaced(len(bearings), step, turns, 1.0 / hertz) if turns else None
    return Drive(seconds, motion, ranges, bearings, mount, delays)


def _degrees(beams: int, view: float | None, logged: bool) -> FloatArray:
    """The beams' bearings in degrees; view None takes the default of a table or of a log."""
    if view is None and logged and beams in LAST_LOST:
        return np.linspace(-90.0, 90.0, beams + 1)[:-1]
    half = 90.0 if view is None else view / 2
    return np.linspace(-half, half, beams)


def _table(lines: list[str], rows: list[int]) -> tuple[FloatArray, Pose, FloatArray]:
    names = [field.strip().strip('"').lower() for field in lines[rows[0]].split(",")]
    beams = len(names) - len(_NAMES)
    expected = [*_NAMES, *(f"r{k}" for k in range(max(beams, 3)))]
    for column, name in zip([*names, *[""] * len(expected)], expected, strict=False):
        if column != name:
            raise ValueError(f"line {rows[0] + 1}: the columns are seconds,dx_m,dy_m,dphi_rad,r0,r1,…;"
                             f" expected {name}, found {told(column)}")  # fmt: skip
    table = numbers(lines, rows[1:], list(range(len(names))), len(names), ",")
    table[:1, 1:4] = 0.0  # it has no scan before it: what is written there does not count
    table[:, 4:][~np.isfinite(table[:, 4:])] = 0.0
    for at, row in zip(rows[1:], table, strict=True):
        if not np.isfinite(row).all() or np.abs(row[1:]).max() > 1e9 or abs(row[0]) > 1e12:  # seconds may be since 1970
            raise ValueError(f"line {at + 1}: a number is not finite, or larger than 1e9 (the seconds: 1e12)")
        if (row[4:] < 0).any():
            raise ValueError(f"line {at + 1}: a range is negative; expected centimetres, or 0, inf or nan for no echo")
    _in_order(table[:, 0], rows[1:])
    motion = table[:, 1:4].copy()
    ranges = np.where(table[:, 4:] == 0.0, np.inf, table[:, 4:] / 100.0)
    return table[:, 0] - table[:1, 0], Pose.from_angle(motion[:, 2], motion[:, :2]), ranges


def _carmen(lines: list[str], rows: list[int]) -> tuple[FloatArray, Pose, FloatArray]:
    scans: list[list[float]] = []
    lines_used: list[int] = []
    beams = -1
    for k in rows:
        fields = lines[k].split()
        if fields[0] != "FLASER":
            continue
        count = fields[1] if len(fields) > 1 and len(fields[1]) <= 6 else ""  # int() refuses 5,000 digits
        if not count.isdecimal() or not 3 <= int(count) <= 100_000:
            raise ValueError(f"line {k + 1}: after FLASER the number of beams is expected, 3 or more")
        n = int(count)
        if beams not in (-1, n):
            raise ValueError(f"line {k + 1}: {n} beams; the scan before has {beams}")
        beams = n
        if len(fields) < n + 9:
            raise ValueError(f"line {k + 1}: {len(fields)} fields found; expected {n + 11} for {n} beams")
        values = fields[2 : n + 9]
        for place, field in enumerate(values):
            if not is_number(field) or not (abs(float(field)) <= 1e12 or (place < n and not np.isfinite(float(field)))):
                raise ValueError(f"line {k + 1}: {told(field)} is not a number; expected one such as -1.25 or 3e-2")
        scans.append([float(field) for field in values])
        lines_used.append(k)
    if not scans:
        raise ValueError(f"line {rows[0] + 1}: neither columns that begin with seconds,dx_m nor a line with FLASER")
    table = np.array(scans)
    _in_order(table[:, beams + 6], lines_used)
    x, y, turn = table[:, beams + 3], table[:, beams + 4], table[:, beams + 5]
    poses = Pose.from_angle(turn, np.stack([x, y], axis=1))
    links = poses[:-1].inverse().compose(poses[1:])
    motion = concatenated([Pose.identity(batch=(1,)), links])
    r = table[:, :beams]
    return table[:, beams + 6] - table[0, beams + 6], motion, np.where((r > 0.0) & (r < LONGEST), r, np.inf)


def _in_order(seconds: FloatArray, rows: list[int]) -> None:
    """Raise ValueError, naming the line, if the times go backwards. `rows`: the line of each scan."""
    for k in np.flatnonzero(np.diff(seconds) < 0.0)[:1]:
        current, previous = (f"{seconds[j]:.15g} s" for j in (k + 1, k))
        raise ValueError(f"line {rows[k + 1] + 1}: its time is {current}, before the {previous} of line {rows[k] + 1}")
