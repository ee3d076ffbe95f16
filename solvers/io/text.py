"""Lines of numbers → rows of an array; errors give the number of the line."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from itertools import islice

import numpy as np

from solvers.core.amounts import amount
from solvers.core.arrays import FloatArray

BLOCK = 20_000  # lines at a time: the split text takes many times the memory of the numbers in it
COMMENTS = ("#", "//", "%")
SEPARATORS = {";": "semicolons", "\t": "tabs", ",": "commas", None: "spaces"}
COMPRESSED = {
    "gzip": b"\x1f\x8b", "zip": b"PK\x03\x04", "bzip2": b"BZh", "xz": b"\xfd7zXZ", "zstd": b"\x28\xb5\x2f\xfd",
}  # fmt: skip
THOUSANDS = re.compile(r"[+-]?\d{1,3}(,\d{3})+(\.\d*)?")
AXIS = re.compile(r"([xyz])(?:[ _]?[\[(]?(?:u|m|mm|cm|km|in|ft|px|metres?|meters?)[\])]?)?", re.IGNORECASE)


def lines_of(text: str) -> list[str]:
    """The lines of a text, with any system's line endings."""
    return text.replace("\r\n", "\n").replace("\r", "\n").split("\n")


def file_bytes(data: object) -> bytes:
    """`data` as bytes; raises ValueError for text, since a file's name would be read as its contents, and for a
    compressed file.
    """
    if not isinstance(data, bytes | bytearray):
        raise ValueError(f"data: expected the file's bytes, e.g. Path(name).read_bytes(), got {type(data).__name__}")
    for name, head in COMPRESSED.items():
        if data.startswith(head):
            raise ValueError(f"the file is compressed ({name}); decompress it first")
    return bytes(data)


def check_size(size: int, most: int) -> None:
    """Raise ValueError if a file of `size` bytes is larger than `most`."""
    if size > most:
        megabytes = math.ceil(size / 1e5) / 10.0  # rounded up: a byte above 24 MB is not 24.0 MB
        raise ValueError(f"{megabytes:.1f} MB are more than the limit of {most / 1e6:.0f} MB")


def told(value: str) -> str:
    """A value that was found, shortened for a message."""
    return repr(value if len(value) <= 40 else value[:39] + "…")


def is_number(field: str) -> bool:
    """Whether a field is a number as files write it: with a decimal point; NaN and
    infinity count too.
    """
    try:
        float(field)
    except ValueError:
        return False
    return "_" not in field and field.isascii()


