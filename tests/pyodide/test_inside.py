"""Figures inside Pyodide: their own tests in the complete runtime, and everything once in the shipped one."""

from __future__ import annotations

import pkgutil

import numpy as np
import pytest

import solvers
import widgets
from sitegen.runtime.assemble import HERE
from tests.pyodide.inside import assert_the_suite_passes, run_python_in_shipped_runtime
from widgets.engine.registry import WIDGETS


def test_the_figures_tests_pass_inside_pyodide() -> None:
    assert_the_suite_passes("tests/widgets")


def test_everything_runs_once_on_the_shipped_runtime() -> None:
    report = run_python_in_shipped_runtime((HERE / "exercise.py").read_text("utf-8"), [])["done"]
    modules = {
        module.name
        for package in (solvers, widgets)
        for module in pkgutil.walk_packages(package.__path__, package.__name__ + ".")
        if not module.name.startswith(("solvers.__main__", "solvers.cli"))  # pages never run the command line
    }
    assert set(report["every_module"]) == modules | {"solvers", "widgets"}
    assert set(report["every_method"]) == set(solvers.METHODS)
    assert set(report["every_figure"]) == {f"{name} {preset}" for name, w in WIDGETS.items() for preset in w.presets}
    assert "LinAlgError" in report["errors"][0]


def test_wasm_tells_no_floating_point_error() -> None:
    """What natively raises or warns gives NaN in the page, so solvers must check results rather than wait for
    LinAlgError."""
    code = """
import json
import numpy as np

def main(text):
    return json.dumps(bool(np.isnan(np.linalg.inv(np.zeros((2, 2)))).all()))
"""
    assert run_python_in_shipped_runtime(code) is True
    with pytest.raises(np.linalg.LinAlgError):
        np.linalg.inv(np.zeros((2, 2)))
