"""A first pass over a parsed chapter: numbers, anchors, figures, formulas, all that other chapters may refer to.

What is found is noted on the tokens' meta, so that rendering only looks it up. A chapter may be surveyed again: what is
noted then is the same.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field

from markdown_it.token import Token
from markupsafe import Markup

from sitegen.chapters.content import Chapter
from sitegen.chapters.placing import changed, id_of, listed, placed
from sitegen.chapters.plot_placing import placed as placed_plot
from sitegen.chapters.promises import HOLDS, OWN, TESTED, Promise, promise, tell_unheld
from sitegen.chapters.slides import Slide
from sitegen.figures.gallery import Placed, Plot
from sitegen.figures.model import Figure
from sitegen.markup.directives import Attribute, Directive
from sitegen.markup.math import Asked, Formula
from sitegen.markup.parser import ANCHOR, ascii_slug, text_of
from sitegen.problems import Place, Problems, hint
from widgets.engine.contract import Record, Widget
from widgets.engine.controls import specs

# Ids that the templates and the figures give; no heading may have them.
OWN_IDS = ("main", "cite-this-page", "notebook", "slides")
OWN_PREFIXES = ("fig-", "eq-", "note-", "noteref-", "claim-", "card-")
SENTENCE = re.compile(r"\s*[.,]((?:\s*\\end\{\w+\})*)\s*$")
LINKS = ("link_open", "claim_open", "cite", "ref", "term", "footnote_ref")


@dataclass(frozen=True)
class Heading:
    """A heading with its anchor, for the table of contents and for references."""

    level: int
    id: str
    tokens: list[Token]


@dataclass(frozen=True)
class Staged:
    """A slide with what it shows of its chapter; `record` is the state that its figure stands in."""

    slide: Slide
    equation: Formula | None = None
    figure: Figure | None = None
    record: Record | None = None
    plot: Placed | None = None


@dataclass
class Survey:
    """What a chapter holds. `notes`: footnote label → number; `equations`: label → number, `labelled`: → formula."""

    chapter: Chapter
    anchors: dict[str, Place] = field(default_factory=dict)
    headings: list[Heading] = field(default_factory=list)
    figures: dict[str, Figure] = field(default_factory=dict)
    plots: dict[str, Placed] = field(default_factory=dict)
    equations: dict[str, str] = field(default_factory=dict)
    notes: dict[str, int] = field(default_factory=dict)
    labelled: dict[str, Formula] = field(default_factory=dict)
    formulas: list[Asked] = field(default_factory=list)
    slides: list[Staged] = field(default_factory=list)
    promises: list[Promise] = field(default_factory=list)
    lost: set[str] = field(default_factory=set)
    """Figures and equations ("fig:id", "eq:label") that are named and could not be made: that is told once."""


@dataclass(frozen=True)
class Outline:
    """What other chapters may say of a chapter: plain data, so that it can be told whether any of it has changed.

    numbered: figures and plots by id, `equations` by label, each with its element's id and number; headings: the text
    of a link to each, by anchor; lost: see Survey.
    """

    file: str
    page: str
    deck: str
    slug: str
    name: str
    title: str
    numbered: Mapping[str, tuple[str, str]]
    equations: Mapping[str, tuple[str, str]]
    headings: Mapping[str, Markup]
    lost: frozenset[str]


def outline(found: Survey, headings: Mapping[str, Markup]) -> Outline:
    """The outline of a chapter, its headings rendered."""
    chapter = found.chapter
    shown: dict[str, Figure | Placed] = {**found.plots, **found.figures}
    return Outline(
        chapter.source.path,
        chapter.page,
        chapter.deck,
        chapter.slug,
        chapter.name,
        chapter.title,
        {name: (one.dom_id, f"Figure {one.number}") for name, one in shown.items()},
        {label: (f"eq-{label}", f"({number})") for label, number in found.equations.items()},
        headings,
        frozenset(found.lost),
    )


def survey(chapter: Chapter, widgets: Mapping[str, Widget], plots: Mapping[str, Plot], problems: Problems) -> Survey:
    """The chapter's survey; what is wrong in itself goes to `problems`."""
    found = Survey(chapter, lost=set(chapter.document.lost))
    flow = chapter.document.tokens
    _notes(found, problems)
    for i, token in enumerate(flow):
        match token.type:
            case "heading_open":
                _heading(found, token, flow[i + 1], problems)
            case "figure":
                _figure(found, token, widgets, problems)
            case "plot":
                _plot(found, token, plots, problems)
    _within(found, [*flow, *(t for tokens in chapter.document.footnotes.values() for t in tokens)], problems)
    for slide in chapter.slides:
        shown, lost = found.figures.get(slide.figure), f"fig:{slide.figure}" in found.lost
        _within(found, [*slide.title, *slide.text, *slide.notes], problems, shown, lost)
        found.slides.append(_staged(found, slide, problems))
    return found


