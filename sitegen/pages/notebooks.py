"""A chapter → a Jupyter notebook: its text as Markdown, its figures as pictures with the Python that computes them.

The chapter's Markdown is kept as its author wrote it, formulas as LaTeX; only our extensions are translated:
directives, citations, references, side notes. Pictures are images in Markdown cells, since Jupyter shows neither an
attached SVG nor, before a notebook is trusted, an SVG in a cell's output.
"""

from __future__ import annotations

import html
import json
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache as once
from functools import partial
from pathlib import Path
from textwrap import dedent
from typing import Any

from markdown_it.token import Token

from sitegen.assets.tokens import TOKENS
from sitegen.cache.files import fingerprint
from sitegen.cache.memory import Memory
from sitegen.cache.store import Store
from sitegen.chapters.citations import Reference
from sitegen.chapters.content import Chapter, Site
from sitegen.chapters.leads import BAR, halves
from sitegen.chapters.pictures import drawn
from sitegen.chapters.render import pieces
from sitegen.chapters.render_context import RenderContext
from sitegen.chapters.rendered import Body
from sitegen.chapters.surveyed import Survey
from sitegen.figures.gallery import Drawn, Placed
from sitegen.figures.model import Figure
from sitegen.figures.wire import Plain
from sitegen.markup.directives import Directive
from sitegen.markup.located import Citation, NoteMark, located
from sitegen.markup.parser import blocks
from sitegen.markup.places import HEADING_ID
from sitegen.pages.portable_svg import SHEETS, data_address, standalone
from sitegen.problems import Place
from widgets.engine.script import WHEEL

Cell = tuple[str, str]  # "markdown" or "code", and its text
_ANCHOR = re.compile(r'<a [^>]*?href="([^"]*)"[^>]*>(.*?)</a>', re.DOTALL)
_ARGUMENT = r"\s*(\{(?:[^{}]|\{(?:[^{}]|\{[^{}]*\})*\})*\}|\\(?:[A-Za-z]+|.)|[^\s{}])"  # braces up to three deep
_BRACKET = re.compile(r"\\.|`[^`]*`|[\[\]]", re.DOTALL)  # or what may contain one that does not count
_LABEL = re.compile(r"\[[^\]]*\]")
_NOTE = re.compile(r"\[\^[^\]]*\]:\s*")


@dataclass(frozen=True)
class NotebookInputs:
    """What notebooks need from the build. context: gives what a chapter's rendering looks up; frame: the first frame of
    a page's figure; drawn: a plot's drawings.

    wheel: the path of our package on the site.
    """

    site: Site
    references: Mapping[str, Reference]
    wheel: str
    context: Callable[[Survey], RenderContext]
    frame: Callable[[str, Figure], Plain]
    drawn: Callable[[Placed], Drawn]


def name_of(chapter: Chapter) -> str:
    """The path of a chapter's notebook on the site."""
    return f"notebooks/{chapter.slug}.ipynb"


def notebook(survey: Survey, cited: Sequence[str], inputs: NotebookInputs) -> bytes:
    """The chapter's notebook, byte for byte reproducible. cited: keys of the works that it cites, in order."""
    writer = _Writer(survey, inputs)
    references = [inputs.references[key] for key in cited]
    cells = [*writer.head(), *writer.body(), *([("markdown", _bibliography(references))] if references else [])]
    return written(_merge(cells))


def written(cells: Sequence[Cell]) -> bytes:
    """The cells as a notebook of format 4.5."""
    entries: list[dict[str, Any]] = []
    for i, (kind, text) in enumerate(cells):
        cell: dict[str, Any] = {"cell_type": kind, "id": f"cell-{i}", "metadata": {}, "source": text.strip("\n")}
        entries.append({**cell, "execution_count": None, "outputs": []} if kind == "code" else cell)
    metadata = {
        "kernelspec": {"display_name": "Python 3", "language": "python", "name": "python3"},
        "language_info": {"name": "python"},
    }
    whole = {"cells": entries, "metadata": metadata, "nbformat": 4, "nbformat_minor": 5}
    return (json.dumps(whole, ensure_ascii=False, indent=1, sort_keys=True) + "\n").encode()


