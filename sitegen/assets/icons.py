"""The site's icons, and the pictures for shared links, drawn from the scene of the first figure or a rung's emblem.

Everything is fixed (size, fonts, colours, metadata), so that the same title gives the same bytes on one machine.
matplotlib is imported only to draw: its import is slow, and most builds find everything in the cache.
"""

from __future__ import annotations

import io
import json
import re
import tempfile
import textwrap
from collections.abc import Callable, Mapping
from functools import partial
from importlib.metadata import version
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np

from sitegen.assets import emblems as emblem_of
from sitegen.assets import typefaces
from sitegen.assets.tokens import colours
from sitegen.cache.files import cache_dir
from sitegen.cache.store import Store
from solvers.scenes.rooms import Scene, kabsch_scene

FORMAT = "1"  # of cached pictures; to be raised when the drawing changes
SHARE = (1200, 630)
RUNGS = (5, 11, 17)  # heights in the emblem's box of 24 by 24; the middle one is the reader's
RAILS = (7, 17)
SAFE = 0.72  # keeps the ladder's corners within the circle of 80 % that every icon mask leaves visible


Emblems = Mapping[str, tuple[str, str, str]]
"""For each page with its own share picture: the rung's emblem, the title and the line."""


def make(
    title: str,
    line: str,
    faces: typefaces.FontSet,
    emblems: Emblems = MappingProxyType({}),
    *,
    cache: Path | None = None,
) -> dict[str, bytes]:
    """The pictures by name: favicon.svg, favicon.png (32 px), touch-icon.png (180 px), share.png (1200 × 630 px); for
    the installed site icon-192.png, icon-512.png and icon-maskable.png (512 px, safe for any mask); and for each page
    with an emblem share-PAGE.png.

    title, line: the share picture's text, the line of about a hundred characters, set in the title and sans faces of
    `faces`. Cached by a key of their inputs.
    """
    store = Store(cache or cache_dir(), "emblem")
    scene = kabsch_scene("clean")
    shapes = [scene.source, scene.target, *scene.outline, scene.truth.matrix, scene.start.matrix]
    inputs = [FORMAT, version("matplotlib"), title, line, sorted(colours().items()), sorted(faces.files)]
    inputs += [shape.tolist() for shape in shapes]
    key = json.dumps(inputs)
    drawings: dict[str, Callable[[], bytes]] = {
        "favicon.png": lambda: _icon(32),
        "touch-icon.png": lambda: _icon(180),
        "icon-192.png": lambda: _icon(192),
        "icon-512.png": lambda: _icon(512),
        "icon-maskable.png": lambda: _icon(512, SAFE),
        "share.png": lambda: _share(title, line, faces, scene),
    }
    files = {"favicon.svg": _svg().encode()}
    for name, draw in drawings.items():
        files[name] = store.get(f"{name} {key}", draw)
    for page, (emblem, *words) in emblems.items():
        inputs_key = json.dumps([key, emblem, emblem_of.path(emblem), words])
        name = f"share-{page}.png"
        files[name] = store.get(f"{name} {inputs_key}", partial(_share, words[0], words[1], faces, emblem))
    return files


def _svg() -> str:
    """A ladder with its middle rung lit, in colours that follow the browser's theme."""
    (ink, pale), (lit, bright) = colours()["ink"], colours()["accent"]
    rails = "".join(f"M{x} 2v20" for x in RAILS)
    low, middle, high = (f"M{RAILS[0]} {y}h{RAILS[1] - RAILS[0]}" for y in RUNGS)
    return (
        '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 24 24" fill="none" stroke-width="2.2"'
        ' stroke-linecap="round">'
        f"<style>.l{{stroke:{ink}}}.r{{stroke:{lit};stroke-width:4;stroke-linecap:butt}}"
        f"@media (prefers-color-scheme:dark){{.l{{stroke:{pale}}}.r{{stroke:{bright}}}}}</style>"
        f'<path class="l" d="{rails}{low}{high}"/><path class="r" d="{middle}"/></svg>\n'
    )


def _canvas(width: int, height: int, ground: str) -> tuple[Any, Any]:
    """A figure of this size in px, with axes in px from the top left."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width / 100, height / 100), dpi=100, facecolor=ground)
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    axes.set_xlim(0, width)
    axes.set_ylim(height, 0)
    axes.axis("off")
    return figure, axes


def _png(figure: Any) -> bytes:
    out = io.BytesIO()
    figure.savefig(out, format="png", facecolor=figure.get_facecolor(), metadata={"Software": None})
    return out.getvalue()


def _px(width: float) -> float:
    """A line width in px as matplotlib's points, at 100 dots per inch."""
    return width * 0.72


