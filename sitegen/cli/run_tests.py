"""`test`: lint, types, a strict build with its checks, then pytest over everything, in a real browser.

Of a part (a file, -k NAME …) nothing is run but these tests, and before them what they need: a browser, the built site.
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


class Ledger:
    """A pytest plugin: notes for the claims every outcome, and what tests of a cause have changed; closes with what
    failed before pytest began."""

    def __init__(self, failures: Sequence[str]) -> None:
        self.failed = failures
        self.reports: list[tuple[str, claims.Outcome]] = []
        self.changes: dict[str, whys.Change] = {}

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        """A test has passed when its call did; set-up and tear-down can only fail it."""
        change = whys.recorded(report.user_properties)
        if change is not None:
            self.changes[report.nodeid] = change
        if report.failed:
            self.reports.append((report.nodeid, "failed"))
        elif report.when == "call" and report.passed:
            self.reports.append((report.nodeid, "passed"))

    def pytest_terminal_summary(self, terminalreporter: pytest.TerminalReporter) -> None:
        """Shown just before the closing line, which would else be all that one sees."""
        if self.failed:
            terminalreporter.section("before the tests", red=True)
            terminalreporter.write_line(f"failed: {', '.join(self.failed)} (see above)", red=True)


class Question:
    """A pytest plugin that has nothing run, and keeps what pytest makes of its arguments."""

    options = argparse.Namespace()

    @pytest.hookimpl(tryfirst=True)
    def pytest_cmdline_main(self, config: pytest.Config) -> int:
        """In place of a run."""
        self.options = config.option
        return 0


class Needs:
    """A pytest plugin that sees to what the tests of a part need, before the first of them runs."""

    def __init__(self, root: Path, browser_path: Path | None) -> None:
        self.root, self.given = root, browser_path

    def pytest_collection_finish(self, session: pytest.Session) -> None:
        """What they need is told by their fixtures."""
        fixtures = {name for item in session.items for name in getattr(item, "fixturenames", ())}
        fault = "" if session.config.option.collectonly else self.fault(fixtures)
        if fault:
            pytest.exit(fault, 1)

    def fault(self, fixtures: Collection[str]) -> str:
        """A browser where one is driven, the site as its sources are where it is looked at; what cannot be had."""
        fault = find_browsers([], self.given) if "playwright" in fixtures else ""
        if not fault and "site" in fixtures and build_command(self.root) != 0:
            return "these tests need the built site, which cannot be built"
        return fault


ENGINE_TESTS = "tests/browser/engines"
HOSTILE_TESTS = "tests/hostile"
USUAL = "not hostile"  # the marks that pyproject.toml has every run ask for
PROCESSES = 4  # at most: the longest file of tests takes a quarter of all
# pytest's options that choose among the tests, or run none.
CHOOSING = ("keyword", "markexpr", "deselect", "ignore", "ignore_glob", "lf", "stepwise", "collectonly", "help")


def test(root: Path, engines: Sequence[str], browser_path: Path | None, further: Sequence[str]) -> int:
    """Run everything, with Chromium; or the part that `further` arguments, which go to pytest, choose; or, on the
    engines that are named, what is tested on every engine.

    The exit code is 0 only when nothing at all failed; an engine that is absent and cannot be installed has failed.
    """
    os.chdir(root)
    options = understood(further)
    if options is None:
        return 2
    if is_part(root, options) and not engines:
        return test_part(Needs(root, browser_path), options, further)
    fault = find_browsers(engines, browser_path)
    if fault:
        print(fault, file=sys.stderr)
        return 1
    os.environ["LADDER_ENGINES"] = ",".join(engines or ["chromium"])
    steps = every_step(root)
    if engines:
        steps = {"check": steps["check"]}
        further = [*further, *([] if any(ENGINE_TESTS in word for word in further) else [ENGINE_TESTS])]
    else:  # what the engines' tests ask of Chromium, the other tests ask too
        further = [*processes(options), f"--ignore={ENGINE_TESTS}", *further]
    failures = failing(steps)
    print("== pytest", flush=True)
    ledger = Ledger(failures)
    code = int(pytest.main([*further], plugins=[ledger]))
    if ledger.reports and not engines:
        claims.write_results(root, claims.merged(ledger.reports), ledger.changes)
    return 1 if code or failures else 0


def every_step(root: Path) -> dict[str, Callable[[], int]]:
    """What a whole run does before pytest, by its name."""
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
    """Take all of these steps; the names of those that failed."""
    failures = []
    for name, step in steps.items():
        print(f"== {name}", flush=True)
        if step() != 0:
            failures.append(name)
    return failures


def test_part(needs: Needs, options: argparse.Namespace, further: Sequence[str]) -> int:
    """Run some tests after what they need, and nothing else; what a claim's test last said stays as it was."""
    if getattr(options, "numprocesses", None):  # these choose for themselves, and tell this one nothing
        fault = needs.fault(("playwright", "site"))
        if fault:
            print(fault, file=sys.stderr)
            return 1
    return 1 if pytest.main([*further], plugins=[needs]) else 0


