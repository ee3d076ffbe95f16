"""What the rendering of a chapter gives to the pages: its text, and all that they list of it elsewhere."""

from __future__ import annotations

from dataclasses import dataclass

from markupsafe import Markup

from sitegen.markup.images import Image


@dataclass(frozen=True)
class Claim:
    """A claim in a chapter: its sentence, the test that checks it, and its kind, "why" where it tells a cause."""

    html: Markup
    test_id: str
    anchor: str
    kind: str = ""


@dataclass(frozen=True)
class Body:
    """A rendered chapter: its text, its contents (level, id, HTML), cited keys, marked terms, claims, images."""

    html: Markup
    contents: tuple[tuple[int, str, Markup], ...]
    cited: tuple[str, ...]
    terms: tuple[str, ...]
    claims: tuple[Claim, ...]
    images: tuple[Image, ...]
