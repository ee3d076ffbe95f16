"""What an edit touches: a chapter's pages and claims, the tests that import a module, or everything."""

from __future__ import annotations

import subprocess
from pathlib import Path

import pytest

from sitegen.cli.changed import OF_PAGES, Chosen, chosen, differing, importing

ROOT = Path(__file__).resolve().parents[3]


def git(root: Path, *words: str) -> None:
    who = ("-c", "user.name=A", "-c", "user.email=a@example.org")
    subprocess.run(["git", *who, *words], cwd=root, check=True, capture_output=True)


def test_what_differs_is_what_was_edited_added_or_taken_away(tmp_path: Path) -> None:
    for name in ("a.md", "b.md", "c.md"):
        (tmp_path / name).write_text("first\n", "utf-8")
    git(tmp_path, "init", "-q")
    git(tmp_path, "add", "-A")
    git(tmp_path, "commit", "-qm", "first")
    assert differing(tmp_path, "HEAD") == []
    (tmp_path / "a.md").write_text("second\n", "utf-8")
    (tmp_path / "b.md").unlink()
    (tmp_path / "d.md").write_text("new\n", "utf-8")
    assert differing(tmp_path, "HEAD") == ["a.md", "b.md", "d.md"]
    with pytest.raises(ValueError, match="git cannot compare with 'nothing'"):
        differing(tmp_path, "nothing")


def test_a_chapter_s_edit_runs_its_claims_and_its_page() -> None:
    found = chosen(ROOT, ["content/02-ransac.md"])
    assert found.pages == ("ransac.html",)
    assert "tests/claims/test_corrupted_pairs.py::test_halving_the_fraction_takes_four_times_the_trials" in found.tests
    assert not any(name.startswith("tests/claims/test_soft_family.py") for name in found.tests)
    assert set(OF_PAGES) <= set(found.tests)
    assert chosen(ROOT, ["content/00-start.md"]).pages == ("index.html",)
    assert chosen(ROOT, ["content/docs/index.md", "content/docs/style.md"]).pages == ("docs-style.html", "docs.html")


def test_with_python_beside_it_every_page_is_looked_at() -> None:
    found = chosen(ROOT, ["content/02-ransac.md", "widgets/figures/race/field.py"])
    assert found.pages == ()
    assert set(OF_PAGES) <= set(found.tests)


def test_a_module_s_edit_runs_the_tests_that_import_it_through_others_as_well() -> None:
    """Through modules, through a helper of the tests, and through the fixtures of their folder."""
    found = importing(ROOT, ["sitegen/cli/changed.py"])
    assert {"tests/sitegen/cli/test_changed.py", "tests/sitegen/cli/test_run_tests.py"} <= found
    assert "tests/solvers/test_units.py" not in found
    assert "tests/solvers/test_units.py" in importing(ROOT, ["solvers/core/pose.py"])
    helped = importing(ROOT, ["tests/browser/layout.py"])
    assert "tests/browser/accessibility/test_axe.py" in helped
    assert "tests/solvers/test_units.py" not in helped
    assert "tests/sitegen/chapters/test_drags.py" in importing(ROOT, ["tests/sitegen/conftest.py"])
    assert importing(ROOT, ["tests/solvers/test_units.py"]) == {"tests/solvers/test_units.py"}


def test_what_everything_depends_on_runs_everything() -> None:
    assert chosen(ROOT, ["pyproject.toml", "content/02-ransac.md"]) == Chosen((), everything=True)
    assert chosen(ROOT, []) == Chosen(())
