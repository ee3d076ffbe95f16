"""What an edit affects: a chapter's pages and claims, the tests that import a module, or everything."""

from __future__ import annotations

import re
import shutil
from pathlib import Path

import pytest

from sitegen.cli.changed import (
    LOADS,
    OF_LOOKS,
    OF_PAGES,
    OF_WORDS,
    Chosen,
    chosen,
    differing,
    importing,
    steps,
)
from tests.sitegen.conftest import git

ROOT = Path(__file__).resolve().parents[3]


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
    git(tmp_path, "mv", "c.md", "e.md")  # gone from its old path
    assert differing(tmp_path, "HEAD") == ["a.md", "b.md", "c.md", "d.md", "e.md"]
    with pytest.raises(ValueError, match="git cannot compare with 'nothing'"):
        differing(tmp_path, "nothing")


def test_a_file_s_name_may_have_any_letters(tmp_path: Path) -> None:
    """git would put such a name in quotes, with numbers for its letters; and then everything would run."""
    (tmp_path / "ä ½.md").write_text("first\n", "utf-8")
    git(tmp_path, "init", "-q")
    git(tmp_path, "add", "-A")
    git(tmp_path, "commit", "-qm", "first")
    (tmp_path / "ä ½.md").write_text("second\n", "utf-8")
    (tmp_path / "ö.md").write_text("new\n", "utf-8")
    assert differing(tmp_path, "HEAD") == ["ä ½.md", "ö.md"]


def test_why_git_cannot_compare_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """In a folder that git does not know, as in one of another user, or without git; not how to use `git diff`."""
    monkeypatch.setenv("LC_ALL", "C")  # git speaks many languages
    with pytest.raises(ValueError, match=r"^git cannot compare with 'HEAD': fatal: not a git repository"):
        differing(tmp_path, "HEAD")
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(ValueError, match=r"^cannot compare with 'HEAD': git is not installed$"):
        differing(tmp_path, "HEAD")


def edit(root: Path, name: str, old: str, new: str) -> None:
    path = root / name
    text = path.read_text("utf-8")
    assert old in text
    path.write_text(text.replace(old, new), "utf-8")


@pytest.fixture
def checkout(tmp_path: Path) -> Path:
    """The project's sources, committed."""
    for room in ("content", "sitegen", "solvers", "templates", "tests", "widgets"):
        shutil.copytree(ROOT / room, tmp_path / room, ignore=shutil.ignore_patterns("__pycache__"))
    shutil.copy(ROOT / "README.md", tmp_path)
    git(tmp_path, "init", "-q")
    git(tmp_path, "add", "-A")
    git(tmp_path, "commit", "-qm", "first")
    return tmp_path


def test_what_a_chapter_s_edit_runs(checkout: Path) -> None:
    """The tests of its pages; the claims of edited sentences; the browser tests of its figures if these changed."""
    chapter, drives = "content/02-ransac.md", "tests/browser/widgets/test_ransac.py"
    claim = "tests/claims/test_corrupted_pairs.py::test_halving_the_fraction_takes_four_times_the_trials"
    edit(checkout, chapter, "summary: ", "summary: Once more. ")
    result = chosen(checkout, [chapter])
    assert result.pages == ("ransac.html", "slides-ransac.html")
    assert not any(name.startswith("tests/claims/test_corrupted") for name in result.tests)
    assert {*OF_PAGES, *OF_WORDS} <= set(result.tests)
    assert drives not in result.tests
    edit(checkout, chapter, f"]{{{claim}}}", f" indeed]{{{claim}}}")
    result = chosen(checkout, [chapter])
    assert claim in result.tests
    assert drives not in result.tests
    edit(checkout, chapter, "]{ransac ", "]{ransac  ")
    assert drives in chosen(checkout, [chapter]).tests
    (checkout / "content/20-new.md").write_text("---\ntitle: New\nslug: new\n---\n\nWords.\n", "utf-8")
    assert chosen(checkout, ["content/20-new.md"]).pages == ("new.html", "slides-new.html")


def test_the_start_page_and_the_docs_have_pages_of_other_names() -> None:
    assert chosen(ROOT, ["content/00-start.md"]).pages == ("index.html", "slides-index.html")
    assert chosen(ROOT, ["content/docs/index.md", "content/docs/style.md"]).pages == ("docs-style.html", "docs.html")


def test_with_python_beside_it_every_page_is_looked_at() -> None:
    result = chosen(ROOT, ["content/02-ransac.md", "widgets/figures/race/field.py"])
    assert result.pages == ()
    assert set(OF_PAGES) <= set(result.tests)


def test_all_that_is_named_is_there() -> None:
    """The listed tests exist, and so do the modules that load others by name."""
    for test in (*OF_PAGES, *OF_WORDS, *OF_LOOKS):
        path, _, name = test.partition("::")
        assert (ROOT / path).exists(), test
        assert not name or f"def {name}(" in (ROOT / path).read_text("utf-8"), test
    for name in (name for loader, modules in LOADS.items() for name in (loader, *modules)):
        path = ROOT / name.replace(".", "/")
        assert path.is_dir() or path.with_suffix(".py").is_file(), name


