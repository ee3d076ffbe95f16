"""Solvers inside Pyodide: their own tests on the complete runtime. A file of its own, since it takes minutes and files
are shared out among processes."""

from __future__ import annotations

from tests.pyodide.inside import assert_the_suite_passes


def test_the_solvers_tests_pass_inside_pyodide() -> None:
    assert_the_suite_passes("tests/solvers")
