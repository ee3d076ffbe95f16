"""build.py as users start it: by hand, from any folder, on a machine that has nothing installed."""

from __future__ import annotations

import ast
import errno
import importlib.util
import io
import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from sitegen.cli import environment
from sitegen.cli.clean import MADE, clean
from sitegen.cli.main import parse
from tests.conftest import copy_file

ROOT = Path(__file__).resolve().parents[3]

# Stands in for the generator in tests of the way to it.
BUILDING = """\
import json, sys
def build_command(root):
    print(json.dumps({"prefix": sys.prefix, "root": str(root)}))
    return 1
"""


def run(*words: str | Path, cwd: Path | None = None) -> subprocess.CompletedProcess[str]:
    env = {**os.environ, "PYTHONIOENCODING": "utf-8"}
    command = [sys.executable, *map(str, words)]
    return subprocess.run(command, cwd=cwd, env=env, capture_output=True, text=True, encoding="utf-8", check=False)


@pytest.fixture
def checkout(tmp_path: Path) -> Path:
    """The commands alone, in a folder with blanks and non-ASCII characters in its name, with an empty lock."""
    root = tmp_path / "a checkout ½"
    for name in ("build.py", "sitegen/__init__.py", "sitegen/stopping.py", "sitegen/pipeline/__init__.py"):
        copy_file(name, root)
    shutil.copytree(ROOT / "sitegen/cli", root / "sitegen/cli", ignore=shutil.ignore_patterns("__pycache__"))
    (root / "sitegen" / "pipeline" / "attempt.py").write_text(BUILDING, "utf-8")
    (root / "requirements.lock").write_text("# nothing\n", "utf-8")
    return root


def test_the_first_use_sets_up_and_later_ones_do_not(checkout: Path, tmp_path: Path) -> None:
    """.venv is made once, follows a changed lock, is remade after an interruption; the exit code is passed on."""
    first = run(checkout / "build.py", cwd=tmp_path)
    assert first.returncode == 1, first.stderr
    assert json.loads(first.stdout) == {"prefix": str(checkout / ".venv"), "root": str(checkout)}
    assert "set up .venv" in first.stderr
    mark = checkout / ".venv" / "kept"
    mark.touch()

    second = run(checkout / "build.py", "build", cwd=tmp_path)
    assert (second.returncode, second.stdout, second.stderr) == (1, first.stdout, "")

    (checkout / "requirements.lock").write_text("# still nothing\n", "utf-8")
    assert not environment.is_ready(checkout)
    third = run(checkout / "build.py", cwd=tmp_path)
    assert "set up .venv" in third.stderr
    assert environment.is_ready(checkout)
    assert mark.exists(), "a complete environment is brought up to date in place"

    (checkout / ".venv" / environment.STAMP).unlink()
    redone = run(checkout / "build.py", cwd=tmp_path)
    assert "set up .venv" in redone.stderr
    assert json.loads(redone.stdout) == json.loads(first.stdout)
    assert not mark.exists(), "what an interrupted set-up left is not built upon"


def test_a_lock_that_cannot_be_installed_ends_with_what_pip_said(checkout: Path) -> None:
    """No traceback, exit code 1, no stamp: the next call tries again."""
    (checkout / "requirements.lock").write_text(f"./absent-1.0-py3-none-any.whl --hash=sha256:{'0' * 64}\n", "utf-8")
    process = run(checkout / "build.py", cwd=checkout)
    assert process.returncode == 1
    assert "pip could not install the locked packages" in process.stderr
    assert "absent-1.0" in process.stderr
    assert "Traceback" not in process.stderr
    assert not (checkout / ".venv" / environment.STAMP).exists()


