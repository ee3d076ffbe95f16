"""The survey of a chapter, for rendering it, writing its notebook and slides, and referring to it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from markdown_it.token import Token
from markupsafe import Markup

from sitegen.chapters.content import Chapter
from sitegen.chapters.promises import Expectation, Promise
from sitegen.chapters.slides import Slide
from sitegen.figures.gallery import Placed
from sitegen.figures.model import Figure
from sitegen.figures.wire import Plain
from sitegen.markup.directives import Directive
from sitegen.markup.located import Anchor, Located, NoteMark, located
from sitegen.markup.math import Formula, FormulaUse
from sitegen.problems import Place
from widgets.engine.contract import Record, Widget


@dataclass(frozen=True)
class Heading:
    """A heading with its anchor, for the table of contents and for references."""

    level: int
    id: str
    tokens: Sequence[Token]


@dataclass(frozen=True)
class Button:
    """The action of a `::try` line: it sets a figure to a record."""

    figure: Figure
    record: Record


@dataclass(frozen=True)
class Prediction:
    """The question of a `::predict` line before a figure runs. record: the state at the end of the run, which decides.

    expected: for each answer, the expectations that make it right; panels: the panels to choose from, right if they
    show the word `says` in the end; within: how close, in u, a ghost of the source has to be placed.
    """

    figure: Figure
    record: Plain
    place: Place
    question: Sequence[Token]
    answers: Sequence[Sequence[Token]]
    expected: Sequence[Sequence[Expectation]] = ()
    panels: Sequence[str] = ()
    says: str = ""
    within: float = 0.0


@dataclass(frozen=True)
class Still:
    """The picture of a `::picture` line: panels of a figure in a state, () for the first one, and the expectations."""

    figure: Figure
    record: Plain
    panels: Sequence[str] = ()
    promise: Promise | None = None


@dataclass(frozen=True)
class Staged:
    """A slide with the things of its chapter that it shows; `record` is the state of its figure."""

    slide: Slide
    equation: Formula | None = None
    figure: Figure | None = None
    record: Record | None = None
    plot: Placed | None = None


@dataclass(frozen=True)
class Tokens:
    """What tokens stand for, keyed by the parser's notes on them; faulty tokens have no entry.

    first: the reference by which each footnote is numbered.
    """

    headings: Mapping[Located[Anchor], Heading]
    figures: Mapping[Located[Directive], Figure]
    plots: Mapping[Located[Directive], Placed]
    pictures: Mapping[Located[Directive], Still]
    buttons: Mapping[Located[Directive], Button]
    promises: Mapping[Located[Directive], Promise]
    first: Mapping[str, Located[NoteMark]]


@dataclass(frozen=True)
class Survey:
    """The contents of a chapter. `notes`: footnote label → number; `equations`: label → number; `labelled`: label →
    formula; `taped`: figure → the states of its tape, including those that buttons, predictions and slides set;
    `predictions`: figure → its question.

    lost: faulty figures and equations ("fig:id", "eq:label"); references to them are not reported as well.
    """

    chapter: Chapter
    anchors: Mapping[str, Place]
    figures: Mapping[str, Figure]
    taped: Mapping[str, Sequence[Plain]]
    plots: Mapping[str, Placed]
    equations: Mapping[str, str]
    notes: Mapping[str, int]
    labelled: Mapping[str, Formula]
    formulas: Sequence[FormulaUse]
    slides: Sequence[Staged]
    predictions: Mapping[str, Prediction]
    lost: frozenset[str]
    tokens: Tokens

    @property
    def headings(self) -> list[Heading]:
        """The chapter's headings, in order."""
        return list(self.tokens.headings.values())

    @property
    def promises(self) -> list[Promise]:
        """All promises that the chapter makes about its figures, in order."""
        return list(self.tokens.promises.values())

    def anchor(self, token: Token) -> str:
        """A heading's anchor; "" where headings are not allowed."""
        heading = self.tokens.headings.get(located(token, Anchor))
        return heading.id if heading else ""

    def figure(self, token: Token) -> Figure | None:
        """The figure that a `::figure` line places."""
        return self.tokens.figures.get(located(token, Directive))

    def plot(self, token: Token) -> Placed | None:
        """The plot that a `::plot` line places."""
        return self.tokens.plots.get(located(token, Directive))

    def picture(self, token: Token) -> Still | None:
        """The picture of a `::picture` line."""
        return self.tokens.pictures.get(located(token, Directive))

    def button(self, token: Token) -> Button | None:
        """The button of a `::try` line."""
        return self.tokens.buttons.get(located(token, Directive))

    def promise(self, token: Token) -> Promise | None:
        """The promise of a button or a piece of text."""
        return self.tokens.promises.get(located(token, Directive))

    def number(self, token: Token) -> str:
        """An equation's number; "" if it has no label."""
        return self.equations[token.info] if token.type == "math_block_label" else ""

    def is_first(self, token: Token) -> bool:
        """Whether a reference to a footnote is the first one."""
        mark = located(token, NoteMark)
        return self.tokens.first.get(mark.thing.label) is mark

    def first_notes(self, tokens: Sequence[Token]) -> list[str]:
        """The labels of the footnotes that these tokens are the first to refer to."""
        marks = [child for token in tokens for child in token.children or [] if is_mark(child) and self.is_first(child)]
        return [located(mark, NoteMark).thing.label for mark in marks]


def is_mark(token: Token) -> bool:
    """Whether a token refers to a footnote."""
    return token.type == "footnote_ref"


@dataclass(frozen=True)
class Outline:
    """What other chapters can refer to in a chapter: plain data, so that changes can be detected.

    numbered: figures and plots by id, `equations` by label, each with its element's id and number; placed: figures by
    id, each with its widget and initial record; headings: the text of a link to each, by anchor; lost: see Survey.
    """

    file: str
    page: str
    deck: str
    slug: str
    name: str
    title: str
    rung: str
    numbered: Mapping[str, tuple[str, str]]
    equations: Mapping[str, tuple[str, str]]
    headings: Mapping[str, Markup]
    placed: Mapping[str, tuple[Widget, Record]]
    lost: frozenset[str]


def outline(survey: Survey, headings: Mapping[str, Markup]) -> Outline:
    """The outline of a chapter. headings: the rendered ones, by anchor."""
    chapter = survey.chapter
    figures: dict[str, Figure | Placed] = {**survey.plots, **survey.figures}
    return Outline(
        chapter.source.path,
        chapter.page,
        chapter.deck,
        chapter.slug,
        chapter.name,
        chapter.title,
        chapter.rung,
        {name: (item.dom_id, f"Figure {item.number}") for name, item in figures.items()},
        {label: (f"eq-{label}", f"({number})") for label, number in survey.equations.items()},
        headings,
        {name: (figure.widget, figure.record) for name, figure in survey.figures.items()},
        survey.lost,
    )