def delimited(lines: Sequence[str]) -> tuple[FloatArray, str, list[str]]:
    """Read points from CSV, XYZ and the like: (n, 2) or (n, 3), how the columns are
    separated, and notices.

    Comments and blank lines are skipped, and so is a first line that only counts the lines
    after it, as in PTS files. A first line that is not all numbers names the columns, and so
    does a comment right before the numbers with as many fields: the columns named x, y and z,
    with a unit (x_m, x [m]) or without, or at the end of a path (field.x) if no other is,
    are taken, otherwise the first two or three. If tabs separate columns, spaces do as well;
    separators at a line's end are ignored. Raises ValueError with the line's number, also if
    x and y are there and an axis is named twice.
    """
    rows = [k for k, line in enumerate(lines) if (bare := line.strip()) and not bare.startswith(COMMENTS)]
    if not rows:
        raise ValueError("line 1: no line with numbers was found; expected x and y, or x, y and z, on every line")
    opening = rows[0]
    if lines[opening].strip() == str(len(rows) - 1) != "0":
        rows = rows[1:]
    head = rows[0] + 1
    first = _bare(lines[rows[0]]).rstrip()  # a tab at the end separates nothing
    unquoted = "".join(_by_quotes(first)[::2])
    separator = next((mark for mark in SEPARATORS if mark and mark in unquoted), None)
    if separator == "\t" and _spaced(first):
        separator = None
    fields = _fields(first, separator)
    if all(map(is_number, values := _without_tail(fields))):
        fields = values
    notices: list[str] = []
    comma = next((field for field in fields if not is_number(field) and is_number(field.replace(",", "."))), None)
    if comma is not None:
        raise ValueError(f"line {rows[0] + 1}: {told(comma)} is not a number; {_hint(comma)}")
    numeric = [is_number(field) for field in fields]
    names = _comment_before(lines, opening, separator)  # in CloudCompare's files the count stands between
    named = len(names) == len(fields) and not any(map(is_number, names))
    if all(numeric) or (any(numeric) and named and _axes(names, len(fields))):  # a column of text may be left out
        width = len(fields)
        columns = _columns(names, opening - 1, notices) if named else list(range(min(3, width)))
    elif any(numeric):
        wrong = next(field for field in fields if not is_number(field))
        hint = _hint(wrong, "expected numbers, or names alone")
        raise ValueError(f"line {rows[0] + 1}: {told(wrong)} is not a number; {hint}")
    else:
        if separator == "\t" and len(_fields(_bare(lines[rows[min(1, len(rows) - 1)]]).rstrip(), "\t")) > len(fields):
            fields = _fields(_bare(lines[rows[0]]), "\t")  # the last columns have no names
        columns, width = _columns(fields, rows[0], notices), len(fields)
        rows = rows[1:]
    if width < 2:
        raise ValueError(
            f"line {head}: {told(first)} is one column; expected at least x and y, separated by"
            " commas, semicolons, tabs or spaces"
        )
    if not rows:
        raise ValueError(f"line {head + 1}: no line follows the columns' names; expected numbers")
    if width > len(columns):
        notices.append(f"columns other than {'xyz'[: len(columns)]} were left out")
    return numbers(lines, rows, columns, width, separator), SEPARATORS[separator], notices


def _bare(line: str) -> str:
    """The line without a comment at its end and without space around it."""
    return line.partition("#")[0].strip(" \r\n\v\f")


def _fields(line: str, separator: str | None) -> list[str]:
    """The line's fields without the quotation marks around them; a separator between such marks is text."""
    parts = _by_quotes(line)
    if separator is None or len(parts) == 1:
        return [field.strip().strip('"') for field in line.split(separator)]
    parts[::2] = [part.replace(separator, "\0") for part in parts[::2]]  # no text has zero bytes
    return [field.strip() for field in "".join(parts).split("\0")]


def _by_quotes(line: str) -> list[str]:
    """The line in parts, every second of which was between quotation marks; whole if a mark is without its second."""
    parts = line.split('"')
    return parts if len(parts) % 2 else [line]


def _spaced(line: str) -> bool:
    """Whether a line separates its numbers, or the names of its axes, by spaces as well as tabs, without empty fields.
    """
    fields, parts = _fields(line, "\t"), _fields(line, None)
    if "" in fields or len(parts) == len(fields):
        return False
    return all(map(is_number, parts)) or (all(map(AXIS.fullmatch, parts)) and bool(_axes(parts, len(parts))))


def _without_tail(fields: list[str], width: int = 1) -> list[str]:
    """The fields without empty ones at the end, cut to no fewer than `width`."""
    count = len(fields)
    while count > width and not fields[count - 1]:
        count -= 1
    return fields[:count]  # cut once: a spreadsheet's row may end in thousands of separators


def _resplit(fields: list[str], line: str, width: int) -> list[str]:
    """A line's fields, split at spaces instead of tabs if that gives `width` of them."""
    if len(fields) >= width or "" in fields:
        return fields
    parts = _fields(_bare(line), None)
    return parts if len(parts) == width else fields


def _columns(fields: Sequence[str], row: int, notices: list[str]) -> list[int]:
    """The columns of x, y and, if there is one, z, by their names; otherwise the first two or three, with a notice."""
    _refuse_twice(fields, row)
    if axes := _axes(fields, len(fields)):
        return axes
    if len(fields) > 1:
        count = min(3, len(fields))
        notices.append(f"no columns are called x and y in line {row + 1}: the first {count} were taken")
        return list(range(count))
    return []


