"""Charts: round ticks, gaps, logarithms."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from widgets.chart import Series, chart, ticks
from widgets.picture import Label, Panel, Path, Points
from widgets.svg import panel_svg


@pytest.mark.parametrize(
    ("low", "high", "expected"),
    [
        (0, 1, [0, 0.5, 1]),
        (0, 40, [0, 10, 20, 30, 40]),
        (-3, 3, [-2, 0, 2]),
        (0.1, 0.35, [0.1, 0.2, 0.3]),
        (5, 5, [5]),
    ],
)
def test_ticks(low: float, high: float, expected: list[float]) -> None:
    assert ticks(low, high) == expected


@settings(deadline=None)
@given(st.floats(-1e6, 1e6), st.floats(1e-3, 1e6))
def test_ticks_are_evenly_spaced_and_inside(low: float, span: float) -> None:
    """Two to six values, of equal step, none outside the range."""
    found = ticks(low, low + span)
    assert 1 <= len(found) <= 6
    assert min(found) >= low - 1e-6 * span
    assert max(found) <= low + span * (1 + 1e-6)
    assert np.ptp(np.diff(found)) <= 1e-6 * span if len(found) > 2 else True


def _chart(y: list[float], log: bool = False, **more: float) -> Panel:
    series = [Series(range(len(y)), y, "source", "RMS", dots=True)]
    y_range = (1e-3, 10.0) if log else (0.0, 10.0)
    return chart(
        "c", "RMS over steps", series, x_label="step", y_label="u", x_range=(0, 9), y_range=y_range, log=log, **more
    )


def test_a_gap_breaks_the_line() -> None:
    """NaN leaves a hole and is drawn nowhere."""
    panel = _chart([1.0, 2.0, np.nan, 3.0, 4.0, np.nan, 5.0])
    lines = [mark for mark in panel.marks if isinstance(mark, Path) and mark.role == "source"]
    assert [np.asarray(line.xy).tolist() for line in lines] == [[[0, 1], [1, 2]], [[3, 3], [4, 4]]]
    (dots,) = (mark for mark in panel.marks if isinstance(mark, Points))
    assert len(np.asarray(dots.xy)) == 5
    assert "<svg" in panel_svg(panel, "f")


def test_logarithms_are_drawn_by_decades_and_clipped() -> None:
    """Zero has no logarithm: it is drawn at the low end of the range."""
    panel = _chart([100.0, 1.0, 0.0], log=True)
    (line,) = (mark for mark in panel.marks if isinstance(mark, Path) and mark.role == "source")
    np.testing.assert_allclose(np.asarray(line.xy)[:, 1], [1, 0, -3])
    labels = [mark.text for mark in panel.marks if isinstance(mark, Label)]
    decades = ["0.001", "0.01", "0.1", "1", "10"]
    assert [text for text in labels if text in decades] == decades


def test_all_gaps_is_an_empty_chart() -> None:
    panel = _chart([np.nan, np.nan], now=1.0)
    assert not [mark for mark in panel.marks if isinstance(mark, Points)]
    assert "<svg" in panel_svg(panel, "f")