def _within(
    found: Survey, tokens: list[Token], problems: Problems, shown: Figure | None = None, lost: bool = False
) -> None:
    """The formulas of some text, its buttons and its promises, for which the chapter's figures must be known.

    shown: the figure that the text stands beside, if it does; lost: it stands beside one whose faults are told.
    """
    for token in tokens:
        if token.type in ("math_block", "math_block_label"):
            _equation(found, token, problems)
        for child in token.children or []:
            if child.type == "math_inline":
                formula = Formula(child.content, False)
                child.meta["formula"] = formula
                found.formulas.append(Asked(formula, _shifted(child)))
    for token in tokens:
        if token.type == "try":
            _try(found, token, problems)
        own = token.meta["figure"] if token.type == "figure" else shown
        for child in token.children or []:
            if child.type == "promise_open":
                _promise(found, child, own, lost or (token.type == "figure" and own is None), problems)
        if token.type in ("figure", "plot", "try", "aside") and not token.children:
            problems.add(token.meta["place"], f"::{token.type} has no text")


def inline(tokens: Iterable[Token]) -> Iterator[Token]:
    """All inline tokens, those of headings, cells and captions among them."""
    for token in tokens:
        yield from token.children or []


def _shifted(token: Token) -> Callable[[int], Place]:
    """From offsets inside an inline formula to places."""
    at, offset = token.meta["at"], token.meta["offset"]
    return lambda inside: at(offset + 1 + inside)


def _anchor(found: Survey, name: str, place: Place, what: str, problems: Problems) -> None:
    if name in found.anchors:
        problems.add(place, f"{what} stands twice in this chapter (first in line {found.anchors[name].line})")
    found.anchors.setdefault(name, place)


def _heading(found: Survey, token: Token, content: Token, problems: Problems) -> None:
    level, place = int(token.tag[1]), token.meta["place"]
    if level == 1:
        problems.add(place, "the chapter's title stands in its front matter: headings begin with ##")
    before = found.headings[-1].level if found.headings else 1
    if level > before + 1:
        problems.add(place, f"a heading of level {level} after one of level {before}: a level is left out")
    name = token.meta.get("id") or ""
    if name and _is_own(name):
        problems.add(place, f"the anchor {name!r} is one that the page gives itself")
    elif not name:
        base = ascii_slug(text_of(content.children or []))
        base = name = f"section-{base}" if _is_own(base) else base
        count = 1
        while name in found.anchors:
            count += 1
            name = f"{base}-{count}"
    _anchor(found, name, place, f"the anchor {name!r}", problems)
    token.meta["id"] = name
    found.headings.append(Heading(level, name, content.children or []))


def _is_own(name: str) -> bool:
    return name in OWN_IDS or name.startswith(OWN_PREFIXES)


