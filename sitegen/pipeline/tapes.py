"""Record the tapes of all figures of a build."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

from sitegen.cache.files import hashed_name
from sitegen.cache.memory import Memory
from sitegen.chapters.surveyed import Survey
from sitegen.figures.bakery import Bakery
from sitegen.figures.picture_faults import FigureFault
from sitegen.figures.tape import Tape, tape_script
from sitegen.problems import Problems
from sitegen.progress import Progress


def record_tapes(
    surveys: Sequence[Survey], bakery: Bakery, problems: Problems, progress: Progress, memory: Memory
) -> dict[tuple[str, str], Tape]:
    """The tape of every figure, by page name and figure id."""
    tapes: dict[tuple[str, str], Tape] = {}
    for i, one in enumerate(surveys):
        progress("drawing figures", i, len(surveys))
        tapes |= memory.told(("tapes", one.chapter.source.path), one, problems, partial(_tapes, one, bakery))
    progress("drawing figures", len(surveys), len(surveys))
    return tapes


def _tapes(one: Survey, bakery: Bakery, problems: Problems) -> dict[tuple[str, str], Tape]:
    tapes = {}
    for figure in one.figures.values():
        try:
            script, first, states = bakery.tape(figure.dom_id, one.taped[figure.id], tape_script)
            results = bakery.results(figure.dom_id, figure.record.plain())
        except FigureFault as fault:  # an error in a widget: the author sees where, in which figure and why
            fault.tell(problems, figure.place)
            continue
        name = hashed_name(f"tapes/{one.chapter.name}-{figure.id}.js", script)
        tapes[one.chapter.name, figure.id] = Tape(name, script, first, results, states)
    return tapes
