"""Surveyed chapters → their texts and slides, each rendered again only if anything that it depends on has changed."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

from jinja2 import Environment
from markupsafe import Markup

from sitegen.cache.memory import Memory, T
from sitegen.chapters.citations import Reference
from sitegen.chapters.content import FIXED_PAGES, Chapter
from sitegen.chapters.glossary import Term
from sitegen.chapters.known import Known
from sitegen.chapters.leads import check_drawn
from sitegen.chapters.render import headings, render
from sitegen.chapters.rendered import Body, Question
from sitegen.chapters.survey import OWN_IDS
from sitegen.chapters.surveyed import Outline, Survey, outline
from sitegen.figures.bakery import Bakery, frames_of, readouts_of
from sitegen.figures.gallery import Gallery, Placed
from sitegen.figures.model import Figure
from sitegen.figures.tape import Tape
from sitegen.markup.math import Mathematics
from sitegen.pages.decks import Deck, deck
from sitegen.pages.views import figure_html, figure_view, picture_html, plot_html
from sitegen.problems import Problems

Tapes = Mapping[tuple[str, str], Tape]


@dataclass(frozen=True)
class Written:
    """A chapter's text, and its slides if it has any."""

    chapter: Chapter
    body: Body
    deck: Deck | None


@dataclass(frozen=True)
class Pen:
    """Renders chapters with their figures and plots."""

    templates: Environment
    tapes: Tapes
    bakery: Bakery
    gallery: Gallery

    def known(self, known: Known, one: Survey, problems: Problems) -> Known:
        """The part of `known` that rendering one chapter may depend on; faults go to `problems`."""
        formulas = {use.formula: known.mathematics.mathml[use.formula] for use in one.formulas}
        return replace(
            known,
            mathematics=Mathematics(formulas, ""),
            frames=partial(frames_of, self.bakery, problems, one.taped),
            readouts=partial(readouts_of, self.bakery, problems, one.taped),
            figure_html=partial(self._figure, one, problems),
            plot_html=partial(self._plot, problems),
            picture_html=picture_html(self.templates),
            problems=problems,
        )

    def headings(self, one: Survey, known: Known, problems: Problems) -> dict[str, Markup]:
        """The text of links to a chapter's headings, by anchor."""
        return headings(one, self.known(known, one, problems))

    def written(self, one: Survey, known: Known, problems: Problems) -> Written:
        """Render a chapter and its slides."""
        own = self.known(known, one, problems)
        slides = deck(one, self.tapes, own, figure_html(self.templates)) if one.slides else None
        return Written(one.chapter, render(one, own), slides)

    def _figure(
        self,
        one: Survey,
        problems: Problems,
        figure: Figure,
        says: Markup,
        caption: Markup,
        question: Question | None,
    ) -> Markup:
        tape = self.tapes.get((one.chapter.name, figure.id))
        if tape is None:  # its widget fails, which has been reported
            return Markup("")
        record = figure.record.plain()
        view = figure_view(figure, record, tape.first, tape, says, caption)
        if figure.lead:
            first = view.leading.controls
            brought = {name for spec in first.values() for sets in spec.sets.values() for name in sets}
            presses = [button.name for button in view.leading.buttons if button.does == "press"]
            panels = [panel["name"] for panel in view.leading.panels]
            view = replace(view, roles=tape.roles(record["controls"], {*first, *brought}, presses, panels))
        check_drawn(figure, view.main, tape.first, problems)
        after = frames_of(self.bakery, problems, one.taped, figure, [figure.after]) if figure.after else [None]
        return figure_html(self.templates)(replace(view, after=next(iter(after), None), question=question))

    def _plot(self, problems: Problems, placed: Placed, caption: Markup) -> Markup:
        try:
            return plot_html(self.templates)(placed, self.gallery.drawn(placed), caption)
        except Exception as error:  # an error in a plot: the author sees which and why
            problems.add(placed.place, f"the plot cannot be drawn: {type(error).__name__}: {error}")
            return Markup("")


def write(surveys: Sequence[Survey], known: Known, pen: Pen, memory: Memory) -> tuple[Known, list[Written]]:
    """Render all chapters. Return `known`, completed with their outlines and pages, and the chapters."""

    def made_of(one: Survey, now: Known) -> object:
        tapes = [pen.tapes.get((one.chapter.name, name)) for name in one.figures]
        return one, tapes, pen.known(now, one, known.problems)

    def kept_of(what: str, make: Callable[[Survey, Known, Problems], T], now: Known) -> list[T]:
        names = [(what, one.chapter.source.path) for one in surveys]
        return [
            memory.told(name, made_of(one, now), known.problems, partial(make, one, now))
            for name, one in zip(names, surveys, strict=True)
        ]

    outlines = list(map(outline, surveys, kept_of("headings", pen.headings, known)))
    known = replace(known, chapters=outlines, pages=_pages(surveys, known.references, known.terms))
    return known, kept_of("text", pen.written, known)


def outlines_of_drafts(surveys: Iterable[Survey]) -> list[Outline]:
    """Outlines of the drafts that are left out, without their headings."""
    return [outline(one, {}) for one in surveys]


def _has(one: Survey, name: str) -> bool:
    """Whether a chapter's page has one of the templates' own ids."""
    return {"slides": bool(one.slides), "where-next": bool(one.chapter.onward)}.get(name, True)


def _pages(
    surveys: Sequence[Survey], references: Mapping[str, Reference], terms: Mapping[str, Term]
) -> dict[str, Collection[str] | None]:
    """Every page that a link may lead to, with its anchors; None if any anchor is accepted."""
    pages: dict[str, Collection[str] | None] = {page.page: None for page in FIXED_PAGES if page.name != "404"}
    pages["references.html"] = [f"ref-{key}" for key in references]
    pages["glossary.html"] = [term.anchor for term in terms.values()]
    pages |= {one.chapter.deck: None for one in surveys if one.slides}

    def anchors(one: Survey) -> list[str]:
        own = ["main"] if one.chapter.is_doc else [name for name in OWN_IDS if _has(one, name)]
        return [*own, *one.anchors]

    # If two chapters have the same name, which is a problem, the first one wins.
    return pages | {one.chapter.page: anchors(one) for one in reversed(surveys)}