def _merge(cells: Sequence[Cell]) -> list[Cell]:
    """Merge consecutive Markdown cells, up to the next heading or code."""
    result: list[Cell] = []
    for kind, text in cells:
        follows = kind == "markdown" and result and result[-1][0] == kind and not text.startswith(("#", "<a id="))
        if follows:
            result[-1] = (kind, f"{result[-1][1]}\n\n{text}")
        else:
            result.append((kind, text))
    return result


class _Writer:
    def __init__(self, survey: Survey, inputs: NotebookInputs) -> None:
        self._survey, self._inputs = survey, inputs
        self._source = survey.chapter.source
        self._context = inputs.context(survey)
        self._html = pieces(survey, self._context).inline
        self._base = inputs.site.url or "../"

    def head(self) -> Iterator[Cell]:
        """Yield the title, the source, and how to install the imported package."""
        chapter, site = self._survey.chapter, self._inputs.site
        question = f"*{chapter.question}*\n\n" if chapter.question else ""
        yield (
            "markdown",
            f"# {chapter.title}\n\n{question}"
            f"A chapter of [{site.title}]({self._base}index.html), as a notebook: its text, its figures as first"
            " shown, and the Python that computes their numbers. The figures can be moved by hand on"
            f" [its page]({self._base}{chapter.page}).\n\n"
            f"The cells import numpy and the site's own package, [{WHEEL}]({self._base}{self._inputs.wheel}): save that"
            " file beside this notebook and take the mark off the next line.\n\n"
            f"By {site.author}, {site.year}. Text and figures: [{site.licence}]({site.licence_url}).",
        )
        yield "code", f"# %pip install {WHEEL}"

    def body(self) -> Iterator[Cell]:
        """Yield the chapter's blocks in order, each followed by the side notes that it is the first to refer to."""
        flow = self._survey.chapter.document.tokens
        for block in blocks([token for token in flow if not token.type.startswith("container_")]):
            yield from self._block(block)
            for label in self._survey.first_notes(block):
                yield "markdown", self._note(label)

    def _block(self, block: Sequence[Token]) -> Iterator[Cell]:
        first = block[0]
        match first.type:
            case "figure" if figure := self._survey.figure(first):
                yield from self._figure(first, figure)
            case "plot" if plot := self._survey.plot(first):
                yield from self._plot(first, plot)
            case "picture" if picture := self._survey.picture(first):
                panels, words = drawn(picture, self._context) or ((), "")
                images = [_image(panel["svg"], panel["view"][4], panel["view"][5], words) for panel in panels]
                yield "markdown", f"{' '.join(images)}\n\n*{self._directive(first)}*"
            case "fence" if first.info.split()[:1] == ["python"]:
                yield "code", first.content
            case "try" if button := self._survey.button(first):
                way = f"[Figure {button.figure.number}]({self._address('#' + button.figure.dom_id)})"
                yield "markdown", f"- To try on the page, in {way}: {self._directive(first)}"
            case "predict":
                yield "markdown", f"> Before you run it: {self._directive(first).replace(' | ', ' · ')}"
            case "aside":
                yield "markdown", f"> {self._directive(first)}"
            case "math_block" | "math_block_label":
                number = self._survey.number(first)
                tag = f"\n\\tag{{{number}}}" if number else ""
                yield "markdown", f"$$\n{self._expand(first.content.strip())}{tag}\n$$"
            case _ if first.map is not None:
                text = self._lines(first.map[0], first.map[1], block)
                yield "markdown", HEADING_ID.sub("", text) if first.type == "heading_open" else text
            case _:
                raise ValueError(f"{self._source.path}: a block {first.type!r} without its place")

    def _figure(self, token: Token, figure: Figure) -> Iterator[Cell]:
        frame = self._inputs.frame(self._survey.chapter.name, figure)
        pictures = [
            _image(panel["svg"], panel["view"][4], panel["view"][5], _alternative(frame, panel), panel["caption"])
            for panel in frame["panels"]
        ]
        readouts = "; ".join(f"{r['label']}: {_readout_text(r)}" for r in frame["readouts"] if r["value"] != "–")
        title = f"**[Figure {figure.number}]({self._address('#' + figure.dom_id)}).** {self._caption(token)}"
        yield "markdown", f"{title}\n\n{' '.join(pictures)}\n\n{readouts}."
        if frame["python"]:
            yield "code", frame["python"]

    def _plot(self, token: Token, plot: Placed) -> Iterator[Cell]:
        drawing = self._inputs.drawn(plot)
        width, height = plot.plot.sizes["wide"]
        picture = _image(drawing.svgs["wide"], width, height, plot.plot.title)
        title = f"**[Figure {plot.number}]({self._address('#' + plot.dom_id)}).** {self._directive(token)}"
        yield "markdown", f"{title}\n\n{picture}\n\n{drawing.words}"

    def _note(self, label: str) -> str:
        """A side note, taken from its place elsewhere in the file."""
        tokens = self._survey.chapter.document.footnotes[label]
        spans = [token.map for token in tokens if token.map]
        text = self._lines(min(a for a, _ in spans), max(b for _, b in spans), tokens)
        note = dedent(_NOTE.sub("    ", text, count=1) if text.startswith("[^") else text)
        return "\n".join(f"> {line}".rstrip() for line in f"<sup>{self._survey.notes[label]}</sup> {note}".split("\n"))

    def _directive(self, token: Token) -> str:
        """The text of a block directive."""
        directive = located(token, Directive).thing
        end = directive.text_start + len(directive.text)
        return " ".join(self._splice(directive.text_start, end, token.children or []).split("\n"))

    def _caption(self, token: Token) -> str:
        """A figure's caption without the bar after its leading sentence."""
        text, (sentence, _) = self._directive(token), halves(token.children or [])
        earlier = sum(child.content.count(BAR) for child in sentence)  # in code, formulas and emphasis
        *before, after = text.split(BAR, earlier + 1)
        return f"{BAR.join(before)} {after}" if sentence else text

    def _lines(self, first: int, last: int, tokens: Sequence[Token]) -> str:
        """Whole lines of the file, in plain Markdown."""
        end = self._source.starts[last] if last < len(self._source.starts) else len(self._source.text)
        inline = [child for token in tokens for child in token.children or []]
        return self._splice(self._source.starts[first], end, inline).strip("\n")

    def _splice(self, start: int, end: int, tokens: Sequence[Token]) -> str:
        """A piece of the file with our extensions replaced by plain Markdown."""
        edits = sorted(edit for token in tokens for edit in self._edits(token))
        parts, at = [], start
        for first, last, text in edits:
            parts += [self._source.text[at:first], text]
            at = last
        return self._expand("".join([*parts, self._source.text[at:end]]))

    def _edits(self, token: Token) -> Iterator[tuple[int, int, str]]:
        """Yield the replacements for a token: start and end in the file, and the new text."""
        match token.type:
            case "value" | "readout" | "ref" | "term":
                line = located(token, Directive)
                end = self._offset(line.at(line.thing.end))
                yield self._offset(line.place), end, self._plain([token])
            case "claim_open" | "promise_open":
                line = located(token, Directive)
                directive = line.thing
                text_end = directive.text_start + len(directive.text)
                yield self._offset(line.place), self._offset(line.at(directive.text_start)), ""
                # Counted from the end of the text, since the directive's own end may be the end of a line.
                tail = self._offset(line.at(text_end))
                yield tail, tail + directive.end - text_end, ""
            case "cite":
                first = self._offset(located(token, Citation).place)
                yield first, self._source.text.index("]", first) + 1, self._plain([token])
            case "footnote_ref":
                mark = located(token, NoteMark)
                first = self._offset(mark.place)
                number = self._survey.notes[mark.thing.label]
                yield first, self._source.text.index("]", first) + 1, f"<sup>{number}</sup>"
            case "link_open" | "image":
                link = located(token, object)
                first = self._offset(link.at(link.offset))
                target = re.compile(r"[^\s)]+").match(self._source.text, first)
                address = re.search(r'(?:href|src)="([^"]*)"', self._html([token]))
                href = self._address(html.unescape(address[1])) if address else ""
                if href and target is not None and self._source.text[first - 2 : first] == "](":
                    yield first, target.end(), href
                elif href and self._source.text.startswith(("[", "!["), first):  # [words][name]: its line is left out
                    end = _words_end(self._source.text, first)
                    label = _LABEL.match(self._source.text, end)
                    yield end, label.end() if label else end, f"({href})"

    def _plain(self, tokens: Sequence[Token]) -> str:
        """Tokens as the page shows them, in Markdown: links and plain text."""
        text = _ANCHOR.sub(lambda m: f"[{m[2]}]({self._address(html.unescape(m[1]))})", self._html(tokens))
        return html.unescape(re.sub(r"<[^>]*>", "", text))

    def _offset(self, place: Place) -> int:
        return self._source.starts[place.line - 1] + place.column - 1

    def _address(self, href: str) -> str:
        """A link target of the page, adapted for the notebook."""
        if re.match(r"[a-z]+:", href):
            return href
        return self._base + (self._survey.chapter.page if href.startswith("#") else "") + href

    def _expand(self, text: str) -> str:
        """The text with the site's macros expanded, since Jupyter does not know them; one may use another."""
        macros = self._inputs.site.macros
        for _ in macros:
            for macro, meaning in macros.items():
                count = max(map(int, re.findall(r"#([1-9])", meaning)), default=0)
                text = re.sub(re.escape(macro) + r"(?![A-Za-z])" + _ARGUMENT * count, partial(_filled, meaning), text)
        return text


