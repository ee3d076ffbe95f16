"""Misspelt words are told with their place; American ones where readers read, and not in code or titles."""

from __future__ import annotations

from pathlib import Path

import pytest

from sitegen.check.spelling import anglicised, spelling


def told(root: Path, capfd: pytest.CaptureFixture[str]) -> tuple[int, list[str]]:
    code = spelling(root)
    return code, [line.removeprefix("./") for line in capfd.readouterr().out.splitlines()]


def test_a_misspelt_and_an_american_word_are_told(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "content").mkdir()
    (tmp_path / "solvers").mkdir()
    chapter, module = tmp_path / "content" / "01-one.md", tmp_path / "solvers" / "one.py"
    chapter.write_text("The colour of a program.\n", "utf-8")
    module.write_text("color = 1  # matplotlib's word\n", "utf-8")
    assert told(tmp_path, capfd) == (0, [])
    chapter.write_text("A neighbor, and the behaviour of the optimizer.\n", "utf-8")
    module.write_text("# It is seperate.\n", "utf-8")
    code, lines = told(tmp_path, capfd)
    assert code == 1
    assert lines == [
        "solvers/one.py:1: seperate ==> separate",
        "content/01-one.md:1: neighbor ==> neighbour",
        "content/01-one.md:1: optimizer ==> optimiser",
    ]


def test_the_titles_of_works_are_spelt_as_they_are(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "content").mkdir()
    (tmp_path / "content" / "references.yaml").write_text("title: On Optimization\n", "utf-8")
    assert told(tmp_path, capfd) == (0, [])


def test_the_dictionary_is_turned_round() -> None:
    """No word that is British itself is among those to be replaced."""
    pairs = dict(line.split("->") for line in anglicised().splitlines())
    assert pairs["center"] == "centre"
    assert "grey" not in pairs
    assert "colour" not in pairs
