"""The label of a cited work: its authors' family names, its year, and a letter where several share them."""

from __future__ import annotations

import pytest

from sitegen.chapters.citations import family_name, read_references
from sitegen.problems import Problems
from tests.sitegen.conftest import Project


@pytest.mark.parametrize(
    ("name", "family"),
    [("Ada One", "One"), ("Cy van der Three", "van der Three"), ("Calvin R. Maurer Jr.", "Maurer"), ("Plato", "Plato")],
)
def test_the_family_name_is_told_from_the_given_ones(name: str, family: str) -> None:
    assert family_name(name) == family


def test_works_of_one_label_get_letters(project: Project) -> None:
    entry = "{}:\n  authors: [A Same]\n  title: {}\n  year: 2000\n  url: https://example.org\n"
    project.write("content/references.yaml", entry.format("b", "Beta") + entry.format("a", "Alpha"))
    references = read_references(project.root, Problems())
    assert [(key, r.label) for key, r in references.items()] == [("a", "Same 2000a"), ("b", "Same 2000b")]
