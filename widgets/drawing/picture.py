"""What a figure shows, as data: marks in world coordinates with semantic roles, readouts, handles and a description.

A Picture knows nothing of colours or browsers. `widgets.drawing.svg` turns it into markup, in the build for the static
page and in the browser for every live frame, so the two cannot disagree.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Literal, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]
Role = Literal[
    "source", "target", "truth", "inlier", "outlier", "ghost", "pair", "normal", "weak", "guide", "ink", "accent",
    # The lines of the race's solvers, by how each links the clouds.
    "by-nearest", "by-samples", "by-cells", "by-weights", "by-means", "by-marginals",
    # Where runs that miss the truth end, by their rotation error: areas of a map, also distinguished by hatching.
    "end-shifted", "end-turned", "end-quarter", "end-half", "end-none",
]  # fmt: skip
Shape = Literal["dot", "square", "cross", "ring", "diamond"]
Anchor = Literal["start", "middle", "end"]

SUPERSCRIPT = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
ROLES: tuple[str, ...] = get_args(Role)
FAINT = 0.34  # weight of a line in the background, such as that of an unused pair


def rows(values: ArrayLike) -> Array:
    """`values` as an (n, 2) float array; a single row may be given as a flat sequence."""
    return np.asarray(values, dtype=float).reshape(-1, 2)


@dataclass(frozen=True, eq=False)
class Points:
    """One layer of points, drawn as one path, or one path per weight level if `weight` is given.

    xy: (n, 2) world. radius: px. weight: (n,) in [0, 1], drawn as opacity in at most six levels.
    """

    xy: ArrayLike
    role: Role
    shape: Shape = "dot"
    radius: float = 4.0
    weight: ArrayLike | None = None


@dataclass(frozen=True, eq=False)
class Segments:
    """Straight lines from a[i] to b[i], both (n, 2) world; `weight` as in Points, drawn as opacity and width."""

    a: ArrayLike
    b: ArrayLike
    role: Role
    weight: ArrayLike | None = None
    dashed: bool = False


@dataclass(frozen=True, eq=False)
class Path:
    """One polyline through xy (n, 2) world, optionally closed and filled. `dashed` and `dotted` together are dash-dot.

    weight: in [0, 1], drawn as opacity as in Points.
    """

    xy: ArrayLike
    role: Role
    closed: bool = False
    filled: bool = False
    dashed: bool = False
    thick: bool = False
    dotted: bool = False
    weight: float = 1.0


@dataclass(frozen=True, eq=False)
class Ellipses:
    """Covariance ellipses: centres (n, 2), covariances (n, 2, 2) in u², drawn at `sigmas` standard deviations."""

    centre: ArrayLike
    covariance: ArrayLike
    role: Role
    sigmas: float = 1.0
    filled: bool = False
    dashed: bool = False


@dataclass(frozen=True, eq=False)
class Ticks:
    """Short lines centred on xy (n, 2) along `direction` (n, 2, unit), `length` in px: normals, tangents."""

    xy: ArrayLike
    direction: ArrayLike
    role: Role
    length: float = 14.0


@dataclass(frozen=True, eq=False)
class Arrow:
    """One arrow from a to b, (2,) world each; `head` is the head's length in px; a small head has a thin shaft."""

    a: ArrayLike
    b: ArrayLike
    role: Role
    head: float = 11.0


@dataclass(frozen=True, eq=False)
class Heat:
    """A field over a window (x0, x1, y0, y1): values (rows, columns), row 0 at y0, in 24 levels from low to high.

    NaN cells are left empty.
    """

    values: ArrayLike
    window: tuple[float, float, float, float]
    low: float
    high: float


@dataclass(frozen=True, eq=False)
class Tiles:
    """A window (x0, x1, y0, y1) divided into tiles of a few kinds: (rows, columns), row 0 at y0, each an index into
    `roles`.

    Tiles with a negative index are left empty. `widgets.drawing.hatching` gives some roles a hatching.
    """

    kinds: ArrayLike
    window: tuple[float, float, float, float]
    roles: tuple[Role, ...]


