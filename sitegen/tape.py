"""Tapes: the frames of a figure's recorded states, in a classic script beside the page."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

from .figures import Bakery, Plain, dumps
from .files import hashed_name
from .memory import Memory
from .outside import Progress
from .picture_faults import FigureFault
from .problems import Problems
from .survey import Survey


@dataclass(frozen=True)
class Tape:
    """A figure's tape: its file on the site, its script, and what the page itself shows: the first frame, and what each
    of its jobs finds."""

    name: str
    script: bytes
    first: Plain
    results: tuple[Plain, ...] = ()


def record_tapes(
    surveys: Sequence[Survey], bakery: Bakery, problems: Problems, progress: Progress, kept: Memory
) -> dict[tuple[str, str], Tape]:
    """The tape of every figure, by page and figure."""
    tapes: dict[tuple[str, str], Tape] = {}
    for i, one in enumerate(surveys):
        progress("drawing figures", i, len(surveys))
        tapes |= kept.told(("tapes", one.chapter.source.path), one, problems, partial(_tapes, one, bakery))
    progress("drawing figures", len(surveys), len(surveys))
    return tapes


def _tapes(one: Survey, bakery: Bakery, problems: Problems) -> dict[tuple[str, str], Tape]:
    tapes = {}
    for figure in one.figures.values():
        try:
            script, first = bakery.tape(figure.dom_id, figure.records, tape_script)
            results = bakery.results(figure.dom_id, figure.records[0])
        except FigureFault as fault:  # a widget's own mistake: the author sees where, which figure and why
            fault.tell(problems, figure.place)
            continue
        name = hashed_name(f"tapes/{one.chapter.name}-{figure.id}.js", script)
        tapes[one.chapter.name, figure.id] = Tape(name, script, first, results)
    return tapes


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
