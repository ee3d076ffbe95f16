"""The glossary: one file of terms, each with its definition and the chapter that explains it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from sitegen.cache.memory import Memory
from sitegen.chapters import yaml_schema
from sitegen.chapters.content import Chapter, is_draft
from sitegen.markup.parser import ascii_slug
from sitegen.problems import Place, Problems, hint, read_text

NAME = "content/glossary.yaml"
FIELDS = {
    "term": yaml_schema.plain(required=True),
    "says": yaml_schema.plain(required=True),
    "chapter": yaml_schema.text(required=True),
    "also": yaml_schema.texts(),
}


@dataclass(frozen=True)
class Term:
    """One term. `page` and `title`: the chapter that explains it."""

    key: str
    term: str
    says: str
    also: tuple[str, ...]
    page: str
    title: str
    place: Place

    @property
    def anchor(self) -> str:
        """The id of its entry; with the prefix `card-`, that of its card."""
        return f"term-{self.key}"


def read_glossary(
    root: Path,
    chapters: Sequence[Chapter],
    drafts: Sequence[Chapter],
    problems: Problems,
    memory: Memory | None = None,
) -> dict[str, Term]:
    """Read the terms, by key and in alphabetical order; faults go to `problems`. drafts: those that are left out."""
    path = root / "content" / "glossary.yaml"
    if not path.is_file():
        return {}
    text = read_text(path, NAME, problems)
    pages = {chapter.slug: (chapter.page, chapter.title) for chapter in chapters}
    left_out = {draft.slug: draft.source.path for draft in drafts}
    make = partial(_terms, text, pages, left_out)
    return (memory or Memory()).told("glossary", (text, pages, left_out), problems, make)


def _terms(
    text: str, chapters: Mapping[str, tuple[str, str]], drafts: Mapping[str, str], problems: Problems
) -> dict[str, Term]:
    document, keys = yaml_schema.entries(text, NAME, "terms", problems)
    if document is None:
        return {}
    terms = []
    for key in keys:
        values = yaml_schema.validated(document, FIELDS, problems, key)
        name = values["chapter"]
        if name and name not in chapters:
            draft = drafts.get(name)
            message = is_draft(repr(name), draft) if draft else f"unknown chapter {name!r}{hint(name, chapters)}"
            problems.add(document.at(key, "chapter"), message)
        page, title = chapters.get(name, ("", ""))  # a faulty term keeps its name
        words = values["term"], values["says"], tuple(values["also"])
        terms.append(Term(str(key), *words, page, title, document.at(key)))
    return {term.key: term for term in sorted(terms, key=lambda term: ascii_slug(term.term))}


def named(words: str, key: str, terms: Mapping[str, Term]) -> Term | None:
    """The term that `:term[words]{key}` refers to: by its key, or else by its words."""
    return terms.get(key or ascii_slug(words))
