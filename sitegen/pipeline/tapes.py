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
    for i, survey in enumerate(surveys):
        progress("drawing figures", i, len(surveys))
        tapes |= memory.told(("tapes", survey.chapter.source.path), survey, problems, partial(_tapes, survey, bakery))
    progress("drawing figures", len(surveys), len(surveys))
    return tapes


def _tapes(survey: Survey, bakery: Bakery, problems: Problems) -> dict[tuple[str, str], Tape]:
    tapes = {}
    for figure in survey.figures.values():
        try:
            script, first, states = bakery.tape(figure.dom_id, survey.taped[figure.id], tape_script)
            results = bakery.results(figure.dom_id, figure.record.plain())
        except FigureFault as fault:  # an error in a widget: the author sees where, in which figure and why
            fault.tell(problems, figure.place)
            continue
        name = hashed_name(f"tapes/{survey.chapter.name}-{figure.id}.js", script)
        tapes[survey.chapter.name, figure.id] = Tape(name, script, first, results, states)
    return tapes
