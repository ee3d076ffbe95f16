"""A figure in a chapter: its widget, its record, and the states that it comes with."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

import widgets.figures
from sitegen.figures.wire import Plain
from sitegen.problems import Place
from widgets.engine.contract import Lead, Record, Widget

FIGURES = Path(widgets.figures.__path__[0])
"""The folder of the figures' modules."""


@dataclass(frozen=True)
class Figure:
    """A figure in a chapter. `states` are the first ones on its tape; the very first is the figure's own.

    lead: the parts shown at first; led: the places of their names in the directive, by "panels", "readouts" ….
    after: the state that shows the outcome to readers without scripts and on paper.
    """

    id: str
    number: str
    widget: Widget
    record: Record
    place: Place
    states: tuple[Plain, ...] = ()
    lead: Lead | None = None
    after: Plain | None = None
    led: Mapping[str, tuple[Place, ...]] = field(default_factory=dict)

    @property
    def dom_id(self) -> str:
        """The id of its element, and the prefix of the ids in its SVGs."""
        return f"fig-{self.id}"


def ways(record: Record) -> list[Plain]:
    """A state, preceded by all the states that lead to it, one action at a time."""
    plain = record.plain()
    return [{**plain, "log": plain["log"][:length]} for length in range(len(plain["log"]) + 1)]


def distinct(states: Iterable[Plain]) -> tuple[Plain, ...]:
    """The states without duplicates, in order of first occurrence."""
    unique: list[Plain] = []
    for state in states:
        if state not in unique:
            unique.append(state)
    return tuple(unique)
