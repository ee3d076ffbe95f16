"""Picture → SVG: the only renderer, run by the build and by the browser's worker.

Coordinates are integers in tenths of a nominal px, so that a point costs few bytes and is the same everywhere: before
rounding, a nudge is added that is far above the difference between two processors and far below what can be seen.
Marks have classes, never colours or style attributes: style sheets handle themes and print, and a strict
Content-Security-Policy forbids inline styles.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Sequence
from functools import lru_cache
from html import escape
from itertools import pairwise
from math import floor
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from widgets.drawing.hatching import hatched
from widgets.drawing.letters import em_width
from widgets.drawing.picture import (
    Array,
    Arrow,
    Ellipses,
    Group,
    Heat,
    Label,
    Mark,
    Panel,
    Path,
    Points,
    Ring,
    Segments,
    Ticks,
    Tiles,
    View,
    rows,
)

UNIT = 10  # SVG user units per nominal px
NUDGE = 1e-6  # breaks ties the same way natively and in wasm, whose results differ by some 1e-14
HALF = 0.5 + NUDGE
WEIGHT_LEVELS = 6
HEAT_LEVELS = 24
# What is seen where no style sheet comes along, as in a browser's reading view: lines and numbers, not filled shapes.
# The sheets undo it (.panel), so that it changes nothing on a page.
BARE = 'fill="none" stroke="currentColor" stroke-width="8" stroke-linecap="round" font-size="110"'
_K = 0.5522847498307936  # 4/3 (√2 − 1): control points of a quarter circle's cubic Bézier curve
_QUARTER = np.array([(1, 0), (1, _K), (_K, 1)])
CIRCLE = np.concatenate([_QUARTER, _QUARTER @ [[0, 1], [-1, 0]], -_QUARTER, _QUARTER @ [[0, -1], [1, 0]], [(1, 0)]])
# Characters that XML forbids even as references: most control characters, and lone surrogates.
FORBIDDEN = re.compile(r"[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")
FAR = 1e6  # px; values beyond are clamped, so that no exponent or overflow reaches the markup


def snap(values: Any) -> list[Any]:
    """Px values as integers in SVG units, in nested lists of the same shape.

    Raises ValueError for NaN: a point without a place must not be drawn at the origin.
    """
    units = np.clip(np.asarray(values, dtype=float), -FAR, FAR)
    if np.isnan(units).any():
        raise ValueError("a mark has a coordinate that is not a number")
    units *= UNIT
    units += HALF
    return np.floor(units, out=units).astype(np.int64).tolist()  # type: ignore[no-any-return]


def _whole(px: float) -> int:
    """`snap` of one number without an array, for the two coordinates of a label."""
    if px != px:
        raise ValueError("a mark has a coordinate that is not a number")
    return floor(min(max(px, -FAR), FAR) * UNIT + HALF)


def _spot(view: View, xy: ArrayLike, dx: float = 0.0, dy: float = 0.0) -> tuple[int, int]:
    """One world point, shifted by px, in SVG units."""
    ((x, y),) = rows(xy).tolist()
    across, down = view.spot(x, y)
    return _whole(across + dx), _whole(down + dy)


def written(text: str, quote: bool = True) -> str:
    """Text escaped for markup, in an attribute or between tags; characters that XML forbids, which a file's name may
    contain, are replaced."""
    return escape(FORBIDDEN.sub("\ufffd", text), quote)


def panel_svg(panel: Panel, prefix: str, draw: Callable[[Mark, View, str], str] | None = None) -> str:
    """The panel as one <svg> element whose ids begin with `prefix`. draw: `mark_svg`, or a cached version of it."""
    width, height = panel.view.size
    w, h = _whole(width), _whole(height)
    body = "".join((draw or mark_svg)(mark, panel.view, prefix) for mark in panel.marks)
    grid = _grid(panel.view) if panel.grid else ""
    padded = " padded" if any(panel.view.pad) else ""
    return (
        f'<svg class="panel{padded}" viewBox="0 0 {w} {h}" role="img" aria-label="{written(panel.label)}" '
        f'focusable="false" {BARE}>{grid}{body}</svg>'
    )


def mark_svg(mark: Mark, view: View, prefix: str) -> str:
    """The markup of one mark; only that of a Group depends on `prefix`."""
    return _DRAW[type(mark)](mark, view, prefix)


def _path(classes: str, d: str) -> str:
    short = d.replace(" -", "-")  # a sign separates two numbers as well as a space does
    return f'<path class="{classes}" d="{short}"/>' if d else ""


def _levels(weight: Any, count: int) -> Array:
    """Weights in [0, 1] as level numbers 1 … WEIGHT_LEVELS; a weight that rounds to zero gets 0 and is not drawn."""
    w = np.fmin(np.fmax(np.asarray(weight, dtype=float).reshape(count), 0.0), 1.0)  # NaN counts as zero
    return np.asarray(np.ceil(np.round(w * WEIGHT_LEVELS, 6) - 0.5 + NUDGE), dtype=float)


def _by_weight(weight: Any, places: list[list[int]], classes: str, draw: Callable[[list[list[int]]], str]) -> str:
    """One path for all places, or one for each weight level in use, faintest first."""
    if weight is None:
        return _path(classes, draw(places))
    rows_: list[list[list[int]]] = [[] for _ in range(WEIGHT_LEVELS + 1)]
    for place, level in zip(places, _levels(weight, len(places)).astype(np.int64).tolist(), strict=True):
        rows_[level].append(place)
    return "".join(_path(f"{classes} w{k}", draw(some)) for k, some in enumerate(rows_) if k and some)


def _points(mark: Points, view: View, prefix: str) -> str:
    if mark.radius <= 1 and mark.weight is None:  # a map of thousands: to 0.2 px, and each place once
        places = [[2 * x, 2 * y] for x, y in dict.fromkeys(map(tuple, snap(view.px(mark.xy) / 2)))]
    else:
        places = snap(view.px(mark.xy))
    if mark.shape in ("dot", "square"):  # tiny strokes with round or square caps: the same size on every screen
        size = "xs" if mark.radius <= 1 else "s" if mark.radius < 3 else "m" if mark.radius < 5 else "l"
        classes = f"{mark.shape} {size} {mark.role}"
        draw = _dots
    else:
        outline = _outline(mark.shape, _whole(mark.radius))
        classes = f"shape {mark.shape} {mark.role}"

        def draw(places: list[list[int]]) -> str:
            return "".join(f"M{x} {y}{outline}" for x, y in places)

    return _by_weight(mark.weight, places, classes, draw)


def _dots(places: list[list[int]]) -> str:
    """A point at each place, each after the first relative to the one before: neighbours on a wall take few bytes."""
    if not places:
        return ""
    (x, y), *rest = places
    parts = [f"M{x} {y}h1"]
    for u, v in rest:
        parts.append(f"m{u - x - 1} {v - y}h1")
        x, y = u, v
    return "".join(parts)


def _outline(shape: str, r: int) -> str:
    """A small shape of radius r as path commands relative to its centre."""
    if shape == "cross":
        return f"m{-r} {-r}l{2 * r} {2 * r}m0 {-2 * r}l{-2 * r} {2 * r}"
    if shape == "diamond":
        return f"m0 {-r}l{r} {r}l{-r} {r}l{-r} {-r}z"
    if shape == "ring":
        return f"m{-r} 0a{r} {r} 0 1 0 {2 * r} 0a{r} {r} 0 1 0 {-2 * r} 0"
    raise ValueError(f"shape: no shape {shape!r}; there are dot, square, cross, ring, diamond")


def _segments(mark: Segments, view: View, prefix: str) -> str:
    a, b = rows(mark.a), rows(mark.b)
    step = 1 if mark.weight is None else 2  # a bundle of many lines: to 0.2 px
    both = (step * np.array(snap(view.px(np.concatenate([a, b])) / step))).tolist()
    ends = [[*one, *other] for one, other in zip(both[: len(a)], both[len(a) :], strict=True)]
    classes = f"line {mark.role}" + (" dashed" if mark.dashed else "")

    return _by_weight(mark.weight, ends, classes, _lines)


def _lines(ends: Iterable[Sequence[int]]) -> str:
    """A line between each pair of ends, relative to where the previous line ended, and continuing it if it begins
    there."""
    parts: list[str] = []
    at_x = at_y = 0
    for x, y, u, v in ends:
        begin = f"M{x} {y}" if not parts else "" if x == at_x and y == at_y else f"m{x - at_x} {y - at_y}"
        parts.append(f"{begin}h{u - x}" if v == y else f"{begin}v{v - y}" if u == x else f"{begin}l{u - x} {v - y}")
        at_x, at_y = u, v
    return "".join(parts)


def _polyline(px: Array, closed: bool) -> str:
    places = snap(px)
    if not places:
        return ""
    x, y = places[0]
    steps = " ".join(f"{u - p} {v - q}" for (p, q), (u, v) in pairwise(places))
    return f"M{x} {y}l{steps}" + ("z" if closed else "") if steps else f"M{x} {y}h1"


def _polyline_mark(mark: Path, view: View, prefix: str) -> str:
    flags = (("filled", mark.filled), ("dashed", mark.dashed), ("thick", mark.thick), ("dotted", mark.dotted))
    level = WEIGHT_LEVELS if mark.weight >= 1 else round(float(_levels(mark.weight, 1)[0]))
    faint = [f"w{level}"] if level < WEIGHT_LEVELS else []
    classes = " ".join(["line", mark.role, *(name for name, on in flags if on), *faint])
    return "" if level == 0 else _path(classes, _polyline(view.px(mark.xy), mark.closed))


def _ellipses(mark: Ellipses, view: View, prefix: str) -> str:
    covariance = np.asarray(mark.covariance, dtype=float).reshape(-1, 2, 2)
    # The symmetric root in closed form: an eigenvector's sign, and so the bytes, may differ between LAPACKs.
    area = np.sqrt(np.maximum(np.linalg.det(covariance), 0.0))
    trace = np.sqrt(np.maximum(np.trace(covariance, axis1=1, axis2=2) + 2 * area, 1e-300))
    root = mark.sigmas * (covariance + area[:, None, None] * np.eye(2)) / trace[:, None, None]
    rim = rows(mark.centre)[:, None, :] + CIRCLE @ root
    places = np.array(snap(view.px(rim.reshape(-1, 2))), dtype=np.int64).reshape(-1, len(CIRCLE), 2)
    # Each quarter relative to its beginning: opposite ones differ only in sign and compress well.
    quarters = places[:, 1:].reshape(len(places), 4, 3, 2) - places[:, :-1:3, None]
    classes = " ".join(["line", mark.role, *(["filled"] if mark.filled else []), *(["dashed"] if mark.dashed else [])])
    begins, curves = places[:, 0].tolist(), quarters.reshape(len(places), 24).tolist()
    pairs = zip(begins, curves, strict=True)
    return _path(classes, "".join(f"M{x} {y}c" + " ".join(map(str, curve)) + "z" for (x, y), curve in pairs))


def _ticks(mark: Ticks, view: View, prefix: str) -> str:
    px = view.px(mark.xy)
    half = rows(mark.direction) * np.array([1.0, -1.0]) * (mark.length / 2)
    ends = snap(np.concatenate([px - half, px + half], axis=1))
    return _path(f"line {mark.role}", _lines(ends))


def _arrow(mark: Arrow, view: View, prefix: str) -> str:
    tail, head = view.px(mark.a)[0], view.px(mark.b)[0]
    along = head - tail
    length = float(np.hypot(*along))
    if length < 1e-9:
        return ""
    along = along / length
    back = head - along * min(mark.head, length)
    side = np.array([-along[1], along[0]]) * (0.41 * mark.head)
    (x, y), (u, v), (p, q), (r, s), (m, n) = snap([tail, back, back + side, back - side, head])
    shaft = _path(f"line {'thick ' if mark.head > 8 else ''}{mark.role}", f"M{x} {y}L{u} {v}")
    return shaft + _path(f"tip {mark.role}", f"M{m} {n}L{p} {q} {r} {s}z")


def _heat(mark: Heat, view: View, prefix: str) -> str:
    values = np.asarray(mark.values, dtype=float)
    span = mark.high - mark.low
    part = np.clip((values - mark.low) / (span if span > 0 else np.inf), 0.0, 1.0)
    level = np.where(
        np.isnan(values), -1, np.minimum(np.floor(np.nan_to_num(part) * HEAT_LEVELS + NUDGE), HEAT_LEVELS - 1)
    )
    paths = _rectangles(level.astype(np.int64), mark.window, view, HEAT_LEVELS)
    return '<g class="heat">' + "".join(_path(f"h{i}", d) for i, d in enumerate(paths)) + "</g>"


def _tiles(mark: Tiles, view: View, prefix: str) -> str:
    kinds = np.asarray(mark.kinds, dtype=np.int64)
    areas = _rectangles(kinds, mark.window, view, len(mark.roles))
    parts = [_path(f"tile {role}", d) for role, d in zip(mark.roles, areas, strict=True)]
    across, down = _lattice(kinds.shape, mark.window, view)
    for k, role in enumerate(mark.roles):
        ends = [(across[i], down[j], across[u], down[v]) for i, j, u, v in hatched(kinds == k, role)]
        parts.append(_path(f"hatch {role}", _lines(ends)))
    return '<g class="heat">' + "".join(parts) + "</g>"


def _lattice(
    shape: tuple[int, ...], window: tuple[float, float, float, float], view: View
) -> tuple[list[int], list[int]]:
    """The borders of a window's columns and of its rows, in SVG units."""
    ny, nx = shape
    x0, x1, y0, y1 = window
    across = snap(view.px(np.stack([np.linspace(x0, x1, nx + 1), np.full(nx + 1, y0)], axis=1))[:, 0])
    down = snap(view.px(np.stack([np.full(ny + 1, x0), np.linspace(y0, y1, ny + 1)], axis=1))[:, 1])
    return across, down


