"""The result of rendering a chapter: its text, and everything about it that pages list elsewhere."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from markupsafe import Markup

from sitegen.figures.wire import Plain
from sitegen.markup.images import Image


@dataclass(frozen=True)
class Claim:
    """A claim in a chapter: its sentence, the test that checks it, and its kind, "why" if it states a cause."""

    html: Markup
    test_id: str
    anchor: str
    kind: str = ""


@dataclass(frozen=True)
class Question:
    """A question on the page. answers: each with whether it is right; record: the state at the end of the run; within:
    how close, in u, a ghost has to be placed, 0 if there is none to place."""

    text: Markup
    answers: Sequence[tuple[Markup, bool]]
    record: Plain
    within: float


@dataclass(frozen=True)
class Step:
    """A link at a chapter's end, the line above it (rung and chapter), and the reason to go there."""

    link: Markup
    over: str
    says: str


@dataclass(frozen=True)
class Body:
    """A rendered chapter: its text, its table of contents (level, id, HTML), cited keys, marked terms, claims, images,
    and the links at its end."""

    html: Markup
    contents: tuple[tuple[int, str, Markup], ...]
    cited: tuple[str, ...]
    terms: tuple[str, ...]
    claims: tuple[Claim, ...]
    images: tuple[Image, ...]
    onward: tuple[Step, ...] = ()
