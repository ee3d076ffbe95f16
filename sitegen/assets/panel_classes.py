"""The class of a panel by the width that it was drawn in: its place in a row and the size of its labels follow from it.

Figures draw their panels near 640, 480, 320 or 200 nominal px wide; each class takes what is nearest to one of these.
"""

from __future__ import annotations

from collections.abc import Mapping

MOST: Mapping[str, int] = {"panel-small": 220, "panel-third": 340, "panel-half": 500}  # px
WIDEST = "panel-wide"


def panel_class(width: float) -> str:
    """The class of a panel of this nominal width."""
    return next((name for name, most in MOST.items() if width <= most), WIDEST)


def constants() -> dict[str, str]:
    """The widths by the names that stand for them in the page's scripts."""
    return {f"__{name.replace('-', '_').upper()}__": str(most) for name, most in MOST.items()}


def filled(script: str) -> str:
    """A script with the widths in the place of their names."""
    for name, width in constants().items():
        script = script.replace(name, width)
    return script
