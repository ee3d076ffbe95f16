"""Tapes: the frames of a figure's recorded states, in a classic script that accompanies the page."""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass

from sitegen.figures.wire import Plain, dumps
from widgets.drawing.picture import ROLES

_CLASSES = re.compile(r'class="([^"]*)"')


@dataclass(frozen=True)
class StateRoles:
    """The roles that a state shows. pressed: the button at the end of its log, "" if that is another action;
    roles: panel → the roles in its drawing."""

    controls: Plain
    pressed: str
    roles: Mapping[str, Sequence[str]]


@dataclass(frozen=True)
class Tape:
    """A figure's tape: its file on the site, its script, and what the page itself shows: the first frame and the
    results of the jobs.

    states: the roles that each state shows.
    """

    name: str
    script: bytes
    first: Plain
    results: tuple[Plain, ...] = ()
    states: tuple[StateRoles, ...] = ()

    def roles(
        self,
        controls: Plain,
        free: Collection[str],
        presses: Collection[str],
        panels: Collection[str],
        promised: Sequence[StateRoles] = (),
    ) -> Collection[str]:
        """The roles that these panels may show while no controls but `free` are moved and no other buttons pressed, in
        the promised states as well; all roles if the tape does not record one of the buttons."""
        fixed = {name: value for name, value in controls.items() if name not in free}
        taped, told = (
            [state for state in states if fixed.items() <= state.controls.items()] for states in (self.states, promised)
        )
        if not {*presses} <= {state.pressed for state in taped}:
            return ROLES
        return {role for state in (*taped, *told) for panel in panels for role in state.roles.get(panel, ())}


def state_roles(record: Plain, frame: Plain) -> Plain:
    """The fields of `StateRoles` for a state."""
    roles = {}
    for panel in frame["panels"]:
        classes = {name for group in _CLASSES.findall(panel["svg"]) for name in group.split()}
        roles[panel["name"]] = sorted(classes & set(ROLES))
    last = record["log"][-1] if record["log"] else [""]
    return {"controls": record["controls"], "pressed": last[1] if last[0] == "press" else "", "roles": roles}


def tape_script(dom_id: str, records: Sequence[Plain], frames: Sequence[Plain]) -> str:
    """The classic script that hands a figure its tape: the drawings, then the entries, whose panels refer to drawings
    by index. Each drawing is stored once; those of one run are grouped by panel, which compresses best."""
    groups: dict[str, list[Plain]] = {}
    for record, frame in zip(records, frames, strict=True):
        groups.setdefault(dumps([record["controls"], record["seed"]]), []).append(frame)
    numbers: dict[tuple[str, str], int] = {}
    for group in groups.values():
        for name in dict.fromkeys(panel["name"] for frame in group for panel in frame["panels"]):
            svgs = [panel["svg"] for frame in group for panel in frame["panels"] if panel["name"] == name]
            for svg in svgs:
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
