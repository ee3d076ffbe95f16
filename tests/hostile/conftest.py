"""Every test here makes thousands of calls; the last lines of a run summarise their outcomes."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from tests.hostile.tally import OUTCOMES, Tally

CALLS = 5000


@pytest.fixture
def calls(pytestconfig: pytest.Config) -> int:
    """Roughly how many calls a test makes."""
    return int(pytestconfig.getoption("hostile_calls") or CALLS)


@pytest.fixture
def tally(request: pytest.FixtureRequest) -> Iterator[Tally]:
    """The outcomes of the test's calls, shown at the end of the run."""
    result = Tally(request.node.name.removeprefix("test_").replace("_", " ").replace("[", " ").rstrip("]"))
    yield result
    request.node.user_properties.append(("hostile", [result.what, *(result.counts[outcome] for outcome in OUTCOMES)]))


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    reports = [report for stats in terminalreporter.stats.values() for report in stats]
    teardowns = [report for report in reports if getattr(report, "when", "") == "teardown"]
    rows = [row for report in teardowns for name, row in report.user_properties if name == "hostile"]
    if rows:
        terminalreporter.section("what was tried")
        terminalreporter.write_line(f"{'':50}{'calls':>9}" + "".join(f"{outcome:>12}" for outcome in OUTCOMES))
        for title, *counts in rows:
            terminalreporter.write_line(f"{title:50}{sum(counts):9,}" + "".join(f"{outcome:12,}" for outcome in counts))
