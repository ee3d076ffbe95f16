"""Tapes: the frames of a figure's recorded states, in a classic script beside the page."""

from __future__ import annotations

import re
from collections.abc import Collection, Sequence
from dataclasses import dataclass

from sitegen.figures.wire import Plain, dumps
from widgets.drawing.picture import ROLES

Drawn = tuple[tuple[Plain, tuple[str, ...]], ...]  # a state's controls and the roles in its drawings
_CLASSES = re.compile(r'class="([^"]*)"')


@dataclass(frozen=True)
class Tape:
    """A figure's tape: its file on the site, its script, and what the page itself shows: the first frame, and what each
    of its jobs finds.

    drawn: of each of its states.
    """

    name: str
    script: bytes
    first: Plain
    results: tuple[Plain, ...] = ()
    drawn: Drawn = ()

    def roles(self, controls: Plain, moved: Collection[str]) -> frozenset[str]:
        """The roles that are drawn while no other controls are moved."""
        kept = {name: value for name, value in controls.items() if name not in moved}
        return frozenset(role for found, roles in self.drawn if kept.items() <= found.items() for role in roles)


def roles_in(frame: Plain) -> list[str]:
    """The roles in a frame's drawings."""
    classes = (found for panel in frame["panels"] for found in _CLASSES.findall(panel["svg"]))
    return sorted({name for group in classes for name in group.split()} & set(ROLES))


def tape_script(dom_id: str, records: Sequence[Plain], frames: Sequence[Plain]) -> str:
    """The classic script that hands a figure its tape: the drawings, then the entries, whose panels name theirs by
    number. Each drawing stands there once, those of one run together and panel by panel, where they compress best."""
    runs: dict[str, list[Plain]] = {}
    for record, frame in zip(records, frames, strict=True):
        runs.setdefault(dumps([record["controls"], record["seed"]]), []).append(frame)
    numbers: dict[tuple[str, str], int] = {}
    for run in runs.values():
        for name in dict.fromkeys(panel["name"] for frame in run for panel in frame["panels"]):
            drawn = [panel["svg"] for frame in run for panel in frame["panels"] if panel["name"] == name]
            for svg in drawn:
                numbers.setdefault((name, svg), len(numbers))
    entries = [
        {
            "record": record,
            "frame": {
                **frame, "panels": [{**panel, "svg": numbers[panel["name"], panel["svg"]]} for panel in frame["panels"]]
            },
        }
        for record, frame in zip(records, frames, strict=True)
    ]  # fmt: skip
    return f"Ladder.tape({dumps(dom_id)}, {dumps([svg for _, svg in numbers])}, {dumps(entries)});\n"
