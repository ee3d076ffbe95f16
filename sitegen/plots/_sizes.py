"""The sizes of the site's plots, in px: as wide as a page's text, or as a phone."""

from __future__ import annotations

WIDE, NARROW = 720, 350


def sizes(wide: int, narrow: int) -> dict[str, tuple[int, int]]:
    """Both sizes of a plot, from their heights."""
    return {"wide": (WIDE, wide), "narrow": (NARROW, narrow)}
