"""Tokens → a chapter's HTML, with everything that it takes from other chapters, references, tests and figures."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import groupby, takewhile
from pathlib import Path
from urllib.parse import unquote

from markdown_it.common.utils import escapeHtml
from markdown_it.renderer import RendererHTML
from markdown_it.token import Token
from markupsafe import Markup, escape

from sitegen.chapters.citations import NAME as REFERENCES
from sitegen.chapters.claims import anchor, kind_of, lacking, standing, test_of, unknown
from sitegen.chapters.glossary import NAME as GLOSSARY
from sitegen.chapters.glossary import named
from sitegen.chapters.leads import halves
from sitegen.chapters.links import Links, state_of
from sitegen.chapters.pictures import drawn
from sitegen.chapters.placing import bare, changed, listed
from sitegen.chapters.predictions import judged
from sitegen.chapters.promises import hold
from sitegen.chapters.render_context import RenderContext
from sitegen.chapters.rendered import Body, Claim
from sitegen.chapters.surveyed import Heading, Survey
from sitegen.chapters.tokens import closing, directive_of, opening, simple, words
from sitegen.chapters.values import CallError, printed, read_value
from sitegen.figures.wire import attribute
from sitegen.markup.code import highlighted
from sitegen.markup.directives import Directive
from sitegen.markup.images import Image, read_image
from sitegen.markup.located import Citation, NoteMark, located
from sitegen.markup.math import formula_of
from sitegen.markup.parser import blocks, parser, text_of, unbroken
from sitegen.markup.slips import CONTAINERS
from sitegen.markup.typography import apostrophes, whole_options
from sitegen.problems import Place, hint


def render(survey: Survey, context: RenderContext) -> Body:
    """Render the chapter's body; faults go to context.problems."""
    return _Renderer(survey, context).body()


def headings(survey: Survey, context: RenderContext) -> dict[str, Markup]:
    """The text of links to the chapter's headings, by anchor. They hold no links, so no other chapter is needed."""
    renderer = _Renderer(survey, context)
    return {heading.id: renderer.heading(heading) for heading in reversed(survey.headings)}  # the first of two wins


@dataclass(frozen=True)
class Pieces:
    """Renders pieces of a chapter apart from its body. found: what they have cited, marked and shown so far."""

    found: Callable[[], Body]
    flow: Callable[[Sequence[Token]], Markup]
    inline: Callable[[Sequence[Token]], Markup]


def pieces(survey: Survey, context: RenderContext, page: str = "") -> Pieces:
    """A renderer of pieces, for the chapter's page or another one; faults go to context.problems."""
    renderer = _Renderer(survey, context, page)
    return Pieces(lambda: renderer.found(Markup()), renderer.flow, lambda tokens: Markup(renderer._inline(tokens)))


