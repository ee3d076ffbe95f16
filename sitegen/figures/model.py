"""A figure in a chapter: its widget, its record, and the states that it brings along."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

import widgets.figures
from sitegen.figures.wire import Plain
from sitegen.problems import Place
from widgets.engine.contract import Lead, Record, Widget

FIGURES = Path(widgets.figures.__path__[0])
"""Where the figures' modules are."""


@dataclass(frozen=True)
class Figure:
    """A figure in a chapter. `states` are those that its tape begins with, the first of them its own.

    lead: what is seen of it at first; led: where the placement says so, name by name, of "panels", "readouts" ….
    after: the state that shows without scripts and on paper what the figure comes to.
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
        """The id of its element, and what its SVG's ids begin with."""
        return f"fig-{self.id}"


def ways(record: Record) -> list[Plain]:
    """A state after all that lead to it, one action at a time."""
    plain = record.plain()
    return [{**plain, "log": plain["log"][:length]} for length in range(len(plain["log"]) + 1)]


def distinct(states: Iterable[Plain]) -> tuple[Plain, ...]:
    """The states, each where it first stands."""
    unique: list[Plain] = []
    for state in states:
        if state not in unique:
            unique.append(state)
    return tuple(unique)
