"""What a survey says of a chapter, to those who render it, write its notebook and its slides, or refer to it."""

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
from sitegen.markup.math import Asked, Formula
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
    """What a `::try` line does: it sets a figure to a record."""

    figure: Figure
    record: Record


@dataclass(frozen=True)
class Prediction:
    """What a `::predict` line asks before a figure runs. record: what the run comes to, which decides.

    expected: what holds where an answer is right, for each; panels: what is chosen from, right where it `says` so in
    the end; within: how near, in u, a ghost of the source has to be placed.
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
    """What a `::picture` line shows: panels of a figure in a state, the first where it names none, and what is expected
    there."""

    figure: Figure
    record: Plain
    panels: Sequence[str] = ()
    promise: Promise | None = None


@dataclass(frozen=True)
class Staged:
    """A slide with what it shows of its chapter; `record` is the state that its figure stands in."""

    slide: Slide
    equation: Formula | None = None
    figure: Figure | None = None
    record: Record | None = None
    plot: Placed | None = None


@dataclass(frozen=True)
class Tokens:
    """What single tokens have come to stand for, by what the parser noted on them; a token with a mistake has nothing.

    first: the reference that each footnote is numbered by.
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
    """What a chapter holds. `notes`: footnote label → number; `equations`: label → number, `labelled`: → formula;
    `taped`: figure → the states of its tape, also those that buttons, predictions and slides set; `predictions`: figure
    → what it asks.

    lost: figures and equations ("fig:id", "eq:label") that are named and could not be made: that is told once.
    """

    chapter: Chapter
    anchors: Mapping[str, Place]
    figures: Mapping[str, Figure]
    taped: Mapping[str, Sequence[Plain]]
    plots: Mapping[str, Placed]
    equations: Mapping[str, str]
    notes: Mapping[str, int]
    labelled: Mapping[str, Formula]
    formulas: Sequence[Asked]
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
        """All that the chapter promises of its figures, in order."""
        return list(self.tokens.promises.values())

    def anchor(self, token: Token) -> str:
        """A heading's anchor, "" where no heading may stand."""
        heading = self.tokens.headings.get(located(token, Anchor))
        return heading.id if heading else ""

    def figure(self, token: Token) -> Figure | None:
        """The figure that a `::figure` line places."""
        return self.tokens.figures.get(located(token, Directive))

    def plot(self, token: Token) -> Placed | None:
        """The plot that a `::plot` line places."""
        return self.tokens.plots.get(located(token, Directive))

    def picture(self, token: Token) -> Still | None:
        """What a `::picture` line shows."""
        return self.tokens.pictures.get(located(token, Directive))

    def button(self, token: Token) -> Button | None:
        """What a `::try` line does."""
        return self.tokens.buttons.get(located(token, Directive))

    def promise(self, token: Token) -> Promise | None:
        """What a button or a piece of text promises."""
        return self.tokens.promises.get(located(token, Directive))

    def number(self, token: Token) -> str:
        """An equation's number, "" where it has no label."""
        return self.equations[token.info] if token.type == "math_block_label" else ""

    def is_first(self, token: Token) -> bool:
        """Whether a reference to a footnote is the first to it."""
        mark = located(token, NoteMark)
        return self.tokens.first.get(mark.thing.label) is mark

    def first_notes(self, tokens: Sequence[Token]) -> list[str]:
        """The labels of the footnotes that these tokens are the first to refer to."""
        marks = [child for each in tokens for child in each.children or [] if is_mark(child) and self.is_first(child)]
        return [located(mark, NoteMark).thing.label for mark in marks]


def is_mark(token: Token) -> bool:
    """Whether a token refers to a footnote."""
    return token.type == "footnote_ref"


@dataclass(frozen=True)
class Outline:
    """What other chapters may say of a chapter: plain data, so that it can be told whether any of it has changed.

    numbered: figures and plots by id, `equations` by label, each with its element's id and number; placed: figures by
    id, each with the widget and the record that it opens in; headings: the text of a link to each, by anchor; lost: see
    Survey.
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
    """The outline of a chapter, its headings rendered."""
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
        {name: (one.dom_id, f"Figure {one.number}") for name, one in figures.items()},
        {label: (f"eq-{label}", f"({number})") for label, number in survey.equations.items()},
        headings,
        {name: (one.widget, one.record) for name, one in survey.figures.items()},
        survey.lost,
    )
