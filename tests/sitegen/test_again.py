"""Builds in one process, one after the other, as `serve` does them."""

from __future__ import annotations

from pathlib import Path

from sitegen.content import _parsed
from tests.sitegen.conftest import START, Project


def contents(folder: Path) -> dict[str, bytes]:
    return {p.relative_to(folder).as_posix(): p.read_bytes() for p in folder.rglob("*") if p.is_file()}


def test_a_build_again_in_one_process_is_the_build_of_a_fresh_one(project: Project) -> None:
    """What a process keeps of chapters that were not edited changes nothing: the same files, and the same problems."""
    project.build()
    project.write("content/00-start.md", START + "\n## A section\n\n## A section\n\nMore, and :ref[fig:demo].\n")
    again = contents(project.site) if project.build() else {}
    _parsed.cache_clear()
    project.build()
    assert contents(project.site) == again
    project.write("content/00-start.md", START + "\n:ref[nowhere]\n")
    wrong = project.problems()
    assert project.problems() == wrong
    mistakes = "\n::try[Go.]{gone}\n\n## Main {#main}\n\n[^x] $$ \n"
    project.chapter(mistakes)
    wrong = project.problems()
    assert project.problems() == wrong
    _parsed.cache_clear()
    assert project.problems() == wrong
