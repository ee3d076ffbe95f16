"""Claims of kind why: how they are written, what they require of their test, and how its outcomes reach the reader."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from sitegen.chapters import claims, whys
from tests.sitegen.conftest import Project

ROOT = Path(__file__).resolve().parents[3]
CAUSE = "tests/test_caused.py::test_the_gate_costs_reach"
TESTS = '''\
def test_the_gate_costs_reach(why):
    """With the gate 3 of 25 arrive."""
    why("the gate", {"0.6 u": "3 of 25", "none": "25 of 25"})


def test_silent():
    """It changes nothing."""
'''
MISTAKES = {  # ¦ comes before the place that is named
    f":claim[C]{{{CAUSE} kind=¦whi}}": "unknown kind of claim 'whi'; did you mean 'why'?",
    f":claim[C]{{{CAUSE} ¦kin=why}}": "unknown claim attribute 'kin'; did you mean 'kind'?",
    f":claim[C]{{{CAUSE} ¦why}}": "expected name=value, got 'why'; did you mean kind=why?",
    ":claim[C]{¦kind=why}": "missing test, as in {tests/file.py::test_name}",
    ":claim[C]{¦tests/test_caused.py::test_silent kind=why}": "tests/test_caused.py::test_silent changes no factor: "
    "a kind=why claim needs a test with the fixture `why`",
}


@pytest.fixture
def causal(project: Project) -> Project:
    """The small site with a claim that gives a cause."""
    project.write("tests/test_caused.py", TESTS)
    project.chapter(f"A run fails, and :claim[the gate is why.]{{{CAUSE} kind=why}}\n")
    project.write("content/00-start.md", "---\ntitle: Start\nslug: index\nrung: '0'\nsummary: S\n---\nText.\n")
    return project


@pytest.mark.parametrize(("body", "message"), MISTAKES.items())
def test_a_kind_that_is_none_is_told_at_its_place(causal: Project, body: str, message: str) -> None:
    causal.chapter(body.replace("¦", "") + "\n")
    assert causal.problems() == [f"content/01-second.md:7:{body.index('¦') + 1}: {message}"]


def test_both_outcomes_of_a_run_stand_on_the_page_of_checks(causal: Project) -> None:
    """As the run recorded them. Before a run, and after an edit of the code, none are shown, yet builds succeed."""
    cells = ["<strong>the gate</strong>", "as it is", "0.6 u", "3 of 25", "changed", "none", "25 of 25"]
    causal.build()
    before = causal.page("checks-second.html")
    assert '<span class="check-kind">Why</span> <a href="second.html#claim-1">' in before
    assert "25 of 25</td>" not in before

    change = whys.change("the gate", {"0.6 u": "3 of 25", "none": "25 of 25"})
    claims.write_results(causal.root, {CAUSE: "passed"}, {CAUSE: change})
    assert claims.read_results(causal.root)[CAUSE] == claims.Result("passed", True, change)
    causal.build()
    table = causal.page("checks-second.html").partition('<table class="check-change">')[2].partition("</table>")[0]
    places = [table.index(text) for text in cells]
    assert places == sorted(places)
    assert "checked by changing this one thing: see how" in causal.page("second.html")

    causal.write("solvers/new.py", "x = 1\n")
    causal.build()
    assert "25 of 25</td>" not in causal.page("checks-second.html")


def test_a_test_that_passed_and_left_no_outcomes_is_a_mistake(causal: Project) -> None:
    claims.write_results(causal.root, {CAUSE: "passed"})
    (problem,) = causal.problems()
    assert problem.startswith("content/01-second.md:7:43: ")
    assert "recorded no outcomes in tests/results.json" in problem
    claims.write_results(causal.root, {CAUSE: "failed"})
    causal.build()


@pytest.mark.parametrize(
    ("outcomes", "message"),
    [
        ({"0.6 u": "3 of 25"}, "an outcome as it is and one with the factor changed"),
        ({"0.6 u": "3 of 25", "none": "3 of 25"}, "every setting gives '3 of 25', so it is not the cause"),
        ({"0.6 u": "3 of 25", "none": " "}, "settings and outcomes must be text"),
    ],
)
def test_what_shows_no_cause_is_refused(outcomes: dict[str, str], message: str) -> None:
    with pytest.raises(ValueError, match="the gate: ") as error:
        whys.change("the gate", outcomes)
    assert message in str(error.value)


RUNS = '''\
import pytest

def test_cause(why):
    why("the gate", {"0.6 u": "3", "none": "25"})

def test_says_nothing(why):
    pass

def test_fails_first(why):
    assert False

def test_twice(why):
    for _ in range(2):
        why("the gate", {"0.6 u": "3", "none": "25"})

@pytest.mark.parametrize("case", [1])
def test_cases(why, case):
    why("the gate", {"0.6 u": "3", "none": "25"})
'''
RUNNER = """
import json, sys
import pytest
from sitegen.chapters import claims
from sitegen.cli.run_tests import Ledger
ledger = Ledger([])
pytest.main([*sys.argv[1:], "-q", "-p", "no:cacheprovider"], plugins=[ledger])
print("SAID", json.dumps([claims.merged(ledger.reports), {k: v.plain() for k, v in ledger.changes.items()}]))
"""


@pytest.mark.parametrize("processes", ["0", "1"])
def test_a_run_notes_the_outcomes_and_refuses_tests_without(tmp_path: Path, processes: str) -> None:
    """In one process or several, a recorded outcome is noted, and a test without one fails, once."""
    (tmp_path / "pyproject.toml").write_text("[tool.pytest.ini_options]\n", "utf-8")
    (tmp_path / "conftest.py").write_text("from tests.recorded import why\n", "utf-8")
    (tmp_path / "test_runs.py").write_text(RUNS, "utf-8")
    command = [sys.executable, "-c", RUNNER, "-n", processes, str(tmp_path)]
    process = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    output, _, message = process.stdout.partition("SAID ")
    assert message.count('"failed"') == 4, process.stdout + process.stderr
    assert message.count('"passed"') == 1
    assert message.count('["the gate", [["0.6 u", "3"], ["none", "25"]]]') >= 1
    assert "takes the fixture `why` and has recorded no outcomes" in output
    assert "1 error in" in output, "a test that has failed is not told a second time"