@dataclass(frozen=True, eq=False)
class Ring:
    """A circle of `radius` px around xy (2,) world, or of radius `reach` in world units if that is given."""

    xy: ArrayLike
    role: Role
    radius: float = 9.0
    reach: float | None = None
    dashed: bool = False


@dataclass(frozen=True, eq=False)
class Label:
    """Text at xy (2,) world, shifted by (dx, dy) px (dy downwards).

    fixed: it keeps its width where a reader's own style sheet spaces letters; for text with others close beside it.
    """

    xy: ArrayLike
    text: str
    role: Role = "ink"
    anchor: Anchor = "start"
    dx: float = 0.0
    dy: float = 0.0
    fixed: bool = False


@dataclass(frozen=True, eq=False)
class Group:
    """Marks that move together: the page may animate the group's transform towards its end pose."""

    name: str
    marks: tuple[Mark, ...]


Mark = Points | Segments | Path | Ellipses | Ticks | Arrow | Heat | Tiles | Ring | Label | Group


@dataclass(frozen=True)
class View:
    """The window of the world that a panel shows, and its nominal size in px.

    Without `height` both axes have the same scale, which every map needs; charts set their own height.
    pad: px left for tick labels outside the window (left, top, right, bottom).
    """

    x0: float
    x1: float
    y0: float
    y1: float
    width: float = 640.0
    height: float | None = None
    pad: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0)

    @cached_property
    def size(self) -> tuple[float, float]:
        """Nominal width and height of the panel in px."""
        left, top, right, bottom = self.pad
        if self.height is not None:
            return self.width, self.height
        scale = (self.width - left - right) / (self.x1 - self.x0)
        return self.width, (self.y1 - self.y0) * scale + top + bottom

    def px(self, xy: ArrayLike) -> Array:
        """World points (n, 2) in px from the panel's top left."""
        origin, span, inner, corner = self._frame
        p: Array = rows(xy) - origin
        p /= span
        p *= inner
        p += corner
        return p

    def spot(self, x: float, y: float) -> tuple[float, float]:
        """One world point in px, with the rounding of `px` but without the cost of an array."""
        ((ox, oy), (sx, sy), (ix, iy), (cx, cy)) = self._numbers
        return (x - ox) / sx * ix + cx, (y - oy) / sy * iy + cy

    @cached_property
    def _frame(self) -> Array:
        left, top, right, bottom = self.pad
        width, height = self.size
        origin, span = (self.x0, self.y1), (self.x1 - self.x0, self.y0 - self.y1)
        return np.array([origin, span, (width - left - right, height - top - bottom), (left, top)])

    @cached_property
    def _numbers(self) -> list[list[float]]:
        return self._frame.tolist()  # type: ignore[no-any-return]

    @cached_property
    def scale(self) -> float:
        """Px per world unit along x."""
        return (self.width - self.pad[0] - self.pad[2]) / (self.x1 - self.x0)


@dataclass(frozen=True)
class Panel:
    """One drawing: a view and its marks, back to front. `label` names it for those who cannot see it.

    caption: the lines below it; of several, the first is a name. A panel has a caption in all states or in none.
    """

    name: str
    label: str
    view: View
    marks: tuple[Mark, ...]
    grid: bool = True
    caption: str = ""


@dataclass(frozen=True)
class Readout:
    """One number beside the figure; `value` is already text, so that build and browser show the same digits."""

    name: str
    label: str
    value: str
    unit: str = ""
    role: Role | None = None


@dataclass(frozen=True)
class Handle:
    """A place that the reader can drag.

    keys: maps a key ("ArrowLeft", "Shift+ArrowLeft" …) to the world position that a drag would have to reach for the
    same effect, so that the keyboard can do all that a pointer can.
    also: other panels, of the same view, in which a pointer may drag the same thing at the same place.
    kind: "move" moves a thing in the plane, "turn" turns one, "orbit" turns the view but not the scene, "push" slides
    along x.
    angle: that of a turning handle, in degrees from −180 to 180.
    sets: the slider whose value is the handle's x, "" for none. Dragging such a handle moves that slider: both always
    agree, and the drag does not enter the log.
    """

    name: str
    label: str
    xy: tuple[float, float]
    value: str
    keys: Mapping[str, tuple[float, float]]
    kind: Literal["move", "turn", "orbit", "push"] = "move"
    panel: str = "main"
    radius: float = 22.0
    also: tuple[str, ...] = ()
    angle: float = 0.0
    sets: str = ""


