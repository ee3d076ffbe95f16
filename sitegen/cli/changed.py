"""Chooses what `test --changed` runs: the tests of the files that differ from a commit, on the edited chapters'
pages."""

from __future__ import annotations

import ast
import re
import subprocess
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import grimp

ROOMS = ("solvers", "sitegen", "widgets")
CLAIM = re.compile(r"\]\{\s*(tests/[^\s}]+?::\w+)")
SLUG = re.compile(r"^slug: *[\"']?([a-z0-9-]+)", re.MULTILINE)
# A chapter's settings of its figures and the targets of its links; everything else is words.
ASKED = re.compile(r"\]\{[^{}]*\}|\{#[^{}]*\}|^ +(?:figure|plot|set|panels|controls|readouts): .*", re.MULTILINE)
# Tests of every page, whatever it says.
OF_PAGES = (
    "tests/browser/pages/test_static.py",
    "tests/browser/pages/test_search.py::test_search_by_key_leads_to_the_section",
    "tests/browser/accessibility/test_axe.py",
    "tests/browser/deck/test_slides.py::test_every_slide_of_every_deck_fits",
)
# Tests that read the words of all chapters and docs.
OF_WORDS = (
    "tests/claims/test_snippets.py",
    "tests/sitegen/assets/test_style_guide.py",
    "tests/sitegen/bench/test_gallery.py",
    "tests/sitegen/bench/test_readme_table.py",
    "tests/sitegen/pages/test_decks.py::test_every_chapter_has_a_complete_deck",
    "tests/sitegen/pages/test_decks.py::test_decks_are_kept_offline_and_in_the_zip_and_not_searched",
    "tests/sitegen/pages/test_notebooks.py::test_every_chapters_notebook_is_whole",
    "tests/sitegen/pages/test_notebooks.py::test_pictures_need_nothing",
    "tests/sitegen/pages/test_notebooks.py::test_every_chapters_notebook_runs",
    "tests/sitegen/pages/test_real_chapters.py",
    "tests/sitegen/pages/test_real_docs.py",
)
# The folders in which a test that names a chapter's file reads it; in tests/sitegen such names belong to small test
# sites.
OF_TEXTS = ("tests/claims", "tests/solvers")
OF_LOOKS = ("tests/browser", "tests/scripts", "tests/sitegen", "tests/test_imports.py")
# The repository's stored results of long runs, and the code that produces them.
KEPT = ("solvers/", "sitegen/experiments/", "sitegen/plots/", "content/data/sweep/", "content/data/plots/")
# Packages loaded by name or read as files, which imports do not show: loader → packages, with everything in them.
LOADS = {
    "sitegen.chapters.values": ("solvers",),
    "sitegen.plots.registry": ("sitegen.plots",),
    "sitegen.runtime.exercise": ("solvers", "widgets"),
    "sitegen.runtime.wheel": ("solvers", "widgets"),
    "sitegen.serve.build_process": ("sitegen.pipeline",),
    "solvers": ("solvers.per_method",),
    "solvers.core.registry": ("solvers.methods",),
    "solvers.core.result": ("solvers.uncertainty.closed_form",),
    "tests.browser.conftest": ("sitegen.pipeline",),
    "tests.conftest": ("tests.recorded",),
    "tests.pyodide.inside": ("solvers", "widgets"),
    "tests.pyodide.test_inside": ("tests.widgets",),
    "tests.pyodide.test_inside_solvers": ("tests.solvers",),
    "tests.sitegen.pages.test_api_reference": ("solvers",),
    "tests.sitegen.pages.test_real_docs": ROOMS,
    "tests.solvers.test_examples": ("solvers",),
    "tests.solvers.test_public_names": ("solvers",),
    "tests.test_imports": (*ROOMS, "tests"),
    "widgets.engine.registry": ("widgets.figures",),
}


@dataclass(frozen=True)
class Chosen:
    """What to run: pytest's files and tests, the pages to which tests of every page are restricted (empty: all), and
    whether to run everything, because something that everything depends on has changed."""

    tests: tuple[str, ...]
    pages: tuple[str, ...] = ()
    everything: bool = False


def differing(root: Path, commit: str) -> list[str]:
    """The files that differ from the commit, including new and deleted ones. Raises ValueError if git does not know the
    commit."""
    names = []
    for words in (  # ls-files first: where git may read no repository, diff would only tell how to compare two files
        ["ls-files", "--others", "--exclude-standard"],
        ["diff", "--name-only", "--no-renames", commit, "--"],
    ):
        names += _git(root, commit, *words).splitlines()
    return sorted(set(names))


def steps(names: Iterable[str]) -> list[str]:
    """The steps of a whole run before pytest that these files need, by their kinds."""
    due = {"ruff", "spelling", "check"}
    for name in names:
        room, kind = name.split("/")[0], Path(name).suffix
        if room in ROOMS and kind in (".py", ".pyi"):
            due |= {"mypy", "imports"}
        if room in ("templates", "sitegen") and kind in (".js", ".mjs", ".ts", ".json"):
            due |= {"eslint", "tsc"}
        if name.startswith(KEPT):
            due.add("sweep")
    return sorted(due)


