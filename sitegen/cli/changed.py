"""What `test --changed` runs: the tests of what differs from a commit, and of a chapter's edit only its own pages."""

from __future__ import annotations

import ast
import re
import subprocess
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

ROOMS = ("solvers", "sitegen", "widgets")
CLAIM = re.compile(r"\]\{\s*(tests/[^\s}]+?::\w+)")
SLUG = re.compile(r"^slug: *[\"']?([a-z0-9-]+)", re.MULTILINE)
# What holds of every page, whatever it says.
OF_PAGES = (
    "tests/browser/pages/test_static.py",
    "tests/browser/accessibility/test_axe.py",
    "tests/browser/figures/test_lead.py",
    "tests/browser/deck/test_slides.py::test_every_slide_of_every_deck_fits",
)
OF_WORDS = ("tests/sitegen/pages/test_notebooks.py", "tests/sitegen/pages/test_real_docs.py")
OF_LOOKS = ("tests/browser", "tests/scripts", "tests/sitegen/assets")


@dataclass(frozen=True)
class Chosen:
    """What to run: pytest's files and tests, the pages that tests of every page go to (none: all of them), and whether
    the whole run is due, since everything depends on something that has changed."""

    tests: tuple[str, ...]
    pages: tuple[str, ...] = ()
    everything: bool = False


def differing(root: Path, commit: str) -> list[str]:
    """The files that differ from the commit, new ones as well, that are still there or were. Raises ValueError where
    git does not know the commit."""
    listed = []
    for words in (["diff", "--name-only", commit, "--"], ["ls-files", "--others", "--exclude-standard"]):
        done = subprocess.run(["git", *words], cwd=root, capture_output=True, text=True, check=False)
        if done.returncode:
            raise ValueError(f"git cannot compare with {commit!r}: {done.stderr.strip()}")
        listed += done.stdout.splitlines()
    return sorted(set(listed))


def chosen(root: Path, names: Sequence[str]) -> Chosen:
    """The tests of these files."""
    tests: set[str] = set()
    pages: set[str] = set()
    modules = [name for name in names if name.endswith(".py") and name.split("/")[0] in (*ROOMS, "tests")]
    for name in names:
        room = name.split("/")[0]
        if name in modules or name == "tests/results.json":
            continue
        if room == "content" and name.endswith(".md") and (root / name).is_file():
            text = (root / name).read_text("utf-8")
            tests |= {*CLAIM.findall(text), *OF_PAGES, *OF_WORDS}
            pages |= _pages(Path(name), text)
        elif room == "content":
            tests |= {*OF_WORDS, "tests/browser/pages"}
        elif room == "templates":
            tests |= set(OF_LOOKS)
        elif name in ("README.md", "CHANGELOG.md"):
            tests |= {"tests/sitegen/cli", "tests/sitegen/bench"}
        elif not name.endswith(".md"):
            return Chosen((), everything=True)
    tests |= importing(root, modules)
    only = all(name.startswith("content/") and name.endswith(".md") for name in names)
    return Chosen(tuple(sorted(name for name in tests if _there(root, name))), tuple(sorted(pages)) if only else ())


def importing(root: Path, modules: Iterable[str]) -> set[str]:
    """The files of tests that import one of these modules, through others as well, or are one of them."""
    import grimp

    names = {_dotted(name) for name in modules if (root / name).is_file()}
    if not names:
        return set()
    graph = grimp.build_graph(*ROOMS)
    touched = names | {far for name in names & graph.modules for far in graph.find_downstream_modules(name)}
    of = {_dotted(path.relative_to(root).as_posix()): path for path in (root / "tests").rglob("*.py")}
    imports = {name: _imported(path) | _fixtures(name) for name, path in of.items()}
    found = {name for name, wanted in imports.items() if name in touched or wanted & touched}
    while more := {name for name, wanted in imports.items() if wanted & found} - found:
        found |= more
    return {of[name].relative_to(root).as_posix() for name in found if of[name].name.startswith("test_")}


def _pages(file: Path, text: str) -> set[str]:
    """The page of a chapter, or of a page of the docs, and its slides."""
    if file.parent.name == "docs":
        return {"docs.html" if file.stem == "index" else f"docs-{file.stem}.html"}
    found = SLUG.search(text)
    slug = found[1] if found else file.stem.partition("-")[2]
    return {"index.html" if file.name.startswith("00-") else f"{slug}.html"}


def _dotted(name: str) -> str:
    return name.removesuffix(".py").removesuffix("/__init__").replace("/", ".")


def _imported(path: Path) -> set[str]:
    """The modules that a file imports, and what might be one: `from a import b` names a and a.b."""
    found = set()
    for node in ast.walk(ast.parse(path.read_text("utf-8"))):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            found |= {node.module, *(f"{node.module}.{alias.name}" for alias in node.names)}
    return found


def _fixtures(name: str) -> set[str]:
    """The conftest modules whose fixtures a module of tests is given without importing them."""
    folders = name.split(".")[:-1]
    return {".".join([*folders[: k + 1], "conftest"]) for k in range(len(folders))} - {name}


def _there(root: Path, test: str) -> bool:
    return (root / test.partition("::")[0]).exists()
