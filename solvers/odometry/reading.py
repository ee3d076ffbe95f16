"""Reading drives from files: a CSV of ranges and odometry, or a CARMEN log.

CSV: a first line that names the columns `seconds, dx_m, dy_m, dphi_rad, r0, r1, …`, then one line per scan: the time,
the odometry's motion since the previous scan in the frame of the previous pose, and the ranges in centimetres; 0, inf
or nan for no echo. The first scan's motion is not used. The beams are spread evenly over the field of view, the first
on the right.

CARMEN: the lines of a log that begin with FLASER or, in newer logs, with ROBOTLASER1, whichever come first, in metres
and radians: `FLASER n r₁ … rₙ x y θ odom_x odom_y odom_θ time host logger_time` or `ROBOTLASER1 laser_type start_angle
field_of_view angular_resolution maximum_range accuracy remission_mode n r₁ … rₙ m i₁ … iₘ x y θ odom_x odom_y odom_θ tv
rv forward_distance side_distance turn_axis time host logger_time`. The first pose is the laser's, the second the
robot's, by odometry. The second is used, so `ahead` must give the laser's distance ahead of the robot; in a raw log
that is the distance between the two poses. Ranges of `LONGEST` or more, or of the maximum that a ROBOTLASER1 line
gives, inf and nan are not echoes. Such a line also says where its beams point. For FLASER, a SICK has 181 or 361 beams
over half a circle, 1° or 0.5° apart; a log with 180 or 360 lacks the last of them, which is how CARMEN reads it too.

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
COUNT_AT = {"FLASER": 1, "ROBOTLASER1": 8}
"""The lines of a CARMEN log that are read, and the field that has the number of beams."""
_Parts = tuple[FloatArray, Pose, FloatArray, FloatArray]
"""A drive's seconds, motion, ranges and bearings."""
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
        of it on either side of straight ahead. None is 180, except that ROBOTLASER1
        lines of a CARMEN log say it themselves, and that with FLASER 180 or 360 beams
        are then 1° or 0.5° apart, the first 90° to the right.
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
    seconds, motion, ranges, bearings = (_table if table else _carmen)(lines, rows, view)
    if len(seconds) < 2:
        raise ValueError(f"line {rows[-1] + 1}: the drive ends after {amount(len(seconds), 'scan')}; two are the least")
    if len(seconds) > MOST_SCANS:
        raise ValueError(f"{len(seconds)} scans are more than the limit of {MOST_SCANS}")
    step = float(bearings[1] - bearings[0])
    delays = interlaced(len(bearings), step, turns, 1.0 / hertz) if turns else None
    return Drive(seconds, motion, ranges, bearings, mount, delays)


def _across(beams: int, view: float) -> FloatArray:
    """The bearings, radians, of beams over a field of view given in degrees."""
    return np.radians(np.linspace(-view / 2, view / 2, beams))


def _table(lines: list[str], rows: list[int], view: float | None) -> _Parts:
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
    bearings = _across(beams, 180.0 if view is None else view)
    return table[:, 0] - table[:1, 0], Pose.from_angle(motion[:, 2], motion[:, :2]), ranges, bearings


