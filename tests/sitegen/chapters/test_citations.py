"""Cited works: their labels, with a letter where several have the same, their entries, and their order."""

from __future__ import annotations

import pytest

from sitegen.chapters.citations import Reference, family_name, read_references
from sitegen.problems import Problems
from tests.sitegen.conftest import Project


def only(project: Project, *lines: str) -> Reference:
    """The work of a file of references with these lines and a year."""
    project.write("content/references.yaml", "one:\n" + "".join(f"  {line}\n" for line in [*lines, "year: 2000"]))
    (reference,) = read_references(project.root, Problems()).values()
    return reference


@pytest.mark.parametrize(
    ("name", "family"),
    [
        ("Ada One", "One"),
        ("Cy van der Three", "van der Three"),
        ("Calvin R. Maurer Jr.", "Maurer"),
        ("Plato", "Plato"),
        ("Di Four", "Four"),
        ("Li De La Five", "De La Five"),
        ("II", "II"),
    ],
)
def test_the_family_name_is_told_from_the_given_ones(name: str, family: str) -> None:
    assert family_name(name) == family


@pytest.mark.parametrize(
    ("authors", "label", "names"),
    [
        ("[A One]", "One 2000", "A One"),
        ("[A One, B Two]", "One and Two 2000", "A One and B Two"),
        ("[A One, B Two, C Three]", "One et al. 2000", "A One, B Two and C Three"),
    ],
)
def test_a_citation_names_two_authors_and_the_bibliography_all(
    project: Project, authors: str, label: str, names: str
) -> None:
    reference = only(project, f"authors: {authors}", "title: T", "doi: 10.1000/one")
    assert reference.label == label
    assert f'<span class="authors">{names}</span> (2000). ' in reference.html


@pytest.mark.parametrize(
    ("lines", "end"),
    [
        (["title: T", "doi: 10.1000/one"], '<a href="https://doi.org/10.1000/one"><cite>T</cite></a>.'),
        (["title: T?", "url: https://example.org"], '<a href="https://example.org"><cite>T?</cite></a>'),
        (["title: T", "url: https://example.org", "doi: 10.1000/one"], '"https://doi.org/10.1000/one"><cite>T</cite></a>.'),
        (["title: T", "doi: 10.1000/one", "venue: Proc. A."], "<cite>T</cite></a>. Proc. A."),
        (["title: T.", "doi: 10.1000/one", "venue: A & B"], "<cite>T.</cite></a> A &amp; B."),
    ],
)
def test_an_entry_has_one_link_and_each_part_one_stop(project: Project, lines: list[str], end: str) -> None:
    """A title has none if it ends with a mark of its own, and a DOI precedes a URL."""
    reference = only(project, "authors: [A One]", *lines)
    assert reference.html.endswith(end)
    assert reference.html.count("<a ") == 1


def test_works_stand_by_family_name_then_year_then_title(project: Project) -> None:
    """Lower-case particles do not come last, and given names do not count."""
    works = {
        "z": ("Abe Zeta", 1990, "A"),
        "v": ("Zoe van Alpha", 1990, "A"),
        "late": ("Zoe Beta", 2001, "A"),
        "early": ("Zoe Beta", 1999, "B"),
        "second": ("Zoe Beta", 2001, "B"),
    }
    entry = "{}:\n  authors: [{}]\n  title: {}\n  year: {}\n  url: https://example.org\n"
    texts = [entry.format(key, author, title, year) for key, (author, year, title) in works.items()]
    project.write("content/references.yaml", "".join(texts))
    references = read_references(project.root, Problems())
    assert list(references) == ["early", "late", "second", "v", "z"]
    assert [r.label for r in references.values()][:3] == ["Beta 1999", "Beta 2001a", "Beta 2001b"]


def test_works_of_one_label_get_letters(project: Project) -> None:
    entry = "{}:\n  authors: [A Same]\n  title: {}\n  year: 2000\n  url: https://example.org\n"
    project.write("content/references.yaml", entry.format("b", "Beta") + entry.format("a", "Alpha"))
    references = read_references(project.root, Problems())
    assert [(key, r.label) for key, r in references.items()] == [("a", "Same 2000a"), ("b", "Same 2000b")]
