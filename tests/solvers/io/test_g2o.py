"""Pose graphs written and read back, and errors reported by line."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from solvers import Pose
from solvers.io.g2o import read, write
from solvers.posegraph import Edges

reals = st.floats(-1e9, 1e9)
angles = st.floats(-3.1, 3.1)
VERTICES = "VERTEX_SE2 0 0 0 0\nVERTEX_SE2 1 1 0 0\n"
EDGE = "EDGE_SE2 0 1 1 0 0 4 0.5 0 4 0 9"


@st.composite
def graphs(draw):
    n = draw(st.integers(1, 6))
    nodes = np.array(draw(st.lists(st.tuples(reals, reals, angles), min_size=n, max_size=n)))
    pairs = draw(st.lists(st.tuples(st.integers(0, n - 1), st.integers(1, n - 1)), max_size=6)) if n > 1 else []
    readings = np.array(draw(st.lists(st.tuples(reals, reals, angles), min_size=len(pairs), max_size=len(pairs))))
    readings = readings.reshape(-1, 3)
    roots = np.array(draw(st.lists(st.lists(st.floats(-3.0, 3.0), min_size=9, max_size=9), min_size=len(pairs),
                                   max_size=len(pairs)))).reshape(-1, 3, 3)  # fmt: skip
    information = roots @ roots.swapaxes(1, 2) + 0.1 * np.eye(3)
    i, j = [a for a, _ in pairs], [(a + b) % n for a, b in pairs]
    edges = Edges(i, j, Pose.from_angle(readings[:, 2], readings[:, :2]), information)
    ids = draw(st.lists(st.integers(0, 2**62 - 1), min_size=n, max_size=n, unique=True))
    fixed = draw(st.sets(st.integers(0, n - 1)))
    return Pose.from_angle(nodes[:, 2], nodes[:, :2]), edges, sorted(fixed), ids


@settings(deadline=None)
@given(graphs())
def test_what_is_written_is_read_back(graph):
    poses, edges, fixed, ids = graph
    result = read(write(poses, edges, fixed=fixed, ids=ids))
    assert result.ids.tolist() == ids
    assert result.fixed.tolist() == fixed
    assert np.array_equal(result.poses.t, poses.t)
    assert np.array_equal(result.edges.relative.t, edges.relative.t)
    assert np.array_equal(result.edges.information, edges.information)
    assert np.array_equal([result.edges.i, result.edges.j], [edges.i, edges.j])
    np.testing.assert_allclose(result.poses.R, poses.R, atol=1e-15)
    np.testing.assert_allclose(result.edges.relative.R, edges.relative.R, atol=1e-15)


def test_the_triangle_is_read_row_by_row():
    graph = read((VERTICES + "EDGE_SE2 1 0 2 3 0.5 10 1 2 20 3 30\n").encode())
    assert np.array_equal(graph.edges.information[0], [[10, 1, 2], [1, 20, 3], [2, 3, 30]])
    assert (graph.edges.i[0], graph.edges.j[0]) == (1, 0)
    assert np.array_equal(graph.edges.relative.t, [[2, 3]])
    np.testing.assert_allclose(graph.edges.relative.angle, [0.5])


def test_order_comments_and_ends_of_lines_do_not_matter():
    text = f"\ufeff# a town\r\n{EDGE}  # a street\r\n\r\nFIX 1 0\r\n{VERTICES}"
    graph = read(text.encode())
    assert (len(graph.edges), graph.fixed.tolist()) == (1, [0, 1])


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "no node was found"),
        ("VERTEX_SE2 0 0 0\n", "line 1: VERTEX_SE2 has 3 fields; expected 4"),
        ("VERTEX_SE2 0 0 0 0\n" * 2, "line 2: node 0 is defined twice"),
        ("VERTEX_SE2 0 0 zero 0\n", "line 1: 'zero' is not a number"),
        ("VERTEX_SE2 0 0 nan 0\n", "line 1: 'nan' is not a number"),
        ("VERTEX_SE2 0 0 1e300 0\n", "line 1: '1e300': expected no number beyond 1e+150"),
        ("VERTEX_SE2 -1 0 0 0\n", "line 1: '-1' is not a node"),
        ("VERTEX_SE2 99999999999999999999 0 0 0\n", "line 1: '99999999999999999999' is not a node"),
        ("VERTEX_SE3:QUAT 0 0 0 0 0 0 0 1\n", "line 1: 'VERTEX_SE3:QUAT' is not read"),
        (VERTICES + "FIX\n", "line 3: FIX names no node"),
        (VERTICES + "FIX 0 7\n", "line 3: node 7 has no VERTEX_SE2"),
        (VERTICES + "\n" + EDGE.replace(" 1 ", " 2 ", 1), "line 4: node 2 has no VERTEX_SE2"),
        (VERTICES + EDGE + "\n" + EDGE.replace("2 0 1", "2 1 1"), "line 4: it joins node 1 to itself"),
        ("VERTEX_SE2 7 0 0 0\n" + EDGE.replace("2 0 1", "2 7 7"), "line 2: it joins node 7 to itself"),
        (VERTICES + EDGE + "\n" + EDGE.replace("9", "-9"), "line 4: information: the matrix is not positive definite"),
        (VERTICES + EDGE + " 1", "line 3: EDGE_SE2 has 12 fields; expected 11"),
        ("\0\xff", "line 1: "),
    ],
)
def test_what_is_wrong_is_told_by_its_line(text, words):
    with pytest.raises(ValueError, match=re.escape(words)):
        read(text.encode("latin-1"))


@settings(deadline=None)
@given(st.binary(max_size=60), st.sampled_from([b"", VERTICES.encode(), (VERTICES + EDGE).encode()]))
def test_any_bytes_are_a_graph_or_a_valueerror(data, before):
    try:
        graph = read(before + data)
    except ValueError:
        return
    assert np.isfinite(graph.poses.t).all()


def test_what_cannot_be_written_is_refused():
    poses = Pose.from_angle([0.0, 0.0], np.zeros((2, 2)))
    edges = Edges.between(poses, [0], [1], np.eye(3))
    for words, call in (
        ("edges.j: entry 0 names node 1", lambda: write(poses[:1], edges)),
        ("fixed: entry 0 names node 2", lambda: write(poses, edges, fixed=[2])),
        ("poses: is empty", lambda: write(Pose.identity(batch=(0,)), edges[:0])),
        ("ids: expected 2 different non-negative integers", lambda: write(poses, edges, ids=[1, 1])),
        ("ids: expected 2 different non-negative integers below 2**62", lambda: write(poses, edges, ids=[1, 2**62])),
        ("ids: expected integers of shape (k,)", lambda: write(poses, edges, ids=[1.0, 2.0])),
        ("fixed: expected integers", lambda: write(poses, edges, fixed=[True, False])),
        ("fixed: expected integers", lambda: write(poses, edges, fixed=[0.9])),
        ("fixed: rows of unequal length", lambda: write(poses, edges, fixed=[[0], [0, 1]])),
        ("edges: expected Edges, got NoneType", lambda: write(poses, None)),
        ("poses: expected shape (n,)", lambda: write(Pose.identity(), edges)),
    ):
        with pytest.raises(ValueError, match=re.escape(words)):
            call()


def test_the_largest_names_are_read_back():
    poses = Pose.identity(batch=(2,))
    ids = [0, 2**62 - 1]
    assert read(write(poses, Edges.between(poses, [0], [1], np.eye(3)), fixed=1, ids=ids)).ids.tolist() == ids


@pytest.mark.parametrize("name", ["file.txt", Path("file.txt"), None])
def test_a_name_in_place_of_bytes_is_refused(name):
    message = f"data: expected the file's bytes, e.g. Path(name).read_bytes(), got {type(name).__name__}"
    with pytest.raises(ValueError, match=f"^{re.escape(message)}$"):
        read(name)
