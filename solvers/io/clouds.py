"""Read a file of points: CSV, XYZ, PTS, PLY or PCD → an (n, 2) or (n, 3) array.

The module takes bytes and opens no file. It recognises the format by how the data begin,
not by the file's name: PLY and PCD say what they are, everything else is lines of numbers.
"""

from __future__ import annotations

import codecs
import re
from dataclasses import dataclass

import numpy as np

from solvers.core.amounts import amount
from solvers.core.arrays import FloatArray
from solvers.core.brief import brief
from solvers.core.validate import LARGEST
from solvers.io import pcd, ply
from solvers.io.text import check_size, delimited, file_bytes, lines_of

MOST_BYTES = 24_000_000
MOST_POINTS = 1_000_000
_UTF16 = (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)
# Possessive: "# # #" can be split into comments in many ways, and all of them would be tried.
_PCD = re.compile(rb"\s*+(?:#[ \t]*\.PCD|(?:#[^\r\n]*\s+)*+(?:VERSION|FIELDS)(?!\S))")


@dataclass(frozen=True, eq=False)
class CloudText:
    r"""A file's points.

    Attributes
    ----------
    points : ndarray of shape (n, 2) or (n, 3)
        The points, n ≥ 1, finite, in the file's own unit.
    format : str
        The file's format in words.
    notices : tuple of str
        What was left out.
    gaps : int
        How many rows were left out because a number was not finite: after one, row i is
        not the file's row i.

    Examples
    --------
    >>> from solvers.cloud_text import read
    >>> read(b"0 0\n1 2\nnan 3\n").notices
    ('1 row with NaN or infinity left out',)
    """

    points: FloatArray
    format: str
    notices: tuple[str, ...] = ()
    gaps: int = 0

    __repr__ = brief


def read(data: bytes) -> CloudText:
    r"""Read the points from a file's bytes.

    Rows with a number that is not finite are left out, with a notice, as PCD marks
    missing returns with NaN.

    Parameters
    ----------
    data : bytes
        CSV, XYZ, PTS, PLY or PCD, at most 24 MB and a million points.

    Returns
    -------
    CloudText
        The points, the format in words, and notices.

    Raises
    ------
    ValueError
        If the data are not bytes, cannot be read, or hold no points or too many. If a
        line is at fault, the message says which, what was found there and what was
        expected.

    Examples
    --------
    >>> from solvers.cloud_text import read
    >>> text = read(b"x,y\n0.0,0.0\n1.5,2.0\n")
    >>> text.points
    array([[0. , 0. ],
           [1.5, 2. ]])
    >>> text.format
    'text separated by commas'
    """
    data = file_bytes(data)
    check_size(len(data), MOST_BYTES)
    data = data.removeprefix(codecs.BOM_UTF8)
    notices: list[str] = []
    if data.startswith((b"ply\n", b"ply\r", b"ply ")):
        points, how = ply.points(data, MOST_POINTS)
        kind = f"PLY, {how}"
    elif _PCD.match(data):
        points, how = pcd.points(data, MOST_POINTS)
        kind = f"PCD, {how}"
    else:
        lines = lines_of(_decoded(data))
        if len(lines) > 2 * MOST_POINTS:
            raise ValueError(f"{len(lines)} lines are more than the limit of {2 * MOST_POINTS}")
        points, separator, notices = delimited(lines)
        kind = f"text separated by {separator}"
    points, left_out, gaps = finite_rows(points)
    if not len(points):
        raise ValueError("no point is left; expected at least one row of finite numbers")
    if len(points) > MOST_POINTS:
        raise ValueError(f"{len(points)} points are more than the limit of {MOST_POINTS}")
    if np.abs(points).max() > LARGEST:
        raise ValueError(f"a coordinate is {np.abs(points).max():.3g}; expected none beyond {LARGEST:g}")
    return CloudText(points, kind, (*notices, *left_out), gaps)


def finite_rows(points: FloatArray) -> tuple[FloatArray, tuple[str, ...], int]:
    """The rows of finite numbers, a notice if there are others, and how many others."""
    finite = np.isfinite(points).all(axis=1)
    gaps = int(np.count_nonzero(~finite))
    if not gaps:
        return points, (), 0
    return points[finite], (f"{amount(gaps, 'row')} with NaN or infinity left out",), gaps


def _decoded(data: bytes) -> str:
    """Decode lines of numbers from UTF-8 or, as spreadsheets write it, UTF-16; comments may
    contain any bytes.
    """
    if data.startswith(_UTF16):
        return codecs.utf_16_decode(data, "replace", True)[0]  # built in, so the page has it
    if b"\0" in data:
        line = data[: data.index(b"\0")].count(b"\n") + 1
        raise ValueError(f"line {line}: a zero byte was found; expected text, PLY or PCD")
    return data.decode("utf-8", "replace")
