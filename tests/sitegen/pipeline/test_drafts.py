"""Draft chapters: which builds include them, and what is reported about a link to one."""

from __future__ import annotations

import pytest

from tests.sitegen.conftest import START, Project

DRAFT = """\
---
title: D
slug: third
summary: S
draft: true
slides:
  - {title: T, text: X}
---

## A part {#part}

::figure[C]{toy id=still}

::plot[C]{toy-plot id=counted}

$$ a $$ (unseen)
"""


def test_drafts_are_left_out_unless_asked_for(project: Project) -> None:
    project.write("content/02-draft.md", "---\ntitle: D\nslug: third\nsummary: S\ndraft: true\n---\n\nText.\n")
    assert "third.html" not in project.build().pages
    assert "third.html" in project.build(drafts=True).pages
    assert "A draft: only" in project.page("third.html")
    assert "A draft: only" not in project.page("second.html")


@pytest.mark.parametrize(
    ("link", "names"),
    [
        ("[x](third.html)", "'third.html'"),
        ("[x](02-draft.md#part)", "'02-draft.md'"),
        ("[x](slides-third.html)", "'slides-third.html'"),
        (":ref[third]", "'third'"),
        (":ref[third#part]", "'third'"),
        (":ref[fig:still]", "the chapter of figure 'still'"),
        (":ref[fig:counted]", "the chapter of figure 'counted'"),
        (":ref[eq:unseen]", "the chapter of equation 'unseen'"),
    ],
)
def test_what_leads_to_a_draft_is_told_as_such(project: Project, link: str, names: str) -> None:
    """If the draft is left out; if it is built, the same link leads there."""
    project.write("content/02-draft.md", DRAFT)
    project.chapter(f"\nSee {link}.\n")
    project.write("content/00-start.md", START.partition("Read")[0])
    (text,) = project.problems()
    assert text.startswith("content/01-second.md:8:")
    assert text.endswith(f": {names} is a draft: remove 'draft: true' from content/02-draft.md to publish it")
    project.build(drafts=True)


def test_a_term_that_a_draft_explains_is_told_as_such(project: Project) -> None:
    project.write("content/02-draft.md", DRAFT)
    project.write("content/glossary.yaml", "pose:\n  term: pose\n  says: Where it is.\n  chapter: third\n")
    message = "'third' is a draft: remove 'draft: true' from content/02-draft.md to publish it"
    assert project.problems() == [f"content/glossary.yaml:4:3: {message}"]
    project.build(drafts=True)


def test_a_mistake_in_a_draft_stops_only_builds_that_have_it(project: Project) -> None:
    """A half-written chapter does not prevent the rest from being published."""
    project.write("content/02-draft.md", DRAFT + "\n::figure[no end\n\n:ref[nowhere]\n")
    project.build(strict=True)
    assert [text.partition(":")[0] for text in project.problems(drafts=True)] == ["content/02-draft.md"] * 2


@pytest.mark.parametrize(
    "front", ["title: ICP: a draft\ndraft: true\n---\n", "title: [T\ndraft: true  # for now\n---\n", "draft: true\n"]
)
def test_a_draft_whose_front_matter_is_broken_stays_one(project: Project, front: str) -> None:
    """It stops only builds that have it."""
    project.write("content/02-draft.md", f"---\n{front}\nText.\n")
    project.build(strict=True)
    assert {text.partition(":")[0] for text in project.problems(drafts=True)} == {"content/02-draft.md"}
