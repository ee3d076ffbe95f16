"""Drives from files: what is read, and what is refused, with the line."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from solvers.odometry import read_drive

HEAD = "seconds,dx_m,dy_m,dphi_rad,r0,r1,r2\n"
GOOD = HEAD + "10,0,0,0,100,200,0\n10.5,0.1,0.01,0.2,90,190,0\n"


def laser(ranges: str = "1 2 81.9", odometry: str = "0 0 0", time: float = 1.0, count: int = 3) -> str:
    return f"FLASER {count} {ranges} 0 0 0 {odometry} {time} host {time}\n"


def robot(
    ranges: str = "1 2 81.9", odometry: str = "0 0 0", time: float = 1.0, count: int = 3,
    angles: str = "-1.5 3 1.5", longest: str = "50", remissions: str = "0",
) -> str:  # fmt: skip
    config = f"0 {angles} {longest} 0.01 0 {count}"
    return f"ROBOTLASER1 {config} {ranges} {remissions} 9.5 9 9 {odometry} 0.1 0.2 0.3 0.4 1e6 {time} host 0\n"


def test_a_table_is_read() -> None:
    drive = read_drive(GOOD.encode(), ahead=0.78)
    assert drive.seconds.tolist() == [0.0, 0.5]
    assert drive.motion.t.tolist() == [[0.0, 0.0], [0.1, 0.01]]
    assert drive.motion.angle.tolist() == pytest.approx([0.0, 0.2])
    assert drive.ranges.tolist() == [[1.0, 2.0, np.inf], [0.9, 1.9, np.inf]]
    assert np.allclose(drive.points(0), [[0.78, -1.0], [2.78, 0.0]])


def test_names_and_numbers_may_stand_in_quotes() -> None:
    """As R's write.csv writes them; a name that is wrong is told without its quotes."""
    fields = [[f'"{field}"' for field in line.split(",")] for line in GOOD.split()]
    quoted = "\r\n".join(map(",".join, fields))
    assert read_drive(quoted.encode()).ranges.tolist() == read_drive(GOOD.encode()).ranges.tolist()
    with pytest.raises(ValueError, match=r"line 1: .*expected dx_m, found 'dx'"):
        read_drive(quoted.replace("dx_m", "dx").encode())


@pytest.mark.parametrize("field", ["nan", "-inf", "1e10", "5"])
def test_the_first_scan_s_motion_is_not_used(field: str) -> None:
    """There is no scan before it, and some recorders write nan."""
    drive = read_drive(GOOD.replace("10,0,0,0,", f"10,{field},{field},{field},").encode())
    assert drive.motion.t.tolist() == [[0.0, 0.0], [0.1, 0.01]]
    assert drive.motion.angle[0] == 0.0


@pytest.mark.parametrize("field", ["inf", "Infinity", "-inf", "nan", "NaN"])
def test_a_range_that_is_infinite_or_no_number_is_no_echo(field: str) -> None:
    """As in a `Drive`; many recorders write these."""
    table = read_drive((GOOD + f"11,0,0,0,100,{field},300\n").encode())
    assert table.ranges[2].tolist() == [1.0, np.inf, 3.0]
    log = read_drive((laser() + laser(f"1 {field} 3")).encode())
    assert log.ranges[1].tolist() == [1.0, np.inf, 3.0]


def test_the_seconds_of_a_table_may_be_since_1970() -> None:
    drive = read_drive((HEAD + "1795862145.25,0,0,0,100,200,0\n1795862145.75,0.1,0,0,90,190,0\n").encode())
    assert drive.seconds.tolist() == [0.0, 0.5]


def test_a_log_is_read_and_its_poses_become_motions() -> None:
    text = "# made by a robot\nPARAM robot_length 1\n" + laser() + laser(odometry="1 2 1.5707963267948966", time=1.5)
    drive = read_drive((text + laser(odometry="1 3 1.5707963267948966", time=2.0)).encode())
    assert drive.seconds.tolist() == [0.0, 0.5, 1.0]
    assert np.allclose(drive.motion.t, [[0, 0], [1, 2], [1, 0]])
    assert np.allclose(drive.motion.angle, [0, np.pi / 2, 0])
    assert drive.ranges[0].tolist() == [1.0, 2.0, np.inf]


def test_the_poses_of_a_log_are_the_robots_and_its_laser_sits_ahead() -> None:
    lines = [line.replace(" 0 0 0 ", " 0.3 7 0 ", 1) for line in (laser(), laser(odometry="1 0 0"))]
    drive = read_drive("".join(lines).encode(), ahead=0.3)
    assert drive.motion.t.tolist() == [[0.0, 0.0], [1.0, 0.0]]
    assert np.allclose(drive.points(0), [[0.3, -1.0], [2.3, 0.0]])


