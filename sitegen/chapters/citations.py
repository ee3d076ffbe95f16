"""Citations: the file of references, author-year links, and the text of cards and of the bibliography."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

from markupsafe import Markup

from sitegen.cache.memory import Memory
from sitegen.chapters import yaml_schema
from sitegen.markup.typography import apostrophes
from sitegen.problems import Place, Problems, read_text

NAME = "content/references.yaml"
FIELDS = {
    "authors": yaml_schema.Field(
        "a list of names",
        lambda v: isinstance(v, list) and bool(v) and all(isinstance(n, str) and n for n in v),
        required=True,
    ),
    "title": yaml_schema.plain(required=True),
    "year": yaml_schema.year(required=True),
    "venue": yaml_schema.plain(),
    "doi": yaml_schema.Field(
        "a DOI like 10.1109/34.88573",
        lambda v: isinstance(v, str) and bool(re.match(r"10\.\d{4,}/\S+$", v)),
        default="",
    ),
    "url": yaml_schema.Field(
        "an http or https URL", lambda v: isinstance(v, str) and bool(re.match(r"https?://\S+$", v)), default=""
    ),
    "note": yaml_schema.plain(),
}
PARTICLES = {"van", "von", "der", "den", "de", "del", "della", "di", "da", "la", "le", "ter", "ten"}
SUFFIXES = {"Jr.", "Sr.", "Jr", "Sr", "II", "III"}


@dataclass(frozen=True)
class Reference:
    """One work. `letter` distinguishes works of the same authors and year."""

    key: str
    authors: tuple[str, ...]
    title: str
    year: int
    venue: str
    doi: str
    url: str
    note: str
    place: Place
    letter: str = ""

    @property
    def link(self) -> str:
        """The work's address: its DOI, or else its URL."""
        return f"https://doi.org/{self.doi}" if self.doi else self.url

    @property
    def label(self) -> str:
        """Author and year, as shown in a citation."""
        names = [family_name(name) for name in self.authors]
        authors = f"{names[0]} et al." if len(names) > 2 else " and ".join(names)
        return f"{authors} {self.year}{self.letter}"

    @property
    def html(self) -> Markup:
        """The complete entry: authors, year, title, venue, link."""
        title = Markup("<cite>{}</cite>").format(apostrophes(self.title))
        if self.link:
            title = Markup('<a href="{}">{}</a>').format(self.link, title)
        end = "" if self.title[-1] in ".?!" else "."
        venue = Markup(" {}.").format(self.venue.rstrip(".")) if self.venue else Markup("")
        return Markup('<span class="authors">{}</span> ({}{}). {}{}{}').format(
            people(self.authors), self.year, self.letter, title, end, venue
        )


def family_name(name: str) -> str:
    """The family name with its particles: 'Hans van der Berg' → 'van der Berg'."""
    words = name.split()
    while len(words) > 1 and words[-1] in SUFFIXES:
        words.pop()
    first = len(words) - 1
    while first > 1 and words[first - 1].lower() in PARTICLES:
        first -= 1
    return " ".join(words[first:])


def people(names: Iterable[str]) -> str:
    """Join names: 'A, B and C'."""
    authors = list(names)
    return authors[0] if len(authors) == 1 else f"{', '.join(authors[:-1])} and {authors[-1]}"


def read_references(root: Path, problems: Problems, memory: Memory | None = None) -> dict[str, Reference]:
    """Read the references, by key and in bibliography order; faults go to `problems`."""
    path = root / "content" / "references.yaml"
    if not path.is_file():
        return {}
    text = read_text(path, NAME, problems)
    return (memory or Memory()).told("references", text, problems, partial(_references, text))


def _references(text: str, problems: Problems) -> dict[str, Reference]:
    document, keys = yaml_schema.entries(text, NAME, "references", problems)
    if document is None:
        return {}
    references = []
    for key in keys:
        count = len(problems.found)
        values = yaml_schema.validated(document, FIELDS, problems, key)
        if not values["doi"] and not values["url"] and len(problems.found) == count:
            problems.warn(document.at(key), f"{key}: missing doi or url")
        values |= {"authors": tuple(values["authors"] or "?"), "year": values["year"] or 0}  # if faulty, which is told
        references.append(Reference(key=str(key), place=document.at(key), **values))
    return {reference.key: reference for reference in _with_letters(references)}


def _with_letters(references: list[Reference]) -> list[Reference]:
    """Sort by authors, year and title, and add letters where labels would be equal."""
    order = sorted(references, key=lambda r: ([family_name(a).lower() for a in r.authors], r.year, r.title))
    counts: dict[str, int] = {}
    for reference in order:
        counts[reference.label] = counts.get(reference.label, 0) + 1
    so_far: dict[str, int] = {}
    result = []
    for reference in order:
        label = reference.label
        so_far[label] = so_far.get(label, 0) + 1
        letter = chr(ord("a") + so_far[label] - 1) if counts[label] > 1 else ""
        result.append(replace(reference, letter=letter))
    return result


def unused(references: Mapping[str, Reference], keys: Iterable[str]) -> list[Reference]:
    """The references that no chapter cites."""
    cited = set(keys)
    return [reference for key, reference in references.items() if key not in cited]
