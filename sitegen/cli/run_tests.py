"""`test`: lint, types, a strict build with its checks, then pytest over everything, in a real browser.

If only some tests are requested (a file, -k NAME …), only these run, after preparing what they need: a browser, the
built site.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
from collections.abc import Callable, Collection, Mapping, Sequence
from pathlib import Path

import pytest

from sitegen.chapters import claims, whys
from sitegen.check import browsers, scripts
from sitegen.check.command import prove_kept, publish_and_check
from sitegen.check.spelling import spelling
from sitegen.cli import changed
from sitegen.pipeline.attempt import build_command
from sitegen.problems import hint


class Ledger:
    """A pytest plugin: records every outcome for the claims, and the changes measured by tests of causes; ends with the
    steps that failed before pytest began."""

    def __init__(self, failures: Sequence[str]) -> None:
        self.failed = failures
        self.reports: list[tuple[str, claims.Outcome]] = []
        self.changes: dict[str, whys.Change] = {}

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        """Record a test as passed if its call passed; set-up and tear-down can only make it fail."""
        change = whys.recorded(report.user_properties)
        if change is not None:
            self.changes[report.nodeid] = change
        if report.failed:
            self.reports.append((report.nodeid, "failed"))
        elif report.when == "call" and report.passed:
            self.reports.append((report.nodeid, "passed"))

    def pytest_terminal_summary(self, terminalreporter: pytest.TerminalReporter) -> None:
        """Print the failed steps just before the closing line, which otherwise would be all that is visible."""
        if self.failed:
            terminalreporter.section("before the tests", red=True)
            terminalreporter.write_line(f"failed: {', '.join(self.failed)} (see above)", red=True)


class Question:
    """A pytest plugin that runs nothing and keeps the options that pytest parsed."""

    options = argparse.Namespace()

    @pytest.hookimpl(tryfirst=True)
    def pytest_cmdline_main(self, config: pytest.Config) -> int:
        """Keep the options instead of running the tests."""
        self.options = config.option
        return 0


class Stop:
    """A pytest plugin: keeps the Ctrl-C that ended the run, which pytest's exit code does not tell."""

    pressed: BaseException | None = None

    def pytest_keyboard_interrupt(self, excinfo: pytest.ExceptionInfo[BaseException]) -> None:
        """Note a Ctrl-C; pytest.exit() comes here too."""
        self.pressed = excinfo.value if excinfo.errisinstance(KeyboardInterrupt) else None


class Needs:
    """A pytest plugin that prepares what the selected tests need before the first one runs."""

    def __init__(self, root: Path, browser_path: Path | None) -> None:
        self.root, self.given = root, browser_path

    def pytest_collection_finish(self, session: pytest.Session) -> None:
        """Prepare what the tests need, judged by their fixtures."""
        fixtures = {name for item in session.items for name in getattr(item, "fixturenames", ())}
        fault = "" if session.config.option.collectonly else self.fault(fixtures)
        if fault:
            pytest.exit(fault, 1)

    def fault(self, fixtures: Collection[str]) -> str:
        """Find a browser and build the site if these fixtures need them; what is not available, or ""."""
        fault = find_browsers([], self.given) if "playwright" in fixtures else ""
        if not fault and "site" in fixtures and build_command(self.root) != 0:
            return "these tests need the built site, which cannot be built"
        return fault


ENGINE_TESTS = "tests/browser/engines"
HOSTILE_TESTS = "tests/hostile"
USUAL = "not hostile"  # the mark expression that pyproject.toml sets for every run
PROCESSES = 4  # at most: the longest test file takes a quarter of the total time
# pytest's options that select tests, or run none.
CHOOSING = ("keyword", "markexpr", "deselect", "ignore", "ignore_glob", "lf", "stepwise", "collectonly", "help")


