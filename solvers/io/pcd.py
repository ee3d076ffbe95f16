"""PCD, the format of the Point Cloud Library: a header of named lines, then the points as text, as binary numbers or as
compressed ones.
"""

from __future__ import annotations

import math
import re

import numpy as np

from solvers.core.arrays import AnyArray, FloatArray
from solvers.io import lzf
from solvers.io.text import lines_of, numbers, told

KEYS = ("VERSION", "FIELDS", "SIZE", "TYPE", "COUNT", "WIDTH", "HEIGHT", "VIEWPOINT", "POINTS", "DATA")
KINDS = {"F": "f", "I": "i", "U": "u"}
SIZES = {"F": ("4", "8"), "I": ("1", "2", "4", "8"), "U": ("1", "2", "4", "8")}
LAST = re.compile(rb"([\r\n])[ \t]*DATA")  # the header's last line, and the line break before it
MOST_FIELDS = 1000
MOST_COUNT = 10_000


def points(data: bytes, most: int) -> tuple[FloatArray, str]:
    """The points' x, y and, if there is one, z: (n, 2) or (n, 3), and how they were
    written.

    Raises a ValueError that gives the line's number, in the header or in text, or says
    what is missing.
    """
    header: dict[str, tuple[int, list[str]]] = {}
    at = line = 0
    last = LAST.search(data)
    mark = last[1] if last else b"\n"
    while "DATA" not in header:
        if at >= len(data):
            raise ValueError(f"line {line + 1}: the file ends within its header; expected 'DATA ascii'")
        end = data.find(mark, at)
        end = len(data) if end < 0 else end + 1
        line += 1
        words = data[at:end].decode("latin-1").partition("#")[0].split()
        at = end
        if words and words[0] not in KEYS:
            raise ValueError(f"line {line}: {told(words[0])} is not understood; expected one of {', '.join(KEYS)}")
        if words:
            header[words[0]] = line, words[1:]
    names, kinds, counts = _fields(header, line)
    count = _count(header, line, most)
    axes = [axis for axis in "xyz" if axis in names]
    starts = [sum(counts[: names.index(axis)]) for axis in axes]
    match header["DATA"][1]:
        case ["ascii"]:
            lines = [""] * line + lines_of(data[at:].rstrip().decode("latin-1"))
            rows = [k for k, text in enumerate(lines) if text.strip()]
            if len(rows) < count:
                raise ValueError(f"line {len(lines)}: the file ends after {len(rows)} points; expected {count}")
            return numbers(lines, rows[:count], starts, sum(counts)), "text"
        case ["binary"]:
            row = np.dtype([(f"f{k}", kind, (n,)) for k, (kind, n) in enumerate(zip(kinds, counts, strict=True))])
            if len(data) - at < count * row.itemsize:
                whole = (len(data) - at) // row.itemsize
                raise ValueError(f"the file ends after {whole} points; expected {count} of {row.itemsize} bytes each")
            table = np.frombuffer(data, row, count, at)
            columns = [table[f"f{names.index(axis)}"][:, 0] for axis in axes]
            return _stacked(columns), "binary"
        case ["binary_compressed"]:
            sizes = [n * np.dtype(kind).itemsize for kind, n in zip(kinds, counts, strict=True)]
            fields = _decompressed(data, at, count * sum(sizes))
            columns = []
            for k in map(names.index, axes):  # each field of all points in turn
                values = np.frombuffer(fields, kinds[k], count * counts[k], count * sum(sizes[:k]))
                columns.append(values[:: counts[k]])
            return _stacked(columns), "binary, compressed"
        case other:
            expected = "expected ascii, binary or binary_compressed"
            raise ValueError(f"line {line}: DATA {told(' '.join(other))} is not read; {expected}")


def _stacked(columns: list[AnyArray]) -> FloatArray:
    return np.stack([column.astype(np.float64) for column in columns], axis=1)


def _decompressed(data: bytes, at: int, size: int) -> bytes:
    """The bytes of all points, field by field: after `at`, two sizes, then the compressed bytes."""
    if len(data) < at + 8:
        raise ValueError("the file ends before the sizes of its compressed points")
    packed, whole = np.frombuffer(data, "<u4", 2, at).tolist()
    if whole != size:
        raise ValueError(f"the compressed points are said to hold {whole} bytes; the header's fields have {size}")
    if len(data) - at - 8 < packed:
        raise ValueError(f"the file ends after {len(data) - at - 8} bytes of compressed points; expected {packed}")
    return lzf.decompress(data[at + 8 : at + 8 + packed], size)


def _fields(header: dict[str, tuple[int, list[str]]], line: int) -> tuple[list[str], list[str], list[int]]:
    """Names, numpy types and counts of the fields."""
    number, names = header.get("FIELDS", (line, []))
    if names.count("x") != 1 or names.count("y") != 1 or names.count("z") > 1 or len(names) > MOST_FIELDS:
        raise ValueError(f"line {number}: the fields are {told(' '.join(names))}; expected x and y, each once")
    at, counts = header.get("COUNT", (line, ["1"] * len(names)))
    if len(counts) != len(names) or not all(_is_count(c) for c in counts):
        expected = f"expected a whole number from 1 to {MOST_COUNT} for each field"
        raise ValueError(f"line {at}: COUNT {told(' '.join(counts))}; {expected}")
    size_line, sizes = header.get("SIZE", (line, ["4"] * len(names)))
    type_line, types = header.get("TYPE", (line, ["F"] * len(names)))
    for at, entries in ((size_line, sizes), (type_line, types)):
        if len(entries) != len(names):
            raise ValueError(f"line {at}: SIZE and TYPE are to name one entry for each of the {len(names)} fields")
    for size, kind in zip(sizes, types, strict=True):
        if size not in SIZES.get(kind, ()):
            at = size_line if kind in SIZES else type_line
            raise ValueError(f"line {at}: a field of TYPE {told(kind)} and SIZE {told(size)} is unknown")
    return names, [f"<{KINDS[kind]}{size}" for size, kind in zip(sizes, types, strict=True)], [int(c) for c in counts]


def _is_count(word: str) -> bool:
    return word.isascii() and word.isdigit() and len(word) <= 9 and 0 < int(word) <= MOST_COUNT


def _count(header: dict[str, tuple[int, list[str]]], line: int, most: int) -> int:
    """How many points the header promises."""
    factors = []
    for key in ("POINTS",) if "POINTS" in header else ("WIDTH", "HEIGHT"):
        at, value = header.get(key, (line, []))
        if len(value) != 1 or not value[0].isascii() or not value[0].isdigit() or len(value[0]) > 12:
            raise ValueError(f"line {at}: {key} {told(' '.join(value))}; expected a whole number")
        factors.append((int(value[0]), at))
    product = math.prod(number for number, _ in factors)
    if product > most:
        raise ValueError(f"line {max(factors)[1]}: {product} points are more than the limit of {most}")
    return product
