"""A figure in a chapter: its widget, its record, and the states of its tape."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from sitegen.figures.wire import Plain
from sitegen.problems import Place
from widgets.engine.contract import Lead, Record, Widget


@dataclass
class Figure:
    """A figure in a chapter. `records` are the states of its tape, the first of them its own.

    lead: what is seen of it at first; led: where the placement says so, name by name, of "panels", "readouts" ….
    after: the state that shows without scripts and on paper what the figure comes to.
    """

    id: str
    number: str
    widget: Widget
    record: Record
    place: Place
    records: list[Plain] = field(default_factory=list)
    lead: Lead | None = None
    after: Plain | None = None
    led: Mapping[str, tuple[Place, ...]] = field(default_factory=dict)

    @property
    def dom_id(self) -> str:
        """The id of its element, and what its SVG's ids begin with."""
        return f"fig-{self.id}"

    def remember(self, record: Record) -> None:
        """Put a state, and all that lead to it, on the tape."""
        plain = record.plain()
        for length in range(len(plain["log"]) + 1):
            state = {**plain, "log": plain["log"][:length]}
            if state not in self.records:
                self.records.append(state)