def test_changed(root: Path, commit: str, browser_path: Path | None, further: Sequence[str]) -> int:
    """Run what the files that differ from a commit touch: of the steps of a whole run those of their kinds, then their
    tests; everything, where everything depends on one of them."""
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
        print(f"nothing differs from {commit}")
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
    code = int(pytest.main(words, plugins=[Ledger(failures)])) if choice.tests else 0
    return 1 if code or failures else 0


def understood(words: Sequence[str]) -> argparse.Namespace | None:
    """pytest's options by its arguments; None, and pytest has told why, where it does not know them."""
    question = Question()
    return question.options if pytest.main([*words], plugins=[question]) == 0 else None


def is_part(root: Path, options: argparse.Namespace) -> bool:
    """Whether pytest is asked for some of the tests: by files, by -k and the like."""
    everything = {root.resolve(), (root / "tests").resolve()}
    some = {Path(name.partition("::")[0]).resolve() for name in options.file_or_dir}
    choices = {name for name in CHOOSING if getattr(options, name, None)}
    if getattr(options, "markexpr", "") == USUAL:
        choices.discard("markexpr")
    return bool(some and not some & everything) or bool(choices)


def hostile(root: Path, further: Sequence[str]) -> int:
    """Run the tests that make thousands of hostile calls, and no others; they need no browser and no site."""
    os.chdir(root)
    options = understood(further)
    if options is None:
        return 2
    return int(pytest.main([*processes(options), "-m", "hostile", *further, HOSTILE_TESTS]))


def processes(options: argparse.Namespace, count: int | None = None) -> list[str]:
    """What makes pytest run in as many processes as the machine has (or `count`), a file in one of them, unless it is
    told how. The browser's files come first: they take longest."""
    count = min(PROCESSES, (os.cpu_count() or 1) if count is None else count)
    decided = getattr(options, "numprocesses", None) is not None or options.usepdb or options.capture == "no"
    return [] if decided or count < 2 else [f"-n{count}", "--dist=loadfile", "--no-loadscope-reorder"]


def find_browsers(engines: Sequence[str], browser_path: Path | None) -> str:
    """Find or install the engines' programs and name them to the tests; what cannot be had. Where no engines are named,
    all that needs no window is tested in Chromium's shell."""
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
    """Hold the rooms to the contracts in pyproject.toml. Its command has no module of its own to run."""
    asks = "from importlinter.cli import lint_imports_command; lint_imports_command()"
    command = [sys.executable, "-P", "-c", asks, "--no-cache"]
    env = {**os.environ, "PYTHONPATH": "."}
    return subprocess.run(command, stdin=subprocess.DEVNULL, env=env, check=False).returncode


def module(*words: str) -> int:
    """Run a tool of the environment."""
    return subprocess.run([sys.executable, "-P", "-m", *words], stdin=subprocess.DEVNULL, check=False).returncode
