"""All figures of the site by name: each module or folder of widgets/figures has its WIDGET."""

from __future__ import annotations

import pkgutil
from collections.abc import Iterator, Mapping
from importlib import import_module

from widgets.engine.contract import Widget

figures = import_module("widgets.figures")  # by name, since no engine module may import a figure

_NAMES = {module.name.replace("_", "-") for module in pkgutil.iter_modules(figures.__path__)}


class _Widgets(Mapping[str, Widget]):
    """Read-only; a figure's module is imported on first access, so that a page pays only for the figures it shows."""

    def __getitem__(self, name: str) -> Widget:
        if name not in _NAMES:
            raise KeyError(name)
        module = import_module(f"{figures.__name__}.{name.replace('-', '_')}")
        if hasattr(module, "__path__"):
            module = import_module(f"{module.__name__}.figure")
        widget: Widget = module.WIDGET
        return widget

    def __contains__(self, name: object) -> bool:
        return name in _NAMES

    def __iter__(self) -> Iterator[str]:
        return iter(sorted(_NAMES))

    def __len__(self) -> int:
        return len(_NAMES)


WIDGETS: Mapping[str, Widget] = _Widgets()
"""`ndt-map` is the WIDGET of widgets/figures/ndt_map.py; a figure in a folder has it in the folder's figure.py."""
