"""What rendering looks up: for the whole site, and for one chapter."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from markupsafe import Markup

from sitegen.chapters.citations import Reference
from sitegen.chapters.claims import Result, Test
from sitegen.chapters.glossary import Term
from sitegen.chapters.rendered import Question
from sitegen.chapters.surveyed import Outline
from sitegen.chapters.values import Values
from sitegen.figures.gallery import Placed
from sitegen.figures.model import Figure
from sitegen.figures.wire import Plain
from sitegen.markup.math import Mathematics
from sitegen.problems import Problems


@dataclass(frozen=True)
class SiteContext:
    """What the rendering of any chapter may look up. pages: name → anchors, None if any is accepted; drafts: those not
    built."""

    root: Path
    chapters: Sequence[Outline]
    drafts: Sequence[Outline]
    pages: Mapping[str, Collection[str] | None]
    references: Mapping[str, Reference]
    terms: Mapping[str, Term]
    tests: Mapping[str, Test]
    results: Mapping[str, Result]
    mathematics: Mathematics
    values: Values = field(compare=False)
    problems: Problems = field(compare=False)


@dataclass(frozen=True)
class RenderContext(SiteContext):
    """The same for one chapter, with its own formulas only, and what draws its figures, plots and pictures.

    Equal objects give the same rendering of a chapter: fields that are not compared return the same results for the
    same code, pictures and chapter.
    """

    frames: Callable[[Figure, Sequence[Plain]], list[Plain]] = field(compare=False)
    readouts: Callable[[Figure, Plain], Mapping[str, str]] = field(compare=False)
    figure_html: Callable[[Figure, Markup, Markup, Question | None], Markup] = field(compare=False)
    plot_html: Callable[[Placed, Markup], Markup] = field(compare=False)
    picture_html: Callable[[Sequence[Plain], str, Markup], Markup] = field(compare=False)
