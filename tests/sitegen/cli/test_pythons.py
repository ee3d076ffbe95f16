"""Which Pythons of a machine are tried, and where: real interpreters are queried, stand-ins answer as others would."""

from __future__ import annotations

import os
import sys
from pathlib import Path

import pytest

from sitegen.cli import pythons
from sitegen.cli.pythons import Interpreter, candidates, copied, interpreters

pytestmark = pytest.mark.native


def program(path: Path, prints: str, code: int = 0) -> Path:
    """A program that prints something and exits with a code, whatever its arguments."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(f"#!/bin/sh\necho '{prints}'\nexit {code}\n", "utf-8")
    path.chmod(0o755)
    return path


def test_this_python_is_found_and_says_its_version(tmp_path: Path) -> None:
    """Under the name that it has on the PATH."""
    (tmp_path / "python3").symlink_to(sys.executable)
    (tmp_path / "python3-config").symlink_to(sys.executable)
    results = interpreters(candidates({"PATH": str(tmp_path), "PYENV_ROOT": str(tmp_path / "none")}))
    assert [(p.version, p.path) for p in results] == [(tuple(sys.version_info[:3]), tmp_path / "python3")]


def test_the_newest_release_of_each_minor_version_is_tried(tmp_path: Path) -> None:
    """On the PATH and under pyenv; none too old, unreleased, broken, or shadowed by one that can make environments."""
    path, pyenv = tmp_path / "bin", tmp_path / "pyenv"
    program(path / "python3.10", "3 10 13 final True")
    program(path / "python3.12", "pyenv: python3.12: command not found", 127)
    program(path / "python3.13", "3 13 9 final False")  # as on Debian without python3-venv
    program(path / "python3.14", "3 14 2 final False")
    program(path / "python3.15", "3 15 0 candidate True")
    program(path / "python3.16", "Segmentation fault", 139)
    program(path / "python3.9t", "3 99 0 final True")
    for version in ("3.12.1", "3.12.10", "3.13.0"):
        program(pyenv / "versions" / version / "bin" / "python3", f"{version.replace('.', ' ')} final True")
    environ = {"PATH": os.pathsep.join([str(path), str(tmp_path / "absent")]), "PYENV_ROOT": str(pyenv)}
    results = interpreters(candidates(environ))
    assert [(p.name, p.can_set_up) for p in results] == [("3.12.10", True), ("3.13.0", True), ("3.14.2", False)]


def test_a_copy_holds_edits_and_nothing_that_was_made(tmp_path: Path) -> None:
    root = tmp_path / "checkout"
    sources = ["build.py", "site/.gitignore", "content/site/kept.md", "tests/build/kept.py", ".ci/run", "tests/new.py"]
    outputs = [".git/HEAD", ".venv/bin/python", "site/index.html", "solvers/__pycache__/x.pyc", ".mypy_cache/x"]
    outputs += ["bench.json", "build/peers/bin/python", "dist/x", "a.egg-info/x", ".site-1/index.html"]
    for name in [*sources, *outputs]:
        (root / name).parent.mkdir(parents=True, exist_ok=True)
        (root / name).write_text(name)
    copied(root, tmp_path / "copy")
    files = (path for path in (tmp_path / "copy").rglob("*") if path.is_file())
    copies = {path.relative_to(tmp_path / "copy").as_posix() for path in files}
    assert copies == {*sources}


def test_one_that_fails_fails_the_whole_and_the_others_are_tried(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    """Each is reported with its outcome; one that cannot make environments is reported and skipped."""
    for name in ("build.py", "site/.gitignore"):
        (tmp_path / "root" / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / "root" / name).touch()
    results = [
        Interpreter((3, 98, 0), True, program(tmp_path / "a", "fails", 1)),
        Interpreter((3, 99, 0), True, program(tmp_path / "b", "passes")),
        Interpreter((3, 99, 1), False, program(tmp_path / "c", "is not run")),
        Interpreter((*sys.version_info[:2], 0), True, program(tmp_path / "d", "is not run")),
    ]
    monkeypatch.setattr(pythons, "interpreters", lambda paths: results)
    monkeypatch.setenv("LADDER_CACHE", str(tmp_path / "cache"))
    assert pythons.test_pythons(tmp_path / "root") == 1
    output = capfd.readouterr().out
    assert "Python 3.98.0: FAILED" in output
    assert "Python 3.99.0: builds the site, solver tests pass" in output
    assert "without ensurepip" in output
    assert output.count("fails\n") == 1, "what needs a site is not begun where there is none"
    assert output.count("passes\n") == len(pythons.steps())
    assert "is not run\n" not in output
