"""Each chapter opens with what it assumes and answers, ends with exercises, whose answers are computed, and five lines,
and leads on. No table has a column without a name."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[3]
CHAPTERS = sorted((ROOT / "content").glob("*.md"))
RUNGS = [path for path in CHAPTERS if not path.name.startswith("00-")]  # the start page needs nothing, and ends nothing
INSTRUMENT = "19-clouds.md"  # a reader's own clouds are the exercise
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
    """Each chapter leads to two or three places, and says to whom."""
    assert 2 <= len(re.findall(r"^  - to: \S+\n    says: \S", front(path), re.MULTILINE)) <= 3


def test_it_ends_in_five_lines(chapter: Path) -> None:
    text = chapter.read_text("utf-8").rstrip()
    (lines,) = parts(text, "in-short")
    assert text.endswith(lines + ":::")
    assert len(re.findall(r"^- \S", lines, re.MULTILINE)) == 5


def test_it_has_three_exercises_whose_answers_are_computed(chapter: Path) -> None:
    _, _, exercises = chapter.read_text("utf-8").partition("\n## Exercises {#exercises}\n")
    answers = parts(exercises, "answer")
    wanted = 0 if chapter.name == INSTRUMENT else 3
    assert len(answers) == len(re.findall(r"^\*\*\d\.\*\* ", exercises, re.MULTILINE)) == wanted
    assert sum(":value[" in answer or ":readout[" in answer for answer in answers) >= wanted - 1


def test_counts_are_folded_in_every_chapter_that_has_them() -> None:
    assert [path.name for path in RUNGS if not parts(path.read_text("utf-8"), "evidence")] == [INSTRUMENT]


@pytest.mark.parametrize("path", CHAPTERS, ids=[path.name for path in CHAPTERS])
def test_every_column_of_a_table_has_a_name(path: Path) -> None:
    heads = re.findall(r"^(\|.*\|)\n\|(?: *:?-+:? *\|)+$", path.read_text("utf-8"), re.MULTILINE)
    assert not [head for head in heads if not all(cell.strip() for cell in head[1:-1].split("|"))]
