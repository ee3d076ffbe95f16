"""Slides → the deck of a chapter: rendered texts, and the chapter's figures and plots, same markup and tapes."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

from markupsafe import Markup

from sitegen.chapters.content import Chapter
from sitegen.chapters.render import Pieces, pieces
from sitegen.chapters.render_context import RenderContext
from sitegen.chapters.rendered import Body
from sitegen.chapters.surveyed import Staged, Survey
from sitegen.figures.model import Figure
from sitegen.figures.tape import Tape
from sitegen.pages.title_slide import check_title
from sitegen.pages.views import IDS, FigureView, figure_view, with_roles
from sitegen.problems import hint
from widgets.engine.contract import Lead

WIDE = 1.75  # from this ratio of width to height on, a plot goes below the text


@dataclass(frozen=True)
class SlideView:
    """A slide as the template shows it. tall: its plot leaves room for the text beside it."""

    title: Markup
    text: Markup
    notes: Markup
    equation: Markup
    figure: Markup
    plot: Markup
    tall: bool


@dataclass(frozen=True)
class Deck:
    """The slides of a chapter. still: a panel of their first figure, without ids; found: what the texts cite."""

    chapter: Chapter
    slides: tuple[SlideView, ...]
    still: Markup
    found: Body

    @property
    def count(self) -> int:
        """The number of slides, including the title slide."""
        return len(self.slides) + 1


def deck(
    survey: Survey, tapes: Mapping[tuple[str, str], Tape], context: RenderContext, draw: Callable[[FigureView], Markup]
) -> Deck:
    """Render the deck of a chapter that has slides; faults in them go to context.problems."""
    check_title(survey.chapter, context.problems)
    write = pieces(survey, context, survey.chapter.deck)
    views, stills = [], []
    for staged in survey.slides:
        tape = tapes.get((survey.chapter.name, staged.figure.id)) if staged.figure else None
        view = _figure(survey, staged, staged.figure, tape, context) if staged.figure and tape else None
        if view:
            stills.append(Markup(IDS.sub("", view.frame["panels"][0]["svg"])))
        views.append(_slide(staged, write, view, draw, context))
    return Deck(survey.chapter, tuple(views), next(iter(stills), Markup()), write.found())


def _slide(
    staged: Staged,
    write: Pieces,
    view: FigureView | None,
    draw: Callable[[FigureView], Markup],
    context: RenderContext,
) -> SlideView:
    slide = staged.slide
    title = [child for token in slide.title for child in token.children or []]
    width, height = staged.plot.plot.sizes["wide"] if staged.plot else (1, 1)
    equation = context.mathematics.mathml.get(staged.equation, "") if staged.equation else ""
    heading, text = write.inline(title), write.flow(slide.text)
    return SlideView(
        heading,
        text,
        write.flow(slide.notes),
        Markup(equation),
        draw(replace(view, beside=text)) if view else Markup(),
        context.plot_html(staged.plot, Markup()) if staged.plot else Markup(),
        staged.plot is not None and width < WIDE * height,
    )


def _figure(
    survey: Survey, staged: Staged, figure: Figure, tape: Tape, context: RenderContext
) -> FigureView | None:
    """The chapter's figure in the slide's state, with the panels, controls and readouts that the slide selects."""
    assert staged.record is not None
    plain = staged.record.plain()
    frames = [tape.first] if plain == figure.record.plain() else context.frames(figure, [plain])
    if not frames:
        return None
    (frame,) = frames
    for kind in ("panel", "readout"):
        names = [item["name"] for item in frame[f"{kind}s"]]
        for i, name in enumerate(getattr(staged.slide, f"{kind}s")):
            if name not in names:
                context.problems.add(staged.slide.at(f"{kind}s", i), f"unknown {kind} {name!r}{hint(name, names)}")
    view = figure_view(figure, plain, frame, tape)
    panels = staged.slide.panels or tuple(panel["name"] for panel in frame["panels"])
    buttons = tuple(button.name for button in figure.widget.buttons)
    lead = Lead(panels, staged.slide.readouts, staged.slide.controls, buttons)
    view = replace(view, jobs=(), lead=lead, whole=False)
    tries = [survey.button(token) for token in staged.slide.text if token.type == "try"]
    starts = [plain, *(button.record.plain() for button in tries if button)]
    return with_roles(view, tape, [start["controls"] for start in starts])