def _axes(names: Sequence[str], width: int) -> list[int]:
    """Which of `width` columns are x, y and, if there is one, z; empty unless the names assign one column to each."""
    letters = _letters(names) if len(names) == width else []
    if letters.count("x") != 1 or letters.count("y") != 1 or letters.count("z") > 1:
        return []
    return [letters.index(axis) for axis in "xyz" if axis in letters]


def _refuse_twice(names: Sequence[str], row: int) -> None:
    """Raise ValueError if x and y are there and an axis is named twice."""
    letters = _letters(names)
    if "x" in letters and "y" in letters:
        for axis in "xyz":
            both = [name for name, letter in zip(names, letters, strict=True) if letter == axis]
            if len(both) > 1:
                raise ValueError(f"line {row + 1}: two columns are named {axis}: {told(both[0])} and {told(both[1])}")


def _letters(names: Sequence[str]) -> list[str]:
    """The axis that each name stands for: x, y or z, or "". Names that are paths, such as ROS's field.x, stand for what
    they end with, unless x and y are there without one.
    """
    letters = [_letter(name) for name in names]
    return letters if {"x", "y"} <= {*letters} else [_letter(re.split("[./]", name)[-1]) for name in names]


def _letter(name: str) -> str:
    match = AXIS.fullmatch(name)
    return match[1].lower() if match else ""


def _comment_before(lines: Sequence[str], row: int, separator: str | None) -> list[str]:
    """The fields of a comment in the line before `row`, where numpy.savetxt writes the columns' names."""
    bare = lines[row - 1].strip() if row else ""
    mark = next((mark for mark in COMMENTS if bare.startswith(mark)), None)
    return [] if mark is None else _fields(bare.removeprefix(mark).strip(), separator)


def numbers(
    lines: Sequence[str], rows: Sequence[int], columns: Sequence[int], width: int, separator: str | None = None
) -> FloatArray:
    """The `columns` of the lines that `rows` names, each of `width` fields: (len(rows),
    len(columns)).

    Raises ValueError with the number of the first line that is not `width` numbers.
    """
    table = np.empty((len(rows), len(columns)))
    left, at = iter(rows), 0
    while block := list(islice(left, BLOCK)):
        parts = [_without_tail(_fields(_bare(lines[k]), separator), width) for k in block]
        if separator == "\t":
            parts = [p if len(p) == width else _resplit(p, lines[k], width) for k, p in zip(block, parts, strict=True)]
        try:
            if any(len(part) != width for part in parts):
                raise ValueError
            selection = [[part[c] for c in columns] for part in parts]
            if any("_" in field or not field.isascii() for part in selection for field in part):
                raise ValueError
            table[at : at + len(block)] = np.array(selection, dtype=np.float64)
        except ValueError:
            raise ValueError(_wrong(block, parts, columns, width, separator)) from None
        at += len(block)
    return table


def _wrong(
    block: Sequence[int], parts: Sequence[Sequence[str]], columns: Sequence[int], width: int, separator: str | None
) -> str:
    """The message about the first wrong line of a block."""
    for k, part in zip(block, parts, strict=True):
        if len(part) != width:
            by = SEPARATORS[separator]
            return f"line {k + 1}: {amount(len(part), 'field')} found; expected {width}, separated by {by}"
        for c in columns:
            if not is_number(part[c]):
                return f"line {k + 1}: {told(part[c])} is not a number; {_hint(part[c])}"
    raise AssertionError("no line is wrong")  # pragma: no cover


def _hint(field: str, otherwise: str = "expected a number such as -1.25 or 3e-2") -> str:
    if not field:
        return "write nan where a number is missing"
    if "," in field and is_number(field.replace(",", ".")):
        return "numbers are written with a decimal point"
    if THOUSANDS.fullmatch(field):
        return "numbers are written without separators of thousands"
    parts = re.split(r"[;,\s]+", field)
    if len(parts) > 1 and all(map(is_number, parts)):
        return "expected one separator throughout: semicolons, tabs, commas or spaces"
    return otherwise
