"""Every figure of the site by name: the modules and folders of widgets/figures, each with its WIDGET."""

from __future__ import annotations

import pkgutil
from collections.abc import Iterator, Mapping
from importlib import import_module

from widgets.engine.contract import Widget

figures = import_module("widgets.figures")  # by name: what figures are made of imports none of them

_NAMES = {module.name.replace("_", "-") for module in pkgutil.iter_modules(figures.__path__)}


class _Widgets(Mapping[str, Widget]):
    """Read-only; a figure's module is imported when the figure is first asked for: a page pays for what it shows."""

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
"""`ndt-map` is the WIDGET of widgets/figures/ndt_map.py; one of several modules, that of its folder's figure.py."""
