"""The benchmark's strips: a dot for each seed's error, a bar at the median, a line at the limit."""

from __future__ import annotations

import numpy as np
import pytest

from widgets.drawing.picture import Label, Path, Points, Segments
from widgets.figures.race.benchmark import strips
from widgets.figures.race.field import field


@pytest.mark.parametrize("count", [3, 9])
def test_each_strip_has_its_errors_and_their_median_by_powers_of_ten(count: int) -> None:
    """In the order of the contestants from above, each beside its name; an error beyond the axis is at its end."""
    entries = field("hypothesis-mixture")[:count]
    errors = 10.0 ** np.random.default_rng(5).uniform(-4.0, 3.0, (count, 25))
    panel = strips("rre", ("Rotation", "°"), entries, errors.tolist(), (0.001, 180.0), 5.0)
    dots = [np.asarray(mark.xy) for mark in panel.marks if isinstance(mark, Points)]
    bars = [np.asarray(mark.xy) for mark in panel.marks if isinstance(mark, Path) and mark.role == "ink"]
    names = {mark.text: float(np.ravel(mark.xy)[1]) for mark in panel.marks if isinstance(mark, Label)}
    assert len(dots) == len(bars) == count
    for entry, error, dot, bar in zip(entries, errors, dots, bars, strict=True):
        clipped = np.clip(error, 0.001, 180.0)
        np.testing.assert_allclose(10.0 ** dot[:, 0], clipped)
        np.testing.assert_allclose(10.0 ** bar[:, 0], np.median(clipped))
        assert np.abs(dot[:, 1] - names[entry.short]).max() < 0.5
        assert bar[:, 1].mean() == pytest.approx(names[entry.short])
    heights = [names[entry.short] for entry in entries]
    assert heights == sorted(heights, reverse=True)
    (limit,) = (mark for mark in panel.marks if isinstance(mark, Segments) and mark.dashed)
    np.testing.assert_allclose(10.0 ** np.stack([limit.a, limit.b])[:, 0], 5.0)
    ticks = {float(mark.text): mark for mark in panel.marks if isinstance(mark, Label) and mark.anchor == "middle"}
    assert sorted(ticks) == [0.001, 0.01, 0.1, 1.0, 10.0, 100.0]
    for value, label in ticks.items():
        assert 10.0 ** float(np.ravel(label.xy)[0]) == pytest.approx(value)
