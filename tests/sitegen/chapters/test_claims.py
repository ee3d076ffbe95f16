"""Claims: the tests that they name, and the results that hold for one state of the code."""

from __future__ import annotations

import json
from pathlib import Path
from types import ModuleType

import pytest

from sitegen.chapters import claims
from sitegen.figures.bakery import code_hash
from tests.sitegen.conftest import SECOND, Project


def test_tests_are_read_and_never_run(project: Project) -> None:
    project.write(
        "tests/test_more.py", "raise SystemExit\n\n\ndef test_a():\n    '''Doc.'''\n\n\ndef helper():\n    pass\n"
    )
    project.write("tests/test_broken.py", "def test_b(:\n")
    tests = claims.read_tests(project.root, claims.test_files(project.root), project.cache)
    assert sorted(tests) == [
        "tests/test_claimed.py::TestGroup::test_inside",
        "tests/test_claimed.py::test_it_holds",
        "tests/test_more.py::test_a",
    ]
    inside = tests["tests/test_claimed.py::TestGroup::test_inside"]
    assert inside.doc == "Inside a class."
    assert inside.source.startswith("def test_inside")


def test_one_failing_case_fails_its_test_whichever_comes_last() -> None:
    reports: list[tuple[str, claims.Outcome]] = [("t[1]", "passed"), ("t[2]", "failed"), ("t[3]", "passed")]
    assert claims.merged(reports) == {"t": "failed"}


def test_a_claim_is_the_whole_sentence_where_it_stands_alone(project: Project) -> None:
    """Terms, references and links in it become plain words without links."""
    entry = "gate:\n  term: Gate\n  says: The largest distance.\n  chapter: second\n"
    project.write("content/glossary.yaml", entry)
    message = "A :term[gate] and *:ref[second#deep]* [are](https://example.org/) open."
    project.write("content/01-second.md", f"{SECOND}\n:claim[{message}]{{tests/test_claimed.py::test_it_holds}}\n")
    project.build()
    assert '<em><a class="ref"' in project.page("second.html")
    assert "<h2>A gate and <em>A section</em> are open.</h2>" in project.page("checks-second.html")


def test_results_hold_for_the_code_that_they_were_made_on(project: Project) -> None:
    holds = "tests/test_claimed.py::test_it_holds"
    reports: list[tuple[str, claims.Outcome]] = [
        (f"{holds}[1]", "passed"),
        (f"{holds}[2]", "passed"),
        ("other", "passed"),
    ]
    claims.write_results(project.root, claims.merged(reports))
    results = json.loads((project.root / claims.RESULTS).read_text())
    assert list(results) == [holds], "only what is claimed is kept"
    assert claims.read_results(project.root) == {holds: claims.Result("passed", True)}
    assert claims.behind(project.root) == []
    project.build()
    assert 'data-outcome="passed"' in project.page("second.html")
    assert "Passed on this code." in project.page("checks-second.html")

    project.write("solvers/new.py", "x = 1\n")
    assert claims.read_results(project.root) == {holds: claims.Result("passed", False)}
    assert claims.behind(project.root) == [holds]
    project.build()
    assert "Not yet run on this code." in project.page("checks-second.html")

    claims.write_results(project.root, claims.merged([*reports, (f"{holds}[3]", "failed")]))
    project.build()
    assert "Failed on this code." in project.page("checks-second.html")
    claims.write_results(project.root, {})
    assert claims.read_results(project.root) == {holds: claims.Result("failed", True)}, (
        "what did not run keeps its result"
    )


@pytest.mark.parametrize("line", ["from widgets.engine import host", "import widgets", "from tests.widgets import a"])
def test_results_of_tests_that_use_widgets_hold_for_the_widgets_as_well(project: Project, line: str) -> None:
    holds = "tests/test_claimed.py::test_it_holds"
    for source, current in (("", True), (f"def test_it_holds():\n    {line}\n", False)):
        project.write("tests/test_claimed.py", source)
        claims.write_results(project.root, {holds: "passed"})
        project.write("widgets/new.py", f"x = {current}\n")
        assert claims.read_results(project.root) == {holds: claims.Result("passed", current)}


@pytest.mark.parametrize("name", ["code.py", "flow.int8", "drive.scans", "poses.f4"])
def test_frames_and_claims_depend_on_code_and_on_the_data_beside_it(tmp_path: Path, name: str) -> None:
    package = ModuleType("solvers")
    package.__path__ = [str(tmp_path / "solvers")]
    for other in ("solvers", "widgets"):
        (tmp_path / other / "deep").mkdir(parents=True)
    hashes = set()
    for data in (b"1", b"2"):
        (tmp_path / "solvers" / "deep" / name).write_bytes(data)
        hashes.add((code_hash([package]), claims.tested_code(tmp_path)["solvers"]))
    frames, tests = zip(*hashes, strict=True)
    assert len({*frames}) == len({*tests}) == 2
