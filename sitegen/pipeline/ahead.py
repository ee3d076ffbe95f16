"""The plots and figures that are not cached: a build makes them first, in parallel processes."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

from sitegen.cache import pool
from sitegen.chapters.surveyed import Survey
from sitegen.figures.bakery import Bakery, draw_ahead, known_by_name, make_ahead
from sitegen.figures.gallery import Gallery
from sitegen.figures.model import Figure
from sitegen.figures.wire import Plain
from sitegen.plots import registry


def missing(surveys: Sequence[Survey], gallery: Gallery, bakery: Bakery, cache: Path) -> list[pool.Piece]:
    """The site's own plots and figures that are not cached, as pieces for the pool: plots first, slowest plot first."""
    plots = registry.longest_first(plot for survey in surveys for plot in survey.plots.values())
    ours = [plot for plot in plots if registry.all_plots().get(plot.plot.name) is plot.plot]
    figures = [(figure, survey.taped[figure.id]) for survey in surveys for figure in survey.figures.values()]
    taped = [(figure, states) for figure, states in figures if known_by_name(figure.widget)]
    return [
        *((registry.make_ahead, (p.plot.name, p.id, cache)) for p in ours if gallery.lacks(p)),
        *((make_ahead, (f.dom_id, states, cache)) for f, states in taped if bakery.lacks(f.dom_id, states)),
        *((draw_ahead, (f.dom_id, [record], cache)) for f, record in _beside(surveys, bakery)),
    ]


def _beside(surveys: Sequence[Survey], bakery: Bakery) -> Iterator[tuple[Figure, Plain]]:
    """The uncached states outside the tapes: those that still pictures show or that promises are checked against."""
    for survey in surveys:
        for still in survey.tokens.pictures.values():
            if known_by_name(still.figure.widget) and bakery.lacks_frames(still.figure.dom_id, [still.record]):
                yield still.figure, still.record
        for figure, record in ((promise.figure, promise.record) for promise in survey.promises):
            separate = known_by_name(figure.widget) and record not in survey.taped[figure.id]
            if separate and bakery.lacks_readouts(figure, record):
                yield figure, record
