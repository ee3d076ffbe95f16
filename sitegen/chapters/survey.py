"""The first pass over a parsed chapter: numbers, anchors, figures, formulas, everything that chapters may refer to.

Tokens are not modified, so that a chapter can be surveyed again: rendering looks up in the survey what each of them
stands for.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TypeVar

from markdown_it.token import Token

from sitegen.chapters.content import Chapter
from sitegen.chapters.pictures import still
from sitegen.chapters.placing import bare, changed, id_of, listed, placed
from sitegen.chapters.plot_placing import placed as placed_plot
from sitegen.chapters.predictions import prediction
from sitegen.chapters.promises import HOLDS, OWN, TESTED, Promise, promise, tell_unheld
from sitegen.chapters.slides import Slide
from sitegen.chapters.surveyed import Button, Heading, Prediction, Staged, Still, Survey, Tokens, is_mark
from sitegen.chapters.unfit import REFERENCES, tell_unfit
from sitegen.figures.gallery import Placed, Plot
from sitegen.figures.model import Figure, distinct, ways
from sitegen.figures.wire import Plain
from sitegen.markup.directives import Attribute, Directive
from sitegen.markup.located import Anchor, EquationLabel, Located, NoteMark, located, place_of
from sitegen.markup.math import Formula, FormulaUse, formula_of
from sitegen.markup.parser import ascii_slug, text_of
from sitegen.markup.places import ANCHOR
from sitegen.problems import Place, Problems, hint
from widgets.engine.contract import Record, Widget
from widgets.engine.controls import specs

# Ids that the templates and the figures use; headings may not have them.
OWN_IDS = ("main", "cite-this-page", "notebook", "slides", "where-next", "works-cited")
OWN_PREFIXES = ("fig-", "eq-", "note-", "noteref-", "claim-", "card-")
SENTENCE = re.compile(r"\s*[.,]((?:\s*\\end\{\w+\})*)\s*$")
DISPLAYED = ("heading_open", "figure", "picture", "plot")
LINKS = ("link_open", "claim_open", "cite", "ref", "term", "footnote_ref")

_Shown = TypeVar("_Shown", Figure, Placed)


@dataclass
class _Finding:
    """A survey in progress; for its fields see Survey and Tokens. set: the records to which figures are set."""

    chapter: Chapter
    lost: set[str]
    anchors: dict[str, Place] = field(default_factory=dict)
    figures: dict[str, Figure] = field(default_factory=dict)
    set: dict[str, list[Record]] = field(default_factory=dict)
    plots: dict[str, Placed] = field(default_factory=dict)
    equations: dict[str, str] = field(default_factory=dict)
    notes: dict[str, int] = field(default_factory=dict)
    labelled: dict[str, Formula] = field(default_factory=dict)
    formulas: list[FormulaUse] = field(default_factory=list)
    slides: list[Staged] = field(default_factory=list)
    predictions: dict[str, Prediction] = field(default_factory=dict)
    heading_of: dict[Located[Anchor], Heading] = field(default_factory=dict)
    figure_of: dict[Located[Directive], Figure] = field(default_factory=dict)
    plot_of: dict[Located[Directive], Placed] = field(default_factory=dict)
    picture_of: dict[Located[Directive], Still] = field(default_factory=dict)
    button_of: dict[Located[Directive], Button] = field(default_factory=dict)
    promise_of: dict[Located[Directive], Promise] = field(default_factory=dict)
    first: dict[str, Located[NoteMark]] = field(default_factory=dict)

    def taped(self, figure: Figure) -> tuple[Plain, ...]:
        """The states of a figure's tape: its own, and those on the way to the records that it is set to."""
        return distinct([*figure.states, *(state for record in self.set.get(figure.id, ()) for state in ways(record))])

    def survey(self) -> Survey:
        """The finished survey."""
        tokens = Tokens(
            self.heading_of, self.figure_of, self.plot_of, self.picture_of, self.button_of, self.promise_of, self.first
        )
        return Survey(
            self.chapter,
            self.anchors,
            self.figures,
            {name: self.taped(figure) for name, figure in self.figures.items()},
            self.plots,
            self.equations,
            self.notes,
            self.labelled,
            self.formulas,
            self.slides,
            self.predictions,
            frozenset(self.lost),
            tokens,
        )