def _icon(size: int, share: float = 1.0) -> bytes:
    """The emblem on the paper colour; `share` is the part of the width that its box of 24 takes, centred."""
    theme = {name: light for name, (light, _) in colours().items()}
    figure, axes = _canvas(size, size, theme["paper"])
    k = size * share / 24
    edge = (1 - share) / 2 * size
    axes.set_xlim(-edge, size - edge)
    axes.set_ylim(size - edge, -edge)
    for x in RAILS:
        axes.plot([x * k, x * k], [2.5 * k, 21.5 * k], color=theme["ink"], lw=_px(2.2 * k), solid_capstyle="round")
    for y in RUNGS:
        lit = y == RUNGS[1]
        colour, weight = theme["accent" if lit else "ink"], _px((4 if lit else 2.2) * k)
        ends = "butt" if lit else "round"
        axes.plot([x * k for x in RAILS], [y * k, y * k], color=colour, lw=weight, solid_capstyle=ends, zorder=3)
    return _png(figure)


def _share(title: str, line: str, faces: typefaces.FontSet, subject: Scene | str) -> bytes:
    """The share picture; `subject` is the first figure's scene, or the name of a rung's emblem."""
    from matplotlib.font_manager import FontProperties

    theme = {name: light for name, (light, _) in colours().items()}
    figure, axes = _canvas(*SHARE, theme["paper"])
    _ladder(axes, theme, 76.0, 132.0, SHARE[1])
    if isinstance(subject, str):
        emblem_of.draw(axes, theme, subject, np.array([930.0, 315.0]), 31.0)
    else:
        _scene(axes, theme, subject)
    with tempfile.TemporaryDirectory(prefix="ladder-emblem-") as folder:
        for face, text, wrap, size, top, colour, leading in (
            ("title", title, 17, 54 if isinstance(subject, str) else 70, 78, "ink", 0.9),
            ("sans", line, 36, 27, 456, "soft", 1.08),
        ):
            font = FontProperties(fname=_font(faces, face, Path(folder)), size=_px(size))
            words = textwrap.fill(text, wrap, break_long_words=False)
            axes.text(192, top, words, font=font, color=theme[colour], va="top", linespacing=leading)
        return _png(figure)


def _font(faces: typefaces.FontSet, face: str, folder: Path) -> Path:
    """Save one of the site's faces in the form that matplotlib takes, uncompressed."""
    data = next(data for name, data in faces.files.items() if re.fullmatch(rf"{face}-[0-9a-f]+\.woff2", name))
    from fontTools.ttLib import TTFont

    font = TTFont(io.BytesIO(data), recalcTimestamp=False)
    font.flavor = None
    path = folder / f"{face}.ttf"
    font.save(path)
    return path


def _ladder(axes: Any, theme: dict[str, str], left: float, right: float, height: int) -> None:
    """Draw the ladder from edge to edge, as if it went on below and above."""
    for x in (left, right):
        axes.plot([x, x], [-10, height + 10], color=theme["edge"], lw=_px(5))
    for i, y in enumerate(np.linspace(height - 48, 48, 7)):
        lit = i == 1
        colour, weight = theme["accent" if lit else "edge"], _px(11 if lit else 5)
        axes.plot([left, right], [y, y], color=colour, lw=weight, solid_capstyle="butt", zorder=3 if lit else 1)


def _scene(axes: Any, theme: dict[str, str], scene: Scene) -> None:
    """Draw the first figure's bird before it is solved: source, target, the pairs, the truth."""
    scale, middle = 50.0, np.array([872.0, 330.0])

    def px(points: Any) -> Any:
        return middle + np.asarray(points) * (scale, -scale)

    source, target = px(scene.start.apply(scene.source)), px(scene.target)
    for curve in scene.outline:
        axes.plot(*px(scene.truth.apply(curve)).T, color=theme["truth"], alpha=0.5, lw=_px(9), solid_joinstyle="round")
    for a, b in zip(source, target, strict=True):
        axes.plot(*np.stack([a, b]).T, color=theme["pair"], lw=_px(1.6))
    axes.scatter(*target.T, s=_px(14) ** 2, marker="s", color=theme["target"], lw=0, zorder=3)
    for curve in scene.outline:
        axes.plot(*px(scene.start.apply(curve)).T, color=theme["source"], lw=_px(2.6), zorder=4)
    axes.scatter(*source.T, s=_px(15) ** 2, color=theme["source"], lw=0, zorder=5)
