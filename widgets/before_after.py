"""Two clouds before and after a registration, seen from above, as one SVG file: what the command line draws."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from solvers import Pose
from solvers.thinning import thinned

from .own_clouds import Fit, about
from .own_marks import scale_bar
from .picture import Array, Panel, Points
from .room import VIEW
from .standalone import document

MOST = 4000  # points drawn of a cloud: more would not be told apart


def before_after(source: ArrayLike, target: ArrayLike, start: Pose, end: Pose, title: str) -> str:
    """The text of an SVG file: source (m, d) at both poses over target (n, d), d = 2 or 3, in one window."""
    p, q = (thinned(np.asarray(x, dtype=float), MOST) for x in (source, target))
    placed = [pose.apply(p)[:, :2] for pose in (start, end)]
    fit = about(np.concatenate([q[:, :2], *placed]))
    before, after = (_panel(fit, q[:, :2], moved) for moved in placed)
    panels = (
        replace(before, name="before", caption="Before: the source at its start"),
        replace(after, name="after", caption="After: the source at the pose"),
    )
    return document(panels, title)


def _panel(fit: Fit, target: Array, source: Array) -> Panel:
    marks = (
        *scale_bar(fit),
        Points(fit.put(target), "target", "square", radius=2.5),
        Points(fit.put(source), "source", radius=2.5),
    )
    return Panel("", "Target and source, seen from above", VIEW, marks, grid=False)
