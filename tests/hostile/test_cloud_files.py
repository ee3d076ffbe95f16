"""Point files that were cut, spliced and mistyped are read as a cloud of finite points, or refused with a reason."""

from __future__ import annotations

import random
import re

import numpy as np
import pytest

from solvers.io.clouds import read
from tests.hostile.tally import Tally
from tests.solvers.io.test_clouds import WRITERS

pytestmark = pytest.mark.hostile

PARTS = (
    *(b"nan", b"inf", b"-1e400", b"1e200", b"0x1p3", b"1_0", b"1,5", b"\xc2\xbd", b"-0", b"--", b"9" * 500),
    *(b"\0", b"\r", b"\n", b"\n\n", b"\t", b" ", b";", b",", b"#", b'"', b"\xff\xfe", b"\xef\xbb\xbf", b"\x1a"),
    *(b"end_header\n", b"property list uchar int a\n", b"element vertex 9\n", b"element a 99999999999\n"),
    *(b"format x 1.0\n", b"DATA binary\n", b"DATA ascii\n", b"COUNT 1 1 1 0\n", b"FIELDS x y\n", b"POINTS 999999\n"),
    *(b"SIZE 8\n", b"TYPE U\n"),
)
NUMBERS = (b"0", b"-1", b"00001", b"1000001", b"999999999999", b"000000001" + b"9" * 30, b"1e5", b"3.5")


def test_a_damaged_file_is_read_or_refused(tally: Tally, calls: int) -> None:
    draw = random.Random(14)
    for k in range(calls):
        kind = draw.choice(list(WRITERS))
        data = WRITERS[kind](cloud(draw))
        for _ in range(draw.choice((0, 1, 1, 1, 2, 4))):
            data = damage(draw, data)
        tally.tries(f"{k}, {kind}: {data[:600]!r}", lambda data=data: outcome(data))
    tally.closes()


def cloud(draw: random.Random) -> np.ndarray:
    d = draw.choice((2, 3))
    small, large = (lambda: draw.gauss(0, 1)), (lambda: draw.gauss(0, 1e9))
    kinds = (small, small, large, lambda: -1e149, lambda: 5e-324)
    return np.array([[draw.choice(kinds)() for _ in range(d)] for _ in range(4)])


def damage(draw: random.Random, data: bytes) -> bytes:
    """Bytes cut out or put in, a line copied over another or swapped with it, or a number replaced."""
    at = draw.randrange(len(data) + 1)
    kind = draw.randrange(6)
    if kind == 0:
        return data[:at]
    if kind == 1:
        return data[:at] + data[min(len(data), at + draw.randrange(9)) :]
    if kind == 2:
        return data[:at] + draw.choice(PARTS) + data[at:]
    if kind == 3:
        return data[:at] + draw.randbytes(draw.randrange(1, 9)) + data[at:]
    lines = data.split(b"\n")
    first, second = (draw.randrange(len(lines)) for _ in range(2))
    if kind == 4:
        lines[first], lines[second] = lines[second], lines[draw.choice((first, second))]
    else:
        numbers = list(re.finditer(rb"\b\d+\b", lines[first]))
        if numbers:
            spot = draw.choice(numbers)
            lines[first] = lines[first][: spot.start()] + draw.choice(NUMBERS) + lines[first][spot.end() :]
    return b"\n".join(lines)


def outcome(data: bytes) -> str:
    points = read(data).points
    assert points.ndim == 2
    assert points.shape[1] in (2, 3)
    assert len(points)
    assert np.isfinite(points).all()
    return "ok"