def survey(chapter: Chapter, widgets: Mapping[str, Widget], plots: Mapping[str, Plot], problems: Problems) -> Survey:
    """Survey the chapter; faults within it go to `problems`."""
    finding = _Finding(chapter, set(chapter.document.lost))
    flow = chapter.document.tokens
    _notes(finding, problems)
    for i, token in enumerate(flow):
        match token.type:
            case "heading_open":
                _heading(finding, token, flow[i + 1], problems)
            case "figure":
                _figure(finding, token, widgets, problems)
            case "plot":
                _plot(finding, token, plots, problems)
            case "picture":
                _picture(finding, token, widgets, problems)
    _within(finding, [*flow, *(t for tokens in chapter.document.footnotes.values() for t in tokens)], problems)
    for slide in chapter.slides:
        figure, lost = finding.figures.get(slide.figure), slide.figure not in ("", *finding.figures)
        _within(finding, [*slide.title, *slide.text, *slide.notes], problems, figure, lost)
        finding.slides.append(_stage(finding, slide, problems))
    return finding.survey()


def _within(
    finding: _Finding, tokens: Sequence[Token], problems: Problems, figure: Figure | None = None, lost: bool = False
) -> None:
    """Collect the formulas, buttons, predictions and promises in some text, after the chapter's figures.

    figure: the figure beside the text, if any; lost: that figure is faulty, which has been reported.
    """
    tell_unfit(tokens, problems)
    for token in tokens:
        if token.type in ("math_block", "math_block_label"):
            _equation(finding, token, problems)
        for child in token.children or []:
            if child.type == "math_inline":
                finding.formulas.append(FormulaUse(formula_of(child), _offset_place(child)))
    for token in tokens:
        if token.type == "try":
            _try(finding, token, problems)
        if token.type == "predict":
            _predict(finding, token, problems)
        target = finding.figure_of.get(located(token, Directive)) if token.type == "figure" else figure
        for child in token.children or []:
            if child.type == "promise_open":
                _promise(finding, child, target, lost or (token.type == "figure" and target is None), problems)
        if token.type in ("figure", "picture", "plot", "predict", "try", "aside") and not token.children:
            problems.add(located(token, Directive).place, f"::{token.type} has no text")


def _offset_place(token: Token) -> Callable[[int], Place]:
    """A function from offsets inside an inline formula to places."""
    formula = located(token, object)
    return lambda offset: formula.at(formula.offset + 1 + offset)


def _anchor(finding: _Finding, name: str, place: Place, subject: str, problems: Problems) -> None:
    if name in finding.anchors:
        problems.add(place, f"duplicate {subject} in this chapter (first on line {finding.anchors[name].line})")
    finding.anchors.setdefault(name, place)


def _heading(finding: _Finding, token: Token, content: Token, problems: Problems) -> None:
    level, heading = int(token.tag[1]), located(token, Anchor)
    name, place = heading.thing.name, heading.place
    if level == 1:
        problems.add(place, "the chapter's title belongs in its front matter: headings start at ##")
    previous = next((h.level for h in reversed(finding.heading_of.values())), 1)
    if level > previous + 1:
        problems.add(place, f"skipped heading level: level {level} after level {previous}")
    if name and _is_own(name):
        problems.add(place, f"reserved anchor {name!r}: choose another name")
    elif not name:
        base = ascii_slug(text_of(content.children or []))
        base = name = f"section-{base}" if _is_own(base) else base
        count = 1
        while name in finding.anchors:
            count += 1
            name = f"{base}-{count}"
    if not _is_own(name):  # left to the element that it belongs to
        _anchor(finding, name, place, f"anchor {name!r}", problems)
    words = [child for child in content.children or [] if child.type not in REFERENCES]  # reported as unfit
    finding.heading_of[heading] = Heading(level, name, words)


def _is_own(name: str) -> bool:
    return name in OWN_IDS or name.startswith(OWN_PREFIXES)


def _figure(finding: _Finding, token: Token, widgets: Mapping[str, Widget], problems: Problems) -> None:
    line = located(token, Directive)
    figure = placed(line.thing, line.at, _next(finding), widgets, problems)
    _tell_unheld(line.thing, line.at, problems)
    _add_item(finding, line, figure, finding.figure_of, finding.figures, problems)


def _plot(finding: _Finding, token: Token, plots: Mapping[str, Plot], problems: Problems) -> None:
    line = located(token, Directive)
    plot = placed_plot(line.thing, line.at, _next(finding), plots, problems)
    _tell_unheld(line.thing, line.at, problems, TESTED)
    _add_item(finding, line, plot, finding.plot_of, finding.plots, problems)