@dataclass(frozen=True)
class Picture:
    """Everything that one state of a figure shows."""

    panels: tuple[Panel, ...]
    readouts: tuple[Readout, ...]
    description: str
    handles: tuple[Handle, ...] = ()
    note: str = ""
    disabled: frozenset[str] = field(default_factory=frozenset)


def number(value: float, decimals: int = 2) -> str:
    """A number as the site prints it: fixed decimals, a true minus sign, never a negative zero.

    A nudge far below the printed digits breaks ties, which rounding errors might break differently in the browser.
    """
    text = f"{value + 1e-9:.{decimals}f}"
    return text.lstrip("-") if float(text) == 0 else text.replace("-", "−")


def worded(text: str) -> str:
    """A solver's message as the site prints it: true apostrophes and minus signs, never a negative zero."""
    return re.sub(r"(?<=\w)'(?=\w)", "’", re.sub(r"-(?=\d)", "−", re.sub(r"-(0\.0+)(?!\d)", r"\1", text)))


def small(value: float) -> str:
    """A magnitude that may be rounding error: three decimals, or one digit and a power of ten below a thousandth.

    Below 10⁻¹² no digits are shown, since they differ between processors.
    """
    if value < 1e-12:
        return "< 10⁻¹²"
    if value >= 1e-3:
        return number(value, 3)
    mantissa, exponent = f"{value * (1 + 1e-9):.0e}".split("e")
    return f"{mantissa}·10" + str(int(exponent)).translate(SUPERSCRIPT)


def degrees(radians: float, decimals: int = 0) -> str:
    """An angle in (−180°, 180°] as text; half a turn is always 180, whichever sign rounding errors give it."""
    wrapped = 180.0 - (180.0 - float(np.degrees(radians)) + 1e-6) % 360.0
    return number(wrapped + 1e-6, decimals)


def move_keys(x: float, y: float, step: float = 0.05, leap: float = 0.5) -> dict[str, tuple[float, float]]:
    """Arrow keys for a handle that moves in the plane: `step` world units per press, `leap` with Shift."""
    ways = {"ArrowLeft": (-1, 0), "ArrowRight": (1, 0), "ArrowUp": (0, 1), "ArrowDown": (0, -1)}
    return {
        prefix + key: (x + size * dx, y + size * dy)
        for prefix, size in (("", step), ("Shift+", leap))
        for key, (dx, dy) in ways.items()
    }


def slide_keys(x: float, y: float, low: float, high: float, step: float) -> dict[str, tuple[float, float]]:
    """Arrow keys for a handle that slides along x from `low` to `high`: right and up add a step, with Shift five."""
    ways = {"ArrowLeft": -1, "ArrowRight": 1, "ArrowUp": 1, "ArrowDown": -1}
    return {
        prefix + key: (min(max(x + sign * size, low), high), y)
        for prefix, size in (("", step), ("Shift+", 5 * step))
        for key, sign in ways.items()
    }


def turn_keys(centre: ArrayLike, reach: float, angle: float) -> dict[str, tuple[float, float]]:
    """Arrow keys for a handle that turns about `centre` at distance `reach`: left and up turn anticlockwise by 1°, with
    Shift by 15°."""
    x, y = rows(centre)[0].tolist()

    def at(heading: float) -> tuple[float, float]:
        return x + reach * float(np.cos(heading)), y + reach * float(np.sin(heading))

    ways = {"ArrowLeft": 1, "ArrowUp": 1, "ArrowRight": -1, "ArrowDown": -1}
    return {
        prefix + key: at(angle + sign * size)
        for prefix, size in (("", np.pi / 180), ("Shift+", np.pi / 12))
        for key, sign in ways.items()
    }
