"""Where next: the places named in a chapter's front matter appear at its end, and unknown places are reported."""

from __future__ import annotations

import re

import pytest

from tests.sitegen.conftest import START, Project

FRONT = '---\ntitle: T\nslug: second\nrung: "1"\nsummary: S\n'
FIRST = START.partition("Read")[0].replace("---\n", "---\nslug: start\n", 1)
NEXT = "next:\n  - to: start#deep\n    says: If <this> & that.\n  - to: start\n    says: \"Else: this.\"\n"

# The text under next:, and the message for the place marked by ¦.
WRONG = {
    "a chapter": ("  - to: ¦strat\n    says: S\n", "unknown chapter 'strat'; did you mean 'start'?"),
    "an anchor": ("  - to: ¦start#dep\n    says: S\n", "unknown anchor 'dep' on index.html; did you mean 'deep'?"),
    "a figure": ("  - to: ¦fig:dmo\n    says: S\n", "unknown figure 'dmo'"),
    "no reason": ("  - ¦to: start\n", "missing says: expected text"),
    "no place": ("  - ¦says: S\n", "missing to: expected text"),
    "a key": ("  - to: start\n    ¦say: S\n    says: S\n", "unknown key 'say'; did you mean 'says'?"),
    "twice": ("  - to: start\n    says: S\n  - to: ¦start\n    says: S\n", "duplicate 'start'"),
    "four": (
        "".join(f"  - {'¦' * (k == 3)}to: {to}\n    says: S\n" for k, to in enumerate(["start", "start#deep",
        "second", "second#two"])),
        "at most 3 entries",
    ),
    "words in the place of a list": (" ¦start", "expected a list of entries with to and says"),
}  # fmt: skip


@pytest.fixture
def desk(project: Project) -> Project:
    """The small site, whose second chapter has hardly any text."""
    project.write("content/00-start.md", FIRST + "## Deep *down* {#deep}\n\nText.\n")
    project.write("content/01-second.md", f"{FRONT}---\n\n## Two\n\nText.\n")
    return project


def test_what_is_named_stands_at_the_end(desk: Project) -> None:
    """A link and its reason as plain words: a chapter under its rung, a section also under its chapter's title."""
    desk.write("content/01-second.md", f"{FRONT}{NEXT}---\n\nText. See [the end](#where-next).\n")
    desk.build()
    page = desk.page("second.html")
    (section,) = re.findall(r'<section class="onward" aria-labelledby="where-next">.*?</section>', page, re.DOTALL)
    assert page.index("Text.") < page.index(section) < page.index('id="notebook"') < page.index('class="pager"')
    assert re.findall(r'<p class="onward-says">(.*?)</p>', section) == ["If &lt;this&gt; &amp; that.", "Else: this."]
    assert re.findall(r'<span class="onward-over">(.*?)</span>', section) == ["Rung 0 · Start here", "Rung 0"]
    assert re.findall(r'<a class="ref" href="(.*?)">(.*?)</a>', section) == [
        ("index.html#deep", "Deep <em>down</em>"),
        ("index.html", "Start here"),
    ]


def test_a_chapter_without_any_has_no_section(desk: Project) -> None:
    desk.build()
    assert "onward" not in desk.page("second.html")
    desk.write("content/01-second.md", f"{FRONT}---\n\n[there](#where-next)\n")
    assert "unknown anchor 'where-next' on second.html" in "\n".join(desk.problems())


@pytest.mark.parametrize("name", WRONG)
def test_what_is_wrong_is_told_at_its_place(desk: Project, name: str) -> None:
    value, words = WRONG[name]
    head = f"{FRONT}next:" + ("" if value.startswith(" ¦") else "\n")
    text = f"{head}{value.rstrip()}\n---\n\n## Two\n\nText.\n"
    before = text.partition("¦")[0]
    line = 1 + before.count("\n")
    column = len(before) - before.rfind("\n")
    desk.write("content/01-second.md", text.replace("¦", ""))
    (message,) = desk.problems()
    position = f"{line}:1" if name.startswith("words") else f"{line}:{column}"  # of a key's value, the key's
    assert message.startswith(f"content/01-second.md:{position}: ")
    assert words in message


def test_a_place_in_a_draft_is_told_as_such(desk: Project) -> None:
    desk.write("content/02-later.md", "---\ntitle: Later\nslug: later\nsummary: S\ndraft: true\n---\n\nText.\n")
    desk.write("content/01-second.md", f"{FRONT}next:\n  - to: later\n    says: S\n---\n\nText.\n")
    (text,) = desk.problems()
    assert "'later' is a draft" in text


def test_an_edit_of_the_place_shows_where_it_is_named(desk: Project) -> None:
    """The link then has the current title of the chapter that it leads to."""
    desk.write("content/01-second.md", f"{FRONT}{NEXT}---\n\nText.\n")
    desk.build()
    desk.write("content/00-start.md", FIRST.replace("Start here", "Begin") + "## Deeper {#deep}\n\nText.\n")
    desk.build()
    assert ">Deeper</a>" in desk.page("second.html")
    assert "Rung 0 · Begin" in desk.page("second.html")
