"""`test` runs everything, on all cores of a small machine; a chosen part gets what it needs and nothing else."""

from __future__ import annotations

import argparse
import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from sitegen.cli.run_tests import PROCESSES, Ledger, imports, is_part, processes
from tests.sitegen.conftest import git

ROOT = Path(__file__).resolve().parents[3]
SPREAD = ["--dist=loadfile", "--no-loadscope-reorder"]

# Runs the command on a small checkout, once per row of words; its steps besides pytest are recorded, not run.
RUNNER = """
import contextlib, io, json, sys
from pathlib import Path
from sitegen.cli import run_tests
told = []
def notes(what, code=0):
    return lambda *_, **__: told.append(what) or code
root, engines, builds, runs, commit = json.loads(sys.argv[1])
run_tests.module = lambda *words: told.append(words[0]) or 0
run_tests.publish_and_check, run_tests.prove_kept = notes("check"), notes("sweep")
run_tests.scripts.script_lint, run_tests.scripts.script_types = notes("eslint"), notes("tsc")
run_tests.imports, run_tests.spelling = notes("imports"), notes("spelling", "misspelt" in root)
run_tests.build_command = notes("build", builds)
run_tests.browsers.found = lambda *_: told.append("browser") or Path("a-browser")
run_tests.claims.write_results = lambda root, outcomes, changes: told.append(f"results of {len(outcomes)}")
found = []
for words in runs:
    told.clear()
    with contextlib.redirect_stdout(io.StringIO()) as printed, contextlib.redirect_stderr(printed):
        words = ["-p", "no:cacheprovider", *words]
        try:
            if commit:
                code = run_tests.test_changed(Path(root), commit, None, words)
            else:
                code = run_tests.test(Path(root), engines, None, words)
        except KeyboardInterrupt:
            code = "stopped"
    found.append([code, [*told], printed.getvalue()])
print(json.dumps(found))
"""
WHOLE = ["browser", "ruff", "spelling", "mypy", "imports", "eslint", "tsc", "check", "sweep", "results of 3"]


@pytest.fixture
def checkout(tmp_path: Path) -> Path:
    """Tests that need nothing, the built site, or a browser as well; and a folder of tests for every engine."""
    (tmp_path / "pyproject.toml").write_text("[tool.pytest.ini_options]\ntestpaths = ['tests']\n", "utf-8")
    (tmp_path / "tests" / "browser" / "engines").mkdir(parents=True)
    fixtures = "import pytest\n@pytest.fixture\ndef site(): pass\n@pytest.fixture\ndef playwright(): pass\n"
    (tmp_path / "tests" / "conftest.py").write_text(fixtures, "utf-8")
    (tmp_path / "tests" / "test_plain.py").write_text("def test_plain(): pass\n", "utf-8")
    (tmp_path / "tests" / "test_looks.py").write_text("def test_looks(site): pass\n", "utf-8")
    (tmp_path / "tests" / "browser" / "test_drives.py").write_text("def test_drives(playwright, site): pass\n", "utf-8")
    (tmp_path / "tests" / "browser" / "engines" / "test_every.py").write_text("def test_every(): pass\n", "utf-8")
    return tmp_path


def run(
    root: Path, *runs: str, engines: tuple[str, ...] = (), builds: int = 0, commit: str = ""
) -> list[tuple[int | str, list[str], str]]:
    """For each run: its exit code ("stopped" after Ctrl-C), its steps besides pytest, and its output. `builds` is the
    exit code of a build; with `commit`, only what has changed since then is tested."""
    request = json.dumps([str(root), engines, builds, [line.split() for line in runs], commit])
    env = {**os.environ, "PYTHONPATH": str(ROOT)}
    command = [sys.executable, "-c", RUNNER, request]
    process = subprocess.run(command, env=env, capture_output=True, text=True, check=False)
    assert process.returncode == 0, process.stdout + process.stderr
    return [tuple(result) for result in json.loads(process.stdout)]


def test_a_whole_run_leaves_nothing_out(checkout: Path) -> None:
    """Also with options on how to run it, or with all tests named."""
    for code, report, output in run(checkout, "", ". -n0 --maxfail=1 --durations 3", "-n0 -x tests"):
        assert (code, report) == (0, WHOLE), output
        assert "3 passed" in output


PARTS = {
    "tests/test_plain.py": ([], 1),
    "tests/test_plain.py::test_plain -v": ([], 1),
    "-k plain": ([], 1),
    "-xkplain": ([], 1),
    "tests/test_looks.py": (["build"], 1),
    "-k drives": (["browser", "build"], 1),
    "tests/browser/test_drives.py tests/test_plain.py": (["browser", "build"], 2),
    "-n2 tests/test_plain.py": (["browser", "build"], 1),
}


