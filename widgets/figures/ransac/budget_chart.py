"""A chart of the trials that a sampler needs, over the fraction of right pairs, with one run marked on the curve."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np

from solvers.methods.pairs.consensus import trials
from widgets.drawing.chart import WIDTH, Axis, Series, chart
from widgets.drawing.picture import Array, Label, Mark, Panel, Points

TOP = 1e4  # the most trials that the chart shows
SHARES = np.linspace(0.02, 1.0, 50)


@lru_cache(maxsize=64)
def budget_chart(confidence: float, sample: int, cap: int, share: float | None) -> Panel:
    """N over w at one confidence, for `sample` pairs per trial, the cap, and the point of a run's estimate `share`.

    Cached, since few of these differ and the host does not render the same object again.
    """
    panel = chart(
        "budget",
        f"Trials needed over the fraction of right pairs, at {100 * confidence:g} % confidence",
        [
            Series(SHARES, curve(confidence, sample), "target"),
            Series([0.0, 1.0], [cap, cap], "guide", f"cap {cap}", dashed=True),
        ],
        Axis("fraction w of right pairs", 0.0, 1.0),
        Axis(f"trials N at {100 * confidence:g} %", 1.0, TOP, log=True),
        now=share,
        size=(WIDTH, 180.0),
    )
    if share is None:
        return panel
    budget = float(trials(share, confidence, sample))
    point = np.array([share, np.log10(min(max(budget, 1.0), TOP))])
    marks: list[Mark] = [Points(point, "inlier", "diamond", radius=6.0)]
    if budget < TOP:
        # The name is above the curve, below it near its right end, and above again where the curve reaches the axis.
        high, name = share < 0.78, f"N = {whole(budget)}"
        dx, dy = (10.0, -9.0) if high else (-18.0, 4.0) if budget > 1.0 else (-8.0, -26.0)
        marks.append(Label(point, name, "inlier", "start" if high else "end", dx=dx, dy=dy))
    return replace(panel, marks=(*panel.marks, *marks))


def whole(count: float) -> str:
    """A whole number with commas between thousands."""
    return f"{count:,.0f}"


def curve(confidence: float, sample: int) -> Array:
    """The exact number of trials at SHARES, at least one and not rounded up."""
    with np.errstate(divide="ignore"):
        exact = np.log1p(-confidence) / np.log1p(-(SHARES**sample))
    return np.asarray(np.maximum(exact, 1.0))
