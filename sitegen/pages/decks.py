"""Slides → the deck of a chapter: rendered texts, and the chapter's figures and plots, same markup and tapes."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

from markupsafe import Markup

from sitegen.chapters.content import Chapter
from sitegen.chapters.known import Known
from sitegen.chapters.render import Pieces, pieces
from sitegen.chapters.rendered import Body
from sitegen.chapters.surveyed import Staged, Survey
from sitegen.figures.model import Figure
from sitegen.figures.tape import Tape
from sitegen.pages.title_slide import check_title
from sitegen.pages.views import IDS, FigureView, figure_view
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
    survey: Survey, tapes: Mapping[tuple[str, str], Tape], known: Known, draw: Callable[[FigureView], Markup]
) -> Deck:
    """Render the deck of a chapter that has slides; faults in them go to known.problems."""
    check_title(survey.chapter, known.problems)
    write = pieces(survey, known, survey.chapter.deck)
    views, stills = [], []
    for one in survey.slides:
        tape = tapes.get((survey.chapter.name, one.figure.id)) if one.figure else None
        view = _figure(one, one.figure, tape, known) if one.figure and tape else None
        if view:
            stills.append(Markup(IDS.sub("", view.frame["panels"][0]["svg"])))
        views.append(_slide(one, write, draw(view) if view else Markup(), known))
    return Deck(survey.chapter, tuple(views), next(iter(stills), Markup()), write.found())


def _slide(one: Staged, write: Pieces, figure: Markup, known: Known) -> SlideView:
    slide = one.slide
    title = [child for token in slide.title for child in token.children or []]
    width, height = one.plot.plot.sizes["wide"] if one.plot else (1, 1)
    equation = known.mathematics.mathml.get(one.equation, "") if one.equation else ""
    return SlideView(
        write.inline(title),
        write.flow(slide.text),
        write.flow(slide.notes),
        Markup(equation),
        figure,
        known.plot_html(one.plot, Markup()) if one.plot else Markup(),
        one.plot is not None and width < WIDE * height,
    )


def _figure(one: Staged, figure: Figure, tape: Tape, known: Known) -> FigureView | None:
    """The chapter's figure in the slide's state, with the panels, controls and readouts that the slide selects."""
    assert one.record is not None
    plain = one.record.plain()
    frames = [tape.first] if plain == figure.record.plain() else known.frames(figure, [plain])
    if not frames:
        return None
    (frame,) = frames
    for what in ("panel", "readout"):
        names = [each["name"] for each in frame[f"{what}s"]]
        for i, name in enumerate(getattr(one.slide, f"{what}s")):
            if name not in names:
                known.problems.add(one.slide.at(f"{what}s", i), f"unknown {what} {name!r}{hint(name, names)}")
    view = figure_view(figure, plain, frame, tape)
    panels = one.slide.panels or tuple(panel["name"] for panel in frame["panels"])
    buttons = tuple(button.name for button in figure.widget.buttons)
    lead = Lead(panels, one.slide.readouts, one.slide.controls, buttons)
    return replace(view, jobs=(), lead=lead, whole=False)