def test_a_part_gets_what_it_needs(checkout: Path) -> None:
    """No lint, spelling, types, checks or sweep, and the tracked file of results is not written."""
    for (needs, count), result in zip(PARTS.values(), run(checkout, *PARTS), strict=True):
        assert result[:2] == (0, needs), result[2]
        assert f"{count} passed" in result[2]
    ((code, report, _),) = run(checkout, "--collect-only tests/browser")
    assert (code, report) == (0, [])


def test_what_fails_or_is_unknown_is_told(checkout: Path) -> None:
    """A failing test gives exit code 1; what was mistyped (an option, a file, a test, a name, an engine) gives 2, and
    an option, a file or an engine does so before anything else."""
    (checkout / "tests" / "test_plain.py").write_text("def test_plain(): assert False\n", "utf-8")
    fails, unknown, absent, several, test, name = run(
        checkout,
        "-k plain",
        "--max-fial=1",
        "tests/test_plian.py",
        "-n2 tests/test_plian.py",
        "tests/test_plain.py::test_plian",
        "-k plian",
    )
    assert fails[:2] == (1, [])
    assert unknown[:2] == (2, [])
    assert "--max-fial" in unknown[2]
    for code, report, output in (absent, several):
        assert (code, report) == (2, [])
        assert "no such file or folder: tests/test_plian.py; did you mean 'tests/test_plain.py'?" in output
    assert test[:2] == name[:2] == (2, [])
    ((code, report, output),) = run(checkout, "", engines=("gecko",))
    assert (code, report) == (2, [])
    assert output == "unknown engine 'gecko'; known: chromium, firefox, webkit\n"


def test_ctrl_c_in_a_run_is_no_result(checkout: Path) -> None:
    """It ends the command as everywhere else; no results are recorded, as a test may have run for some of its cases."""
    (checkout / "tests" / "test_plain.py").write_text("def test_plain(): raise KeyboardInterrupt\n", "utf-8")
    whole, part = run(checkout, "-n0", "-n0 -k plain")
    assert whole[:2] == ("stopped", WHOLE[:-1]), whole[2]
    assert part[:2] == ("stopped", []), part[2]


def test_a_site_that_cannot_be_built_ends_the_part(checkout: Path) -> None:
    ((code, report, output),) = run(checkout, "tests/test_looks.py", builds=1)
    assert (code, report) == (1, ["build"])
    assert "which cannot be built" in output
    assert "passed" not in output


def test_an_engine_s_tests_write_no_results(checkout: Path) -> None:
    ((code, report, output),) = run(checkout, "", engines=("firefox",))
    assert (code, report) == (0, ["browser", "check"]), output
    assert "1 passed" in output


@pytest.fixture
def repository(checkout: Path) -> Path:
    """The checkout with a chapter, a test of every page, and a package for each of the rooms."""
    (checkout / "content").mkdir()
    chapter = "---\nslug: one\n---\n\nSo it is.[it]{tests/test_plain.py::test_plain}\n"
    (checkout / "content" / "01-one.md").write_text(chapter, "utf-8")
    for room in ("solvers", "sitegen", "widgets"):
        (checkout / room).mkdir()
        (checkout / room / "__init__.py").write_text("", "utf-8")
    code = "def pytest_addoption(parser): parser.addoption('--pages')\n"
    (checkout / "tests" / "conftest.py").write_text(code, "utf-8")
    static = checkout / "tests" / "browser" / "pages" / "test_static.py"
    static.parent.mkdir()
    static.write_text("def test_static(pytestconfig): print(pytestconfig.getoption('--pages'))\n", "utf-8")
    (checkout / "tests" / "test_solvers.py").write_text("import solvers\ndef test_solvers(): pass\n", "utf-8")
    (checkout / ".gitignore").write_text("__pycache__/\n", "utf-8")  # runs may leave bytecode behind
    git(checkout, "init", "-q")
    git(checkout, "add", "-A")
    git(checkout, "commit", "-qm", "first")
    return checkout


BRIEF = ["browser", "ruff", "spelling", "check"]


def test_changed_runs_what_a_chapter_s_edit_touches(repository: Path) -> None:
    """Its claim and the tests of every page, for its pages only; lint, spelling and check, and no other step."""
    chapter = repository / "content" / "01-one.md"
    chapter.write_text(chapter.read_text("utf-8") + "More.\n", "utf-8")
    ((code, report, output),) = run(repository, "-n0 -v -rP", commit="HEAD")
    assert (code, report) == (0, BRIEF), output
    assert "2 passed" in output
    assert "one.html,slides-one.html" in output