def _carmen(lines: list[str], rows: list[int], view: float | None) -> _Parts:
    scans: list[list[float]] = []
    lines_used: list[int] = []
    kind, beams = "", -1
    for k in rows:
        fields = lines[k].split()
        if fields[0] not in COUNT_AT or kind not in ("", fields[0]):
            continue
        kind = fields[0]
        n = _count(fields, COUNT_AT[kind], 3, "beams", k)
        if beams not in (-1, n):
            raise ValueError(f"line {k + 1}: {n} beams; the scan before has {beams}")
        beams = n
        values = _values(fields, n, k)
        for place, field in enumerate(values):
            if not is_number(field) or not (abs(float(field)) <= 1e12 or (place < n and not np.isfinite(float(field)))):
                raise ValueError(f"line {k + 1}: {told(field)} is not a number; expected one such as -1.25 or 3e-2")
        scans.append([float(field) for field in values])
        lines_used.append(k)
    if not scans:
        raise ValueError(f"line {rows[0] + 1}: neither columns that begin with seconds,dx_m nor a line with"
                         f" {' or '.join(COUNT_AT)}{_raw(lines, rows)}")  # fmt: skip
    table = np.array(scans)
    ranges, poses, seconds, laser = np.split(table, [beams, beams + 6, beams + 7], axis=1)
    _in_order(seconds[:, 0], lines_used)
    robot = Pose.from_angle(poses[:, 5], poses[:, 3:5])
    motion = concatenated([Pose.identity(batch=(1,)), robot[:-1].inverse().compose(robot[1:])])
    longest = np.full((len(table), 1), LONGEST)
    if laser.size:
        longest = np.where(laser[:, 2:] > 0.0, np.minimum(laser[:, 2:], LONGEST), LONGEST)
    if view is not None:
        bearings = _across(beams, view)
    elif laser.size:
        bearings = _spread(laser[:, :2], beams, lines_used)
    else:
        bearings = _across(beams + 1, 180.0)[:-1] if beams in LAST_LOST else _across(beams, 180.0)
    echoes = np.where((ranges > 0.0) & (ranges < longest), ranges, np.inf)
    return seconds[:, 0] - seconds[0], motion, echoes, bearings


def _count(fields: list[str], at: int, least: int, items: str, k: int) -> int:
    """The number of `items` in a field of line `k`."""
    text = fields[at] if len(fields) > at else ""
    if len(text) > 6 or not text.isdecimal() or not least <= int(text) <= 100_000:  # int() refuses 5,000 digits
        raise ValueError(f"line {k + 1}: field {at + 1} of {fields[0]} is the number of {items}, {least} or more;"
                         f" found {told(text)}")  # fmt: skip
    return int(text)


def _values(fields: list[str], n: int, k: int) -> list[str]:
    """Of the line `k`: its n ranges, the laser's pose, the robot's, the time, and of ROBOTLASER1 also the first beam's
    angle, that between two beams, and the longest range."""
    first = COUNT_AT[fields[0]] + 1
    poses, between, laser = first + n, 0, []
    if fields[0] == "ROBOTLASER1":
        poses += 1 + _count(fields, first + n, 0, "remissions", k)
        between, laser = 5, [fields[2], fields[4], fields[5]]  # between are velocities, distances and the axis
    time = poses + 6 + between
    if len(fields) <= time:
        raise ValueError(f"line {k + 1}: {len(fields)} fields found; expected {time + 3} for {n} beams")
    return [*fields[first : first + n], *fields[poses : poses + 6], fields[time], *laser]


def _spread(laser: FloatArray, beams: int, rows: list[int]) -> FloatArray:
    """The bearings that ROBOTLASER1 lines give. `laser`: for each scan the first beam's angle, and that between two."""
    for scan in np.flatnonzero((laser != laser[0]).any(axis=1))[:1]:
        raise ValueError(f"line {rows[scan] + 1}: its beams point elsewhere than those of line {rows[0] + 1}")
    first, step = laser[0]
    bearings = first + step * np.arange(beams)
    if not 0.0 < step <= 2.001 * np.pi / (beams - 1) or np.abs(bearings).max() > 2.0 * np.pi:
        raise ValueError(
            f"line {rows[0] + 1}: {beams} beams that begin at {first:g} and are {step:g} radians apart; expected a turn"
            " at most, anticlockwise; with a field of view given, these are not used"
        )
    return np.asarray(bearings)


def _raw(lines: list[str], rows: list[int]) -> str:
    """What to say of a log that has RAWLASER lines only."""
    raw = any(lines[k].lstrip().startswith("RAWLASER") for k in rows)
    return "; RAWLASER lines lack the robot's pose" if raw else ""


def _in_order(seconds: FloatArray, rows: list[int]) -> None:
    """Raise ValueError, naming the line, if the times go backwards. `rows`: the line of each scan."""
    for k in np.flatnonzero(np.diff(seconds) < 0.0)[:1]:
        current, previous = (f"{seconds[j]:.15g} s" for j in (k + 1, k))
        raise ValueError(f"line {rows[k + 1] + 1}: its time is {current}, before the {previous} of line {rows[k] + 1}")
