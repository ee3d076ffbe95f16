"""The CSS class of a panel, by its nominal width: it sets the panel's place in a row and the size of its labels.

Figures draw their panels about 640, 480, 320 or 200 nominal px wide; each class covers the widths around one of these.
"""

from __future__ import annotations

from collections.abc import Mapping

MOST: Mapping[str, int] = {"panel-small": 220, "panel-third": 340, "panel-half": 500}  # px
WIDEST = "panel-wide"


def panel_class(width: float) -> str:
    """The class of a panel of this nominal width."""
    return next((name for name, limit in MOST.items() if width <= limit), WIDEST)


def constants() -> dict[str, str]:
    """The widths by their placeholders in the page's scripts."""
    return {f"__{name.replace('-', '_').upper()}__": str(limit) for name, limit in MOST.items()}


def filled(script: str) -> str:
    """A script with the placeholders replaced by the widths."""
    for name, width in constants().items():
        script = script.replace(name, width)
    return script
