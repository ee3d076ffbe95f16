"""A page's drawing → a self-contained SVG in the site's light colours, for use outside of pages."""

from __future__ import annotations

import re
from base64 import b64encode
from functools import cache
from html import escape
from textwrap import wrap

from sitegen.assets.css import rules
from sitegen.assets.tokens import TOKENS, colours

FOLDER = TOKENS.parents[1] / "figure"
SHEETS = tuple(FOLDER / f"{name}.css" for name in ("legend", "plot", "panel", "field", "labels"))
LINE, LETTER = 16, 6.3  # px: a caption's line height, and an upper bound on its average letter width
FACE = "Arial, Helvetica, sans-serif"
_CHOICE = re.compile(r":\w+\([^)]*\)|\[[^]]*\]")  # parts of a selector other than classes it needs
_CLASS = re.compile(r"\.([\w-]+)")


def standalone(svg: str, width: float, height: float, caption: str = "") -> str:
    """The drawing, `width` × `height` px, with the CSS rules for its classes included and colours resolved.

    svg: one element `svg.panel` (widgets.drawing.svg) or `svg.plot-svg` (figures.matplotlib_svg). caption: lines below
    it.
    """
    classes = {name for value in re.findall(r'class="([^"]*)"', svg) for name in value.split()}
    rules = "".join(text for subset, text in _rules() if subset <= classes)
    ground = _light()["panel" if "panel" in classes else "paper"]
    head, _, body = svg.partition(">")
    inner = re.sub(r' (?:xmlns|width|height|role|aria-\w+)="[^"]*"', "", head)
    lines = [part for line in caption.splitlines() for part in wrap(line, int((width - 12) / LETTER))]
    words = "".join(
        f'<text x="6" y="{height + LINE * (k + 0.8):g}">{escape(line)}</text>' for k, line in enumerate(lines)
    )
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{width:g}" height="{height + LINE * len(lines):g}">'
        f"<style>:root{{background:{ground};font:12px {FACE};fill:{_light()['soft']}}}{rules}</style>"
        f'{inner} width="{width:g}" height="{height:g}">{body}{words}</svg>'
    )


def data_address(svg: str) -> str:
    """The drawing as a data URL, which an `<img>` shows without a request."""
    return "data:image/svg+xml;base64," + b64encode(svg.encode()).decode()


@cache
def _light() -> dict[str, str]:
    return {name: light for name, (light, _) in colours().items()}


@cache
def _rules() -> tuple[tuple[frozenset[str], str], ...]:
    """The CSS rules for drawings: the classes that each needs, and its text. Those in media queries are left out."""
    result = []
    for path in SHEETS:
        for rule in rules(path.read_text("utf-8")):
            body = ";".join(f"{name}:{_with_colours(value)}" for name, value in rule.declarations)
            for selector in rule.selectors:
                role = re.fullmatch(r"\.[\w-]+", selector) and "--colour" in body
                if role or selector.startswith((".panel", ".plot-svg")):
                    classes = frozenset(_CLASS.findall(_CHOICE.sub("", selector)))
                    result.append((classes, f"{selector}{{{body}}}"))
    return tuple(result)


def _with_colours(value: str) -> str:
    """A value with its variables replaced by the site's colours and font."""
    values = {**_light(), "sans": FACE}
    return re.sub(r"var\(--([\w-]+)\)", lambda m: values.get(m[1], m[0]), value)
