"""All that rendering looks things up in."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from markupsafe import Markup

from .cite import Reference
from .claims import Result, Test
from .computed import Values
from .figures import Figure, Plain
from .glossary import Term
from .maths import Mathematics
from .plotting import Placed
from .problems import Problems
from .survey import Outline


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
    figure_html: Callable[[Figure, Markup], Markup] = field(compare=False)
    plot_html: Callable[[Placed, Markup], Markup] = field(compare=False)
    problems: Problems = field(compare=False)
