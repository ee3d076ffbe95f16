"""House rules for every file: which way imports run, how long a file may be, which hosts are never named."""

from __future__ import annotations

import ast
import pkgutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

import widgets.figures

ROOT = Path(__file__).resolve().parent.parent
STDLIB = frozenset(sys.stdlib_module_names)
SOURCES = ("build.py", "solvers", "widgets", "sitegen", "templates", "tests")
LONGEST = 400
LONGER: dict[str, str] = {}  # file → why it is one idea all the same

# Written in parts, so that this file does not name them either.
REGISTRIES = [".".join(parts) for parts in (
    ("pypi", "org"), ("pythonhosted", "org"), ("npmjs", "org"), ("npmjs", "com"), ("deb", "debian", "org"),
)]  # fmt: skip
CDN, MANIFEST = ".".join(("jsdelivr", "net")), "sitegen/external/pins.toml"


def python_files(package: str) -> list[Path]:
    return sorted((ROOT / package).rglob("*.py"))


def imports(path: Path) -> Iterator[tuple[str, bool]]:
    """The top-level packages that a file imports, and whether at import time. Relative imports name its own."""
    tree = ast.parse(path.read_text("utf-8"))
    inner = {id(n) for f in ast.walk(tree) if isinstance(f, (ast.FunctionDef, ast.Lambda)) for n in ast.walk(f)}
    own = path.relative_to(ROOT).parts[0]
    for node in ast.walk(tree):
        names = []
        if isinstance(node, ast.Import):
            names = [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            names = [own if node.level else node.module or ""]
        for name in names:
            yield name.partition(".")[0], id(node) not in inner


def foreign(path: Path, packages: frozenset[str] | set[str]) -> list[str]:
    return sorted({name for name, _ in imports(path)} - STDLIB - packages)


@pytest.mark.parametrize("path", python_files("solvers"), ids=lambda p: p.relative_to(ROOT).as_posix())
def test_solvers_import_numpy_and_the_standard_library_alone(path: Path) -> None:
    """In the browser there is only numpy. SciPy is tested below; the command line may draw with matplotlib."""
    packages = {"numpy", "solvers", "scipy"}
    if path == ROOT / "solvers" / "cli" / "picture.py":
        packages.add("matplotlib")
        assert ("matplotlib", True) not in set(imports(path)), "matplotlib is an extra: asked for at call time"
    assert foreign(path, packages) == []


def test_scipy_is_asked_in_two_places_and_only_when_called() -> None:
    """SciPy serves a tree and a sparse factorisation; both files import without it, as they must in the browser."""
    paths = {path: at_once for path in python_files("solvers") for name, at_once in imports(path) if name == "scipy"}
    assert set(paths) == {ROOT / "solvers/geometry/nearest.py", ROOT / "solvers/posegraph/linear.py"}
    assert not any(paths.values())


@pytest.mark.parametrize("path", python_files("widgets"), ids=lambda p: p.relative_to(ROOT).as_posix())
def test_widgets_import_solvers_numpy_and_the_standard_library_alone(path: Path) -> None:
    """The figures depend on the solvers, not on the generator."""
    assert foreign(path, {"numpy", "solvers", "widgets"}) == []


@pytest.mark.parametrize("path", python_files("sitegen"), ids=lambda p: p.relative_to(ROOT).as_posix())
def test_the_generator_knows_neither_the_commands_nor_the_tests(path: Path) -> None:
    """Nothing imports upwards."""
    assert {"build", "tests"}.isdisjoint(name for name, _ in imports(path))


LATE = {
    "solvers.posegraph": {"pose_loop"},
    "solvers.uncertainty": {"spread"},
    "solvers.scenes.drive": {"drive", "own_clouds", "wrong_loop"},
    "solvers.odometry": set(),
}
"""Packages that a page loads only when it shows a figure that needs them. No page runs the drive's odometry: its
figures read stored results."""


def test_graphs_drives_and_covariances_are_imported_where_they_are_shown_alone() -> None:
    """Importing the figures that show none of them loads none; each figure that shows one loads that one alone."""
    showing = set[str]().union(*LATE.values())
    names = {module.name for module in pkgutil.iter_modules(widgets.figures.__path__)}
    assert showing < names
    assert late_imports(names - showing) == set()
    for name in showing:
        assert late_imports({name}) == {module for module in LATE if name in LATE[module]}, name


def late_imports(figures: set[str]) -> set[str]:
    """The packages of `LATE` that a fresh Python loads for these figures."""
    ask = (
        "import sys; from widgets.engine.registry import WIDGETS\n"
        f"assert all(WIDGETS[name.replace('_', '-')] for name in {sorted(figures)!r})\n"
        f"print(*(name for name in {list(LATE)!r} if name in sys.modules))"
    )
    process = subprocess.run([sys.executable, "-c", ask], cwd=ROOT, capture_output=True, text=True, check=True)
    return set(process.stdout.split())


def test_the_commands_begin_with_python_alone() -> None:
    """Help, error messages and the set-up run before anything is installed, that is, without any site-packages."""
    code = (
        "import runpy, sys; sys.argv = ['build.py', '--help']\n"
        "try: runpy.run_path('build.py', run_name='__main__')\n"
        "except SystemExit as end: assert not end.code, end.code\n"
        "import sitegen.cli.clean\n"
        "tops = {name.partition('.')[0] for name in sys.modules}\n"
        "print('beyond:', sorted(tops - set(sys.stdlib_module_names) - {'sitegen', '__main__', '__mp_main__'}))"
    )
    command = [sys.executable, "-S", "-E", "-c", code]
    process = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, encoding="utf-8", check=False)
    assert process.returncode == 0, process.stderr
    assert "beyond: []" in process.stdout


def test_no_file_is_longer_than_one_idea() -> None:
    """Beyond four hundred lines a file has become two; exceptions are named with their reason."""
    long = {}
    for source in SOURCES:
        base = ROOT / source
        for path in [base] if base.is_file() else sorted(base.rglob("*")):
            if path.suffix in (".py", ".js", ".mjs", ".css") and "__pycache__" not in path.parts:
                lines = len(path.read_text("utf-8").splitlines())
                if lines > LONGEST:
                    long[path.relative_to(ROOT).as_posix()] = lines
    assert set(long) == set(LONGER), long


def tracked_files() -> list[Path]:
    listing = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, text=True, check=False).stdout
    names = listing.split("\0") if listing else [str(p) for name in SOURCES for p in (ROOT / name).rglob("*")]
    return [ROOT / name for name in names if name and (ROOT / name).is_file()]


def test_no_registry_is_named_and_the_cdn_only_in_the_manifest() -> None:
    """Packages are requested by name through their clients, so any mirror that a machine is set to will do."""
    results = []
    for path in tracked_files():
        text, name = path.read_bytes().decode("utf-8", "ignore"), path.relative_to(ROOT).as_posix()
        results += [(name, host) for host in REGISTRIES if host in text]
        if CDN in text and name != MANIFEST:
            results.append((name, CDN))
    assert results == []