def _rectangles(
    level: NDArray[np.int64], window: tuple[float, float, float, float], view: View, count: int
) -> list[str]:
    """The areas of a window whose tiles have the levels 0 … count − 1, one path each."""
    across, down = _lattice(level.shape, window, view)
    runs: list[list[str]] = [[] for _ in range(count)]
    at = [(0, 0)] * count  # each rectangle is written relative to the start of the previous one
    for here, left, right, first, last in _blocks(level).tolist():
        width, height = across[right] - across[left], down[last] - down[first]
        (p, q), (x, y) = at[here], (across[left], down[first])
        runs[here].append(f"{'m' if runs[here] else 'M'}{x - p} {y - q}h{width}v{height}h{-width}z")
        at[here] = (x, y)
    return ["".join(run) for run in runs]


def _blocks(level: NDArray[np.int64]) -> NDArray[np.int64]:
    """The rectangles of equal level ≥ 0 in (rows, columns): runs along a row, merged with equal runs of the rows that
    follow. Rows of (level, left, right, first row, last row), right and last exclusive."""
    ny, nx = level.shape
    new = np.ones((ny, nx + 1), dtype=np.bool_)
    new[:, 1:-1] = level[:, 1:] != level[:, :-1]
    row, edge = np.nonzero(new)
    inner = np.flatnonzero(edge[:-1] < nx)  # the last edge of a row begins no run
    row, left, right = row[inner], edge[inner], edge[inner + 1]
    runs = np.stack([level[row, left], left, right, row], axis=1)
    runs = runs[runs[:, 0] >= 0]
    runs = runs[np.lexsort(runs.T[::-1])]
    begins = np.ones(len(runs), dtype=np.bool_)
    begins[1:] = (runs[1:] != runs[:-1] + np.array([0, 0, 0, 1])).any(axis=1)
    first = np.flatnonzero(begins)
    return np.column_stack([runs[first], runs[np.append(first, len(runs))[1:] - 1, 3] + 1])


