"""What the parser notes on tokens: the things of ours that they stand for, each with its place in the file.

Nobody else reads or writes a token's `meta`, and once a file is parsed nobody writes there at all: what is found out
about a token later stands elsewhere, under what is noted here.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Generic, TypeVar

from markdown_it.token import Token

from sitegen.problems import Place

NOTED = "noted"  # our key in `meta`, beside those of markdown-it's plugins
T = TypeVar("T")
T_co = TypeVar("T_co", covariant=True)


@dataclass(frozen=True)
class Anchor:
    """The anchor that a heading gives itself, "" where it leaves that to us."""

    name: str


@dataclass(frozen=True)
class Work:
    """A work that a citation names. offset: of its key in the line."""

    key: str
    locator: str
    offset: int


@dataclass(frozen=True)
class Citation:
    """The works that stand in one pair of brackets."""

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
    """What is wrong here."""

    message: str


@dataclass(frozen=True, eq=False)
class Located(Generic[T_co]):
    """A thing and where it stands. at: from offsets in what it was read from to places; offset: its own.

    Two are never equal: each is the key of its own token.
    """

    thing: T_co
    place: Place
    at: Callable[[int], Place]
    offset: int


@dataclass(frozen=True)
class InLine:
    """A thing in a line of text whose place in the file is not known yet. offset: in the line."""

    thing: object
    offset: int


@dataclass(frozen=True)
class TextStart:
    """Where in the file the text of a block directive begins."""

    offset: int


def note(token: Token, remark: Located[object] | InLine | TextStart) -> None:
    """Note something on a token, in the place of what was noted before."""
    token.meta[NOTED] = remark


def noted(token: Token, kind: type[T]) -> T | None:
    """What is noted on a token, if it is of this kind."""
    remark = token.meta.get(NOTED)
    return remark if isinstance(remark, kind) else None


def place_of(token: Token) -> Place | None:
    """The place of a token, where it is known."""
    remark = noted(token, Located)
    return remark.place if remark else None


def located(token: Token, kind: type[T]) -> Located[T]:
    """The thing of this kind that a token stands for, with its place. `object` stands for whatever it is."""
    remark = noted(token, Located)
    if remark is None or not isinstance(remark.thing, kind):
        raise TypeError(f"a token {token.type!r} stands for no {kind.__name__}")
    return remark


def footnote_label(token: Token) -> str:
    """The label of a footnote's definition or reference, as markdown-it's plugin has it."""
    return str(token.meta["label"])
