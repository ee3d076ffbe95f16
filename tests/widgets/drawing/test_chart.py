"""Charts: round ticks, gaps, logarithmic axes."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from widgets.drawing.chart import Axis, Series, chart, steps_axis, ticks
from widgets.drawing.picture import Label, Panel, Path, Points, View
from widgets.drawing.svg import panel_svg


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
    """One to six ticks, evenly spaced, none outside the range."""
    result = ticks(low, low + span)
    assert 1 <= len(result) <= 6
    assert min(result) >= low - 1e-6 * span
    assert max(result) <= low + span * (1 + 1e-6)
    assert all(abs(step - (result[1] - result[0])) <= 1e-6 * span for step in np.diff(result))


def _chart(y: list[float], log: bool = False, now: float | None = None) -> Panel:
    series = [Series(range(len(y)), y, "source", "RMS", dots=True)]
    y_axis = Axis("u", 1e-3 if log else 0.0, 10.0, log=log)
    return chart("c", "RMS over steps", series, Axis("step", 0, 9), y_axis, now=now)


def test_a_gap_breaks_the_line() -> None:
    """NaN leaves a gap, and no dot is drawn for it."""
    panel = _chart([1.0, 2.0, np.nan, 3.0, 4.0, np.nan, 5.0])
    lines = [mark for mark in panel.marks if isinstance(mark, Path) and mark.role == "source"]
    assert [np.asarray(line.xy).tolist() for line in lines] == [[[0, 1], [1, 2]], [[3, 3], [4, 4]]]
    (dots,) = (mark for mark in panel.marks if isinstance(mark, Points))
    assert len(np.asarray(dots.xy)) == 5
    assert "<svg" in panel_svg(panel, "f")


def test_logarithms_are_drawn_by_decades_and_clipped() -> None:
    """Zero has no logarithm, so it is drawn at the low end of the range."""
    panel = _chart([100.0, 1.0, 0.0], log=True)
    (line,) = (mark for mark in panel.marks if isinstance(mark, Path) and mark.role == "source")
    np.testing.assert_allclose(np.asarray(line.xy)[:, 1], [1, 0, -3])
    labels = [mark.text for mark in panel.marks if isinstance(mark, Label)]
    decades = ["0.001", "0.01", "0.1", "1", "10"]
    assert [text for text in labels if text in decades] == decades


def _labels(panel: Panel) -> list[Label]:
    return [mark for mark in panel.marks if isinstance(mark, Label)]


def _log_chart(low: float, high: float) -> list[str]:
    panel = chart("c", "", [], Axis("", 0, 1), Axis("", low, high, log=True))
    return [label.text for label in _labels(panel) if label.dx == -6]


def test_far_decades_are_written_as_powers() -> None:
    """10⁻⁵ is not printed as 0.0000, and one axis writes all its decades in the same style."""
    assert _log_chart(1e-5, 1.0) == ["10⁻⁵", "10⁻⁴", "10⁻³", "10⁻²", "10⁻¹", "1"]
    assert _log_chart(1e-6, 1.0) == ["10⁻⁶", "10⁻⁴", "10⁻²", "1"]
    assert _log_chart(1e-12, 1e3) == ["10⁻¹²", "10⁻⁹", "10⁻⁶", "10⁻³", "1", "10³"]


def test_small_ticks_of_a_linear_axis_keep_their_value() -> None:
    panel = chart("c", "", [], Axis("", 0, 1), Axis("", -2e-5, 4e-5))
    assert [label.text for label in _labels(panel) if label.dx == -6] == ["−2·10⁻⁵", "0", "2·10⁻⁵", "4·10⁻⁵"]


def test_the_name_of_the_y_axis_stands_clear_of_the_highest_grid_line() -> None:
    panel = _chart([1.0, 2.0])
    (name,) = (label for label in _labels(panel) if label.text == "u")
    assert name.dy <= -8
    assert panel.view.pad[1] + name.dy >= 13  # leaves room for the letters above it


@pytest.mark.parametrize("last", [[5.0, 5.0, 5.0], [5.0, 5.1, 4.9], [9.9, 10.0, 0.0], [1.0, 1.2, 6.0], [0.0, 0.0, 0.0]])
def test_names_at_the_ends_of_lines_do_not_overlap(last: list[float]) -> None:
    """Lines may end close together; their names are stacked between the panel's top and its x axis."""
    series = [Series([0, 9], [0, y], "source", f"line {i}") for i, y in enumerate(last)]
    panel = chart("c", "", series, Axis("", 0, 9), Axis("", 0, 10))
    names = [label for label in _labels(panel) if label.text.startswith("line")]
    heights = sorted(float(panel.view.px(label.xy)[0, 1]) + label.dy for label in names)
    assert len(heights) == 3
    assert heights[0] >= 12  # inside the panel
    assert heights[-1] <= panel.view.px([0, 0])[0, 1]  # above the ticks of the x axis
    assert min(np.diff(heights)) >= 16 - 1e-9


def _below(lines: dict[str, list[float]], name: str) -> bool:
    """Whether a line's name stands below the line's end, in a chart of lines over equal steps."""
    series = [Series(np.linspace(0, 9, len(y)), y, "source", key) for key, y in lines.items()]
    panel = chart("c", "", series, Axis("", 0, 9), Axis("", 0, 10))
    (label,) = (label for label in _labels(panel) if label.text == name)
    return label.dy > 0