def _figure(found: Survey, token: Token, widgets: Mapping[str, Widget], problems: Problems) -> None:
    figure = placed(token.meta["directive"], token.meta["at"], _next(found), widgets, problems)
    token.meta["figure"] = figure
    _unheld(token, problems)
    if figure is not None:
        _anchor(found, figure.dom_id, figure.place, f"the figure {figure.id!r}", problems)
        found.figures.setdefault(figure.id, figure)
    else:
        found.lost.add(f"fig:{id_of(token.meta['directive'])}")


def _plot(found: Survey, token: Token, plots: Mapping[str, Plot], problems: Problems) -> None:
    plot = placed_plot(token.meta["directive"], token.meta["at"], _next(found), plots, problems)
    token.meta["plot"] = plot
    _unheld(token, problems, TESTED)
    if plot is not None:
        _anchor(found, plot.dom_id, plot.place, f"the figure {plot.id!r}", problems)
        found.plots.setdefault(plot.id, plot)
    else:
        found.lost.add(f"fig:{id_of(token.meta['directive'])}")


def _next(found: Survey) -> str:
    """The number of the next figure: one series for live ones and plots."""
    return found.chapter.numbered(len(found.figures) + len(found.plots) + 1)


def _equation(found: Survey, token: Token, problems: Problems) -> None:
    source = token.content
    lead = len(source) - len(source.lstrip())
    formula = Formula(source.strip(), True)
    at = token.meta["at"]
    token.meta["formula"] = formula
    found.formulas.append(Asked(formula, lambda inside: at(lead + inside)))
    if token.type == "math_block_label":
        label, place = token.info, token.meta["label_place"]
        if not ANCHOR.fullmatch(label):
            problems.add(place, f"{label!r} is no label: small letters, digits and hyphens, a letter first")
        _anchor(found, f"eq-{label}", place, f"the equation {label!r}", problems)
        number = found.chapter.numbered(len(found.equations) + 1)
        token.meta["number"] = found.equations.setdefault(label, number)
        found.labelled.setdefault(label, formula)


def _notes(found: Survey, problems: Problems) -> None:
    """Number the footnotes in the order of their first references."""
    document = found.chapter.document
    places = {}
    for child in inline(document.tokens):
        if child.type != "footnote_ref":
            continue
        label = child.meta["label"]
        if label not in document.footnotes:
            problems.add(child.meta["place"], f"no footnote [^{label}]{hint(label, document.footnotes)}")
        elif label not in found.notes:
            found.notes[label] = len(found.notes) + 1
            places[label] = child.meta["place"]
            child.meta["first"] = True
    for label, tokens in document.footnotes.items():
        for child in inline(tokens):
            if child.type == "footnote_ref":
                problems.add(child.meta["place"], "a footnote cannot refer to a footnote")
        if label not in found.notes:
            line = next((t.map[0] + 1 for t in tokens if t.map), 1)
            problems.add(Place(found.chapter.source.path, line, 1), f"footnote [^{label}] is never referred to")
    for label, number in found.notes.items():
        _anchor(found, f"note-{number}", places[label], f"the note {label!r}", problems)


def figure_of(found: Survey, given: list[Attribute], token: Token, problems: Problems) -> Figure | None:
    """The figure that a directive's first bare word names; None, and a problem, where there is none."""
    at = token.meta["at"]
    bare = [a for a in given if not a.name]
    for extra in bare[1:]:
        problems.add(at(extra.start), f"name=value is expected, not {extra.value!r}")
    if not bare:
        problems.add(at(token.meta["directive"].attributes_start), "a figure's id is expected first: {solve noise=0.2}")
        return None
    figure = found.figures.get(bare[0].value)
    if figure is None and f"fig:{bare[0].value}" not in found.lost:
        problems.add(
            at(bare[0].start), f"no figure {bare[0].value!r} in this chapter{hint(bare[0].value, found.figures)}"
        )
    return figure