class _Renderer:
    """Renders parts of a chapter for one page: the chapter's own, or its deck if `page` names that."""

    def __init__(self, survey: Survey, context: RenderContext, page: str = "") -> None:
        self._survey, self._context = survey, context
        self._chapter = survey.chapter
        self._problems = context.problems
        self._cited: list[str] = []
        self._terms: list[str] = []
        self._claims: list[Claim] = []
        self._images: list[Image] = []
        page = page or survey.chapter.page
        self._links = Links(
            page, survey.chapter.page, context.chapters, context.drafts, context.pages, context.problems
        )
        self._html = RendererHTML(parser())
        self._options = parser().options
        rules = {
            "text": lambda token: escapeHtml(unbroken(token.content)),
            "code_inline": lambda token: f"<code>{whole_options(token.content)}</code>",
            "heading_open": self._heading_open,
            "heading_close": self._heading_close,
            "fence": self._fence,
            "code_block": self._fence,
            "table_open": lambda token: '<div class="table" tabindex="0">\n<table>\n',
            "table_close": lambda token: "</table>\n</div>\n",
            "math_inline": lambda token: self._context.mathematics.mathml[formula_of(token)],
            "math_block": self._equation,
            "math_block_label": self._equation,
            "image": self._image,
            "link_open": self._link_open,
            "footnote_ref": self._note_reference,
            "figure": self._figure,
            "plot": self._plot,
            "picture": self._picture,
            "predict": lambda token: "",  # its figure shows the question
            "try": self._try,
            "aside": lambda token: f'<div class="aside" role="note"><p>{self._inline(token.children)}</p></div>\n',
            "value": self._value,
            "readout": self._readout,
            "promise_open": self._promise,
            "promise_close": lambda token: "",
            "claim_close": self._claim_close,
            "ref": self._ref,
            "cite": self._cite,
            "term": self._term,
        }
        for name in CONTAINERS:  # within a list or a quotation
            rules[f"container_{name}_open"] = lambda token: opening(token.info.strip())
            rules[f"container_{name}_close"] = lambda token: closing(token.type.split("_")[1])
        for name, rule in rules.items():
            self._html.rules[name] = simple(rule)  # type: ignore[assignment]
        self._html.rules["claim_open"] = self._claim_open  # type: ignore[assignment]

    def body(self) -> Body:
        html = self.flow(self._chapter.document.tokens)
        sections = [heading for heading in self._survey.headings if heading.level in (2, 3)]
        contents = tuple((heading.level, heading.id, self.heading(heading)) for heading in sections)
        return replace(self.found(html, contents), onward=self._links.onward(self._chapter.onward))

    def found(self, html: Markup, contents: tuple[tuple[int, str, Markup], ...] = ()) -> Body:
        """A body with everything cited, marked, claimed and shown so far."""
        return Body(html, contents, tuple(self._cited), tuple(self._terms), tuple(self._claims), tuple(self._images))

    def heading(self, heading: Heading) -> Markup:
        """A heading's text without links."""
        return words(self._inline, heading.tokens)

    def flow(self, tokens: Sequence[Token]) -> Markup:
        """Render top-level blocks; consecutive buttons become a list."""
        parts: list[str] = []
        for tries, group in groupby(blocks(tokens), lambda block: block[0].type == "try"):
            if tries:
                items = "".join(f"<li>{self._blocks(block)}</li>\n" for block in group)
                parts.append(f'<ul class="tries">\n{items}</ul>\n')
            else:
                for b in group:
                    parts.append(self._container(b) if b[0].type.startswith("container_") else self._with_notes(b))
        return Markup("".join(parts))

    def _container(self, block: Sequence[Token]) -> str:
        """Render a container, from `:::name` to `:::`; an example also shows its source."""
        (first, last), name = block[0].map or (0, 0), block[0].info.strip()
        content = self.flow(block[1:-1])
        if name == "example":
            source = escape("\n".join(self._chapter.source.lines[first + 1 : last]))
            code = f'<pre class="code" tabindex="0"><code>{source}</code></pre>'
            content = Markup(f'{code}\n<div class="example-result">\n{content}</div>\n')
        return f"{opening(name)}{content}{closing(name)}"

    def _with_notes(self, block: Sequence[Token]) -> str:
        """Render a block, with the notes that it is the first to refer to beside it."""
        html = self._blocks(block)
        notes = "".join(map(self._note, self._survey.first_notes(block)))
        return f'<div class="noted">\n{html}<div class="notes">\n{notes}</div>\n</div>\n' if notes else html

    def _blocks(self, tokens: Sequence[Token]) -> str:
        return str(self._html.render(tokens, self._options, {}))

    def _inline(self, tokens: Sequence[Token] | None) -> str:
        return str(self._html.renderInline(tokens or [], self._options, {}))

    def _heading_open(self, token: Token) -> str:
        return f'<{token.tag} id="{escape(self._survey.anchor(token))}">'

    def _heading_close(self, token: Token) -> str:
        return f"</{token.tag}>\n"

    def _fence(self, token: Token) -> str:
        language = token.info.split()[0] if token.info.strip() else ""
        try:
            code = highlighted(token.content, language)
        except ValueError as error:
            self._problems.add(located(token, object).place, str(error))
            return ""
        return f'<pre class="code" tabindex="0"><code>{code}</code></pre>\n'

    def _equation(self, token: Token) -> str:
        mathml = self._context.mathematics.mathml[formula_of(token)]
        number = self._survey.number(token)
        if not number:
            return f'<div class="equation"><div class="formula">{mathml}</div></div>\n'
        name = f"eq-{token.info}"
        return (
            f'<div class="equation numbered" id="{escape(name)}"><div class="formula">{mathml}</div>'
            f'<a class="equation-number" href="#{escape(name)}">({escape(number)})</a></div>\n'
        )

    def _image(self, token: Token) -> str:
        place, source = located(token, object).place, unquote(str(token.attrs["src"]))
        alt = apostrophes(text_of(token.children or []).strip())
        if not alt:
            self._problems.add(place, f"missing alternative text: ![what it shows]({source})")
        path = Path(self._context.root, "content", source)
        folder = (self._context.root / "content").resolve()
        if "://" in source or folder not in path.resolve().parents or not path.is_file():
            home = self._context.root / "content"
            files = [p.relative_to(home).as_posix() for p in home.rglob("*")]
            self._problems.add(
                place, f"image not found: content/{source}{hint(source, [f for f in files if not f.endswith('.md')])}"
            )
            return ""
        try:
            image = read_image(path)
        except ValueError as error:
            self._problems.add(place, str(error))
            return ""
        self._images.append(image)
        title = f' title="{escape(token.attrs["title"])}"' if "title" in token.attrs else ""
        size = f'width="{image.width}" height="{image.height}"'
        return f'<img src="{escape(image.name)}" alt="{escape(alt)}"{title} {size} loading="lazy" decoding="async">'

    def _link_open(self, token: Token) -> str:
        href = self._links.target(str(token.attrs["href"]), located(token, object).place)
        title = f' title="{escape(token.attrs["title"])}"' if "title" in token.attrs else ""
        return f'<a href="{escape(href)}"{title}>'

    def _note_reference(self, token: Token) -> str:
        number = self._survey.notes.get(located(token, NoteMark).thing.label, 0)
        name = f' id="noteref-{number}"' if self._survey.is_first(token) else ""
        return f'<sup class="note-mark"><a href="#note-{number}"{name} aria-label="Note {number}">{number}</a></sup>'

    def _note(self, label: str) -> str:
        number = self._survey.notes[label]
        link_label = f"Back to the text from note {number}"
        back = f'<a class="note-number" href="#noteref-{number}" aria-label="{link_label}">{number}</a>'
        tokens = self._chapter.document.footnotes[label]
        return f'<div class="note" role="note" id="note-{number}">{back}\n{self._blocks(tokens)}</div>\n'

    def _figure(self, token: Token) -> str:
        figure = self._survey.figure(token)
        sentence, caption = (Markup(self._inline(half)) for half in halves(token.children or []))
        if figure is None:
            return ""
        question = judged(self._survey.predictions.get(figure.id), self._context, self._inline)
        return str(self._context.figure_html(figure, sentence, caption, question))

    def _plot(self, token: Token) -> str:
        plot = self._survey.plot(token)
        return "" if plot is None else str(self._context.plot_html(plot, Markup(self._inline(token.children))))

    def _picture(self, token: Token) -> str:
        picture, caption = self._survey.picture(token), Markup(self._inline(token.children))
        drawing = drawn(picture, self._context) if picture else None
        return str(self._context.picture_html(*drawing, caption)) if drawing else ""

    def _try(self, token: Token) -> str:
        text = self._inline(token.children)
        button = self._survey.button(token)
        if button is None:
            return ""
        self._promise(token)
        dom_id = escape(button.figure.dom_id)
        record = attribute(button.record.plain())
        return f'<button type="button" class="try" data-figure="{dom_id}" data-record={record}>{text}</button>'

    def _promise(self, token: Token) -> str:
        """Check a promise; the page shows only its text."""
        promise = self._survey.promise(token)
        if promise is not None:
            hold(promise, self._context.readouts, self._problems)
        return ""

    def _value(self, token: Token) -> str:
        directive, at = directive_of(token)
        try:
            value = read_value(directive.text)
            number = value if isinstance(value, float) else self._context.values.value(value)
        except CallError as error:
            self._problems.add(at(directive.text_start + error.offset), str(error))
            return ""
        try:
            text = printed(number, directive.attributes.strip())
        except ValueError as error:
            self._problems.add(at(directive.attributes_start), f"invalid format {directive.attributes!r}: {error}")
            return ""
        return f'<span class="computed">{escape(text)}</span>'

    def _readout(self, token: Token) -> str:
        directive, at = directive_of(token)
        words = [(word, directive.text.index(word)) for word in directive.text.split()]
        if len(words) != 2:
            self._problems.add(at(directive.text_start), "expected :readout[figure readout]{changes}")
            return ""
        (figure_id, figure_at), (name, _) = words
        name_at = directive.text.rindex(name)
        figure = self._survey.figures.get(figure_id)
        if figure is None and f"fig:{figure_id}" not in self._survey.lost:
            place = at(directive.text_start + figure_at)
            suggestion = hint(figure_id, self._survey.figures)
            self._problems.add(place, f"unknown figure {figure_id!r} in this chapter{suggestion}")
            return ""
        attributes = listed(directive, at, self._problems)
        if figure is None or attributes is None:
            return ""
        bare(attributes, 0, at, self._problems)
        record = changed(figure.widget, figure.record, [a for a in attributes if a.name], at, self._problems)
        readouts = self._context.readouts(figure, record.plain())
        if name in readouts:
            return f'<span class="computed">{escape(readouts[name])}</span>'
        if readouts:
            self._problems.add(at(directive.text_start + name_at), f"unknown readout {name!r}{hint(name, readouts)}")
        return ""

    def _claim_open(self, tokens: Sequence[Token], idx: int, options: object, env: object) -> str:
        token = tokens[idx]
        directive, at = directive_of(token)
        test_id, kind = test_of(directive), kind_of(directive, at, self._problems)
        lead = len(directive.attributes) - len(directive.attributes.lstrip())
        if test_id not in self._context.tests:
            place = at(directive.attributes_start + lead)
            self._problems.add(place, unknown(test_id, self._context.tests))
        else:
            self._hold(test_id, kind, at(directive.attributes_start + lead))
        number = len(self._claims) + 1
        inner = list(takewhile(lambda t: t.type != "claim_close", tokens[idx + 1 :]))
        claim = Claim(words(self._inline, inner), test_id, f"claim-{number}", kind)
        self._claims.append(claim)
        return f'<span class="claim" id="claim-{number}">'

    def _hold(self, test_id: str, kind: str, place: Place) -> None:
        """Check that a claim's test has a docstring for readers and, for a cause, records the effect of its change."""
        test = self._context.tests[test_id]
        if not test.doc:
            self._problems.warn(place, f"{test_id} needs a docstring that tells readers what it checks")
        if kind and (lacks := lacking(test, self._context.results.get(test_id))):
            self._problems.add(place, lacks)

    def _claim_close(self, token: Token) -> str:
        number = len(self._claims)
        claim = self._claims[-1]
        state = standing(self._context.results.get(claim.test_id))
        label = {"passed": "checked", "failed": "check failed", "unknown": "check not yet run on this code"}[state]
        if claim.kind and state == "passed":
            label = "checked by changing this one thing"
        return (  # contains a word joiner, so that it never begins a line
            f'<a class="claim-mark" data-outcome="{state}" href="{self._chapter.checks}#{anchor(claim.test_id)}" '
            f'title="{label}: see how" aria-label="Claim {number}, {label}: see how">&#8288;</a></span>'
        )

    def _ref(self, token: Token) -> str:
        directive, at = directive_of(token)
        name = directive.text.strip()
        link = self._links.reference(name, at(directive.text_start), self._state(name, directive, at))
        return str(link)

    def _state(self, name: str, directive: Directive, at: Callable[[int], Place]) -> str:
        """The suffix of a link to a figure in a named state, "" without one; faults are reported."""
        attributes = listed(directive, at, self._problems) or []
        kind, _, figure_id = name.partition(":")
        figure = self._links.placed(figure_id) if attributes and kind == "fig" else None
        if figure is None:
            if attributes and (kind != "fig" or figure_id in self._survey.plots):
                self._problems.add(at(attributes[0].start), "only a figure has a state: :ref[fig:id]{press=finish}")
            return ""
        bare(attributes, 0, at, self._problems)
        widget, record = figure
        return state_of(record, changed(widget, record, [a for a in attributes if a.name], at, self._problems))

    def _cite(self, token: Token) -> str:
        parts = []
        citation = located(token, Citation)
        for work in citation.thing.works:
            reference = self._context.references.get(work.key)
            if reference is None:
                suggestion = hint(work.key, self._context.references)
                message, has_references = f"unknown reference {work.key!r}{suggestion}", bool(self._context.references)
                self._problems.lacks(REFERENCES, citation.at(work.offset), message, has_references)
                continue
            if work.key not in self._cited:
                self._cited.append(work.key)
            locator = f", {escape(work.locator)}" if work.locator else ""
            attributes = f'class="cite" href="references.html#ref-{work.key}" data-card="card-{work.key}"'
            parts.append(f"<a {attributes}>{escape(reference.label)}</a>{locator}")
        return f'<span class="cites">({"; ".join(parts)})</span>'

    def _term(self, token: Token) -> str:
        directive, at = directive_of(token)
        key = directive.attributes.strip()
        term = named(directive.text, key, self._context.terms)
        if term is None:
            place = at(directive.attributes_start if key else directive.text_start)
            name = key or directive.text
            message = f"unknown glossary term {name!r}{hint(name, self._context.terms)}"
            self._problems.lacks(GLOSSARY, place, message, bool(self._context.terms))
            return escapeHtml(directive.text)
        if term.key not in self._terms:
            self._terms.append(term.key)
        attributes = f'class="term" href="glossary.html#{term.anchor}" data-card="card-{term.anchor}"'
        return f"<a {attributes}>{escape(unbroken(apostrophes(directive.text)))}</a>"
