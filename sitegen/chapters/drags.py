"""`drag="source 1.2 -0.5, turn 0 3"`: positions to which handles are dragged, in order, as actions of a log."""

from __future__ import annotations

from collections.abc import Callable

from sitegen.markup.directives import Attribute
from sitegen.problems import Place, Problems, hint
from widgets.engine.contract import Widget, action

WRITTEN = 'expected a handle and where to put it, in u: drag="source 1.2 -0.5"'


def drags(
    widget: Widget, attribute: Attribute, at: Callable[[int], Place], problems: Problems
) -> list[list[str | float]]:
    """The log entries of a `drag=`; faults go to `problems`."""
    offset, log = attribute.text_start, list[list[str | float]]()
    for piece in attribute.value.split(","):
        place = at(offset + len(piece) - len(piece.lstrip()))
        name, *position = piece.split() or [""]
        if name not in widget.handles:
            problems.add(place, f"{widget.name} has no handle {name!r} to drag{hint(name, widget.handles)}")
        else:
            try:
                log.append(action(widget, ["drag", name, *map(float, position)]).plain())
            except ValueError:
                problems.add(place, f"{piece.strip()!r}: {WRITTEN}")
        offset += len(piece) + 1
    return log