def test(root: Path, engines: Sequence[str], browser_path: Path | None, further: Sequence[str]) -> int:
    """Run everything, with Chromium; or the tests that `further`, pytest's arguments, selects; or the cross-browser
    tests on the named engines.

    The exit code is 0 only if nothing failed; an engine that is absent and cannot be installed counts as a failure.
    """
    os.chdir(root)
    options = understood(further)
    if options is None:
        return 2
    if is_part(root, options) and not engines:
        return test_part(Needs(root, browser_path), options, further)
    if unknown := [name for name in engines if name not in browsers.ENGINES]:
        print(f"unknown engine {unknown[0]!r}; known: {', '.join(browsers.ENGINES)}", file=sys.stderr)
        return 2
    fault = find_browsers(engines, browser_path)
    if fault:
        print(fault, file=sys.stderr)
        return 1
    os.environ["LADDER_ENGINES"] = ",".join(engines or ["chromium"])
    steps = every_step(root)
    if engines:
        steps = {"check": steps["check"]}
        further = [*further, *([] if any(ENGINE_TESTS in word for word in further) else [ENGINE_TESTS])]
    else:  # for Chromium, the other tests cover what the engines' tests check
        further = [*processes(options), f"--ignore={ENGINE_TESTS}", *further]
    failures = failing(steps)
    print("== pytest", flush=True)
    ledger = Ledger(failures)
    code = pytest_code([*further], ledger)
    if ledger.reports and not engines:
        claims.write_results(root, claims.merged(ledger.reports), ledger.changes)
    return 1 if failures else code


def every_step(root: Path) -> dict[str, Callable[[], int]]:
    """The steps of a whole run before pytest, by name."""
    return {
        "ruff": lambda: module("ruff", "check", "."),
        "spelling": lambda: spelling(root),
        "mypy": lambda: module("mypy"),
        "imports": imports,
        "eslint": lambda: scripts.script_lint(root),
        "tsc": lambda: scripts.script_types(root),
        "check": lambda: publish_and_check(root, root / "site"),
        "sweep": lambda: prove_kept(root, anew=True),
    }


def failing(steps: Mapping[str, Callable[[], int]]) -> list[str]:
    """Run all of these steps; the names of those that failed."""
    failures = []
    for name, step in steps.items():
        print(f"== {name}", flush=True)
        if step() != 0:
            failures.append(name)
    return failures


def test_part(needs: Needs, options: argparse.Namespace, further: Sequence[str]) -> int:
    """Prepare what some tests need and run only them; the recorded results of the claims' tests stay as they were."""
    if getattr(options, "numprocesses", None):  # worker processes select the tests, and this one never sees them
        fault = needs.fault(("playwright", "site"))
        if fault:
            print(fault, file=sys.stderr)
            return 1
    return pytest_code(further, needs)


def pytest_code(words: Sequence[str], *plugins: object) -> int:
    """Run pytest. The exit code is 0 if all passed, 2 if no such tests exist, 1 otherwise. Raises KeyboardInterrupt if
    Ctrl-C ended the run."""
    stop = Stop()
    code = pytest.main([*words], plugins=[stop, *plugins])
    if stop.pressed:
        raise stop.pressed
    if code in (pytest.ExitCode.USAGE_ERROR, pytest.ExitCode.NO_TESTS_COLLECTED):
        return 2
    return 1 if code else 0


def test_changed(root: Path, commit: str, browser_path: Path | None, further: Sequence[str]) -> int:
    """Run what the files that differ from a commit affect: the steps of a whole run for their kinds, then their tests;
    everything if everything depends on one of them."""
    os.chdir(root)
    options = understood(further)
    if options is None:
        return 2
    try:
        names = changed.differing(root, commit)
        choice = changed.chosen(root, names, commit)
    except ValueError as error:
        print(error, file=sys.stderr)
        return 2
    if not names:
        print(f"no changes since {commit}")
        return 0
    if choice.everything:
        return test(root, [], browser_path, further)
    fault = find_browsers([], browser_path)
    if fault:
        print(fault, file=sys.stderr)
        return 1
    os.environ["LADDER_ENGINES"] = "chromium"
    due = changed.steps(names)
    failures = failing({name: step for name, step in every_step(root).items() if name in due})
    pages = [f"--pages={','.join(choice.pages)}"] if choice.pages else []
    words = [*processes(options), f"--ignore={ENGINE_TESTS}", *pages, *choice.tests, *further]
    code = pytest_code(words, Ledger(failures)) if choice.tests else 0
    return 1 if failures else code


