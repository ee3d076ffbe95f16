"""The scale bar: a round length, drawn as long as it says, inside its window."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from widgets.drawing.picture import Label, Segments, View
from widgets.parts.scale_bar import LONG, scale_bar

VIEW = View(-6.4, 6.4, -4.6, 4.6)


@given(st.floats(1e-4, 1e4))
def test_the_bar_is_as_long_as_its_label_says(scale: float) -> None:
    """A round number of units, drawn at the window's scale, taking 0.4 to all of the room it has."""
    bar, ticks, label = scale_bar(VIEW, "m", scale)
    assert isinstance(ticks, Segments)
    ends = [np.atleast_2d(np.asarray(end)) for mark in (bar, ticks) for end in (mark.a, mark.b)]
    places = np.concatenate([*ends, np.atleast_2d(np.asarray(label.xy))])
    assert ((places > (VIEW.x0, VIEW.y0)) & (places < (VIEW.x1, VIEW.y1))).all()
    assert isinstance(bar, Segments)
    assert isinstance(label, Label)
    length = float(np.linalg.norm(np.asarray(bar.b) - np.asarray(bar.a)))
    number, unit = label.text.split()
    assert unit == "m"
    assert np.isclose(float(number) * scale, length, rtol=1e-5)
    assert number.lstrip("0.").strip("0.")[:1] in ("1", "2", "5")
    room = LONG * (VIEW.x1 - VIEW.x0)
    assert 0.399 * room < length <= room * 1.001
