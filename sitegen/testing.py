"""`test`: lint, types, a strict build with its checks, then pytest over everything, in a real browser."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable, Sequence
from pathlib import Path

import pytest

from sitegen import browser, claims
from sitegen.check import prove_sweep, publish_and_check


class Ledger:
    """A pytest plugin: notes every outcome for the claims, and closes with what failed before pytest began."""

    def __init__(self, failed: Sequence[str]) -> None:
        self.failed = failed
        self.reports: list[tuple[str, claims.Outcome]] = []

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        """A test has passed when its call did; set-up and tear-down can only fail it."""
        if report.failed:
            self.reports.append((report.nodeid, "failed"))
        elif report.when == "call" and report.passed:
            self.reports.append((report.nodeid, "passed"))

    def pytest_terminal_summary(self, terminalreporter: pytest.TerminalReporter) -> None:
        """Shown just before the closing line, which would else be all that one sees."""
        if self.failed:
            terminalreporter.section("before the tests", red=True)
            terminalreporter.write_line(f"failed: {', '.join(self.failed)} (see above)", red=True)


ENGINE_TESTS = "tests/browser/engines"
PROCESSES = 4  # at most: the longest file of tests takes a quarter of all


def test(root: Path, engines: Sequence[str], given: Path | None, further: Sequence[str]) -> int:
    """Run everything, with Chromium; or, on the engines that are named, what is tested on every engine.

    `further` arguments go to pytest. The exit code is 0 only when nothing at all failed; an engine that is absent and
    cannot be installed has failed.
    """
    os.chdir(root)
    faults = []
    for name in engines or ["chromium"]:
        try:
            program = browser.found(name, given if name == "chromium" else None)
            os.environ[f"LADDER_{name.upper()}"] = str(program)
        except browser.BrowserMissing as error:
            faults.append(str(error))
    if faults:
        print("\n".join(faults), file=sys.stderr)
        return 1
    os.environ["LADDER_ENGINES"] = ",".join(engines or ["chromium"])
    steps: dict[str, Callable[[], int]] = {
        "ruff": lambda: module("ruff", "check", "."),
        "mypy": lambda: module("mypy"),
        "check": lambda: publish_and_check(root, root / "site"),
        "sweep": lambda: prove_sweep(root, anew=True),
    }
    if engines:
        steps = {"check": steps["check"]}
        further = [*further, *([] if any(ENGINE_TESTS in word for word in further) else [ENGINE_TESTS])]
    else:
        further = [f"--ignore={ENGINE_TESTS}", *further]  # what these ask of Chromium, the other tests ask too
    failed = []
    for name, step in steps.items():
        print(f"== {name}", flush=True)
        if step() != 0:
            failed.append(name)
    print("== pytest", flush=True)
    ledger = Ledger(failed)
    code = int(pytest.main([*processes(further), *further], plugins=[ledger]))
    if ledger.reports:
        claims.write_results(root, claims.merged(ledger.reports))
    return 1 if code or failed else 0


def processes(further: Sequence[str], count: int | None = None) -> list[str]:
    """What makes pytest run in as many processes as the machine has (or `count`), a file in one of them, unless it is
    told how, or of a few tests only. The browser's files come first: they take longest."""
    count = min(PROCESSES, (os.cpu_count() or 1) if count is None else count)
    told = any(word.startswith(("-n", "--numprocesses", "--pdb", "-s")) for word in further)
    some = any(Path(word.partition("::")[0]).exists() for word in further if not word.startswith("-"))
    return [] if told or some or count < 2 else [f"-n{count}", "--dist=loadfile", "--no-loadscope-reorder"]


def module(*words: str) -> int:
    """Run a tool of the environment."""
    return subprocess.run([sys.executable, "-P", "-m", *words], stdin=subprocess.DEVNULL, check=False).returncode
