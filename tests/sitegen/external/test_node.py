"""The answers of Node scripts, and how scripts that never end are handled."""

from __future__ import annotations

import json
from collections.abc import Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path
from typing import Any

import pytest

from sitegen.external.node import NodeError, run_node

READ = 'import { appendFileSync, readFileSync } from "node:fs";\nconst said = JSON.parse(readFileSync(0, "utf-8"));\n'
Outcomes = dict[str, tuple[Future[Any], Path]]
STAY = "setInterval(() => {}, 1000);\n"


def script(folder: Path, body: str) -> Path:
    """A Node script that reads its request as `said` and then runs `body`."""
    path = folder / "script.mjs"
    path.write_text(READ + body, "utf-8")
    return path


def test_the_last_line_is_the_answer(tmp_path: Path) -> None:
    path = script(tmp_path, 'console.log("on the way"); console.log(JSON.stringify([said, "ü"]));')
    assert run_node(path, {"a": 1}) == [{"a": 1}, "ü"]


@pytest.fixture(scope="module")
def outcomes(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Outcomes]:
    """Scripts that never end, all awaited at once: the result of each, and the file to which each start adds a mark."""
    condition = 'if (readFileSync(said, "utf-8") === "x") '
    bodies = {"answers": ("console.log(7);\n" + STAY, {"attempts": 1}), "always": (STAY, {})}
    with ThreadPoolExecutor() as threads:
        results = {}
        for name, (body, options) in {**bodies, "at first": (condition + STAY + "else console.log(7);", {})}.items():
            folder = tmp_path_factory.mktemp("node")
            path, log = script(folder, 'appendFileSync(said, "x");\n' + body), folder / "begun"
            results[name] = (threads.submit(run_node, path, str(log), timeout=5, **options), log)
        yield results


def test_an_answer_counts_although_its_process_never_ends(outcomes: Outcomes) -> None:
    answer, log = outcomes["answers"]
    assert answer.result() == 7
    assert log.read_text() == "x"


def test_a_script_that_hangs_is_run_once_more(outcomes: Outcomes) -> None:
    answer, log = outcomes["at first"]
    assert answer.result() == 7
    assert log.read_text() == "xx"


def test_one_that_always_hangs_is_an_error_in_the_end(outcomes: Outcomes) -> None:
    answer, log = outcomes["always"]
    with pytest.raises(NodeError, match=r"script\.mjs did not answer within 5 s"):
        answer.result()
    assert log.read_text() == "xx"


@pytest.mark.parametrize(
    ("body", "words"),
    [
        ('throw new Error("no such thing");', "no such thing"),
        ("process.exit(3);", "exited with code 3"),
        ('console.log("{");', "returned invalid JSON"),
        ("", "returned invalid JSON"),
    ],
)
def test_a_failure_tells_why(tmp_path: Path, body: str, words: str) -> None:
    with pytest.raises(NodeError, match=words):
        run_node(script(tmp_path, body), json.dumps({}))
