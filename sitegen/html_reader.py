"""HTML that we wrote, read for its elements and its text; what html5lib says of it is for the checks.

Every element that opens is closed, in order: a void one at once, one without its end tag with what it stands in or at
the end of the page. An end tag that closes nothing is passed over.
"""

from __future__ import annotations

from collections.abc import Mapping
from html.parser import HTMLParser
from typing import NamedTuple, Protocol

VOID = frozenset(
    ("area", "base", "br", "col", "embed", "hr", "img", "input", "link", "meta", "param", "source", "track", "wbr")
)


class Tag(NamedTuple):
    """A start tag: its attributes (no value is ""), line and column from 1. Made by the thousand."""

    name: str
    attributes: Mapping[str, str]
    line: int
    column: int

    def get(self, name: str) -> str:
        """An attribute's value, "" where there is none."""
        return self.attributes.get(name, "")


class Reader(Protocol):
    """What is told of a page. Events made into a list would take twice the time."""

    def opened(self, tag: Tag) -> None:
        """An element begins."""

    def closed(self, tag: Tag) -> None:
        """The element of this very tag ends."""

    def text(self, text: str) -> None:
        """A piece of text, its entities read; what stands in scripts and styles comes as it is."""


def read(html: str, reader: Reader) -> None:
    """Tell the reader what stands in a page, in order."""
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
        if self.open and self.open[-1].name == tag:  # as nearly all are
            self.reader.closed(self.open.pop())
        elif any(element.name == tag for element in self.open):
            while (element := self.open.pop()).name != tag:
                self.reader.closed(element)
            self.reader.closed(element)

    def handle_data(self, data: str) -> None:
        self.reader.text(data)
