"""Successive builds in one process, as `serve` does them: each equals the build of a fresh process."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

import pytest

from sitegen.cache.memory import Memory
from sitegen.chapters.claims import write_results
from sitegen.chapters.render_context import RenderContext
from sitegen.chapters.rendered import Body
from sitegen.chapters.surveyed import Survey
from sitegen.pages import bodies
from sitegen.pipeline.build import build
from sitegen.pipeline.context import Parts
from sitegen.problems import BuildFailed
from tests.sitegen.conftest import REFERENCES, SECOND, START, Project, contents

GLOSSARY = """\
pose:
  term: pose
  says: Where a thing is.
  chapter: second
"""
WITH_ALL = f"{START}\nA :term[pose]. By :ref[fig:demo], :ref[eq:energy]; ![A dot](dot.svg)\n\n::plot[D.]{{toy-plot}}\n"
SLIDES = """\
slides:
  - title: "Deep: :ref[second#deep]"
    figure: demo
    set: noise=0.25
    text: As [@one2001] say.
"""
DOT = '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 9 9"/>'


Found = dict[str, bytes] | list[str]
Edit = Callable[[Path], object]


class Again:
    """A project that is always built in one process, and for comparison with nothing cached."""

    def __init__(self, project: Project) -> None:
        self.root, self.memory, self._cache = project.root, Memory(), project.cache
        parts = Parts(project.widgets, project.plots, licences=lambda names, cache: [])
        self._parts = replace(parts, assemble=None, cut_fonts=None)

    def build(self) -> Found:
        """The files of the site with its warnings, or the problems."""
        return self._built(self.memory, self.root / "site")

    def fresh(self) -> Found:
        """The same from a process that has not built anything."""
        return self._built(Memory(), self.root / "fresh")

    def _built(self, memory: Memory, site: Path) -> Found:
        try:
            report = build(self.root, site, pack=False, cache=self._cache, parts=self._parts, memory=memory)
        except BuildFailed as error:
            return [str(problem) for problem in error.problems]
        return {**contents(site), "warnings": "\n".join(map(str, report.warnings)).encode()}


@pytest.fixture
def again(project: Project) -> Again:
    front, _, text = SECOND.partition("redirects")
    project.write("content/00-start.md", WITH_ALL)
    text = text.replace("::figure[The", '::figure[:promise[Press twice]{press=go*2 expect="presses > 1"}. The')
    text = text.replace("press=go,go}", 'press=go,go expect="noise falls"}')
    project.write("content/01-second.md", f"{front}{SLIDES}redirects{text}")
    project.write("content/glossary.yaml", GLOSSARY)
    project.write("content/dot.svg", DOT)
    write_results(project.root, {"tests/test_claimed.py::test_it_holds": "passed"})
    return Again(project)


def write(name: str, text: str) -> Edit:
    """An edit that creates or replaces a file."""
    return lambda root: (root / name).write_text(text, "utf-8")


def swap(name: str, old: str, new: str) -> Edit:
    """An edit that replaces text in a file."""

    def edit(root: Path) -> None:
        text = (root / name).read_text("utf-8")
        assert old in text
        (root / name).write_text(text.replace(old, new), "utf-8")

    return edit


def remove(name: str) -> Edit:
    """An edit that removes a file."""
    return lambda root: (root / name).unlink()


def series(*edits: Edit) -> Edit:
    """Several edits saved at once."""
    return lambda root: [edit(root) for edit in edits]


FIRST, OTHER = "content/00-start.md", "content/01-second.md"
EDITS = {
    "a sentence": swap(OTHER, "A first paragraph", "Another paragraph"),
    "the title of a chapter that another names": swap(OTHER, "alert(1)", "alert(2)"),
    "the title of the first": swap(FIRST, "Start here", "Begin here"),
    "a heading that another chapter's slide names": swap(OTHER, "## A section", "## Its *section* of $q$"),
    "an anchor that another chapter links to": swap(OTHER, "{#deep}", "{#deeper}"),
    "an anchor, with all that links to it": series(
        swap(OTHER, "{#deep}", "{#low}"),
        swap(OTHER, "second#deep", "second#low"),
        swap(FIRST, "#deep", "#low"),
    ),
    "a page's name": swap(OTHER, "slug: second", "slug: other"),
    "a file's name": lambda root: (root / OTHER).rename(root / "content/03-third.md"),
    "a rung": swap(OTHER, 'rung: "1"', 'rung: "2"'),
    "a figure before, so that numbers move": swap(OTHER, "A first", "::figure[One.]{toy id=new}\n\nA first"),
    "a figure that is gone": swap(OTHER, "id=demo", "id=gone"),
    "a figure's state": swap(OTHER, "id=demo noise=0.5", "id=demo noise=0.75"),
    "an equation's label": swap(OTHER, "$$ (energy)", "$$ (mass)"),
    "an equation before": swap(OTHER, "A first", "$$\na\n$$ (before)\n\nA first"),
    "a formula": swap(OTHER, "$a^2", "$b^3"),
    "a promise of no readout": swap(OTHER, "presses > 1", "press > 1"),
    "a promise that is not kept": swap(OTHER, "presses > 1", "presses > 4"),
    "what a promise is held to": swap(OTHER, "twice]{press=go*2", "twice]{press=go"),
    "a button's promise": swap(OTHER, "noise falls", "noise rises"),
    "a word that promises": swap(FIRST, "::plot[D.]", "::figure[It falls.]{toy}\n\n::plot[D.]"),
    "a plot's place": swap(FIRST, "{toy-plot}", "{toy-plot id=dots}"),
    "a slide": swap(OTHER, "noise=0.25\n", "noise=0.35\n"),
    "no slides": swap(OTHER, SLIDES, ""),
    "a reference": swap("content/references.yaml", "year: 2001", "year: 1999"),
    "a new reference that makes letters": write(
        "content/references.yaml", REFERENCES + "one-too:\n  authors: [Eve One]\n  title: Too\n  year: 2001\n"
    ),
    "a reference that is gone": swap("content/references.yaml", "two2002:", "two2003:"),
    "references that cannot be read": swap("content/references.yaml", "one2001:", "one2001: {"),
    "a term's words": swap("content/glossary.yaml", "Where a thing is", "Where it is"),
    "a term that is gone": swap("content/glossary.yaml", "pose:\n", "place:\n"),
    "no glossary": remove("content/glossary.yaml"),
    "the site's title": swap("content/site.yaml", "A <small>", "A <large>"),
    "the site's address": swap("content/site.yaml", "url: https://example.org/ladder\n", ""),
    "a macro": swap("content/site.yaml", "\\mathbb{R}", "\\mathbf{R}"),
    "the ladder": swap("content/site.yaml", "Not yet written", "Some day"),
    "a test's words": swap("tests/test_claimed.py", "What holds", "What always holds"),
    "a test's source": swap("tests/test_claimed.py", "1 < 2", "1 < 3"),
    "a test that is gone": swap("tests/test_claimed.py", "test_it_holds", "test_it_held"),
    "a test's outcome": swap("tests/results.json", "passed", "failed"),
    "code that tests ran on": swap("solvers/__init__.py", "solvers", "others"),
    "a picture": swap("content/dot.svg", "0 0 9 9", "0 0 8 8"),
    "a picture that is gone": remove("content/dot.svg"),
    "a page's template": swap("templates/chapter.html", "Cite this page", "Cite it"),
    "a figure's template": swap("templates/figure.html", "<figure", "<figure data-new"),
    "a style sheet": swap("templates/assets/css/base/type.css", "1.65rem", "1.75rem"),
    "a draft": swap(OTHER, "slug: second", "slug: second\ndraft: true"),
    "a chapter between": write("content/00.5-new.md", '---\ntitle: "New"\n---\n\nBy @x.\n'),
    "a chapter that is gone": remove(OTHER),
    "half a directive": swap(FIRST, "{toy-plot}", "{toy-plot"),
    "many mistakes": write(OTHER, "---\ntitle: T\n---\n\n::try[Go.]{gone}\n\n## Main {#main}\n\n[^x] $$ \n"),
    "an unclosed fence": swap(OTHER, 'print("<hello>")\n```', 'print("<hello>")'),
}


@pytest.mark.parametrize("edit", EDITS)
def test_an_edit_gives_the_site_of_a_fresh_build(again: Again, edit: str) -> None:
    """So does undoing it, and the same edit once more, when everything has been built before."""
    before = again.build()
    assert isinstance(before, dict), before
    assert again.fresh() == before
    files = {name: data for name, data in contents(again.root).items() if not name.startswith(("site/", "fresh/"))}
    EDITS[edit](again.root)
    after = again.build()
    assert after != before
    assert after == again.fresh()
    for name in contents(again.root).keys() - files.keys():
        if not name.startswith(("site/", "fresh/")):
            (again.root / name).unlink()
    for name, data in files.items():
        (again.root / name).write_bytes(data)
    assert again.build() == before
    EDITS[edit](again.root)
    assert again.build() == after


def test_edits_on_top_of_each_other(again: Again) -> None:
    """Even after an edit that was a mistake."""
    count = 0
    for edit in EDITS.values():
        with suppress(AssertionError, FileNotFoundError):  # an earlier edit has removed what this one would change
            edit(again.root)
            count += 1
        assert again.build() == again.fresh()
    assert count > len(EDITS) / 2


def test_a_sentence_makes_its_own_chapter_anew_and_no_other(again: Again, monkeypatch: pytest.MonkeyPatch) -> None:
    names: list[str] = []
    render = bodies.render

    def watch(survey: Survey, context: RenderContext) -> Body:
        names.append(survey.chapter.name)
        return render(survey, context)

    monkeypatch.setattr(bodies, "render", watch)
    again.build()
    assert names == ["index", "second"]
    EDITS["a sentence"](again.root)
    again.build()
    assert names == ["index", "second", "second"]


def test_what_has_not_changed_is_not_written_again(again: Again) -> None:
    """A file with the same bytes is left in place; one that someone has changed is written again."""
    again.build()
    site, picture = again.root / "site", "images/" + next((again.root / "site/images").iterdir()).name
    files = {name: (site / name).stat().st_ino for name in contents(site)}
    (site / picture).write_text("Somebody else's.", "utf-8")
    EDITS["a sentence"](again.root)
    result = again.build()
    assert isinstance(result, dict)
    assert result[picture] == DOT.encode()
    stats = {name: (site / name).stat() for name in contents(site)}
    assert all(facts.st_nlink == 1 for facts in stats.values())
    stable = {name for name, facts in stats.items() if files.get(name) == facts.st_ino}
    assert {name for name in stats if name.startswith("tapes/")} <= stable
    assert not {"second.html", picture} & stable