def test_the_lines_of_newer_logs_are_read() -> None:
    """They carry remissions, and say themselves where the beams point and how far the laser sees."""
    text = "RAWLASER1 0 -1.5 3 1.5 50 0.01 0 3 7 7 7 0 0 host 0\nODOM 5 5 5 0 0 0 0 host 0\n"
    text += robot("1 2 50") + robot("3 nan 49", odometry="1 2 1.5707963267948966", time=1.5, remissions="3 8 8 8")
    drive = read_drive((text + robot(odometry="1 3 1.5707963267948966", time=2.0, remissions="1 8")).encode())
    assert drive.seconds.tolist() == [0.0, 0.5, 1.0]
    assert np.allclose(drive.motion.t, [[0, 0], [1, 2], [1, 0]])
    assert np.allclose(drive.motion.angle, [0, np.pi / 2, 0])
    assert drive.ranges.tolist() == [[1.0, 2.0, np.inf], [3.0, np.inf, 49.0], [1.0, 2.0, np.inf]]
    assert drive.bearings.tolist() == [-1.5, 0.0, 1.5]


def test_where_the_beams_of_newer_logs_point_may_be_told_instead() -> None:
    log = (robot(angles="-90 180 90") + robot(angles="-90 180 90", time=2.0)).encode()
    with pytest.raises(ValueError, match=r"line 1: 3 beams that begin at -90 and are 90 radians apart"):
        read_drive(log)
    assert np.degrees(read_drive(log, view=180.0).bearings) == pytest.approx([-90.0, 0.0, 90.0])


@pytest.mark.parametrize("longest", ["0", "-1", "81.92"])
def test_a_longest_range_beyond_the_usual_or_unknown_does_not_count(longest: str) -> None:
    log = (robot("1 79 81.9", longest=longest) + robot(time=2.0, longest=longest)).encode()
    assert read_drive(log).ranges[0].tolist() == [1.0, 79.0, np.inf]


def test_of_a_log_with_lines_of_both_kinds_those_of_the_first_are_read() -> None:
    """They would give one scan twice."""
    for first, second in ((laser, robot), (robot, laser)):
        log = first("1 2 3") + second("4 5 6") + second("4 5 6", time=1.1) + first("7 8 9", time=2.0)
        assert read_drive(log.encode()).ranges.tolist() == [[1.0, 2.0, 3.0], [7.0, 8.0, 9.0]]


def box(bearings: np.ndarray) -> str:
    """Ranges from the middle of a square room 6 m wide."""
    return " ".join(map(repr, (3.0 / np.maximum(np.abs(np.cos(bearings)), np.abs(np.sin(bearings)))).tolist()))


@pytest.mark.parametrize(("beams", "spacing"), [(180, 1.0), (181, 1.0), (360, 0.5), (361, 0.5)])
def test_the_beams_of_a_log_are_a_degree_or_half_of_one_apart(beams: int, spacing: float) -> None:
    """A SICK laser sends these over half a circle; CARMEN's logs often lack its last beam."""
    ranges = box(np.radians(-90.0 + spacing * np.arange(beams)))
    log = "".join(laser(ranges, time=time, count=beams) for time in (1.0, 2.0)).encode()
    assert np.abs(read_drive(log).points(1)).max(axis=1) == pytest.approx(np.full(beams, 3.0), abs=1e-9)
    assert np.degrees(read_drive(log, view=90.0).bearings[[0, -1]]) == pytest.approx([-45.0, 45.0])


