"""The marks for random features: one wave's crests over the clouds, its phases on a circle, all waves in a chart."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from widgets.drawing.chart import WIDTH, Axis, Series, chart
from widgets.drawing.picture import Array, Arrow, Label, Mark, Panel, Path, Points, Ring, Segments, View
from widgets.parts.room import VIEW, with_marks

MAP = replace(VIEW, width=460.0)
CIRCLE = View(-1.56, 1.56, -1.123, 1.123, 460.0)  # as high as the map
INNER = 0.8  # radius of the circle of the target's phases, inside the source's
HEIGHT = 169.6  # px, that of the error chart
TURN = 2.0 * np.pi
MOST = 60  # crests on each side of the origin
LONGEST = 3.5  # rad, |ω|·ℓ at the right end of the chart of waves


def crests(view: View, frequency: Array) -> Segments:
    """The lines of phase 0 of the wave with `frequency` (2,) in rad/u, across the window."""
    size = float(np.hypot(*frequency))
    along = frequency / size
    across = np.array([-along[1], along[0]])
    reach = float(np.hypot(view.x1 - view.x0, view.y1 - view.y0))
    corners = np.array([[x, y] for x in (view.x0, view.x1) for y in (view.y0, view.y1)]) @ along * size / TURN
    first, last = np.ceil(corners.min()), np.floor(corners.max())
    k = np.arange(max(first, -MOST), min(last, MOST) + 1)
    foot = along * (k[:, None] * TURN / size)
    ends = [_clipped(view, f, across, reach) for f in foot]
    segments = [pair for pair in ends if pair is not None]
    a, b = (np.array([pair[i] for pair in segments]).reshape(-1, 2) for i in range(2))
    return Segments(a, b, "accent", weight=np.full(len(segments), 0.6))


def _clipped(view: View, foot: Array, direction: Array, reach: float) -> tuple[Array, Array] | None:
    """The part of a line within the window; None if there is none."""
    low, high = -reach, reach
    for i, (least, most) in enumerate([(view.x0, view.x1), (view.y0, view.y1)]):
        if abs(direction[i]) < 1e-12:
            if not least <= foot[i] <= most:
                return None
            continue
        first, last = sorted([(least - foot[i]) / direction[i], (most - foot[i]) / direction[i]])
        low, high = max(low, first), min(high, last)
    return (foot + low * direction, foot + high * direction) if low < high else None


def phases(source: Array, target: Array, frequency: Array) -> Panel:
    """The points of the moved source (m, 2) and of the target (n, 2), each at its phase on a circle, and both means."""
    moving, fixed = (np.stack([np.cos(a), np.sin(a)], axis=1) for a in (source @ frequency, target @ frequency))
    means = moving.mean(axis=0), fixed.mean(axis=0)
    marks: list[Mark] = [
        Ring([0.0, 0.0], "guide", reach=1.0),
        Ring([0.0, 0.0], "guide", reach=INNER),
        Points(INNER * fixed, "target", "square", radius=2.5),
        Points(moving, "source", radius=2.5),
        Path(np.stack(means), "accent", thick=True),
        Arrow([0.0, 0.0], means[1], "target"),
        Arrow([0.0, 0.0], means[0], "source"),
    ]
    label, caption = "The phases of one wave at all points, and their means", "The phase of each point, and both means"
    return Panel("phases", label, CIRCLE, tuple(marks), grid=False, caption=caption)


def waves(sizes: Array, apart: Array, chosen: int) -> Panel:
    """The distance (D,) between the two means of every wave over |ω| ℓ (D,), with one wave highlighted."""
    places = np.stack([np.minimum(sizes, LONGEST), apart], axis=1)
    panel = chart(
        "waves",
        "Distance between the two means, for every wave",
        [],
        Axis("|ω|·ℓ, rad", 0.0, LONGEST),
        # Two means are never more than 2 apart.
        Axis("Means apart, each wave", 0.0, 1.0 if apart.max() <= 1.0 else 2.0),
        size=(WIDTH, HEIGHT),
    )
    foot = places * [1.0, 0.0]
    point = places[chosen : chosen + 1]
    return with_marks(
        panel,
        Segments(foot, places, "guide"),
        Points(places, "ink", radius=2.5),
        Segments(foot[chosen : chosen + 1], point, "accent"),
        Points(point, "accent", radius=4.5),
    )


def convergence(running: Array, exact: float, at_truth: float, count: int) -> Panel:
    """The estimate from the first 1, 2, … waves (k,), with the D in use marked; the exact MMD² here and at the truth.

    Both axes are logarithmic: powers of two for D, of ten for the values.
    """
    most, least = float(np.log2(len(running))), 3e-4
    panel = chart(
        "estimate",
        "The estimate of MMD² from the first D waves of the draw",
        [
            Series([0.0, most], [at_truth, at_truth], "truth", dashed=True),
            Series([0.0, most], [exact, exact], "source", dashed=True),
            Series(np.log2(np.arange(1, len(running) + 1)), running, "ink"),
        ],
        Axis("D", 0.0, most, tuple((float(k), str(2**k)) for k in range(0, int(most) + 1, 2))),
        Axis("MMD², estimated from D waves", least, 1.0, log=True),
        now=float(np.log2(count)),
        size=(WIDTH, HEIGHT),
    )
    # The upper line is named above it, the lower one below, so that neither name lies on the other's line.
    above, below = (-7.0, 15.0) if exact >= at_truth else (15.0, -7.0)
    ends = [[most, float(np.log10(max(value, least)))] for value in (exact, at_truth)]
    label = Label(ends[0], "exact, here", "source", "end", dx=-4, dy=above)
    return with_marks(panel, label, Label(ends[1], "exact, at the truth", "truth", "end", dx=-4, dy=below))
