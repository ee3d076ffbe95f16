"""Pose graphs as text: the planar part of the g2o format.

    VERTEX_SE2 id x y angle
    EDGE_SE2 from to x y angle  I11 I12 I13 I22 I23 I33
    FIX id …

Lengths are in the file's unit, angles in radians; the six numbers are the upper triangle
of the information matrix, row by row. Lines that begin with # and blank lines are
skipped. The module takes bytes and opens no file.

Source: Kümmerle, Grisetti, Strasdat, Konolige & Burgard 2011, g2o: A general framework
for graph optimization.
"""

from __future__ import annotations

import codecs
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from solvers.core import validate
from solvers.core.arrays import FloatArray, IntArray
from solvers.core.brief import brief
from solvers.core.edges import Edges, graph, row_numbers, within
from solvers.core.numbers import array
from solvers.core.pose import Pose
from solvers.io.text import check_size, file_bytes, is_number, lines_of, told

MOST_BYTES = 64_000_000
_LARGEST_ID = 2**62
_UPPER = np.triu_indices(3)
_FIELDS = {"VERTEX_SE2": 4, "EDGE_SE2": 11}


@dataclass(frozen=True, eq=False)
class GraphText:
    r"""A file's pose graph, its nodes counted from 0 in the order of the file.

    Attributes
    ----------
    ids : ndarray of int64, shape (n,)
        Each node's id in the file.
    poses : Pose of shape (n,)
        The nodes.
    edges : Edges
        The measurements between them, by row of `poses`.
    fixed : ndarray of int64
        The rows that FIX lines name, ascending; often none.

    Examples
    --------
    >>> from solvers.g2o import read
    >>> graph = read(b"VERTEX_SE2 7 0 0 0\nVERTEX_SE2 9 1 0 0.5\nFIX 7\n")
    >>> graph.ids, graph.poses.batch, len(graph.edges), graph.fixed
    (array([7, 9]), (2,), 0, array([0]))
    """

    ids: IntArray
    poses: Pose
    edges: Edges
    fixed: IntArray

    __repr__ = brief


def read(data: bytes) -> GraphText:
    r"""Read the pose graph from a g2o file's bytes.

    Parameters
    ----------
    data : bytes
        The file, at most 64 MB.

    Returns
    -------
    GraphText
        Nodes, edges, and which nodes are fixed.

    Raises
    ------
    ValueError
        If the data are not bytes, if there is no node, or if a line does not follow the
        format: the message says which line, what was found there and what was expected.

    Examples
    --------
    >>> from solvers.g2o import read
    >>> from solvers.posegraph import optimise
    >>> graph = read(
    ...     b"VERTEX_SE2 0 0 0 0\n"
    ...     b"VERTEX_SE2 1 1 0 0\n"
    ...     b"EDGE_SE2 0 1 2 0 0 100 0 0 100 0 400\n"
    ... )
    >>> optimise(graph.poses, graph.edges).poses.t.round(6)
    array([[0., 0.],
           [2., 0.]])
    """
    data = file_bytes(data)
    check_size(len(data), MOST_BYTES)
    rows: dict[int, int] = {}
    places: list[list[float]] = []
    ends: list[tuple[int, int]] = []
    measurements: list[list[float]] = []
    fix_ids: list[int] = []
    edge_lines: list[int] = []
    fix_lines: list[int] = []
    text = data.removeprefix(codecs.BOM_UTF8).decode("utf-8", "replace")
    for number, line in enumerate(lines_of(text), 1):
        tag, *fields = line.partition("#")[0].split() or [""]
        if not tag:
            continue
        if tag == "FIX":
            if not fields:
                raise ValueError(f"line {number}: FIX names no node")
            fix_ids += [_id(field, number) for field in fields]
            fix_lines += [number] * len(fields)
        elif tag in _FIELDS:
            if len(fields) != _FIELDS[tag]:
                raise ValueError(f"line {number}: {tag} has {len(fields)} fields; expected {_FIELDS[tag]}")
            if tag == "VERTEX_SE2":
                node = _id(fields[0], number)
                if node in rows:
                    raise ValueError(f"line {number}: node {node} is defined twice")
                rows[node] = len(rows)
                places.append(_numbers(fields[1:], number))
            else:
                ends.append((_id(fields[0], number), _id(fields[1], number)))
                if ends[-1][0] == ends[-1][1]:
                    raise ValueError(f"line {number}: it joins node {fields[0]} to itself")
                measurements.append(_numbers(fields[2:], number))
                edge_lines.append(number)
        else:
            raise ValueError(f"line {number}: {told(tag)} is not read; expected VERTEX_SE2, EDGE_SE2 or FIX")
    if not rows:
        raise ValueError("no node was found; expected at least one line VERTEX_SE2 id x y angle")
    i = _rows_of(rows, [a for a, _ in ends], edge_lines)
    j = _rows_of(rows, [b for _, b in ends], edge_lines)
    fixed = np.unique(_rows_of(rows, fix_ids, fix_lines))
    edges = _edges(i, j, np.array(measurements, dtype=np.float64).reshape(-1, 9), edge_lines)
    return GraphText(np.array(list(rows), dtype=np.int64), _poses(np.array(places)), edges, fixed)


