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
from sitegen.chapters.leads import check_drawn
from sitegen.chapters.render import headings, render
from sitegen.chapters.render_context import RenderContext, SiteContext
from sitegen.chapters.rendered import Body, Question
from sitegen.chapters.survey import OWN_IDS
from sitegen.chapters.surveyed import Outline, Survey, outline
from sitegen.figures.bakery import Bakery, frames_of, readouts_of
from sitegen.figures.gallery import Gallery, Placed
from sitegen.figures.model import Figure
from sitegen.figures.tape import StateRoles, Tape, state_roles
from sitegen.markup.math import Mathematics
from sitegen.pages.decks import Deck, deck
from sitegen.pages.views import figure_html, figure_view, picture_html, plot_html, with_roles
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

    def chapter_context(self, context: SiteContext, survey: Survey, problems: Problems) -> RenderContext:
        """The part of `context` that rendering one chapter may depend on; faults go to `problems`."""
        formulas = {use.formula: context.mathematics.mathml[use.formula] for use in survey.formulas}
        own = replace(context, mathematics=Mathematics(formulas, ""), problems=problems)
        return RenderContext(
            **vars(own),
            frames=partial(frames_of, self.bakery, problems, survey.taped),
            readouts=partial(readouts_of, self.bakery, problems, survey.taped),
            figure_html=partial(self._figure, survey, problems),
            plot_html=partial(self._plot, problems),
            picture_html=picture_html(self.templates),
        )

    def headings(self, survey: Survey, context: SiteContext, problems: Problems) -> dict[str, Markup]:
        """The text of links to a chapter's headings, by anchor."""
        return headings(survey, self.chapter_context(context, survey, problems))

    def written(self, survey: Survey, context: SiteContext, problems: Problems) -> Written:
        """Render a chapter and its slides."""
        own_context = self.chapter_context(context, survey, problems)
        slides = deck(survey, self.tapes, own_context, figure_html(self.templates)) if survey.slides else None
        return Written(survey.chapter, render(survey, own_context), slides)

    def _figure(
        self,
        survey: Survey,
        problems: Problems,
        figure: Figure,
        sentence: Markup,
        caption: Markup,
        question: Question | None,
    ) -> Markup:
        tape = self.tapes.get((survey.chapter.name, figure.id))
        if tape is None:  # its widget fails, which has been reported
            return Markup("")
        record = figure.record.plain()
        view = figure_view(figure, record, tape.first, tape, sentence, caption)
        drawn = partial(frames_of, self.bakery, problems, survey.taped, figure)
        if figure.lead:
            records = [promise.record for promise in survey.promises if promise.figure == figure]
            promised = [StateRoles(**state_roles(*one)) for one in zip(records, drawn(records), strict=False)]
            view = with_roles(view, tape, [record["controls"]], promised)
        check_drawn(figure, view.main, tape.first, problems)
        frames = drawn([figure.after]) if figure.after else [None]
        return figure_html(self.templates)(replace(view, after=next(iter(frames), None), question=question))

    def _plot(self, problems: Problems, plot: Placed, caption: Markup) -> Markup:
        try:
            return plot_html(self.templates)(plot, self.gallery.drawn(plot), caption)
        except Exception as error:  # an error in a plot: the author sees which and why
            problems.add(plot.place, f"the plot cannot be drawn: {type(error).__name__}: {error}")
            return Markup("")


def write(
    surveys: Sequence[Survey], context: SiteContext, pen: Pen, memory: Memory
) -> tuple[SiteContext, list[Written]]:
    """Render all chapters. Return `context`, completed with their outlines and pages, and the chapters."""

    def made_of(survey: Survey, current: SiteContext) -> object:
        tapes = [pen.tapes.get((survey.chapter.name, name)) for name in survey.figures]
        return survey, tapes, pen.chapter_context(current, survey, context.problems)

    def kept_of(kind: str, make: Callable[[Survey, SiteContext, Problems], T], current: SiteContext) -> list[T]:
        names = [(kind, survey.chapter.source.path) for survey in surveys]
        return [
            memory.told(name, made_of(survey, current), context.problems, partial(make, survey, current))
            for name, survey in zip(names, surveys, strict=True)
        ]

    outlines = list(map(outline, surveys, kept_of("headings", pen.headings, context)))
    context = replace(context, chapters=outlines, pages=_pages(surveys, context.references, context.terms))
    return context, kept_of("text", pen.written, context)


def outlines_of_drafts(surveys: Iterable[Survey]) -> list[Outline]:
    """Outlines of the drafts that are left out, without their headings."""
    return [outline(survey, {}) for survey in surveys]


def _has(survey: Survey, name: str) -> bool:
    """Whether a chapter's page has one of the templates' own ids."""
    document = survey.chapter.document
    texts = [token for tokens in (document.tokens, *document.footnotes.values()) for token in tokens]
    cites = any(child.type == "cite" for token in texts for child in token.children or [])
    shown = {"slides": bool(survey.slides), "where-next": bool(survey.chapter.onward), "works-cited": cites}
    return shown.get(name, True)


def _pages(
    surveys: Sequence[Survey], references: Mapping[str, Reference], terms: Mapping[str, Term]
) -> dict[str, Collection[str] | None]:
    """Every page that a link may lead to, with its anchors; None if any anchor is accepted."""
    pages: dict[str, Collection[str] | None] = {page.page: None for page in FIXED_PAGES if page.name != "404"}
    pages["references.html"] = [f"ref-{key}" for key in references]
    pages["glossary.html"] = [term.anchor for term in terms.values()]
    pages |= {survey.chapter.deck: None for survey in surveys if survey.slides}

    def anchors(survey: Survey) -> list[str]:
        ids = ["main"] if survey.chapter.is_doc else [name for name in OWN_IDS if _has(survey, name)]
        return [*ids, *survey.anchors]

    # If two chapters have the same name, which is a problem, the first one wins.
    return pages | {survey.chapter.page: anchors(survey) for survey in reversed(surveys)}
