"""The parser's notes on tokens: the objects of ours that they stand for, each with its place in the file.

Only this module accesses a token's `meta`, and nothing is written there once a file is parsed: what is found out about
a token later is stored elsewhere, keyed by the note.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Generic, TypeVar

from markdown_it.token import Token

from sitegen.problems import Place

NOTED = "noted"  # our key in `meta`, next to those of markdown-it's plugins
T = TypeVar("T")
T_co = TypeVar("T_co", covariant=True)


@dataclass(frozen=True)
class Anchor:
    """The explicit anchor of a heading; "" if it has none and we choose one."""

    name: str


@dataclass(frozen=True)
class Work:
    """A work in a citation. offset: of its key in the line."""

    key: str
    locator: str
    offset: int


@dataclass(frozen=True)
class Citation:
    """The works in one pair of brackets."""

    works: tuple[Work, ...]


@dataclass(frozen=True)
class NoteMark:
    """A reference to a footnote."""

    label: str


@dataclass(frozen=True)
class EquationLabel:
    """A numbered equation's label, which is the token's `info`. place: of the label."""

    place: Place


@dataclass(frozen=True)
class Fault:
    """A problem at this place."""

    message: str


@dataclass(frozen=True, eq=False)
class Located(Generic[T_co]):
    """A thing and its place. at: maps offsets in the text it was read from to places; offset: its own.

    No two are equal: each serves as the key for its token.
    """

    thing: T_co
    place: Place
    at: Callable[[int], Place]
    offset: int


@dataclass(frozen=True)
class InLine:
    """A thing in a line of text whose place in the file is not yet known. offset: in the line."""

    thing: object
    offset: int


@dataclass(frozen=True)
class TextStart:
    """The offset in the file at which the text of a block directive begins."""

    offset: int


def note(token: Token, remark: Located[object] | InLine | TextStart) -> None:
    """Note something on a token, replacing an earlier note."""
    token.meta[NOTED] = remark


def noted(token: Token, kind: type[T]) -> T | None:
    """The note on a token, if it is of this kind."""
    remark = token.meta.get(NOTED)
    return remark if isinstance(remark, kind) else None


def place_of(token: Token) -> Place | None:
    """The place of a token; None if unknown."""
    remark = noted(token, Located)
    return remark.place if remark else None


def located(token: Token, kind: type[T]) -> Located[T]:
    """The thing that a token stands for, with its place. Raises TypeError unless it is of this kind (`object`: any)."""
    remark = noted(token, Located)
    if remark is None or not isinstance(remark.thing, kind):
        raise TypeError(f"token {token.type!r} does not stand for a {kind.__name__}")
    return remark


def footnote_label(token: Token) -> str:
    """The label of a footnote's definition or reference, as set by markdown-it's plugin."""
    return str(token.meta["label"])
