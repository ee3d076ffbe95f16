"""A scale bar in the lower left corner of a picture's window."""

from __future__ import annotations

import numpy as np

from widgets.drawing.picture import Label, Mark, Segments, View

LONG = 7 / 32  # of the window's width: the bar is the longest round length below that, and at least 0.4 of it
TICK = 4.0  # px, half the height of an end tick


def round_length(limit: float) -> float:
    """The longest of 1, 2, 5, 10 … that is at most `limit`, which is positive."""
    power = 10.0 ** np.floor(np.log10(limit))
    return float(max(step * power for step in (1.0, 2.0, 5.0) if step * power <= limit * (1 + 1e-9)))


def scale_bar(view: View, unit: str, scale: float = 1.0) -> tuple[Mark, ...]:
    """A bar of a round length in `unit`; `scale` is the size of one `unit` in world units."""
    length = round_length(LONG * (view.x1 - view.x0) / scale)
    px = 1.0 / view.scale
    x, y = view.x0 + 17.5 * px, view.y0 + 17.5 * px
    end = x + length * scale
    ticks = Segments([[x, y - TICK * px], [end, y - TICK * px]], [[x, y + TICK * px], [end, y + TICK * px]], "ink")
    return Segments([x, y], [end, y], "ink"), ticks, Label((x, y), f"{length:g} {unit}", "ink", dy=-9.0)
