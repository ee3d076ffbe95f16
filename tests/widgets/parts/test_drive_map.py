"""The map of the recorded drive: which echoes it shows, and where."""

from __future__ import annotations

import numpy as np
import pytest

from solvers.scenes.drive import telecom_loop
from widgets.parts.drive_map import EVERY, FARTHEST, SCANS, VIEW, drawn_scans, echo_marks, loops
from widgets.parts.drive_table import table


def test_the_scans_drawn_lie_apart() -> None:
    t = table().way("matched").t[list(drawn_scans())]
    assert np.linalg.norm(np.diff(t, axis=0), axis=1).min() >= 0.35
    assert len(t) > 100


@pytest.mark.parametrize("count", [1, 37, SCANS])
def test_the_echoes_are_those_of_the_scans_so_far_inside_the_window(count: int) -> None:
    """Every so many of each drawn scan, placed by its pose."""
    way = table().way("closed", "huber", True)
    expected = []
    for k in drawn_scans():
        if k < count:
            placed = telecom_loop().points(k, FARTHEST)[k % EVERY :: EVERY] @ way.R[k].T + way.t[k]
            expected += [p for p in placed if VIEW.x0 < p[0] < VIEW.x1 and VIEW.y0 < p[1] < VIEW.y1]
    drawn = np.concatenate([np.asarray(mark.xy) for mark in echo_marks(count, "closed", "huber", True)])
    np.testing.assert_allclose(drawn, expected, atol=1e-12)


def test_a_line_joins_the_scans_of_every_so_many_loops() -> None:
    data, way = table(), table().way("matched")
    lines = loops(way, 200, every=2, weight=0.5)
    rows = [k for k in range(len(data.later)) if data.later[k] < 200][::2]
    np.testing.assert_array_equal(lines.a, [way.t[data.earlier[k]] for k in rows])
    np.testing.assert_array_equal(lines.b, [way.t[data.later[k]] for k in rows])
    assert np.asarray(lines.weight).tolist() == [0.5] * len(rows)
    assert loops(way, SCANS).weight is None
    assert np.asarray(loops(way, 1).a).shape == (0, 2)