def _promise(found: Survey, token: Token, figure: Figure | None, lost: bool, problems: Problems) -> None:
    """What is promised of a figure: the one that is named, or else the text's own, of which nothing is said if lost."""
    directive, at = token.meta["directive"], token.meta["at"]
    token.meta.pop("promise", None)  # of an earlier survey
    given = listed(directive, at, problems)
    if given is not None and not (all(a.name for a in given) and (figure or lost)):
        figure = figure_of(found, given, token, problems)
    if given is None or figure is None:
        return
    promised = promise(figure, directive, given, at, problems)
    if promised is None:
        problems.add(at(directive.start), 'a promise says what holds: {figure press=finish expect="rms < 0.1"}')
    else:
        token.meta["promise"] = promised
        found.promises.append(promised)


def _unheld(token: Token, problems: Problems, held: str = HOLDS) -> None:
    directive, at = token.meta["directive"], token.meta["at"]
    tell_unheld(directive.text, lambda offset: at(directive.text_start + offset), problems, held)


def _try(found: Survey, token: Token, problems: Problems) -> None:
    at = token.meta["at"]
    for name in ("record", "promise"):  # of an earlier survey
        token.meta.pop(name, None)
    given = listed(token.meta["directive"], at, problems)
    figure = None if given is None else figure_of(found, given, token, problems)
    for child in token.children or []:
        if child.type in LINKS:
            problems.add(child.meta.get("place", token.meta["place"]), "a button's text holds no links")
    if figure is not None and given is not None:
        set_by = [a for a in given if a.name and a.name not in OWN]
        record = changed(figure.widget, figure.record, set_by, at, problems, OWN)
        figure.remember(record)
        token.meta["figure"], token.meta["record"] = figure, record
        promised = promise(figure, token.meta["directive"], given, at, problems)
        if promised is not None:
            token.meta["promise"] = promised
            found.promises.append(promised)
        elif not any(a.name in OWN for a in given):
            _unheld(token, problems)


def _staged(found: Survey, slide: Slide, problems: Problems) -> Staged:
    """The slide with the things of the chapter that it names; what it names wrongly goes to `problems`."""
    shown: dict[str, Iterable[str]] = {"equation": found.labelled, "figure": found.figures, "plot": found.plots}
    for what, known in shown.items():
        name = getattr(slide, what)
        if name and name not in known and f"{'eq' if what == 'equation' else 'fig'}:{name}" not in found.lost:
            problems.add(slide.at(what), f"no {what} {name!r} in this chapter{hint(name, known)}")
        if name and what != "equation" and any(getattr(before.slide, what) == name for before in found.slides):
            problems.add(slide.at(what), f"the {what} {name!r} stands on a slide before: a ::try line sets it anew")
    equation = found.labelled.get(slide.equation)
    if equation is not None:  # without what ends it in a sentence
        equation = Formula(SENTENCE.sub(r"\1", equation.source), True)
        found.formulas.append(Asked(equation, lambda inside: slide.at("equation")))
    figure = found.figures.get(slide.figure)
    for token in slide.text:
        if token.type == "try" and token.meta.get("figure") not in (None, figure):
            problems.add(token.meta["place"], "a slide's button sets the slide's own figure")
    return Staged(
        slide,
        equation,
        figure,
        _set(figure, slide, problems) if figure else None,
        found.plots.get(slide.plot),
    )


def _set(figure: Figure, slide: Slide, problems: Problems) -> Record:
    """The state of a slide's figure: the chapter's own, or what `set` makes of it, which the tape then has as well."""
    known = specs(figure.widget.controls)
    for i, name in enumerate(slide.controls):
        if name not in known:
            problems.add(slide.at("controls", i), f"{figure.widget.name} has no control {name!r}{hint(name, known)}")
    if not slide.set:
        return figure.record
    written = Directive("set", "", slide.set, 0, 0, 0, len(slide.set))

    def at(offset: int) -> Place:
        return slide.text_at("set", offset)

    given = listed(written, at, problems) or []
    for extra in (a for a in given if not a.name):
        problems.add(at(extra.start), f"name=value is expected, not {extra.value!r}")
    record = changed(figure.widget, figure.record, [a for a in given if a.name], at, problems)
    figure.remember(record)
    return record