def _filled(meaning: str, use: re.Match[str]) -> str:
    """A macro's meaning with the arguments of a use of it, in their braces."""
    return re.sub(r"#([1-9])", lambda at: use[int(at[1])], meaning)


def _words_end(text: str, start: int) -> int:
    """Where the brackets around the words of the link or image at `start` end."""
    depth = 0
    for match in _BRACKET.finditer(text, start):
        depth += {"[": 1, "]": -1}.get(match[0], 0)
        if match[0] == "]" and depth == 0:
            return match.end()
    return len(text)


def _readout_text(readout: Plain) -> str:
    """A readout's value with its unit; no space before °."""
    return f"{readout['value']}{'' if readout['unit'] == '°' else ' '}{readout['unit']}".strip()


def _alternative(frame: Plain, panel: Plain) -> str:
    """The alternative text of a panel: the figure's description for the first one, its label for the others."""
    label = re.search(r'aria-label="([^"]*)"', panel["svg"])
    return str(frame["description"]) if panel is frame["panels"][0] or label is None else html.unescape(label[1])


def _image(svg: str, width: float, height: float, words: str, caption: str = "") -> str:
    address = data_address(standalone(svg, width, height, caption))
    return f'<img alt="{html.escape(words)}" width="{width:g}" src="{address}">'


