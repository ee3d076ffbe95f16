"""The scripts' lint and types find what they are there for, and nothing in the scripts as they are."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from sitegen.check.scripts import lint_problems, script_lint, script_types

ROOT = Path(__file__).resolve().parents[3]
SCRIPTS = "templates/assets/js"


@pytest.fixture
def checkout(tmp_path: Path) -> Path:
    """The templates and the preview in a folder of their own."""
    for folder in ("templates", "sitegen/serve/preview"):
        shutil.copytree(ROOT / folder, tmp_path / folder)
    return tmp_path


def edit(path: Path, old: str, new: str) -> None:
    text = path.read_text("utf-8")
    assert old in text
    path.write_text(text.replace(old, new, 1), "utf-8")


def test_the_scripts_are_clean() -> None:
    """By both."""
    assert lint_problems(ROOT) == []
    assert script_types(ROOT) == 0


def test_lint_tells_a_mistake_and_an_import_upwards(checkout: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """By file, line and column."""
    edit(checkout / SCRIPTS / "base/emitter.js", "export function", "let idle = 1;\nexport function")
    edit(checkout / SCRIPTS / "base/record.js", "const LONGEST", 'import "../figure/state.js";\nconst LONGEST')
    found = lint_problems(checkout)
    assert [problem.path.rpartition("/")[2] for problem in found] == ["emitter.js", "emitter.js", "record.js"]
    assert [problem.message.rpartition("(")[2] for problem in found] == [
        "no-unused-vars)", "prefer-const)", "no-restricted-imports)",
    ]  # fmt: skip
    assert script_lint(checkout) == 1
    assert str(found[0]) in capsys.readouterr().err


def test_types_are_told(checkout: Path, capfd: pytest.CaptureFixture[str]) -> None:
    """Of the page's scripts, of the workers, and of the preview."""
    edit(checkout / SCRIPTS / "figure/motion.js", "calm() ||", "calm(1) ||")
    edit(checkout / "templates/assets/sw.js", "worker.registration", "worker.registrations")
    edit(checkout / "sitegen/serve/preview/swap.js", "ladder()?.describeCards()", "ladder().describeCards()")
    assert script_types(checkout) == 1
    told = capfd.readouterr().out
    assert f"{SCRIPTS}/figure/motion.js(" in told
    assert "templates/assets/sw.js(" in told
    assert "sitegen/serve/preview/swap.js(" in told


def test_lint_reads_the_preview(checkout: Path) -> None:
    """Its scripts as the page's."""
    edit(checkout / "sitegen/serve/preview/swap.js", "const kept = keep();", "let kept = keep();")
    (problem,) = lint_problems(checkout)
    assert (problem.path, problem.message.rpartition("(")[2]) == ("sitegen/serve/preview/swap.js", "prefer-const)")
