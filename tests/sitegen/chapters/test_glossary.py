"""Terms: marked in chapters, explained on a card and on their own page; mistakes are reported with their place."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
import yaml

from tests.sitegen.conftest import SECOND, START, Project

CONTENT = Path(__file__).resolve().parents[3] / "content"
TERMS = yaml.safe_load((CONTENT / "glossary.yaml").read_text("utf-8"))
CHAPTERS = [path.read_text("utf-8") for path in sorted(CONTENT.glob("[0-9]*.md"))]
MARKED = sorted(key for key in TERMS if any(f"]{{{key}}}" in text for text in CHAPTERS))

GLOSSARY = """\
gate:
  term: Gate & fence
  says: The <largest> distance.
  chapter: second
  also: [cut-off]

basin:
  term: Basin
  says: All starts that end in one place.
  chapter: second
"""


def test_a_marked_term_has_a_link_a_card_and_an_entry(project: Project) -> None:
    project.write("content/glossary.yaml", GLOSSARY)
    project.write("content/01-second.md", SECOND + "\nA :term[gated]{gate} *:term[basin]* and a :term[gate].\n")
    project.build()
    page = project.page("second.html")
    link = '<a class="term" href="glossary.html#term-gate" data-card="card-term-gate">gated</a>'
    assert link in page
    assert page.count('id="card-term-gate"') == 1
    assert "<strong>Gate &amp; fence.</strong> The &lt;largest&gt; distance." in page
    assert '<em><a class="term" href="glossary.html#term-basin" data-card="card-term-basin">basin</a></em>' in page
    glossary = project.page("glossary.html")
    assert glossary.index('id="term-basin"') < glossary.index('id="term-gate"')
    assert 'Also: cut-off. In <a href="second.html">' in glossary
    assert "card-term" not in project.page("index.html")


def test_a_heading_has_a_term(project: Project) -> None:
    """Its words are part of the anchor."""
    project.write("content/glossary.yaml", GLOSSARY)
    headings = "## :term[Basins]{basin}\n\nA.\n\n## The :term[gate]{gate} of :value[2] u\n\nB.\n"
    project.write("content/01-second.md", f"{SECOND}\n{headings}")
    project.build()
    assert re.findall(r'<h2 id="([^"]*)"><a class="term"', page := project.page("second.html")) == ["basins"]
    assert '<h2 id="the-gate-of-u">The <a class="term"' in page


def test_a_term_s_words_are_plain_text(project: Project) -> None:
    """Markdown and formulas in them are reported; apostrophes are curly, as in other text."""
    project.write("content/glossary.yaml", GLOSSARY)
    project.write("content/00-start.md", START.partition("Read")[0])
    project.chapter("A :term[*gate*]{gate}\nof :term[size $r$]{gate}.\n")
    assert project.problems() == [
        f"content/01-second.md:{at}: a term's words are plain text; {text!r} would be printed as is"
        for at, text in (("7:3", "*gate*"), ("8:4", "$r$"))
    ]
    project.chapter("The :term[gate's edge]{gate}.\n")
    project.build()
    assert ">gate’s edge</a>" in project.page("second.html")


def test_what_is_wrong_with_terms(project: Project) -> None:
    project.write("content/glossary.yaml", GLOSSARY.replace("chapter: second", "chapter: secnd", 1) + "  seys: x\n")
    project.chapter("A :term[gated]{gat} and :term[basins].\n")
    project.write("content/00-start.md", START.partition("Read")[0])
    assert project.problems() == [
        "content/01-second.md:7:16: unknown glossary term 'gat'; did you mean 'gate'?",
        "content/01-second.md:7:31: unknown glossary term 'basins'; did you mean 'basin'?",
        "content/glossary.yaml:4:3: unknown chapter 'secnd'; did you mean 'second'?",
        "content/glossary.yaml:11:3: unknown key 'seys'; did you mean 'says'?",
    ]


@pytest.mark.parametrize("key", MARKED)
def test_the_chapter_of_a_marked_term_speaks_of_it(key: str) -> None:
    """The chapter that an entry links to marks the term, or contains one of its names."""
    term = TERMS[key]
    (text,) = (text for text in CHAPTERS if re.search(rf"^slug: {term['chapter']}$", text, re.MULTILINE))
    names = [term["term"], *term.get("also", [])]
    assert f"]{{{key}}}" in text or any(name.lower() in text.lower() for name in names)