def _add_item(
    finding: _Finding,
    line: Located[Directive],
    item: _Shown | None,
    by_line: dict[Located[Directive], _Shown],
    by_id: dict[str, _Shown],
    problems: Problems,
) -> None:
    """Record a live figure or a plot by its line and its id. None: its fault has been reported, and its id is lost."""
    if item is None:
        finding.lost.add(f"fig:{id_of(line.thing)}")
        return
    by_line[line] = item
    _anchor(finding, item.dom_id, item.place, f"figure {item.id!r}", problems)
    by_id.setdefault(item.id, item)


def _picture(finding: _Finding, token: Token, widgets: Mapping[str, Widget], problems: Problems) -> None:
    line = located(token, Directive)
    picture = still(line.thing, line.at, len(finding.picture_of) + 1, widgets, problems)
    if picture is not None:
        finding.picture_of[line] = picture
        if picture.promise is None:
            _tell_unheld(line.thing, line.at, problems)


def _next(finding: _Finding) -> str:
    """The number of the next figure; live figures and plots share one series."""
    return finding.chapter.numbered(len(finding.figures) + len(finding.plots) + 1)


def _equation(finding: _Finding, token: Token, problems: Problems) -> None:
    lead = len(token.content) - len(token.content.lstrip())
    formula, at = formula_of(token), located(token, object).at
    finding.formulas.append(FormulaUse(formula, lambda index: at(lead + index)))
    if token.type == "math_block_label":
        label, place = token.info, located(token, EquationLabel).thing.place
        if not ANCHOR.fullmatch(label):
            message = f"invalid label {label!r}: use lower-case letters, digits and hyphens, starting with a letter"
            problems.add(place, message)
        _anchor(finding, f"eq-{label}", place, f"equation {label!r}", problems)
        finding.equations.setdefault(label, finding.chapter.numbered(len(finding.equations) + 1))
        finding.labelled.setdefault(label, formula)


def _notes(finding: _Finding, problems: Problems) -> None:
    """Number the footnotes in the order of their first reference; faults go to `problems`."""
    document = finding.chapter.document
    for mark in _marks(document.tokens):
        label = mark.thing.label
        if label not in document.footnotes:
            problems.add(mark.place, f"unknown footnote [^{label}]{hint(label, document.footnotes)}")
        elif label not in finding.notes:
            finding.notes[label] = len(finding.notes) + 1
            finding.first[label] = mark
    for label, tokens in document.footnotes.items():
        for mark in _marks(tokens):
            problems.add(mark.place, "a footnote cannot refer to another footnote")
        for token in tokens:
            if token.type in DISPLAYED:
                message = "headings, figures, pictures and plots belong in the chapter itself, not in a footnote"
                problems.add(located(token, object).place, message)
        if label not in finding.notes:
            line = next((t.map[0] + 1 for t in tokens if t.map), 1)
            problems.add(Place(finding.chapter.source.path, line, 1), f"unused footnote [^{label}]")
    for label, number in finding.notes.items():
        _anchor(finding, f"note-{number}", finding.first[label].place, f"note {label!r}", problems)


def _marks(tokens: Iterable[Token]) -> list[Located[NoteMark]]:
    """The references to footnotes."""
    return [located(child, NoteMark) for token in tokens for child in token.children or [] if is_mark(child)]


def _figure_by_name(
    finding: _Finding, attributes: list[Attribute], line: Located[Directive], problems: Problems
) -> Figure | None:
    """The figure that a directive's first bare word names; None, and a problem, if there is none."""
    at = line.at
    words = bare(attributes, 1, at, problems)
    if not words:
        problems.add(at(line.thing.attributes_start), "missing figure id, as in {solve noise=0.2}")
        return None
    figure = finding.figures.get(words[0].value)
    if figure is None and f"fig:{words[0].value}" not in finding.lost:
        suggestion = hint(words[0].value, finding.figures)
        problems.add(at(words[0].start), f"unknown figure {words[0].value!r} in this chapter{suggestion}")
    return figure


def _promise(finding: _Finding, token: Token, figure: Figure | None, lost: bool, problems: Problems) -> None:
    """Record a promise about the named figure, or else the text's own; if that is lost, nothing is reported."""
    line = located(token, Directive)
    directive, at = line.thing, line.at
    attributes = listed(directive, at, problems)
    if attributes is not None and not (all(a.name for a in attributes) and (figure or lost)):
        figure = _figure_by_name(finding, attributes, line, problems)
    if attributes is None or figure is None:
        return
    promised = promise(figure, attributes, at, problems)
    if promised is None:
        problems.add(at(directive.start), 'a promise needs expect=: {figure press=finish expect="rms < 0.1"}')
    else:
        finding.promise_of[line] = promised


