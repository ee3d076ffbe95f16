"""The plots' common look: light axes, labels beside their marks, intervals."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from numpy.typing import ArrayLike

from sitegen.figures.matplotlib_svg import COLOURS

Boxes = Sequence[tuple[float, float, float, float]]


def axes_in(figure: Any, narrow: bool, wide_boxes: Boxes, narrow_boxes: Boxes) -> list[Any]:
    """Axes at these boxes of (left, top, width, height) in px from the figure's upper left corner."""
    width, height = 72.0 * figure.get_size_inches()
    boxes = narrow_boxes if narrow else wide_boxes
    return [figure.add_axes([x / width, 1.0 - (y + h) / height, w / width, h / height]) for x, y, w, h in boxes]


def titled(axes: Any, title: str, x: str = "", y: str = "") -> None:
    """Set the axes' title, in bold at the upper left, the x label, and the y label below the title."""
    axes.set_title(title, fontweight="bold", pad=26.0 if y else 10.0)
    if y:
        position = {"xycoords": "axes fraction", "xytext": (0.0, 8.0), "textcoords": "offset points", "va": "bottom"}
        axes.annotate(y, (0.0, 1.0), color=COLOURS["soft"], fontsize=12.0, **position)
    axes.set_xlabel(x)
    axes.grid(axis="y")
    axes.spines["left"].set_visible(False)


def label(axes: Any, x: float, y: float, text: str, role: str = "ink", **extra: Any) -> None:
    """Write a label beside a mark, `dx` and `dy` px away from it (up is positive)."""
    shift = extra.pop("dx", 0.0), extra.pop("dy", 0.0)
    options = {"va": "center", "ha": "left", "color": COLOURS[role], "fontsize": 12.5, "annotation_clip": False}
    axes.annotate(text, (x, y), xytext=shift, textcoords="offset points", **{**options, **extra})


def measured(
    axes: Any,
    x: ArrayLike,
    y: ArrayLike,
    low: ArrayLike,
    high: ArrayLike,
    role: str,
    joined: bool = False,
    mark: str = "o",
) -> None:
    """Draw marks with their intervals; `joined`: with a line through them."""
    colour = COLOURS[role]
    axes.vlines(x, low, high, color=colour, linewidth=1.5, capstyle="butt")
    axes.plot(
        x, y, f"{mark}-" if joined else mark, color=colour, markersize=5.5, markeredgecolor=COLOURS["paper"],
        markeredgewidth=1.25, linewidth=1.75, zorder=3, clip_on=False,
    )  # fmt: skip
