"""A drawing for use outside of pages: well-formed, in the light colours, with its caption, and in need of nothing."""

from __future__ import annotations

import re
from base64 import b64decode
from xml.etree import ElementTree

import pytest

from sitegen.assets.tokens import colours
from sitegen.pages.portable_svg import LETTER, LINE, data_address, standalone
from widgets.drawing.picture import Label, Panel, Points, View
from widgets.drawing.svg import BARE, panel_svg

VIEW = View(0.0, 1.0, 0.0, 0.5, width=120.0)
MARKS = (Points([[0.2, 0.3]], "source"), Label((0.5, 0.4), "x < y", "truth"))
DRAWING = panel_svg(Panel("main", "A panel", VIEW, MARKS), "fig-a-main")
PLOT = '<svg xmlns="http://www.w3.org/2000/svg" class="plot-svg" width="9" height="9"><path class="line ink"/></svg>'
SVG = "{http://www.w3.org/2000/svg}"


def style_of(svg: str) -> str:
    return svg.partition("<style>")[2].partition("</style>")[0]


def test_it_has_the_size_of_the_drawing_which_is_inside() -> None:
    """The outer element and the drawing state one size each, and the drawing keeps its window and marks."""
    whole = ElementTree.fromstring(standalone(DRAWING, 120.0, 60.0))
    assert (whole.tag, whole.attrib) == (f"{SVG}svg", {"width": "120", "height": "60"})
    _, inner = whole
    assert inner.attrib == {
        "class": "panel",
        "viewBox": re.findall(r'viewBox="([^"]*)"', DRAWING)[0],
        "focusable": "false",
        **dict(re.findall(r'([a-z-]+)="([^"]*)"', BARE)),
        "width": "120",
        "height": "60",
    }
    assert [(mark.get("class"), mark.text) for mark in inner][-2:] == [
        ("dot m source", None),
        ("label truth start", "x < y"),
    ]


@pytest.mark.parametrize(("svg", "ground"), [(DRAWING, "panel"), (PLOT, "paper")])
def test_it_has_the_rules_of_its_classes_in_light_colours(svg: str, ground: str) -> None:
    """On the ground that it has on the page. No variable of the page is left: each that a rule uses, one sets."""
    style = style_of(standalone(svg, 120.0, 60.0))
    assert f"background:{colours()[ground][0]};" in style
    assert set(re.findall(r"var\((--[\w-]+)", style)) <= set(re.findall(r"(--[\w-]+):", style))
    assert (f".source{{--colour:{colours()['source'][0]};" in style) == ("source" in svg)
    assert (".panel .label{" in style) == ('class="label' in svg)
    assert (".panel{" in style, ".plot-svg{" in style) == (svg is DRAWING, svg is PLOT)
    assert "target" not in style
    assert "@media" not in style


def test_a_caption_stands_below_in_lines_that_fit() -> None:
    """Its own lines are kept, long ones are wrapped at words, and the height grows by as many lines as there are."""
    caption = "One line that is far too long for so narrow a drawing\nand <another>"
    whole = ElementTree.fromstring(standalone(DRAWING, 120.0, 60.0, caption))
    lines = [(float(str(text.get("y"))), str(text.text)) for text in whole.findall(f"{SVG}text")]
    words = [text for _, text in lines]
    assert " ".join(words) == caption.replace("\n", " ")
    assert words[-1] == "and <another>"
    assert max(len(text) for text in words) * LETTER <= 120.0 - 12.0
    assert whole.get("height") == f"{60 + LINE * len(lines)}"
    places = [y for y, _ in lines]
    assert all(60.0 + LINE * k < y < 60.0 + LINE * (k + 1) for k, y in enumerate(places))


def test_an_image_holds_it() -> None:
    address = data_address("<svg>Σ</svg>")
    assert b64decode(address.removeprefix("data:image/svg+xml;base64,")).decode() == "<svg>Σ</svg>"