# They load only modules from outside the project.
FOREIGN = {
    "sitegen.bench.solvers", "sitegen.experiments.sweep", "sitegen.runtime.compile_in_pyodide",
    "sitegen.runtime.patches", "tests.sitegen.chapters.test_values",
}  # fmt: skip


def test_whoever_loads_modules_by_name_is_listed() -> None:
    """A new one must declare what it loads, since no import graph shows it."""
    names = {
        path.relative_to(ROOT).with_suffix("").as_posix().removesuffix("/__init__").replace("/", ".")
        for room in ("solvers", "sitegen", "widgets", "tests")
        for path in (ROOT / room).rglob("*.py")
        if re.search(r"\b(?:import_module|__import__|walk_packages|iter_modules)\(", path.read_text("utf-8"))
        if "page-python" not in path.parts  # stands in for Pyodide's own modules
    }
    assert names - set(LOADS) == FOREIGN


@pytest.mark.parametrize(
    ("file", "test"),
    [
        ("solvers/methods/mmd/mmd.py", "tests/solvers/test_hostile.py"),  # a method, through the list of methods
        ("widgets/figures/race/field.py", "tests/widgets/test_every_widget.py"),  # a figure, likewise
        ("solvers/uncertainty/closed_form.py", "tests/pyodide/test_equality.py"),  # in the page's Python
        ("solvers/core/pose.py", "tests/browser/figures/test_live.py"),  # in the built site
        ("sitegen/plots/basins.py", "tests/sitegen/pipeline/test_build.py"),
        ("tests/solvers/test_units.py", "tests/pyodide/test_inside_solvers.py"),
        ("tests/recorded.py", "tests/claims/test_race.py"),
        ("content/data/sweep/curves.json", "tests/claims/test_race.py"),
        ("content/data/sweep/curves.json", "tests/browser/figures/test_plots.py"),
        ("content/data/plots/coverage.json", "tests/sitegen/figures/test_parts.py"),
        ("content/site.yaml", "tests/sitegen/pages/test_ladder.py"),
        ("content/glossary.yaml", "tests/sitegen/chapters/test_glossary.py"),
        ("content/13-reading.md", "tests/claims/test_real_scans.py"),
        ("solvers/README.md", "tests/sitegen/cli/test_package.py"),
        ("tests/scripts/marks.test.mjs", "tests/scripts"),
        ("templates/figure.html", "tests/browser"),
    ],
)
def test_what_reads_a_file_is_run(file: str, test: str) -> None:
    assert test in chosen(ROOT, [file]).tests


@pytest.mark.parametrize(
    ("file", "due"),
    [
        ("content/02-ransac.md", set()),
        ("solvers/core/pose.py", {"mypy", "imports", "sweep"}),
        ("solvers/_functions.pyi", {"mypy", "imports", "sweep"}),
        ("widgets/drawing/svg.py", {"mypy", "imports"}),
        ("templates/assets/js/main.js", {"eslint", "tsc"}),
        ("templates/assets/worker.mjs", {"eslint", "tsc"}),
        ("templates/assets/css/print.css", set()),
        ("content/data/sweep/curves.json", {"sweep"}),
        ("content/data/plots/coverage.json", {"sweep"}),
        ("sitegen/plots/coverage.py", {"mypy", "imports", "sweep"}),
        ("tests/solvers/test_units.py", set()),
    ],
)
def test_steps_are_taken_by_kind(file: str, due: set[str]) -> None:
    assert set(steps([file])) == {"ruff", "spelling", "check"} | due


def test_a_module_s_edit_runs_the_tests_that_import_it_through_others_as_well() -> None:
    """Through modules, through a helper of the tests, and through the fixtures of their folder."""
    result = importing(ROOT, ["sitegen/cli/changed.py"])
    assert {"tests/sitegen/cli/test_changed.py", "tests/sitegen/cli/test_run_tests.py"} <= result
    assert "tests/solvers/test_units.py" not in result
    assert not any(test.startswith("tests/solvers/") for test in importing(ROOT, ["sitegen/chapters/links.py"]))
    assert "tests/solvers/test_units.py" in importing(ROOT, ["solvers/core/pose.py"])
    tests = importing(ROOT, ["tests/browser/layout.py"])
    assert "tests/browser/accessibility/test_axe.py" in tests
    assert "tests/solvers/test_units.py" not in tests
    assert "tests/sitegen/chapters/test_drags.py" in importing(ROOT, ["tests/sitegen/conftest.py"])
    inside = {"tests/pyodide/test_inside_solvers.py", "tests/test_imports.py"}
    assert importing(ROOT, ["tests/solvers/test_units.py"]) == {"tests/solvers/test_units.py", *inside}


def test_what_everything_depends_on_runs_everything() -> None:
    """So does a deleted file: nothing shows what depended on it."""
    assert chosen(ROOT, ["solvers/methods/gone.py", "content/02-ransac.md"]) == Chosen((), everything=True)
    assert chosen(ROOT, ["pyproject.toml", "content/02-ransac.md"]) == Chosen((), everything=True)
    assert chosen(ROOT, []) == Chosen(())
