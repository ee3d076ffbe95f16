"""A panel's class follows from the width it was drawn at, in the page and in what its scripts draw."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from sitegen.assets.panel_classes import constants, filled, panel_class

TEMPLATES = Path(__file__).resolve().parents[3] / "templates"


@pytest.mark.parametrize(
    ("width", "name"),
    [(200, "panel-small"), (300, "panel-third"), (320, "panel-third"), (460, "panel-half"), (480, "panel-half"),
     (640, "panel-wide"), (220, "panel-small"), (220.5, "panel-third"), (340, "panel-third"), (500, "panel-half")],
)  # fmt: skip
def test_widths_have_classes(width: float, name: str) -> None:
    """The widths that figures use, and the last width of each class."""
    assert panel_class(width) == name


def test_scripts_and_templates_have_no_widths_of_their_own() -> None:
    """They use each of our constants by name."""
    script = (TEMPLATES / "assets/js/figure/jobs.js").read_text("utf-8")
    assert set(re.findall(r"__PANEL_\w+__", script)) == set(constants())
    assert "width <= 220" in filled(script)
    assert "__PANEL" not in filled(script)
    for text in (script, (TEMPLATES / "figure.html").read_text("utf-8")):
        assert not re.search(r"width\s*<=?\s*\d", text)
