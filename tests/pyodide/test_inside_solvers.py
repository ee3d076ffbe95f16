"""Solvers inside Pyodide: their own tests in the complete runtime. They have a file to themselves because they take
minutes and files are distributed among processes."""

from __future__ import annotations

from tests.pyodide.inside import assert_the_suite_passes


def test_the_solvers_tests_pass_inside_pyodide() -> None:
    assert_the_suite_passes("tests/solvers")
