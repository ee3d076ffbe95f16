"""Every figure of the site by name."""

from __future__ import annotations

from . import kabsch, ladder_map, two_poses
from .contract import Widget

WIDGETS: dict[str, Widget] = {widget.name: widget for widget in (two_poses.WIDGET, ladder_map.WIDGET, kabsch.WIDGET)}