def understood(words: Sequence[str]) -> argparse.Namespace | None:
    """pytest's options for these arguments; None if it rejects them, which it reports itself, or if a file is missing,
    which its worker processes would not report."""
    question = Question()
    if pytest.main([*words], plugins=[question]) != 0:
        return None
    names = [] if question.options.pyargs else [name.partition("::")[0] for name in question.options.file_or_dir]
    missing = [name for name in names if not Path(name).exists()]
    for name in missing:
        print(f"test: no such file or folder: {name}{hint(name, claims.test_files(Path()))}", file=sys.stderr)
    return None if missing else question.options


def is_part(root: Path, options: argparse.Namespace) -> bool:
    """Whether only some of the tests are selected: by files, by -k and the like."""
    everything = {root.resolve(), (root / "tests").resolve()}
    paths = {Path(name.partition("::")[0]).resolve() for name in options.file_or_dir}
    choices = {name for name in CHOOSING if getattr(options, name, None)}
    if getattr(options, "markexpr", "") == USUAL:
        choices.discard("markexpr")
    return bool(paths and not paths & everything) or bool(choices)


def hostile(root: Path, further: Sequence[str]) -> int:
    """Run only the tests that make thousands of hostile calls; they need neither a browser nor the site."""
    os.chdir(root)
    options = understood(further)
    if options is None:
        return 2
    return pytest_code([*processes(options), "-m", "hostile", *further, HOSTILE_TESTS])


def processes(options: argparse.Namespace, count: int | None = None) -> list[str]:
    """pytest's arguments for one process per core, or `count`, up to PROCESSES, each test file in one of them; none if
    the options already decide this. The browser's files come first: they take longest."""
    count = min(PROCESSES, (os.cpu_count() or 1) if count is None else count)
    decided = getattr(options, "numprocesses", None) is not None or options.usepdb or options.capture == "no"
    return [] if decided or count < 2 else [f"-n{count}", "--dist=loadfile", "--no-loadscope-reorder"]


def find_browsers(engines: Sequence[str], browser_path: Path | None) -> str:
    """Find or install the engines' programs and pass them to the tests; what is not available, or "". If no engines are
    named, everything that needs no window is tested in Chromium's headless shell."""
    shell = None if engines else browsers.shell(browser_path)
    faults = []
    for name in engines or ["chromium"]:
        try:
            program = browsers.found(name, browser_path if name == "chromium" else None)
            os.environ[f"LADDER_{name.upper()}"] = str(program)
        except browsers.BrowserMissing as error:
            faults.append(str(error))
    if shell:
        os.environ["LADDER_SHELL"] = str(shell)
    return "\n".join(faults)


def imports() -> int:
    """Check the packages' imports against the contracts in pyproject.toml. import-linter cannot be run by `-m`."""
    asks = "from importlinter.cli import lint_imports_command; lint_imports_command()"
    command = [sys.executable, "-P", "-c", asks, "--no-cache"]
    env = {**os.environ, "PYTHONPATH": "."}
    return subprocess.run(command, stdin=subprocess.DEVNULL, env=env, check=False).returncode


def module(*words: str) -> int:
    """Run one of the environment's tools."""
    return subprocess.run([sys.executable, "-P", "-m", *words], stdin=subprocess.DEVNULL, check=False).returncode
