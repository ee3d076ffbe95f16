"""What the rendering of a chapter gives to the pages: its text, and all that they list of it elsewhere."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from markupsafe import Markup

from sitegen.figures.wire import Plain
from sitegen.markup.images import Image


@dataclass(frozen=True)
class Claim:
    """A claim in a chapter: its sentence, the test that checks it, and its kind, "why" where it tells a cause."""

    html: Markup
    test_id: str
    anchor: str
    kind: str = ""


@dataclass(frozen=True)
class Question:
    """What the page asks. answers: each with whether it is right; record: what the run comes to; within: how near, in
    u, a ghost has to be placed, 0 where none is asked for."""

    text: Markup
    answers: Sequence[tuple[Markup, bool]]
    record: Plain
    within: float


@dataclass(frozen=True)
class Step:
    """A place to go from a chapter's end: the link, what stands over it (rung and chapter), and the reason."""

    link: Markup
    over: str
    says: str


@dataclass(frozen=True)
class Body:
    """A rendered chapter: its text, its contents (level, id, HTML), cited keys, marked terms, claims, images, and where
    to go from its end."""

    html: Markup
    contents: tuple[tuple[int, str, Markup], ...]
    cited: tuple[str, ...]
    terms: tuple[str, ...]
    claims: tuple[Claim, ...]
    images: tuple[Image, ...]
    onward: tuple[Step, ...] = ()
