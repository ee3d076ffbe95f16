"""Every figure of the site by name."""

from __future__ import annotations

from . import kabsch
from .contract import Widget

WIDGETS: dict[str, Widget] = {widget.name: widget for widget in (kabsch.WIDGET,)}
