"""PLY: a header that describes what follows, then the vertices as text or as
little-endian or big-endian binary numbers.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from solvers.core.arrays import FloatArray
from solvers.io.text import lines_of, numbers, told

TYPES = {
    **dict.fromkeys(("char", "int8"), "i1"),
    **dict.fromkeys(("uchar", "uint8"), "u1"),
    **dict.fromkeys(("short", "int16"), "i2"),
    **dict.fromkeys(("ushort", "uint16"), "u2"),
    **dict.fromkeys(("int", "int32"), "i4"),
    **dict.fromkeys(("uint", "uint32"), "u4"),
    **dict.fromkeys(("float", "float32"), "f4"),
    **dict.fromkeys(("double", "float64"), "f8"),
}
ORDERS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}
END = re.compile(rb"([\r\n])end_header")


@dataclass
class _Element:
    """One element of the header and its line there; its properties are names with numpy's types, which are
    empty for lists.
    """

    name: str
    count: int
    line: int
    properties: list[tuple[str, str]] = field(default_factory=list)


def points(data: bytes, most: int) -> tuple[FloatArray, str]:
    """The vertices' x, y and, if there is one, z: (n, 2) or (n, 3), and how they were
    written.

    Raises a ValueError that gives the line's number, in the header or in text, or says
    what is missing.
    """
    match = END.search(data)
    if not match:
        last = len(lines_of(data.rstrip().decode("latin-1")))
        raise ValueError(f"line {last}: the file ends within its header; expected 'end_header'")
    at = match.end(1)
    end = data.find(match[1], at)
    end = len(data) if end < 0 else end + 1
    header = lines_of(data[:at].decode("latin-1"))
    order, elements = _header(header)
    before, vertex = _vertices(elements, len(header), most)
    if order == "ascii":
        return _text(data[end:], len(header), before, vertex), "text"
    return _binary(data[end:], ORDERS[order], before, vertex), order.replace("_", " ")


def _header(lines: Sequence[str]) -> tuple[str, list[_Element]]:
    order, elements = "", list[_Element]()
    for k, line in enumerate(lines[1:], 2):
        words = line.split()
        match words:
            case [] | ["comment" | "obj_info", *_]:
                continue
            case ["format", kind, _] if kind in ORDERS:
                order = kind
            case ["element", name, count] if count.isascii() and count.isdigit() and len(count) < 12:
                elements.append(_Element(name, int(count), k))
            case ["property", "list", _, _, name] if elements:
                elements[-1].properties.append((name, ""))
            case ["property", kind, name] if elements and kind in TYPES:
                elements[-1].properties.append((name, TYPES[kind]))
            case _:
                raise ValueError(
                    f"line {k}: {told(line)} is not understood; expected format, element, property or comment"
                )
    if not order:
        raise ValueError(f"line 2: no format is named; expected 'format' and one of {', '.join(ORDERS)}")
    return order, elements


def _vertices(elements: Sequence[_Element], line: int, most: int) -> tuple[Sequence[_Element], _Element]:
    """The elements before the vertices, and that of the vertices."""
    names = [element.name for element in elements]
    if "vertex" not in names:
        raise ValueError(f"line {line}: the header has no 'element vertex'")
    before, vertex = elements[: names.index("vertex")], elements[names.index("vertex")]
    properties = [name for name, _ in vertex.properties]
    if not {"x", "y"} <= set(properties) or len(set(properties)) < len(properties):
        listing = ", ".join(properties) or "nothing"
        raise ValueError(f"line {vertex.line}: the vertices have {listing}; expected x and y, each once")
    if not all(kind for _, kind in vertex.properties):
        raise ValueError(f"line {vertex.line}: a property of the vertices is a list; expected numbers")
    if vertex.count > most:
        raise ValueError(f"line {vertex.line}: {vertex.count} vertices are more than the limit of {most}")
    return before, vertex


def _axes(vertex: _Element) -> list[str]:
    return [axis for axis in "xyz" if axis in [name for name, _ in vertex.properties]]


def _text(body: bytes, header: int, before: Sequence[_Element], vertex: _Element) -> FloatArray:
    # The body's first line is line header + 1 of the file: `header` empty lines before it
    # keep the numbering right.
    lines = [""] * header + lines_of(body.rstrip().decode("latin-1"))
    rows = [k for k, line in enumerate(lines) if line.strip()]
    first = sum(element.count for element in before)
    own = rows[first : first + vertex.count]
    if len(own) < vertex.count:
        raise ValueError(f"line {len(lines)}: the file ends after {len(own)} vertices; expected {vertex.count}")
    names = [name for name, _ in vertex.properties]
    return numbers(lines, own, [names.index(axis) for axis in _axes(vertex)], len(names))


def _binary(body: bytes, order: str, before: Sequence[_Element], vertex: _Element) -> FloatArray:
    offset = 0
    for element in before:
        if not all(kind for _, kind in element.properties):
            raise ValueError(f"the element {told(element.name)} has lists before the vertices; expected them after")
        offset += element.count * sum(int(kind[1]) for _, kind in element.properties)
    row = np.dtype([(name, order + kind) for name, kind in vertex.properties])
    size = vertex.count * row.itemsize
    if len(body) - offset < size:
        whole = max(0, len(body) - offset) // row.itemsize
        raise ValueError(f"the file ends after {whole} vertices; expected {vertex.count} of {row.itemsize} bytes each")
    table = np.frombuffer(body, row, vertex.count, offset)
    return np.stack([table[axis].astype(np.float64) for axis in _axes(vertex)], axis=1)