def test_the_beams_of_a_table_span_the_field_of_view() -> None:
    head = "seconds,dx_m,dy_m,dphi_rad," + ",".join(f"r{k}" for k in range(180)) + "\n"
    table = (head + 2 * ("0,0,0,0" + 180 * ",100" + "\n")).encode()
    for view in (None, 180.0):
        assert np.degrees(read_drive(table, view=view).bearings[[0, -1]]) == pytest.approx([-90.0, 90.0])


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "line 1: no line was found"),
        ("hello\n", "line 1: neither columns that begin with seconds,dx_m nor a line with FLASER or ROBOTLASER1$"),
        ("RAWLASER1 0 -1.5 3 1.5 50 0.01 0 3 7 7 7 0\n", "nor a line with .*; RAWLASER lines lack the robot's pose$"),
        ("seconds,dx,dy_m,dphi_rad,r0,r1,r2\n", "line 1: .*expected dx_m, found 'dx'"),
        ("seconds,dx_m,dy_m,dphi_rad,r0\n0,0,0,0,1\n", "line 1: .*expected r1, found ''"),
        (GOOD + "11,0,0,0,5\n", "line 4: 5 fields found; expected 7"),
        (GOOD + "11,0,0,0,5,x,5\n", "line 4: 'x' is not a number"),
        (GOOD + "11,0,nan,0,5,5,5\n", "line 4: a number is not finite"),
        (GOOD + "11,0,1e10,0,5,5,5\n", "line 4: a number is not finite, or larger"),
        (GOOD + "1795862145250000000,0,0,0,5,5,5\n", r"line 4: .* larger than 1e9 \(the seconds: 1e12\)"),
        (GOOD + "11,0,0,0,5,-5,5\n", "line 4: a range is negative"),
        (GOOD + "# a gap\n10.4,0,0,0,5,5,5\n", r"line 5: its time is 10\.4 s, before the 10\.5 s of line 3"),
        (laser(time=2.0) + "ODOM 1\n" + laser(time=1.5), r"line 3: its time is 1\.5 s, before the 2 s of line 1"),
        (HEAD, "line 1: the drive ends after 0 scans; two"),
        (HEAD + "0,0,0,0,1,1,1\n", "line 2: the drive ends after 1 scan;"),
        (laser(count=2), "line 1: field 2 of FLASER is the number of beams, 3 or more; found '2'"),
        ("FLASER " + "9" * 5000, "line 1: field 2 of FLASER is the number of beams, 3 or more; found '99"),
        ("FLASER", "line 1: field 2 of FLASER is the number of beams, 3 or more; found ''"),
        (robot(count=2), "line 1: field 9 of ROBOTLASER1 is the number of beams, 3 or more; found '2'"),
        (robot(remissions=""), "line 1: field 13 of ROBOTLASER1 is the number of remissions, 0 or more; found"),
        (robot(remissions="3"), "line 1: 27 fields found; expected 30 for 3 beams"),
        (robot() + robot("1 2 3 4", count=4), "line 2: 4 beams; the scan before has 3"),
        (robot() + robot(odometry="0 x 0"), "line 2: 'x' is not a number"),
        (robot() + robot(angles="x 3 1.5"), "line 2: 'x' is not a number"),
        (robot() + "#\n" + robot(angles="-1 2 1"), "line 3: its beams point elsewhere than those of line 1"),
        (2 * robot(angles="-1.5 3 0"), "line 1: 3 beams that begin at -1.5 and are 0 radians apart"),
        (2 * robot(angles="-3.2 6.4 3.2"), "line 1: 3 beams that begin at -3.2 and are 3.2 radians apart"),
        (2 * robot(angles="7 3 1.5"), "line 1: 3 beams that begin at 7 and are 1.5 radians apart"),
        (laser() + laser("1 2 3 4", count=4), "line 2: 4 beams; the scan before has 3"),
        (laser() + "FLASER 3 1 2 3\n", "line 2: 5 fields found; expected 14"),
        (laser() + laser("1 two 3"), "line 2: 'two' is not a number"),
        (laser() + laser(odometry="1 inf 3"), "line 2: 'inf' is not a number"),
        (laser() + laser("1 1e13 3"), "line 2: '1e13' is not a number"),
        (GOOD + "11,0,inf,0,5,5,5\n", "line 4: a number is not finite"),
        (GOOD + "inf,0,0,0,5,5,5\n", "line 4: a number is not finite"),
    ],
)
def test_what_cannot_be_read_is_told_by_its_line(text: str, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        read_drive(text.encode())


@pytest.mark.parametrize("view", [0.0, -1.0, 361.0, float("nan")])
def test_a_field_of_view_is_an_angle(view: float) -> None:
    with pytest.raises(ValueError, match="view"):
        read_drive(GOOD.encode(), view=view)


@given(st.binary(max_size=200) | st.text("ROBOTFLASER1 0123.e-\n", max_size=120).map(str.encode))
def test_bytes_of_any_kind_are_read_or_refused(data: bytes) -> None:
    try:
        drive = read_drive(data)
    except ValueError:
        return
    assert len(drive.ranges) >= 2


@pytest.mark.parametrize("name", ["file.txt", Path("file.txt"), None])
def test_a_name_in_place_of_bytes_is_refused(name: object) -> None:
    message = f"data: expected the file's bytes, e.g. Path(name).read_bytes(), got {type(name).__name__}"
    with pytest.raises(ValueError, match=f"^{re.escape(message)}$"):
        read_drive(name)