def chosen(root: Path, names: Sequence[str], commit: str = "HEAD") -> Chosen:
    """The tests of these files, which differ from the commit; everything if one is deleted, as its use is unknown."""
    if not all((root / name).is_file() for name in names):
        return Chosen((), everything=True)
    tests: set[str] = set()
    chapters: set[str] = set()
    modules = {name for name in names if name.endswith(".py") and name.split("/")[0] in (*ROOMS, "tests")}
    for name in set(names) - modules - {"tests/results.json"}:
        room = name.split("/")[0]
        if room == "content" and name.endswith(".md"):
            chapters.add(name)
            tests |= {test for room in OF_TEXTS for test in _naming(root, Path(name).name, room, "test_*.py")}
        elif room == "content":
            chapters |= _naming(root, name, "content", "*.md")
            modules |= naming(root, name)
        elif room == "templates":
            tests |= set(OF_LOOKS)
        elif name.endswith(".md"):
            modules |= naming(root, name)
            tests |= {"tests/claims/test_snippets.py", "tests/sitegen/cli", "tests/sitegen/pages/test_real_docs.py"}
        elif room == "tests" and name.endswith(".mjs"):
            tests.add("tests/scripts")
        else:
            return Chosen((), everything=True)
    pages = set()
    for name in chapters:
        text, old_text = (root / name).read_text("utf-8"), _previous_text(root, commit, name)
        its = _pages(Path(name), text)
        tests |= {*CLAIM.findall("\n\n".join(_paragraphs(text) - _paragraphs(old_text))), *OF_PAGES, *OF_WORDS}
        if ASKED.findall(text) != ASKED.findall(old_text):
            mentions = (*its, Path(name).name)
            tests |= {test for mention in mentions for test in _naming(root, mention, "tests/browser", "test_*.py")}
        pages |= its
    tests |= importing(root, modules)
    only = all(name.startswith("content/") for name in names) and not modules
    return Chosen(tuple(sorted(name for name in tests if _exists(root, name))), tuple(sorted(pages)) if only else ())


def naming(root: Path, name: str) -> set[str]:
    """The modules that name a file or its folder, and so may read it."""
    modules = {module for room in (*ROOMS, *OF_TEXTS, "tests/browser") for module in _naming(root, name, room, "*.py")}
    return modules - {"sitegen/cli/changed.py"}  # names some files, but reads only those that git lists


def importing(root: Path, modules: Iterable[str]) -> set[str]:
    """The test files that import or load one of these modules, directly or not, or are one of them."""
    names = {_module_name(name) for name in modules}
    if not names:
        return set()
    graph, of = _imports(root)
    touched = names | {far for name in names & graph.modules for far in graph.find_downstream_modules(name)}
    files = (path for name, path in of.items() if name in touched and path.name.startswith("test_"))
    return {path.relative_to(root).as_posix() for path in files}


@cache
def _imports(root: Path) -> tuple[grimp.ImportGraph, dict[str, Path]]:
    """The graph of imports and loads, including tests; and the files of the tests' modules."""
    import grimp

    of = {_module_name(path.relative_to(root).as_posix()): path for path in (root / "tests").rglob("*.py")}
    graph = grimp.build_graph(*ROOMS)
    for name, path in of.items():
        for module in (_imports_of(path) | _fixtures(name)) & (graph.modules | of.keys()):
            graph.add_import(importer=name, imported=module)
    for loader, modules in LOADS.items():
        for module in graph.modules:
            if module != loader and any(f"{module}.".startswith(f"{parent}.") for parent in modules):
                graph.add_import(importer=loader, imported=module)
    return graph, of


def _git(root: Path, commit: str, *words: str) -> str:
    command = ["git", "-c", "core.quotePath=false", *words]
    try:
        result = subprocess.run(command, cwd=root, capture_output=True, text=True, encoding="utf-8", check=False)
    except FileNotFoundError as error:
        raise ValueError(f"cannot compare with {commit!r}: git is not installed") from error
    if result.returncode:
        raise ValueError(f"git cannot compare with {commit!r}: {result.stderr.strip()}")
    return result.stdout


def _previous_text(root: Path, commit: str, name: str) -> str:
    """A file's text at the commit; "" if there was none."""
    listing = _git(root, commit, "ls-tree", "--name-only", commit, "--", name)
    return _git(root, commit, "show", f"{commit}:{name}") if listing else ""


def _paragraphs(text: str) -> set[str]:
    return set(re.split(r"\n\s*\n", text))


def _naming(root: Path, name: str, folder: str, pattern: str) -> set[str]:
    """The files in a folder that contain a file's name, or its folder's if that is nested."""
    path = Path(name)
    words = {path.name, *([path.parent.as_posix()] if len(path.parts) > 2 else [])}
    files = (path for path in (root / folder).rglob(pattern) if any(word in path.read_text("utf-8") for word in words))
    return {path.relative_to(root).as_posix() for path in files}


def _pages(file: Path, text: str) -> set[str]:
    """The page of a chapter and its slides, or the page of a docs file."""
    if file.parent.name == "docs":
        return {"docs.html" if file.stem == "index" else f"docs-{file.stem}.html"}
    match = SLUG.search(text)
    slug = match[1] if match else file.stem.partition("-")[2]
    page = "index.html" if file.name.startswith("00-") else f"{slug}.html"
    return {page, f"slides-{page}"}


def _module_name(name: str) -> str:
    return name.removesuffix(".py").removesuffix("/__init__").replace("/", ".")


def _imports_of(path: Path) -> set[str]:
    """The modules that a file imports, or may import: `from a import b` gives a and a.b."""
    modules = set()
    for node in ast.walk(ast.parse(path.read_text("utf-8"))):
        if isinstance(node, ast.Import):
            modules |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            modules |= {node.module, *(f"{node.module}.{alias.name}" for alias in node.names)}
    return modules


def _fixtures(name: str) -> set[str]:
    """The conftest modules whose fixtures a test module gets without importing them."""
    folders = name.split(".")[:-1]
    return {".".join([*folders[: k + 1], "conftest"]) for k in range(len(folders))} - {name}


def _exists(root: Path, test: str) -> bool:
    return (root / test.partition("::")[0]).exists()
