"""A matplotlib figure → inline SVG for a page: roles for colours, attributes for styles, the page's own fonts.

A page's policy blocks style attributes, so matplotlib's become presentation attributes, and colours become classes:
`f-source` fills, `s-source` strokes with the role's colour (figure/plot.css). Only the site's own colours are
allowed; any other is an error. Figures are made at the size at which they are shown, so that 1 px of theirs is 1 px on
the screen.

matplotlib is imported only to draw, since most builds find all drawings in the cache.
"""

from __future__ import annotations

import io
import re
from collections.abc import Callable
from html import escape
from typing import Any
from xml.etree import ElementTree

from sitegen.assets.tokens import TOKENS, colours

SVG, LINK = "{http://www.w3.org/2000/svg}", "{http://www.w3.org/1999/xlink}"
ROLES = (
    *("ink", "soft", "rule", "edge", "grid", "paper", "panel", "accent"),
    *("source", "target", "truth", "inlier", "outlier", "ghost", "pair", "normal", "weak", "guide"),
    *(f"h{i}" for i in range(24)),
)
COLOURS = {role: colours()[role][0] for role in ROLES}
_ROLE = {colour: role for role, colour in COLOURS.items()}
NUMBER = re.compile(r"-?\d+\.?\d*(?:e-?\d+)?")
COMMAND = re.compile(r"([MLCQZz])([^MLCQZz]*)")  # the commands that matplotlib writes
POINTS = {"M": 1, "L": 1, "C": 3, "Q": 2}  # points per command
DRAWN = ("path", "use", "text", "tspan")
PLAIN = (
    *("opacity", "fill-opacity", "stroke-opacity", "stroke-width", "stroke-dasharray", "stroke-dashoffset"),
    *("stroke-linecap", "stroke-linejoin", "text-anchor", "font-size", "font-weight", "font-style"),
)
LEFT_OUT = ("stroke-miterlimit", "font-family", "font")

SETTINGS: Any = {
    "svg.fonttype": "none",  # keep text as text
    "svg.hashsalt": "ladder",
    "font.size": 13.0,
    "axes.labelsize": 13.0,
    "axes.titlesize": 13.0,
    "xtick.labelsize": 12.0,
    "ytick.labelsize": 12.0,
    "axes.edgecolor": COLOURS["edge"],
    "axes.labelcolor": COLOURS["soft"],
    "axes.titlecolor": COLOURS["ink"],
    "axes.titlelocation": "left",
    "axes.titlepad": 8.0,
    "axes.linewidth": 1.0,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.facecolor": "none",
    "axes.axisbelow": True,
    "axes.unicode_minus": True,
    "figure.facecolor": "none",
    "savefig.facecolor": "none",
    "grid.color": COLOURS["grid"],
    "grid.linewidth": 1.0,
    "lines.linewidth": 1.75,
    "lines.solid_capstyle": "round",
    "lines.dash_capstyle": "butt",
    "lines.solid_joinstyle": "round",
    "text.color": COLOURS["ink"],
    "xtick.color": COLOURS["edge"],
    "ytick.color": COLOURS["edge"],
    "xtick.labelcolor": COLOURS["soft"],
    "ytick.labelcolor": COLOURS["soft"],
    "xtick.major.size": 4.0,
    "ytick.major.size": 0.0,
    "xtick.minor.size": 0.0,
    "ytick.minor.size": 0.0,
    "xtick.major.width": 1.0,
    "patch.linewidth": 1.0,
    "path.simplify": False,
}


def draw(fill: Callable[[Any], None], size: tuple[int, int], prefix: str) -> str:
    """The SVG of a figure of this size in px that `fill` draws into; its ids begin with `prefix`.

    Raises ValueError for a colour that the site does not have, and for elements or styles that a page cannot show.
    """
    import matplotlib
    from matplotlib.figure import Figure

    buffer = io.StringIO()
    with matplotlib.rc_context():
        matplotlib.rcdefaults()
        matplotlib.rcParams.update(SETTINGS)
        figure = Figure(figsize=(size[0] / 72, size[1] / 72), dpi=72)
        fill(figure)
        figure.savefig(buffer, format="svg", metadata=dict.fromkeys(("Date", "Creator", "Format", "Type")))
    return clean(buffer.getvalue(), size, prefix)


def clean(source: str, size: tuple[int, int], prefix: str) -> str:
    """Convert matplotlib's SVG for use in a page."""
    root = ElementTree.fromstring(source)
    ids = {element.get(f"{LINK}href", "")[1:] for element in root.iter(f"{SVG}use")}
    for element in root.iter():
        ids.update(re.findall(r"url\(#([^)]+)\)", element.get("clip-path", "")))
    names = {name: f"{prefix}-{i}" for i, name in enumerate(n for n in _ids(root) if n in ids)}
    out: list[str] = []
    _write(root, names, out)
    width, height = size
    head = f'<svg class="plot-svg" viewBox="0 0 {width} {height}" width="{width}" height="{height}">'
    return f"{head}{''.join(out)}</svg>"


def _ids(root: ElementTree.Element) -> list[str]:
    return [element.get("id", "") for element in root.iter() if element.get("id")]


