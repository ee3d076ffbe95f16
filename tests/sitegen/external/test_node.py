"""What a Node script answers, and what becomes of one that does not end."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from sitegen.external.node import NodeError, run_node

READ = 'import { appendFileSync, readFileSync } from "node:fs";\nconst said = JSON.parse(readFileSync(0, "utf-8"));\n'
STAY = "setInterval(() => {}, 1000);\n"


def script(folder: Path, body: str) -> Path:
    """A Node script that has read its request as `said` and does `body`."""
    path = folder / "script.mjs"
    path.write_text(READ + body, "utf-8")
    return path


def test_the_last_line_is_the_answer(tmp_path: Path) -> None:
    path = script(tmp_path, 'console.log("on the way"); console.log(JSON.stringify([said, "ü"]));')
    assert run_node(path, {"a": 1}) == [{"a": 1}, "ü"]


def test_an_answer_counts_although_its_process_never_ends(tmp_path: Path) -> None:
    path = script(tmp_path, "console.log(JSON.stringify(said + 1));\n" + STAY)
    assert run_node(path, 1, timeout=5, attempts=1) == 2


def test_a_script_that_hangs_is_run_once_more(tmp_path: Path) -> None:
    begun = tmp_path / "begun"
    first = 'appendFileSync(said, "x");\nif (readFileSync(said, "utf-8") === "x") '
    assert run_node(script(tmp_path, first + STAY + "else console.log(7);"), str(begun), timeout=5) == 7
    assert begun.read_text() == "xx"


def test_one_that_always_hangs_is_an_error_in_the_end(tmp_path: Path) -> None:
    begun = tmp_path / "begun"
    path = script(tmp_path, 'appendFileSync(said, "x");\n' + STAY)
    with pytest.raises(NodeError, match=r"script\.mjs did not answer within 5 s"):
        run_node(path, str(begun), timeout=5)
    assert begun.read_text() == "xx"


@pytest.mark.parametrize(
    ("body", "words"),
    [
        ('throw new Error("no such thing");', "no such thing"),
        ("process.exit(3);", "ended with code 3"),
        ('console.log("{");', "gave no JSON"),
        ("", "gave no JSON"),
    ],
)
def test_a_failure_tells_why(tmp_path: Path, body: str, words: str) -> None:
    with pytest.raises(NodeError, match=words):
        run_node(script(tmp_path, body), json.dumps({}))
