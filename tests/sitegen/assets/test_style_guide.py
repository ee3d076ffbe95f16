"""The style guide shows every directive beside its result, and every colour that carries a meaning."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from sitegen.assets.swatches import MEANING, contrast, swatches
from sitegen.chapters.content import read_docs
from sitegen.markup.inline import AROUND, BLOCK, INLINE
from sitegen.problems import Problems
from tests.sitegen.conftest import START, Project
from widgets.drawing.picture import ROLES

ROOT = Path(__file__).resolve().parents[3]
MARKDOWN = {
    *("cite", "footnote_ref", "math_inline", "math_block_label", "image", "link_open", "em_open", "strong_open"),
    *("code_inline", "fence", "table_open", "bullet_list_open", "blockquote_open"),
}


def test_every_directive_stands_in_an_example() -> None:
    """So does every other construct that chapters are written with."""
    problems = Problems()
    guide = next(doc for doc in read_docs(ROOT, problems) if doc.name == "docs-style")
    types: set[str] = set()
    inside = False
    for token in guide.document.tokens:
        inside = token.type == "container_example_open" or (inside and token.type != "container_example_close")
        if inside:
            types |= {token.type, *(child.type for child in token.children or [])}
    assert problems.found == []
    expected = {*BLOCK, *INLINE, *MARKDOWN} - {*AROUND} | {f"{name}_open" for name in AROUND}
    assert expected - types == set()


def test_an_example_is_its_source_and_its_result(project: Project) -> None:
    """The source as typed, then what a chapter would show; the guide is neither on the ladder nor in the search."""
    project.write("content/00-start.md", START.partition("Read")[0])
    project.chapter("\nText.\n")
    body = ":::example\nA *word* & :ref[second].\n:::\n\n:::anatomy\n::figure[C]{toy id=demo}\n:::\n"
    front = "title: Style\nquestion: How?\nsummary: S\nhidden: true"
    project.write("content/docs/style.md", f"---\n{front}\n---\n\n{body}")
    project.write("content/docs/index.md", "---\ntitle: Docs\nquestion: How?\nsummary: S\n---\n\n[Style](style.md)\n")
    project.build(strict=True)
    page = project.page("docs-style.html")
    assert '<code translate="no">A *word* &amp; :ref[second].</code></pre>' in page
    assert '<div class="example-result">\n<p>A <em>word</em> &amp; <a class="ref" href="second.html">' in page
    assert re.search(r'<div class="anatomy">\s*<figure class="figure" id="fig-demo"', page)
    assert 'name="robots" content="noindex"' in page
    assert '<h2 id="colours">Colours</h2>' in page
    assert "style.html" not in project.page("sitemap.xml")
    assert "Figures</th><td>0" not in project.page("about.html")
    project.write("content/docs/style.md", f"---\n{front}\n---\n\n:::exmple\nText.\n\n{body[:-4]}")
    assert project.problems() == [
        "content/docs/style.md:8:1: unknown block :::exmple; did you mean 'example'?",
        "content/docs/style.md:15:1: unclosed :::anatomy: missing :::",
    ]


def test_colours_are_told_with_their_least_contrast() -> None:
    """Each role of pictures has a meaning, except those of the race and of a map's areas, which a legend explains."""
    assert {role for role in ROLES if not role.startswith(("by-", "end-"))} <= set(MEANING)
    assert contrast("#000000", "#ffffff") == pytest.approx(21.0)
    for swatch in swatches():
        assert swatch.mark >= 3.0, swatch
        assert swatch.text >= 4.5, swatch