def write(poses: Pose, edges: Edges, *, fixed: int | Sequence[int] = (), ids: ArrayLike | None = None) -> bytes:
    """Encode a pose graph as a g2o file.

    Parameters
    ----------
    poses : Pose of shape (n,)
        The nodes.
    edges : Edges
        The measurements between them.
    fixed : int or sequence of int, default ()
        The rows of `poses` to mark as fixed.
    ids : array_like of int, shape (n,), optional
        The nodes' ids in the file, below 2⁶². None means 0, 1, 2, …

    Returns
    -------
    bytes
        The file. `read` gives the same numbers back, up to rounding in the angles'
        last digits.

    Raises
    ------
    ValueError
        If the poses are not rigid motions of the plane, of shape (n,), or are none, if
        `edges` is not Edges, if an edge or `fixed` names a node that does not exist, or
        if `ids` are not n different integers from 0 to 2⁶² − 1.

    Examples
    --------
    >>> import numpy as np
    >>> from solvers import Pose
    >>> from solvers.g2o import write
    >>> from solvers.posegraph import Edges
    >>> poses = Pose.from_angle([0.0, 0.5], [[0.0, 0.0], [1.0, 0.0]])
    >>> print(write(poses, Edges.between(poses, [0], [1], np.eye(3)), fixed=[0]).decode().splitlines()[0])
    VERTEX_SE2 0 0.0 0.0 0.0
    """
    n = graph(poses, edges)
    if not n:
        raise ValueError("poses: is empty; at least one node is needed")
    names = np.arange(n) if ids is None else row_numbers(ids, "ids")
    if len(names) != n or len(np.unique(names)) != n or (names >= _LARGEST_ID).any():
        raise ValueError(f"ids: expected {n} different non-negative integers below 2**62")
    rows = row_numbers(np.atleast_1d(array(fixed, "fixed")), "fixed")
    within(rows, n, "fixed")
    lines = [
        f"VERTEX_SE2 {name} {_text([*t, angle])}"
        for name, t, angle in zip(names, poses.t, np.atleast_1d(poses.angle), strict=True)
    ]
    lines += [f"FIX {names[row]}" for row in rows]
    Z = edges.relative
    lines += [
        f"EDGE_SE2 {names[a]} {names[b]} {_text([*t, angle, *matrix[_UPPER]])}"
        for a, b, t, angle, matrix in zip(edges.i, edges.j, Z.t, np.atleast_1d(Z.angle), edges.information, strict=True)
    ]
    return ("\n".join(lines) + "\n").encode()


def _text(values: Sequence[float]) -> str:
    return " ".join(repr(float(value)) for value in values)


def _id(field: str, line: int) -> int:
    if not (field.isascii() and field.isdigit() and len(field) < 20 and int(field) < _LARGEST_ID):
        raise ValueError(f"line {line}: {told(field)} is not a node; expected a number such as 12")
    return int(field)


def _numbers(fields: Sequence[str], line: int) -> list[float]:
    values = []
    for field in fields:
        value = float(field) if is_number(field) else np.nan
        if not np.isfinite(value):
            raise ValueError(f"line {line}: {told(field)} is not a number; expected one such as -1.25 or 3e-2")
        if abs(value) > validate.LARGEST:
            raise ValueError(f"line {line}: {told(field)}: expected no number beyond {validate.LARGEST:g}")
        values.append(value)
    return values


def _rows_of(rows: dict[int, int], nodes: Sequence[int], lines: Sequence[int]) -> IntArray:
    for node, line in zip(nodes, lines, strict=True):
        if node not in rows:
            raise ValueError(f"line {line}: node {node} has no VERTEX_SE2")
    return np.array([rows[node] for node in nodes], dtype=np.int64)


def _poses(values: FloatArray) -> Pose:
    return Pose.from_angle(values[:, 2], values[:, :2])


def _edges(i: IntArray, j: IntArray, values: FloatArray, lines: Sequence[int]) -> Edges:
    information = np.zeros((len(i), 3, 3))
    information[:, _UPPER[0], _UPPER[1]] = values[:, 3:]
    information[:, _UPPER[1], _UPPER[0]] = values[:, 3:]
    try:
        return Edges(i, j, _poses(values), information)
    except ValueError:
        for k, line in enumerate(lines):
            edge = slice(k, k + 1)
            try:
                Edges(i[edge], j[edge], _poses(values[edge]), information[edge])
            except ValueError as wrong:
                message = str(wrong).replace(" of edge 0", "").replace("j: edge 0", "it")
                raise ValueError(f"line {line}: {message}") from None
        raise
