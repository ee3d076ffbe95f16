"""The search finds what a reader can read: sections, but not code, controls or cards."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from sitegen.pages import search_index
from sitegen.pages.search_index import Section, search_data, sections

PAGE = """<!doctype html><html><body><header><h2 id="no">Not in main</h2></header><main id="main"><article>
<h1>The <em>title</em> &amp; more</h1><p>First<br>words.</p>
<nav class="contents"><ol><li>silent</li></ol></nav>
<h2 id="one">One <math><mi>x</mi></math>heading</h2><p>A<b>b</b>c, <a class="cite">One 2001</a>.</p>
<figure><script type="application/json">{"no": 1}</script><div class="figure-stage"><svg><text>no</text></svg></div>
<form><label>no</label><input></form><figcaption>Figure 1.1 The caption.</figcaption></figure>
<div class="card" hidden><p>no</p></div><h3 id="two">Two</h3><p>Deeper &lt;b&gt;.</p>
<dl><div id="term-gate"><dt>Gate</dt><dd>A distance.</dd></div></dl>
<footer class="chapter-footer"><h2 id="cite">no</h2><p>no</p></footer></article></main><p>no</p></body></html>"""


def test_sections_of_a_page() -> None:
    results = [(section.at, section.page, section.heading, section.text) for section in sections("p.html", PAGE)]
    title = "The title & more"
    assert results == [
        ("p.html", title, title, "First words."),
        ("p.html#one", title, "One heading", "Abc, One 2001. Figure 1.1 The caption."),
        ("p.html#two", title, "Two", "Deeper <b>."),
        ("p.html#term-gate", title, "Gate", "A distance."),
    ]


def test_the_script_holds_every_section_and_ends_no_element(tmp_path: Path) -> None:
    unsearched = ("checks.html", "checks-p.html", "slides-p.html")
    pages = {"p.html": PAGE, **dict.fromkeys(unsearched, PAGE), "old.html": "<p>Moved</p>"}
    script = search_data(pages, tmp_path).decode()
    entries = json.loads(script.removeprefix("Ladder.searchable(").removesuffix(");\n"))
    assert [at for at, *_ in entries] == ["p.html", "p.html#one", "p.html#two", "p.html#term-gate"]
    assert "<" not in script


def test_a_page_is_read_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """By all builds that share a cache, until its text or its name changes."""
    reads: list[str] = []

    def noted(name: str, html: str) -> list[Section]:
        reads.append(name)
        return sections(name, html)

    monkeypatch.setattr(search_index, "sections", noted)
    first = search_data({"p.html": PAGE}, tmp_path)
    assert search_data({"p.html": PAGE}, tmp_path) == first
    search_data({"p.html": PAGE, "q.html": PAGE}, tmp_path)
    search_data({"p.html": PAGE + " "}, tmp_path)
    assert reads == ["p.html", "q.html", "p.html"]


def test_what_is_hidden_is_not_found() -> None:
    page = "<main><h1>T</h1><p>Seen.</p><p hidden>Unseen.</p></main>"
    assert [section.text for section in sections("p.html", page)] == ["Seen."]


def test_words_of_different_blocks_are_apart() -> None:
    """Also what follows a block within another."""
    page = "<main><h1>T</h1><div>One<p>two</p>three<ul><li>four</li><li>five</li></ul>six</div></main>"
    assert [section.text for section in sections("p.html", page)] == ["One two three four five six"]


def test_only_the_first_term_of_an_entry_is_a_heading() -> None:
    """In a list under a heading the terms are text, as are the further ones of a glossary's entry."""
    page = (
        "<main><h1>T</h1><h2 id='o'>Options</h2><dl><dt>gate</dt><dd>A distance.</dd></dl>"
        "<dl><div id='term-a'><dt>pose</dt><dt>place</dt><dd>Where it is.</dd></div></dl></main>"
    )
    results = [(section.at, section.heading, section.text) for section in sections("p.html", page)][1:]
    assert results == [
        ("p.html#o", "Options", "gate A distance."),
        ("p.html#term-a", "pose", "place Where it is."),
    ]


def test_a_work_is_found_and_an_empty_section_is_not(tmp_path: Path) -> None:
    """An entry of the references has no heading."""
    page = "<main><h1>References</h1><ul><li id='ref-one2001'>One (2001).</li><li id='ref-two'></li></ul></main>"
    script = search_data({"references.html": page}, tmp_path).decode()
    entries = json.loads(script.removeprefix("Ladder.searchable(").removesuffix(");\n"))
    assert entries == [
        ["references.html", "References", "References", ""],
        ["references.html#ref-one2001", "References", "", "One (2001)."],
    ]