def _ring(mark: Ring, view: View, prefix: str) -> str:
    x, y = _spot(view, mark.xy)
    r = _whole(mark.radius if mark.reach is None else mark.reach * view.scale)
    classes = f"line ring {mark.role}" + (" dashed" if mark.dashed else "")
    return _path(classes, f"M{x} {y}{_outline('ring', r)}")


def _label(mark: Label, view: View, prefix: str) -> str:
    x, y = _spot(view, mark.xy, mark.dx, mark.dy)
    width = f' textLength="{em_width(mark.text):.2f}em" lengthAdjust="spacingAndGlyphs"' if mark.fixed else ""
    text = written(mark.text, quote=False)
    return f'<text class="label {mark.role} {mark.anchor}" x="{x}" y="{y}"{width}>{text}</text>'


def group_svg(mark: Group, view: View, prefix: str, draw: Callable[[Mark, View, str], str] = mark_svg) -> str:
    """The marks of a group as one element with its own id; draw: as in `panel_svg`."""
    inside = "".join(draw(m, view, prefix) for m in mark.marks)
    return f'<g id="{prefix}-{mark.name}" class="group">{inside}</g>'


@lru_cache(maxsize=64)
def _grid(view: View) -> str:
    """A faint line at every world unit, or every 2, 5, 10 … units: the smallest step that keeps lines 24 px apart."""
    step = next(s for s in _steps() if s * view.scale >= 24)
    xs = np.arange(np.ceil(view.x0 / step), np.floor(view.x1 / step) + 1) * step
    ys = np.arange(np.ceil(view.y0 / step), np.floor(view.y1 / step) + 1) * step
    x_px = view.px(np.stack([xs, np.full_like(xs, view.y0)], axis=1))[:, 0]
    y_px = view.px(np.stack([np.full_like(ys, view.x0), ys], axis=1))[:, 1]
    w, h = snap(view.size)
    lines = "".join(f"M{x} 0V{h}" for x in snap(x_px)) + "".join(f"M0 {y}H{w}" for y in snap(y_px))
    return _path("grid", lines)


def _steps() -> Iterable[float]:
    for power in range(12):
        yield from (1 * 10.0**power, 2 * 10.0**power, 5 * 10.0**power)


_DRAW: dict[type, Callable[[Any, View, str], str]] = {
    Points: _points,
    Segments: _segments,
    Path: _polyline_mark,
    Ellipses: _ellipses,
    Ticks: _ticks,
    Arrow: _arrow,
    Heat: _heat,
    Tiles: _tiles,
    Ring: _ring,
    Label: _label,
    Group: group_svg,
}
