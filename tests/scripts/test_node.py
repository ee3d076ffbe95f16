"""The page's scripts that work without a page, tested by Node's own runner: each Node test is a pytest case."""

from __future__ import annotations

import re
import subprocess
from pathlib import Path
from xml.etree import ElementTree

import pytest

from sitegen.external.node import environment, node_command

HERE = Path(__file__).parent
FILES = sorted(HERE.glob("*.test.mjs"))
NAMES = [(path, name) for path in FILES for name in re.findall(r'^test\("([^"]+)"', path.read_text("utf-8"), re.M)]


@pytest.fixture(scope="module")
def outcomes() -> dict[tuple[str, str], str]:
    """(file, test) → its fault, "" if it passed; from one run of all files."""
    command = node_command("--no-warnings", "--test", "--test-reporter=junit", *FILES)
    process = subprocess.run(command, capture_output=True, text=True, encoding="utf-8", env=environment(), check=False)
    results = {}
    for case in ElementTree.fromstring(process.stdout).iter("testcase"):
        fault = next((child for child in case if child.tag in ("failure", "error", "skipped")), None)
        words = "" if fault is None else f"{fault.tag}: {fault.get('message', '')}\n{fault.text or ''}"
        results[Path(case.get("file", "")).name, case.get("name", "")] = words
    assert results, process.stdout + process.stderr
    return results


@pytest.mark.parametrize(("path", "name"), NAMES, ids=[f"{path.stem}: {name}" for path, name in NAMES])
def test_script(outcomes: dict[tuple[str, str], str], path: Path, name: str) -> None:
    """The Node test has run and passed."""
    assert outcomes.get((path.name, name), "it did not run") == ""


def test_every_test_of_node_is_listed(outcomes: dict[tuple[str, str], str]) -> None:
    """No test runs without being counted."""
    assert set(outcomes) == {(path.name, name) for path, name in NAMES}
