"""Every figure of the site by name."""

from __future__ import annotations

from .contract import Widget

WIDGETS: dict[str, Widget] = {}