def test_a_name_goes_below_its_line_if_it_would_cover_another_line_above() -> None:
    assert not _below({"low": [3.0, 3.0]}, "low")
    assert _below({"low": [3.0, 3.0], "high": [4.0, 4.0]}, "low")
    assert not _below({"low": [3.0, 3.0], "high": [4.0, 4.0]}, "high")
    assert not _below({"low": [3.0, 3.0], "high": [6.0, 6.0]}, "low"), "the other line is far enough above"


def test_a_name_goes_below_its_own_line_where_that_falls_steeply() -> None:
    assert _below({"falls": [10.0, 2.0]}, "falls")
    assert not _below({"rises": [2.0, 6.0]}, "rises")


def test_a_name_stays_above_if_a_line_or_the_axis_is_below() -> None:
    assert not _below({"low": [0.4, 0.4], "high": [1.4, 1.4]}, "low"), "the axis is below"
    assert not _below({"lowest": [2.0, 2.0], "low": [3.0, 3.0], "high": [4.0, 4.0]}, "low")


@given(
    st.lists(st.tuples(st.integers(0, 9), st.floats(0, 10)), min_size=1, max_size=3),
    st.sampled_from(["u", "RMS in units", "Error against the truth, ° and u"]),
)
def test_names_of_lines_keep_clear_of_the_name_of_the_axis(last: list[tuple[int, float]], title: str) -> None:
    """Wherever lines end, even at the top right after they begin; a letter is taken to be 6.5 px wide."""
    series = [Series([0, k], [0, y], "source", f"line {i}") for i, (k, y) in enumerate(last)]
    panel = chart("c", "", series, Axis("", 0, 9), Axis(title, 0, 10))
    boxes = {}
    for label in _labels(panel):
        (x, y), width = panel.view.px([label.xy])[0], 6.5 * len(label.text)
        left = x + label.dx - (width if label.anchor == "end" else 0.0)
        boxes[label.text] = (left, left + width, y + label.dy - 10, y + label.dy + 3)
    left, right, top, bottom = boxes.pop(title)
    names = [box for text, box in boxes.items() if text.startswith("line")]
    assert len(names) == len(last)
    for box in names:
        assert box[0] >= right or box[1] <= left or box[2] >= bottom or box[3] <= top
        assert box[2] >= 0


def test_a_name_of_a_line_that_has_just_begun_does_not_cover_the_ticks() -> None:
    panel = _chart([1.0, 2.0])
    (name,) = (label for label in _labels(panel) if label.text == "RMS")
    assert name.anchor == "start"


def test_all_gaps_is_an_empty_chart() -> None:
    panel = _chart([np.nan, np.nan], now=1.0)
    assert not [mark for mark in panel.marks if isinstance(mark, Points)]
    assert "<svg" in panel_svg(panel, "f")


def test_an_axis_of_x_may_be_logarithmic_too() -> None:
    series = [Series([0.1, 1.0, 10.0], [1, 2, 3], "source")]
    panel = chart("c", "", series, Axis("", 0.1, 10.0, log=True), Axis("", 0, 4))
    (line,) = (mark for mark in panel.marks if isinstance(mark, Path) and mark.role == "source")
    np.testing.assert_allclose(np.asarray(line.xy)[:, 0], [-1, 0, 1])
    assert [label.text for label in _labels(panel) if label.dy == 15] == ["0.1", "1", "10"]


def test_given_ticks_stand_in_for_round_values() -> None:
    """An axis may show another quantity than its window: its tick labels are then the given texts."""
    panel = chart("c", "c", [], Axis("x", 0, 1), Axis("y", 0, 1, ((0.0, "0.01"), (0.75, "ten"))))
    texts = [mark.text for mark in panel.marks if isinstance(mark, Label)]
    assert "ten" in texts
    assert "0.01" in texts
    assert "0.25" not in texts[texts.index("0.01") :]
    powers = chart("c", "c", [], Axis("D", 0, 4, ((2.0, "four"),)), Axis("y", 0, 1))
    words = [mark for mark in powers.marks if isinstance(mark, Label)]
    assert [tuple(np.ravel(mark.xy)) for mark in words if mark.text == "four"] == [(2.0, 0.0)]
    assert "3" not in [mark.text for mark in words]


def test_an_axis_of_steps_is_as_long_as_the_run_needs() -> None:
    """Its ticks are steps; its places are fractions, so that the window stays as it is."""
    for taken, span in ((0, 8), (8, 8), (9, 16), (17, 40), (40, 40)):
        length, axis = steps_axis(taken, 40)
        assert length == span
        assert axis.ends == (0.0, 1.0)
        assert [float(text) == place * span for place, text in axis.ticks] == [True] * 5


def test_a_panel_with_numbers_at_its_edges_says_so() -> None:
    """The style sheet lets them extend a little beyond the drawing; the marks of a map without axes end at its edge."""
    text = panel_svg(Panel("main", "x", View(0, 4, 0, 3, width=320, pad=(46.0, 0.0, 0.0, 0.0)), ()), "f")
    assert text.startswith('<svg class="panel padded" viewBox=')
