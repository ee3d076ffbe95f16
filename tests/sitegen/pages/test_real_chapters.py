"""Each chapter opens with what it assumes and answers, ends with exercises, whose answers are computed, and five lines,
and leads on. Every table column has a name."""

from __future__ import annotations

import re
from html import unescape
from pathlib import Path

import pytest

from sitegen.assets.typefaces import BASICS, TITLES

ROOT = Path(__file__).resolve().parents[3]
CHAPTERS = sorted((ROOT / "content").glob("*.md"))
RUNGS = [path for path in CHAPTERS if not path.name.startswith("00-")]  # the start page assumes and concludes nothing
INSTRUMENT = "19-clouds.md"  # a reader's own clouds are the exercise
# Answers without a number to compute: clutter as ε, and the choice of the fixed cloud.
IN_WORDS = {"09-mmd.md": [3], "14-four.md": [2]}
PART = r"^:::{}\n(.*?)^:::$"


def parts(text: str, name: str) -> list[str]:
    return re.findall(PART.format(name), text, re.MULTILINE | re.DOTALL)


def front(path: Path) -> str:
    """A chapter's front matter."""
    return path.read_text("utf-8").split("\n---\n", 1)[0]


@pytest.fixture(params=RUNGS, ids=[path.name for path in RUNGS])
def chapter(request: pytest.FixtureRequest) -> Path:
    return request.param  # type: ignore[no-any-return]


def test_it_opens_with_what_it_assumes_and_answers(chapter: Path) -> None:
    text = chapter.read_text("utf-8").split("\n---\n", 1)[1].strip()
    assert text.startswith(":::opening\n**Assumes**")
    (opening,) = parts(text, "opening")
    assert re.findall(r"^\*\*(\w+)\*\*", opening, re.MULTILINE) == ["Assumes", "Answers"]


@pytest.mark.parametrize("path", CHAPTERS, ids=[path.name for path in CHAPTERS])
def test_it_says_where_next(path: Path) -> None:
    """Each chapter leads to two or three places, and says for whom each is."""
    assert 2 <= len(re.findall(r"^  - to: \S+\n    says: \S", front(path), re.MULTILINE)) <= 3


def test_it_ends_in_five_lines(chapter: Path) -> None:
    text = chapter.read_text("utf-8").rstrip()
    (lines,) = parts(text, "in-short")
    assert text.endswith(lines + ":::")
    assert len(re.findall(r"^- \S", lines, re.MULTILINE)) == 5


def test_it_has_three_exercises_whose_answers_are_computed(chapter: Path) -> None:
    _, _, exercises = chapter.read_text("utf-8").partition("\n## Exercises {#exercises}\n")
    answers = parts(exercises, "answer")
    count = 0 if chapter.name == INSTRUMENT else 3
    assert len(answers) == len(re.findall(r"^\*\*\d\.\*\* ", exercises, re.MULTILINE)) == count
    bare = [k for k, answer in enumerate(answers, 1) if ":value[" not in answer and ":readout[" not in answer]
    assert bare == IN_WORDS.get(chapter.name, [])


def test_counts_are_folded_in_every_chapter_that_has_them() -> None:
    assert [path.name for path in RUNGS if not parts(path.read_text("utf-8"), "evidence")] == [INSTRUMENT]


@pytest.mark.parametrize("path", CHAPTERS, ids=[path.name for path in CHAPTERS])
def test_every_column_of_a_table_has_a_name(path: Path) -> None:
    heads = re.findall(r"^(\|.*\|)\n\|(?: *:?-+:? *\|)+$", path.read_text("utf-8"), re.MULTILINE)
    assert not [head for head in heads if not all(cell.strip() for cell in head[1:-1].split("|"))]


def test_its_head_links_slides_notebook_and_sources(chapter: Path, site: Path) -> None:
    """Above the text, each to a heading at the foot of the same page."""
    slug = re.search(r"^slug: (\S+)$", chapter.read_text("utf-8"), re.MULTILINE)
    assert slug
    page = (site / f"{slug[1]}.html").read_text("utf-8")
    (links,) = re.findall(r'<p class="chapter-links">(.*?)</p>', page, re.DOTALL)
    matches = re.findall(r'href="#([\w-]+)"', links)
    assert matches == ["slides", "notebook", *(["works-cited"] if 'id="works-cited"' in page else [])]
    assert all(f'id="{anchor}"' in page for anchor in matches)
    assert page.index("chapter-links") < page.index("<strong>Assumes</strong>")


def test_the_contestants_stand_right_before_the_race() -> None:
    names = [path.name for path in CHAPTERS]
    assert names.index("10-contestants.md") + 1 == names.index("11-race.md")


def test_the_minutes_of_each_path_add_up() -> None:
    """On the first page, the minutes of each path's steps add up to those in its heading."""
    text = CHAPTERS[0].read_text("utf-8").partition("{#forty-minutes}\n")[2].partition("\n## ")[0]
    first, *rest = re.split(r"^\*\*[^*]+\*\* \((\d+) min\)\.$", text, flags=re.MULTILINE)
    numbers = [40, *(int(minutes) for minutes in rest[::2])]
    steps = [[int(n) for n in re.findall(r"\((\d+) min\)", part)] for part in (first, *rest[1::2])]
    assert [len(part) for part in steps] == [8, 3, 4]
    assert [sum(part) for part in steps] == numbers


def test_the_titles_face_has_every_letter_of_the_titles(site: Path) -> None:
    """The face is cut to the characters of titles: any other would be shown in a reader's own typeface."""
    pages = {name: headings(page.read_text("utf-8")) for name, page in ((p.name, p) for p in site.glob("*.html"))}
    assert sum(map(len, pages.values())) > 1000
    strange = {name: set(text) & set(BASICS) - set(TITLES) for name, text in pages.items()}
    assert not {name: signs for name, signs in strange.items() if signs}


def headings(html: str) -> str:
    """The text of a page's headings, without what they set in other typefaces."""
    inside = "".join(re.findall(r"<h[1-4]\b[^>]*>(.*?)</h[1-4]>", html, re.DOTALL))
    return unescape(re.sub(r"<(math|code)\b.*?</\1>|<[^>]+>", "", inside, flags=re.DOTALL))
