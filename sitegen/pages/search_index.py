"""Pages → the search data: one entry per section, with its page, heading, anchor and text.

The index itself is built in the page, by the search library, when a reader first searches.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path

from sitegen.cache.memo import Remembered
from sitegen.cache.memory import Memory
from sitegen.chapters.content import FIXED_PAGES
from sitegen.external.fetch import gather
from sitegen.figures.wire import dumps
from sitegen.html_reader import Tag, read

FORMAT = "1"  # of the cached entries; raised when the extraction changes
LEFT_OUT = tuple(fixed.page for fixed in FIXED_PAGES if not fixed.searched)
HEADINGS = ("h1", "h2", "h3")
# Text that is found elsewhere or is not prose: cards, code in figures, controls, drawings, formulas, script data.
SILENT = ("script", "style", "svg", "math", "form", "nav", "button", "select", "template", "dialog", "details")
SILENT_CLASSES = ("card", "figure-stage", "buttons", "readouts", "legend", "job", "runs", "chapter-footer", "pager")
ENTRY_IDS = ("term-", "ref-")  # entries of the glossary and of the references are sections of their own
BLOCKS = ("p", "li", "dt", "dd", "td", "th", "figcaption", "div", "section", "pre", "tr", "blockquote")


def library(cache: Path) -> bytes:
    """The search library, unchanged except for the line that names its source map, which the site lacks."""
    script = gather(["minisearch"], cache=cache)["minisearch/dist/umd/index.js"].read_bytes()
    return script.partition(b"//# sourceMappingURL")[0]


@dataclass
class Section:
    """One search entry. `at` is the address relative to the site; `page` the title of its page."""

    at: str
    page: str
    heading: str = ""
    parts: list[str] = field(default_factory=list)

    @property
    def text(self) -> str:
        """Its text, in one line."""
        return " ".join("".join(self.parts).split())


def search_data(pages: Mapping[str, str], cache: Path, memory: Memory | None = None) -> bytes:
    """The script that hands the page all sections, each as [address, page, heading, text]."""
    memo, memory = Remembered(cache, f"search-{FORMAT}"), memory or Memory()

    def entries(name: str, html: str) -> str:
        return dumps(memo.answer(f"{name}\0{html}", partial(_entries, name, html)))[1:-1]

    parts = [memory.answer(("sections", name), html, partial(entries, name, html)) for name, html in pages.items()]
    memo.keep()
    return f"Ladder.searchable([{','.join(filter(None, parts))}]);\n".encode()


def _entries(name: str, html: str) -> list[list[str]]:
    parts = sections(name, html) if _is_searched(name) else []
    return [[part.at, part.page, part.heading, part.text] for part in parts if part.heading or part.text]


def _is_searched(name: str) -> bool:
    """Whether a page is searched; slides and checks repeat their chapters, so they are not."""
    return name not in LEFT_OUT and not name.startswith(("slides-", "checks-"))


def sections(name: str, html: str) -> list[Section]:
    """The sections of a page, in order; none for a page that only redirects."""
    reader = _Reader(name)
    read(html, reader)
    for section in reader.sections:
        section.heading = " ".join(section.heading.split())
        section.page = reader.title or section.heading
    return reader.sections


class _Reader:
    """Reads <main>: a heading or an entry's id begins a section, and silent elements are skipped."""

    def __init__(self, name: str) -> None:
        self.name = name
        self.title = ""
        self.sections: list[Section] = []
        self._main: Tag | None = None
        self._silent: Tag | None = None  # the outermost silent element around
        self._heading: Tag | None = None  # the heading or the term that is being read

    def opened(self, tag: Tag) -> None:
        if self._main is None:
            self._main = tag if tag.name == "main" else None
            return
        if self._silent is not None:
            return
        classes, anchor = tag.get("class").split(), tag.get("id")
        if tag.name in SILENT or set(classes) & set(SILENT_CLASSES) or "hidden" in tag.attributes:
            self._silent = tag
        elif tag.name in HEADINGS:
            self._begin("" if tag.name == "h1" else anchor)
            self._heading = tag
        elif anchor.startswith(ENTRY_IDS):
            self._begin(anchor)
        elif tag.name == "dt" and self.sections and not self.sections[-1].heading:
            self._heading = tag
        elif tag.name in BLOCKS or tag.name == "br":
            self._say(" ")

    def closed(self, tag: Tag) -> None:
        if self._main is None:
            return
        if tag is self._main:
            self._main = None
        if tag is self._silent:
            self._silent = None
        if tag is self._heading:
            self._heading = None
            if tag.name == "h1":
                self.title = " ".join(self.sections[-1].heading.split())
        if tag.name in BLOCKS:
            self._say(" ")

    def text(self, text: str) -> None:
        if self._main is None or self._silent is not None:
            return
        if self._heading is not None:
            self.sections[-1].heading += text
        else:
            self._say(text)

    def _begin(self, anchor: str) -> None:
        self.sections.append(Section(self.name + (f"#{anchor}" if anchor else ""), ""))

    def _say(self, text: str) -> None:
        if self.sections and not self._heading:
            self.sections[-1].parts.append(text)
