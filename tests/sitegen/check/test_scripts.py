"""The scripts' lint and type checks find mistakes. A whole test run applies both to the real scripts, as steps that
tests/sitegen/cli/test_run_tests.py names."""

from __future__ import annotations

import re
import shutil
from pathlib import Path

import pytest

from sitegen.check.scripts import script_lint, script_types

ROOT = Path(__file__).resolve().parents[3]
SCRIPTS = "templates/assets/js"


@pytest.fixture
def checkout(tmp_path: Path) -> Path:
    """The templates and the preview in a separate folder."""
    for folder in ("templates", "sitegen/serve/preview"):
        shutil.copytree(ROOT / folder, tmp_path / folder)
    return tmp_path


def edit(path: Path, old: str, new: str) -> None:
    text = path.read_text("utf-8")
    assert old in text
    path.write_text(text.replace(old, new, 1), "utf-8")


def test_lint_tells_a_mistake_and_an_import_upwards(checkout: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """By file, line and column, in the preview's scripts as in the page's, and nothing else."""
    edit(checkout / SCRIPTS / "base/emitter.js", "export function", "let idle = 1;\nexport function")
    edit(checkout / SCRIPTS / "base/record.js", "const LONGEST", 'import "../figure/state.js";\nconst LONGEST')
    edit(checkout / "sitegen/serve/preview/swap.js", "const state = keep();", "let state = keep();")
    assert script_lint(checkout) == 1
    output = capsys.readouterr().err.splitlines()
    places, rules = zip(*((line.split(":")[0], line.rpartition("(")[2]) for line in output), strict=True)
    assert places == (
        "sitegen/serve/preview/swap.js", f"{SCRIPTS}/base/emitter.js", f"{SCRIPTS}/base/emitter.js",
        f"{SCRIPTS}/base/record.js",
    )  # fmt: skip
    assert rules == ("prefer-const)", "no-unused-vars)", "prefer-const)", "no-restricted-imports)")
    assert all(re.match(r"[^:]+:[1-9]\d*:[1-9]\d*: ", line) for line in output)


def test_types_are_told(checkout: Path, capfd: pytest.CaptureFixture[str]) -> None:
    """In the page's scripts, the workers and the preview."""
    edit(checkout / SCRIPTS / "figure/motion.js", "calm() ||", "calm(1) ||")
    edit(checkout / "templates/assets/sw.js", "worker.registration", "worker.registrations")
    edit(checkout / "sitegen/serve/preview/swap.js", "ladder()?.describeCards()", "ladder().describeCards()")
    assert script_types(checkout) == 1
    output = capfd.readouterr().out
    assert f"{SCRIPTS}/figure/motion.js(" in output
    assert "templates/assets/sw.js(" in output
    assert "sitegen/serve/preview/swap.js(" in output
