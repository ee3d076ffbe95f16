"""All that rendering looks things up in."""

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
class Known:
    """All that rendering looks things up in. pages: name → anchors, None where any will do; drafts: not built.

    Of two that are equal a chapter is rendered alike: what is not compared gives the same for the same code, pictures
    and chapter. mathematics: of the chapter's own formulas.
    """

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
    frames: Callable[[Figure, Sequence[Plain]], list[Plain]] = field(compare=False)
    readouts: Callable[[Figure, Plain], Mapping[str, str]] = field(compare=False)
    figure_html: Callable[[Figure, Markup, Markup, Question | None], Markup] = field(compare=False)
    plot_html: Callable[[Placed, Markup], Markup] = field(compare=False)
    picture_html: Callable[[Sequence[Plain], str, Markup], Markup] = field(compare=False)
    problems: Problems = field(compare=False)
