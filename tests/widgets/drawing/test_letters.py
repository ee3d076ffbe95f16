"""A label of fixed width says how wide its text is; that the widths are the typeface's is tested in a browser."""

from __future__ import annotations

import re

from widgets.drawing.letters import em_width
from widgets.drawing.picture import Label, Panel, View
from widgets.drawing.svg import panel_svg


def test_a_label_of_fixed_width_says_how_wide_it_is() -> None:
    """In em, since the size of a panel's letters follows its width on the screen."""
    marks = (Label([1, 2], "ICP & Co", fixed=True), Label([1, 3], "free"))
    svg = panel_svg(Panel("main", "Labels", View(0.0, 10.0, 0.0, 10.0), marks, grid=False), "fig")
    assert re.findall(r'textLength="([^"]+)" lengthAdjust="(\w+)">([^<]+)', svg) == [
        (f"{em_width('ICP & Co'):.2f}em", "spacingAndGlyphs", "ICP &amp; Co")
    ]


def test_letters_have_their_own_widths() -> None:
    assert em_width("") == 0.0
    assert em_width("ICP") == 0.263 + 0.571 + 0.566
    assert em_width("0.2\u00a0u") == em_width("0.2 u")
    assert em_width("∇") == 0.5  # of a letter that is not in the table
