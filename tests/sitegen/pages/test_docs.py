"""Pages of the docs: written, linked, searched and checked like chapters, but not on the ladder."""

from __future__ import annotations

import json
import re

from sitegen.chapters.claims import claimed
from sitegen.pages.search_index import search_data
from sitegen.pipeline.build import build
from sitegen.pipeline.context import Parts
from tests.sitegen.check_site import check_site
from tests.sitegen.conftest import START, Project

INDEX = "---\ntitle: Docs\nquestion: How?\nsummary: S\n---\n\n- [One](one.md#part)\n- [Hidden](docs-hidden.html)\n"
ONE = """\
---
title: One
question: How is it?
summary: What one says.
redirects: [old-one]
---

## A part {#part}

It leads to [the index](index.md), [the second](01-second.md#deep) and :ref[docs-hidden]. It cites [@one2001].
:claim[Inside.]{tests/test_claimed.py::TestGroup::test_inside}

::figure[C]{toy id=doc-demo}
"""
HIDDEN = "---\ntitle: Hidden\nquestion: How?\nsummary: S\nhidden: true\n---\n\nText.\n"


def with_docs(project: Project, **pages: str) -> Project:
    project.write("content/00-start.md", START.partition("Read")[0] + "See [one](docs-one.html#part).\n")
    project.chapter("\n## Deep {#deep}\n\nText.\n")
    for name, text in {"index": INDEX, "one": ONE, "hidden": HIDDEN, **pages}.items():
        project.write(f"content/docs/{name}.md", text)
    return project


def test_a_page_of_the_docs_is_a_page_of_the_site(project: Project) -> None:
    """Linked from every page's foot and the about page, in the site map; not on the ladder, without a notebook."""
    report = with_docs(project).build(strict=True)
    assert {"docs.html", "docs-one.html", "docs-hidden.html", "old-one.html"} <= set(report.pages)
    assert report.sources["content/docs/one.md"] == "docs-one.html"
    page = project.page("docs-one.html")
    assert '<a href="docs.html">the index</a>, <a href="second.html#deep">the second</a>' in page
    assert '<a class="ref" href="docs-hidden.html">Hidden</a>' in page
    assert '<p class="chapter-rung"><a href="docs.html">Docs</a></p>' in page
    assert "notebooks/" not in page
    assert 'class="pager"' not in page
    assert 'class="chapter-rung"' not in project.page("docs.html")
    for name in ("second.html", "about.html", "docs.html"):
        assert '<li><a href="docs.html">Docs</a></li>' in project.page(name)
    assert 'The <a href="docs.html">docs</a> explain' in project.page("about.html")
    ladder = page.partition('<nav class="ladder')[2].partition("</nav>")[0]
    assert "second.html" in ladder
    assert "docs" not in ladder
    public = re.findall(r"<loc>https://example.org/ladder/(docs.*?)</loc>", project.page("sitemap.xml"))
    assert public == ["docs.html", "docs-one.html"]
    assert 'content="noindex"' in project.page("docs-hidden.html")
    assert 'content="noindex"' not in page
    assert check_site(project.site, project.cache) == []


def test_what_the_docs_claim_is_checked(project: Project) -> None:
    """Their claims are among the checks, and `test` records their tests' outcomes."""
    with_docs(project).build(strict=True)
    assert 'href="docs-one.html#claim-1"' in project.page("checks-docs-one.html")
    assert claimed(project.root) == ["tests/test_claimed.py::TestGroup::test_inside"]


def test_the_docs_are_searched_but_what_is_hidden(project: Project) -> None:
    with_docs(project)
    empty = Parts(project.widgets, project.plots, None, None, None, lambda names, cache: [], lambda cache: b"//")
    build(project.root, project.site, cache=project.cache, pack=False, parts=empty)
    (script,) = project.site.glob("assets/search.*.js")
    entries = json.loads(script.read_text("utf-8").removeprefix("Ladder.searchable(").removesuffix(");\n"))
    assert ["docs-one.html#part", "One", "A part"] in [entry[:3] for entry in entries]
    assert not [at for at, *_ in entries if at.startswith("docs-hidden")]
    assert search_data({"checks.html": project.page("docs-one.html")}, project.cache) == b"Ladder.searchable([]);\n"


def test_mistakes_in_the_docs_are_told_where_they_are(project: Project) -> None:
    """A broken link and front matter that only chapters may have; all other mistakes are those of chapters."""
    with_docs(project, one=ONE.replace("index.md", "indx.md").replace("hidden]", "hiden]"))
    assert project.problems() == [
        "content/docs/one.md:10:25: unknown page 'indx.md'; did you mean 'index.html'?",
        "content/docs/one.md:10:76: unknown chapter 'docs-hiden'; did you mean 'docs-hidden'? "
        "(figures are fig:id, equations eq:label)",
    ]
    with_docs(project, one=ONE.replace("redirects:", "rung: '1'\nredirects:"))
    (text,) = project.problems()
    assert text.startswith("content/docs/one.md:5:1: unknown key 'rung'")


def test_every_page_of_the_docs_is_led_to(project: Project) -> None:
    with_docs(project, index=INDEX.replace("- [One](one.md#part)\n", ""))
    assert project.problems() == ["content/docs/index.md:2:1: missing link to content/docs/one.md"]
    with_docs(project)
    (project.root / "content/docs/index.md").unlink()
    project.write("content/docs/one.md", ONE.replace("[the index](index.md)", "it"))
    message = "missing docs index: it must link to every other page of the docs"
    assert project.problems() == [f"content/docs/index.md:0:0: {message}"]


def test_names_of_docs_and_of_chapters_do_not_meet(project: Project) -> None:
    with_docs(project, **{"Odd name": HIDDEN})
    project.write("content/02-third.md", "---\ntitle: T\nslug: docs-one\nsummary: S\n---\n\nText.\n")
    project.write("content/docs/one.md", ONE.replace("old-one", "second"))
    faults = project.problems()
    assert any("Odd name.md:0:0: expected a file name like authoring.md" in line for line in faults)
    assert "content/02-third.md:3:1: page name 'docs-one' is taken by content/docs/one.md" in faults
    assert any("redirect from 'second': page name is taken by content/01-second.md" in line for line in faults)