def test_a_python_that_cannot_make_environments_says_what_to_install(
    checkout: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Debian ships ensurepip in a separate package."""
    find = importlib.util.find_spec
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None if name == "ensurepip" else find(name))
    with pytest.raises(environment.SetupError, match="apt-get install python3-venv"):
        environment.set_up(checkout)


def test_an_older_python_is_told_so_in_one_line() -> None:
    """Old Pythons read build.py without a syntax error, and it ends with one sentence."""
    ast.parse((ROOT / "build.py").read_text("utf-8"), feature_version=(3, 4))
    older = "import runpy, sys; sys.version_info = (3, 10, 4, 'final', 0)"
    code = f"{older}; runpy.run_path(sys.argv[1], run_name='__main__')"
    process = run("-c", code, ROOT / "build.py")
    assert process.returncode == 1
    assert process.stderr.strip() == "build.py needs Python 3.11 or newer; this is Python 3.10"


@pytest.mark.parametrize(
    ("words", "code", "message"),
    [
        (["--help"], 0, "serve"),
        (["serve", "--help"], 0, "--no-open"),
        (["biuld"], 2, "unknown command 'biuld'; did you mean 'build'?"),
        (["xyzzy"], 2, "unknown command 'xyzzy'; known: build, serve"),
        (["serve", "--prot", "1"], 2, "serve: unknown arguments --prot 1"),
        (["build", "everything"], 2, "build: unknown arguments everything"),
        (["serve", "--port", "x"], 2, "expected a port from 0 to 65535, got 'x'"),
        (["serve", "--port", "70000"], 2, "expected a port from 0 to 65535, got '70000'"),
        (["serve", "--offline-check", "--port", "1"], 2, "--offline-check cannot be combined with --port"),
    ],
)
def test_help_and_mistakes_are_answered_before_any_set_up(
    checkout: Path, words: list[str], code: int, message: str
) -> None:
    """The exit code is 0 for help and 2 for an unknown command, and neither makes a .venv."""
    process = run(checkout / "build.py", *words)
    assert process.returncode == code
    assert message in process.stdout + process.stderr
    assert not (checkout / ".venv").exists()


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ("serve --offline-check --host ::1", "--offline-check cannot be combined with --host"),
        ("serve --no-open --offline-check", "--offline-check cannot be combined with --no-open"),
        ("serve --browser-path chrome", "--browser-path has no effect without --offline-check"),
        ("test --pythons -k kabsch", "--pythons cannot be combined with -k kabsch"),
        ("test --pythons --hostile", "--pythons cannot be combined with --hostile"),
        ("test --pythons --browser-path chrome", "--pythons cannot be combined with --browser-path"),
        ("test --engines firefox --changed", "--changed cannot be combined with --engines"),
        ("test --hostile --changed main", "--hostile cannot be combined with --changed"),
        ("bench --gallery python --only start", "--gallery cannot be combined with --only"),
        ("bench --gallery python --keep", "--gallery cannot be combined with --keep"),
        ("bench --gallery python --out a.json", "--gallery cannot be combined with --out"),
        ("bench --keep --only start", "--keep cannot be combined with --only"),
    ],
)
def test_an_option_that_would_have_no_effect_is_refused(
    words: str, message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as end:
        parse(words.split())
    assert end.value.code == 2
    assert capsys.readouterr().err.endswith(f": error: {message}\n")


@pytest.mark.parametrize(
    "words",
    [
        "test --engines firefox -k drag --browser-path chrome",
        "test --changed main -x",
        "test --hostile --hostile-calls 9",
        "test --pythons",
        "bench --keep --out a.json --browser-path chrome",
        "serve --host ::1 --port 1 --no-open",
        "serve --offline-check --browser-path chrome",
        "",
    ],
)
def test_options_that_go_together_are_taken(words: str) -> None:
    assert parse(words.split()).command == (words.split() or ["build"])[0]


def test_test_passes_further_arguments_on_in_order() -> None:
    """`build.py test -k drag -x tests/browser` reaches pytest as written."""
    arguments = parse(["test", "--engines", "firefox", "-k", "drag", "-x", "tests/browser"])
    assert arguments.engines == "firefox"
    assert arguments.further == ["-k", "drag", "-x", "tests/browser"]
    assert parse(["test", "--engines", "-x"]).engines == "chromium,firefox,webkit"
    assert parse(["test"]).engines == ""


def test_clean_tells_what_cannot_be_removed_and_removes_the_rest(
    checkout: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """As on a read-only tree: one line each, no traceback, exit code 1."""
    for name in ("site/index.html", "site/assets/a.css", ".mypy_cache/x", ".ruff_cache/x"):
        (checkout / name).parent.mkdir(parents=True, exist_ok=True)
        (checkout / name).touch()
    remove = shutil.rmtree

    def stubborn(path: Path) -> None:
        if path.name == ".mypy_cache":
            raise OSError(errno.EROFS, os.strerror(errno.EROFS), str(path))
        remove(path)

    monkeypatch.setattr(shutil, "rmtree", stubborn)
    assert clean(checkout) == 1
    output = capsys.readouterr()
    assert output.err == "clean: .mypy_cache cannot be removed: Read-only file system\n"
    assert "removed .ruff_cache" in output.out
    assert not (checkout / "site" / "index.html").exists()


def test_clean_removes_everything_though_nobody_reads_what_it_says(
    checkout: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As behind `| head`, which exits once it has its lines."""

    class Gone(io.StringIO):
        def write(self, text: str) -> int:
            raise BrokenPipeError

    for name in (".mypy_cache/x", ".ruff_cache/x"):
        (checkout / name).parent.mkdir(parents=True, exist_ok=True)
        (checkout / name).touch()
    monkeypatch.setattr(sys, "stdout", Gone())
    assert clean(checkout) == 0
    assert not (checkout / ".mypy_cache").exists()
    assert not (checkout / ".ruff_cache").exists()


def test_clean_leaves_the_site_folder_and_the_sources(checkout: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Files made by the commands are removed, people's files stay; .venv goes only with --all."""
    outputs = ["site/index.html", "site/assets/a.css", ".mypy_cache/x", "sitegen/__pycache__/x.pyc", ".venv/bin/x"]
    outputs += ["bench.json", "build/peers/bin/python", "dist/a.whl", "a.egg-info/x", ".site-1/x", ".grimp_cache/x"]
    stays = ["site/.gitignore", "sitegen/cli/main.py", "content/01-a.md", "content/build/a.svg"]
    for name in [*outputs, *stays]:
        (checkout / name).parent.mkdir(parents=True, exist_ok=True)
        (checkout / name).touch()
    assert clean(checkout) == 0
    assert [name for name in outputs if (checkout / name).exists()] == [".venv/bin/x"]
    monkeypatch.delenv("LADDER_CACHE", raising=False)
    assert clean(checkout, everything=True) == 1, "the cache of a broken .venv cannot be found, and that is said"
    assert not (checkout / ".venv").exists()
    assert all((checkout / name).exists() for name in stays)


def test_whatever_git_ignores_is_what_clean_removes() -> None:
    """Git ignores exactly what the commands make, and .venv, which only --all removes."""
    patterns = (ROOT / ".gitignore").read_text("utf-8").split()
    assert {name.rstrip("/") for name in patterns} == {*MADE, ".venv"}


def test_clean_removes_no_folder_that_a_variable_names(
    checkout: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """LADDER_CACHE may be anyone's folder, with other things in it."""
    path = tmp_path / "mine" / "thesis.tex"
    path.parent.mkdir()
    path.touch()
    monkeypatch.setenv("LADDER_CACHE", str(path.parent))
    assert clean(checkout, everything=True) == 0
    assert path.exists()