def _tell_unheld(directive: Directive, at: Callable[[int], Place], problems: Problems, suggestion: str = HOLDS) -> None:
    tell_unheld(directive.text, lambda offset: at(directive.text_start + offset), problems, suggestion)


def _of_figure(
    finding: _Finding, token: Token, subject: str, problems: Problems
) -> tuple[Figure, list[Attribute]] | None:
    """The figure that a button or a prediction names, and its attributes; None, and a problem, if there is none."""
    line = located(token, Directive)
    attributes = listed(line.thing, line.at, problems)
    figure = None if attributes is None else _figure_by_name(finding, attributes, line, problems)
    for child in token.children or []:
        if child.type in LINKS:
            problems.add(place_of(child) or line.place, f"{subject} cannot contain links")
    return None if figure is None or attributes is None else (figure, attributes)


def _try(finding: _Finding, token: Token, problems: Problems) -> None:
    target = _of_figure(finding, token, "a button", problems)
    if target is None:
        return
    figure, attributes = target
    line = located(token, Directive)
    set_by = [a for a in attributes if a.name and a.name not in OWN]
    record = changed(figure.widget, figure.record, set_by, line.at, problems, OWN)
    finding.set.setdefault(figure.id, []).append(record)
    finding.button_of[line] = Button(figure, record)
    promised = promise(figure, attributes, line.at, problems)
    if promised is not None:
        finding.promise_of[line] = promised
    elif not any(a.name in OWN for a in attributes):
        _tell_unheld(line.thing, line.at, problems)


def _predict(finding: _Finding, token: Token, problems: Problems) -> None:
    target = _of_figure(finding, token, "a prediction", problems)
    if target is None:
        return
    figure, attributes = target
    line = located(token, Directive)
    if figure.id in finding.predictions:
        problems.add(line.place, f"duplicate prediction: figure {figure.id!r} already has one")
        return
    result = prediction(figure, line.thing, token.children or [], attributes, line.at, problems)
    if result is not None:
        finding.predictions[figure.id], record = result
        finding.set.setdefault(figure.id, []).append(record)


def _stage(finding: _Finding, slide: Slide, problems: Problems) -> Staged:
    """The slide with the things of the chapter that it names; wrong names go to `problems`."""
    kinds: dict[str, Iterable[str]] = {"equation": finding.labelled, "figure": finding.figures, "plot": finding.plots}
    for kind, names in kinds.items():
        name = getattr(slide, kind)
        if name and name not in names and f"{'eq' if kind == 'equation' else 'fig'}:{name}" not in finding.lost:
            problems.add(slide.at(kind), f"unknown {kind} {name!r} in this chapter{hint(name, names)}")
        if name and kind != "equation" and any(getattr(staged.slide, kind) == name for staged in finding.slides):
            problems.add(slide.at(kind), f"{kind} {name!r} is already on an earlier slide: change it with a ::try line")
    equation = finding.labelled.get(slide.equation)
    if equation is not None:  # without its sentence's punctuation
        equation = Formula(SENTENCE.sub(r"\1", equation.source), True)
        finding.formulas.append(FormulaUse(equation, lambda offset: slide.at("equation")))
    figure = finding.figures.get(slide.figure)
    for line in (located(token, Directive) for token in slide.text if token.type == "try"):
        button = finding.button_of.get(line)
        if button is not None and button.figure is not figure:
            problems.add(line.place, "a slide's button can set only the slide's own figure")
    return Staged(
        slide,
        equation,
        figure,
        _set(finding, figure, slide, problems) if figure else None,
        finding.plots.get(slide.plot),
    )


def _set(finding: _Finding, figure: Figure, slide: Slide, problems: Problems) -> Record:
    """The state of a slide's figure: the chapter's own, or as changed by `set`, which is then added to the tape."""
    controls = specs(figure.widget.controls)
    for i, name in enumerate(slide.controls):
        if name not in controls:
            problems.add(slide.at("controls", i), f"{figure.widget.name} has no control {name!r}{hint(name, controls)}")
    if not slide.set:
        return figure.record
    directive = Directive("set", "", slide.set, 0, 0, 0, len(slide.set))

    def at(offset: int) -> Place:
        return slide.text_at("set", offset)

    attributes = listed(directive, at, problems) or []
    bare(attributes, 0, at, problems)
    record = changed(figure.widget, figure.record, [a for a in attributes if a.name], at, problems)
    finding.set.setdefault(figure.id, []).append(record)
    return record
