"""A fast reader for HTML that we wrote: reports elements and text. Strict parsing with html5lib is left to the checks.

Every opened element is closed, in order: a void element at once, one without an end tag together with its parent or at
the end of the page. An end tag that closes nothing is ignored.
"""

from __future__ import annotations

from collections.abc import Mapping
from html.parser import HTMLParser
from typing import NamedTuple, Protocol

VOID = frozenset(
    ("area", "base", "br", "col", "embed", "hr", "img", "input", "link", "meta", "param", "source", "track", "wbr")
)


class Tag(NamedTuple):
    """A start tag: its attributes ("" for those without a value), line and column from 1. Created by the thousand."""

    name: str
    attributes: Mapping[str, str]
    line: int
    column: int

    def get(self, name: str) -> str:
        """The attribute's value; "" if it is missing."""
        return self.attributes.get(name, "")


class Reader(Protocol):
    """Callbacks for the events of a page. Collecting the events in a list would take twice the time."""

    def opened(self, tag: Tag) -> None:
        """Called when an element begins."""

    def closed(self, tag: Tag) -> None:
        """Called when an element ends, with the same object that `opened` received."""

    def text(self, text: str) -> None:
        """Called for each piece of text, with entities decoded; scripts and styles are passed on verbatim."""


def read(html: str, reader: Reader) -> None:
    """Report the elements and text of a page to the reader, in order."""
    parser = _Parser(reader)
    parser.feed(html)
    parser.close()
    while parser.open:
        reader.closed(parser.open.pop())


class _Parser(HTMLParser):
    def __init__(self, reader: Reader) -> None:
        super().__init__(convert_charrefs=True)
        self.reader = reader
        self.open: list[Tag] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        line, column = self.getpos()
        element = Tag(tag, {name: value or "" for name, value in attrs} if attrs else {}, line, column + 1)
        self.reader.opened(element)
        if tag in VOID:
            self.reader.closed(element)
        else:
            self.open.append(element)

    def handle_endtag(self, tag: str) -> None:
        if self.open and self.open[-1].name == tag:  # the usual case
            self.reader.closed(self.open.pop())
        elif any(element.name == tag for element in self.open):
            while (element := self.open.pop()).name != tag:
                self.reader.closed(element)
            self.reader.closed(element)

    def handle_data(self, data: str) -> None:
        self.reader.text(data)