def _bibliography(references: Sequence[Reference]) -> str:
    lines = []
    for reference in references:
        title = f"[{reference.title}]({reference.link})" if reference.link else reference.title
        venue = f" {reference.venue.rstrip('.')}." if reference.venue else ""
        end = "" if reference.title[-1] in ".?!" else "."
        lines.append(f"- {', '.join(reference.authors)} ({reference.year}{reference.letter}). {title}{end}{venue}")
    return "## References\n\n" + "\n".join(lines)


def notebooks(
    surveys: Sequence[Survey], bodies: Sequence[Body], inputs: NotebookInputs, cache: Path, memory: Memory
) -> dict[str, bytes]:
    """Every chapter's notebook by its path on the site, cached by its inputs. bodies: the rendered chapters."""
    store = Store(cache, "notebooks")
    files = {}
    for survey, body in zip(surveys, bodies, strict=True):
        make = partial(notebook, survey, body.cited, inputs)
        works = [inputs.references[key] for key in body.cited]
        key = memory.answer(
            ("notebook", survey.chapter.source.path),
            (survey, body, works, inputs.site, inputs.wheel),
            partial(_inputs_hash, survey, body, inputs),
        )
        files[name_of(survey.chapter)] = store.get(key, make)
    return files


def _inputs_hash(survey: Survey, body: Body, inputs: NotebookInputs) -> str:
    """The hash of a notebook's inputs: the chapter as written and as rendered, which includes all that comes from
    elsewhere (numbers, references, drawings with their words and Python), the cited works, the site, and this code."""
    chapter = survey.chapter
    works = [repr(inputs.references[key]) for key in body.cited]
    heading = [chapter.title, chapter.question, chapter.page, chapter.slug]
    notes = [inputs.site, inputs.wheel, *heading, survey.notes, works]
    parts = [("source", chapter.source.text), ("html", body.html), ("notes", repr(notes)), ("code", _code())]
    return fingerprint((name, text.encode()) for name, text in parts)


@once
def _code() -> str:
    """The hash of the code that writes notebooks and of the styles that it inlines in pictures."""
    folder = Path(__file__).parent
    files = [folder / "notebooks.py", folder / "portable_svg.py", TOKENS, *SHEETS]
    return fingerprint((path.name, path.read_bytes()) for path in files)