def _write(parent: ElementTree.Element, names: dict[str, str], out: list[str]) -> None:
    """Write the marks below an element. Groups are dropped, unless they clip or hold definitions that are reused."""
    for element in parent:
        kind = element.tag.removeprefix(SVG)
        if kind == "style" or kind == "metadata":
            continue
        if kind in ("image", "linearGradient", "pattern"):
            raise ValueError(f"unsupported element {kind} in a plot: draw areas and lines instead")
        attributes = _attributes(element, names)
        if kind in DRAWN:
            unseen = attributes.get("fill") == "none" and "s-" not in attributes.get("class", "")
            if attributes.get("d") == "" or (unseen and kind == "path"):
                continue
            _element(kind, attributes, element, names, out)
        elif kind in ("clipPath", "rect", "defs") or "clip-path" in attributes:
            _element(kind, attributes, element, names, out)
        else:
            _write(element, names, out)


def _element(
    kind: str, attributes: dict[str, str], element: ElementTree.Element, names: dict[str, str], out: list[str]
) -> None:
    children: list[str] = []
    _write(element, names, children)
    if kind == "defs" and not children:
        return
    text = escape(element.text or "") if kind in ("text", "tspan") else ""
    attrs = "".join(f' {name}="{escape(value)}"' for name, value in attributes.items())
    content = f"{text}{''.join(children)}"
    out.append(f"<{kind}{attrs}>{content}</{kind}>" if content else f"<{kind}{attrs}/>")


def _attributes(element: ElementTree.Element, names: dict[str, str]) -> dict[str, str]:
    result: dict[str, str] = {}
    classes: list[str] = []
    for raw, value in element.items():
        name = raw.removeprefix(LINK)
        if name == "style":
            for declaration in filter(None, map(str.strip, value.split(";"))):
                key, _, setting = declaration.partition(":")
                _declare(key.strip(), setting.strip(), result, classes)
        elif name == "id":
            if value in names:
                result["id"] = names[value]
        elif name == "href":
            result["href"] = f"#{names[value[1:]]}"
        elif name == "clip-path":
            result["clip-path"] = re.sub(r"#([^)]+)", lambda match: f"#{names[match[1]]}", value)
        elif name == "d":
            result["d"] = _path(value)
        elif name == "transform":
            if not value.startswith("rotate(-0 "):
                result["transform"] = NUMBER.sub(lambda match: _short(match[0]), value)
        elif name in ("x", "y", "width", "height"):
            result[name] = _short(value)
    return ({"class": " ".join(classes)} if classes else {}) | result


def _declare(name: str, value: str, result: dict[str, str], classes: list[str]) -> None:
    if name in ("fill", "stroke"):
        if value == "none":
            result[name] = "none"
        elif value in _ROLE:
            classes.append(f"{name[0]}-{_ROLE[value]}")
        else:
            raise ValueError(f"unknown colour {value}: use one of matplotlib_svg.COLOURS")
    elif name in PLAIN:
        result[name] = NUMBER.sub(lambda match: _short(match[0]), value.removesuffix("px"))
    elif name not in LEFT_OUT:
        raise ValueError(f"unsupported style {name!r} in a plot")


def _path(value: str) -> str:
    """The path in relative commands, to a tenth of a px: precise enough, and short.

    Points are rounded before the differences are taken, so that rounding errors do not add up along a line.
    """
    parts: list[str] = []
    begin = at = (0, 0)  # start of the subpath, and the pen's position
    for command, numbers in COMMAND.findall(value):
        if command in "zZ":
            parts.append("z")
            at = begin
            continue
        tenths = [round(10 * float(number)) for number in numbers.split()]
        points = list(zip(tenths[::2], tenths[1::2], strict=True))
        step = POINTS[command]
        for k in range(0, len(points), step):
            parts.append(_move(command, at, points[k : k + step]) if parts else f"M{_pair(*points[0])}")
            at = points[k + step - 1]
            begin = at if command == "M" else begin
    return "".join(parts)


def _move(command: str, at: tuple[int, int], points: list[tuple[int, int]]) -> str:
    """One command, relative to the pen's position."""
    steps = [(x - at[0], y - at[1]) for x, y in points]
    if command == "L" and 0 in steps[0]:
        across, down = steps[0]
        return f"h{_tenths(across)}" if down == 0 else f"v{_tenths(down)}"
    return command.lower() + " ".join(_pair(*step) for step in steps).replace(" -", "-")


def _pair(x: int, y: int) -> str:
    return f"{_tenths(x)} {_tenths(y)}".replace(" -", "-")


def _tenths(value: int) -> str:
    """A number of tenths, as short as a path allows."""
    whole, part = divmod(abs(value), 10)
    sign = "-" if value < 0 else ""
    return f"{sign}{whole or ''}.{part}" if part else f"{sign}{whole}"


def _short(number: str) -> str:
    """A number in px with at most two decimals."""
    return f"{round(float(number), 2) + 0.0:.10g}"


__all__ = ["COLOURS", "TOKENS", "clean", "draw"]
