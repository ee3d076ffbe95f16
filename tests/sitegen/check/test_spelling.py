"""Misspelt words are reported with their place, American ones in prose but not in code or titles, and phrases that
sound translated anywhere."""

from __future__ import annotations

from pathlib import Path

import pytest

from sitegen.check.spelling import anglicised, spelling
from sitegen.check.style import style

ROOT = Path(__file__).resolve().parents[3]


def run_check(root: Path, capfd: pytest.CaptureFixture[str]) -> tuple[int, list[str]]:
    code = spelling(root)
    return code, [line.removeprefix("./") for line in capfd.readouterr().out.splitlines()]


def test_a_misspelt_and_an_american_word_are_told(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "content").mkdir()
    (tmp_path / "solvers").mkdir()
    chapter, module = tmp_path / "content" / "01-one.md", tmp_path / "solvers" / "one.py"
    chapter.write_text("The colour of a program.\n", "utf-8")
    module.write_text("color = 1  # matplotlib's word\n", "utf-8")
    assert run_check(tmp_path, capfd) == (0, [])
    chapter.write_text("A neighbor, and the behaviour of the optimizer.\n", "utf-8")
    module.write_text("# It is seperate.\n", "utf-8")
    code, lines = run_check(tmp_path, capfd)
    assert code == 1
    assert lines == [
        "solvers/one.py:1: seperate ==> separate",
        "content/01-one.md:1: neighbor ==> neighbour",
        "content/01-one.md:1: optimizer ==> optimiser",
    ]


def test_the_titles_of_works_are_spelt_as_they_are(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "content").mkdir()
    (tmp_path / "content" / "references.yaml").write_text("title: On Optimization\n", "utf-8")
    assert run_check(tmp_path, capfd) == (0, [])


def test_the_dictionary_is_turned_round() -> None:
    """No British word is among those to be replaced."""
    pairs = dict(line.split("->") for line in anglicised().splitlines())
    assert pairs["center"] == "centre"
    assert "grey" not in pairs
    assert "colour" not in pairs


def test_american_words_in_drawings_are_told_and_names_of_others_are_not(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "widgets").mkdir()
    (tmp_path / "widgets" / "one.py").write_text('svg = "text-anchor: center"\nlabel = "Neighbors"\n', "utf-8")
    (tmp_path / "templates").mkdir()
    (tmp_path / "templates" / "one.css").write_text("a { color: red; }\n", "utf-8")
    code, lines = run_check(tmp_path, capfd)
    assert (code, lines) == (1, ["widgets/one.py:2: Neighbors ==> Neighbours"])


@pytest.mark.parametrize(
    ("text", "phrases"),
    [
        ("It is no number.", ["2: is no number"]),
        ("# What is no\n# pose, and rows that are no\n    array", ["2: is no # pose", "3: are no array"]),
        ("Equal but for rounding, it comes home.", ["2: but for rounding", "2: comes home"]),
        ("Every so many-th echo.", ["2: so many-th"]),
        ("There is no number, it is no longer there and is no larger; there\nare no rows.", []),
        ("This is not a number. These rows do not make an array, up to rounding.", []),
    ],
)
@pytest.mark.parametrize("name", ["content/01-one.md", "solvers/one.py", "templates/one.html", "README.md"])
def test_a_phrase_that_sounds_translated_is_told(
    tmp_path: Path, capfd: pytest.CaptureFixture[str], name: str, text: str, phrases: list[str]
) -> None:
    """With its place and what to write instead; the line is the one on which it begins."""
    path = tmp_path / name
    path.parent.mkdir(exist_ok=True)
    path.write_text(f"First.\n{text}\n", "utf-8")
    assert style(tmp_path) == bool(phrases)
    lines = capfd.readouterr().out.splitlines()
    assert [line.partition(" ==> ")[0] for line in lines] == [f"{name}:{phrase}" for phrase in phrases]
    assert all(line.partition(" ==> ")[2] for line in lines)


def test_each_phrase_has_its_own_advice(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "README.md").write_text("Equal but for rounding.\nIt comes home.\n", "utf-8")
    assert style(tmp_path) == 1
    assert capfd.readouterr().out.splitlines() == [
        "README.md:1: but for rounding ==> up to rounding",
        "README.md:2: comes home ==> succeeds",
    ]


def test_this_project_has_none_of_them(capfd: pytest.CaptureFixture[str]) -> None:
    assert style(ROOT) == 0, capfd.readouterr().out