def test_changed_runs_what_a_module_s_edit_touches(repository: Path) -> None:
    (repository / "solvers" / "__init__.py").write_text("ONE = 1\n", "utf-8")
    ((code, report, output),) = run(repository, "-n0", commit="HEAD")
    assert (code, report) == (0, ["browser", "ruff", "spelling", "mypy", "imports", "check", "sweep"]), output
    assert "1 passed" in output


def test_changed_runs_everything_where_everything_may_depend_on_it(repository: Path) -> None:
    (repository / "solvers" / "__init__.py").unlink()
    (repository / "tests" / "test_solvers.py").write_text("def test_solvers(): pass\n", "utf-8")
    ((_, report, _),) = run(repository, "-n0", commit="HEAD")
    assert report[: len(WHOLE) - 1] == WHOLE[:-1]


def test_changed_says_what_it_cannot_do_or_need_not(repository: Path) -> None:
    """Nothing differs; no such commit; an option that pytest does not know."""
    nothing, unknown = run(repository, "", "--max-fial=1", commit="HEAD")
    assert nothing[:2] == (0, [])
    assert "no changes since HEAD" in nothing[2]
    assert unknown[:2] == (2, [])
    ((code, report, output),) = run(repository, "", commit="nowhere")
    assert (code, report) == (2, [])
    assert "git cannot compare with 'nowhere'" in output


@pytest.mark.parametrize("fails", ["step", "test"])
def test_changed_fails_where_something_does(repository: Path, fails: str) -> None:
    """A failed step is reported after the tests, which run all the same; a failing test alone suffices."""
    root = repository.rename(repository.with_name("misspelt")) if fails == "step" else repository
    wrong = "assert False" if fails == "test" else "pass"
    (root / "tests" / "test_solvers.py").write_text(f"def test_solvers(): {wrong}\n", "utf-8")
    ((code, report, output),) = run(root, "-n0", commit="HEAD")
    assert (code, report) == (1, BRIEF), output
    assert ("1 failed" if fails == "test" else "1 passed") in output
    assert ("failed: spelling (see above)" in output) == (fails == "step")


def arguments(**options: Any) -> argparse.Namespace:
    """pytest's default options, with some of them set."""
    plain = {"file_or_dir": [], "keyword": "", "numprocesses": None, "usepdb": False, "capture": "fd"}
    return argparse.Namespace(**{**plain, **options})


@pytest.mark.parametrize(("cores", "used"), [(2, 2), (4, 4), (64, PROCESSES)])
def test_a_whole_run_uses_the_machine(cores: int, used: int) -> None:
    """As many processes as cores, up to a limit."""
    assert processes(arguments(), cores) == [f"-n{used}", *SPREAD]


@pytest.mark.parametrize("option", [{"numprocesses": 0}, {"usepdb": True}, {"capture": "no"}])
def test_a_word_on_it_is_left_alone(option: dict[str, Any]) -> None:
    """A debugger, visible prints and a given number take precedence; one core needs no other process."""
    assert processes(arguments(**option), 2) == []
    assert processes(arguments(), 1) == []


def test_the_folder_of_all_tests_is_no_part() -> None:
    assert not is_part(ROOT, arguments(file_or_dir=[str(ROOT / "tests")]))
    assert is_part(ROOT, arguments(file_or_dir=[str(ROOT / "tests" / "solvers")]))


def test_an_import_against_the_direction_of_the_rooms_fails(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    """Upwards between rooms, even inside a function, and between two families of methods."""
    for name in ("solvers", "widgets", "sitegen"):
        shutil.copytree(ROOT / name, tmp_path / name, ignore=shutil.ignore_patterns("__pycache__"))
    shutil.copy(ROOT / "pyproject.toml", tmp_path)
    monkeypatch.chdir(tmp_path)
    assert imports() == 0
    wrong = {
        "solvers/core/pose.py": "def _late():\n    import solvers.geometry.rigid\n",
        "solvers/methods/mmd/mmd.py": "import solvers.methods.soft.cpd\n",
        "sitegen/cache/files.py": "import sitegen.pages.writer\n",
    }
    for path, line in wrong.items():
        with (tmp_path / path).open("a", encoding="utf-8") as file:
            file.write(f"\n\n{line}")
    capfd.readouterr()
    assert imports() == 1
    output = capfd.readouterr().out
    for contract in ("The rooms of solvers", "No family of methods knows another", "The rooms of the generator"):
        assert re.search(rf"{contract}.* BROKEN", output)


def test_a_skipped_test_is_not_recorded_as_passed() -> None:
    ledger = Ledger([])
    stages: tuple[tuple[Any, Any], ...] = (("setup", "passed"), ("call", "skipped"), ("teardown", "passed"))
    for stage, outcome in stages:
        ledger.pytest_runtest_logreport(pytest.TestReport("a::b", ("a", 0, "b"), {}, outcome, None, stage))
    assert ledger.reports == []
