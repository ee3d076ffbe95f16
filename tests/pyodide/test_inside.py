"""Solvers and figures inside Pyodide: their own tests on the complete runtime, everything once on the shipped one."""

from __future__ import annotations

import pkgutil
import re
import sysconfig
from pathlib import Path

import numpy as np
import pytest

import solvers
import widgets
from sitegen.runtime.assemble import HERE
from tests.pyodide.inside import run_python_in_complete_runtime, run_python_in_shipped_runtime
from widgets.engine.registry import WIDGETS

ROOT = HERE.parents[1]
SUITE = Path(__file__).with_name("suite.py")


@pytest.mark.parametrize("folder", ["tests/solvers", "tests/widgets"])
def test_the_tests_of_what_runs_in_the_page_pass_inside_pyodide(folder: str) -> None:
    answer = run_python_in_complete_runtime(
        SUITE.read_text("utf-8"),
        # The conftest above is the site's: it serves and drives a browser.
        {"args": [folder, f"--confcutdir={folder}", "-p", "tests.recorded", "-m", "not native", "-q"]},
        mounts={"/repo": ROOT, "/venv": Path(sysconfig.get_path("purelib"))},
    )
    assert answer["code"] == 0, answer["output"]
    assert re.search(r"\b[1-9]\d* passed", answer["output"]), answer["output"]


def test_everything_runs_once_on_the_shipped_runtime() -> None:
    done = run_python_in_shipped_runtime((HERE / "exercise.py").read_text("utf-8"), [])["done"]
    modules = {
        module.name
        for package in (solvers, widgets)
        for module in pkgutil.walk_packages(package.__path__, package.__name__ + ".")
        if not module.name.startswith(("solvers.__main__", "solvers.cli"))  # no page runs the command line
    }
    assert set(done["every_module"]) == modules | {"solvers", "widgets"}
    assert set(done["every_method"]) == set(solvers.METHODS)
    assert set(done["every_figure"]) == {f"{name} {preset}" for name, w in WIDGETS.items() for preset in w.presets}
    assert "LinAlgError" in done["errors"][0]


def test_wasm_tells_no_floating_point_error() -> None:
    """What natively raises or warns gives NaN in the page: solvers must look at results, not wait for LinAlgError."""
    code = """
import json
import numpy as np

def main(text):
    return json.dumps(bool(np.isnan(np.linalg.inv(np.zeros((2, 2)))).all()))
"""
    assert run_python_in_shipped_runtime(code) is True
    with pytest.raises(np.linalg.LinAlgError):
        np.linalg.inv(np.zeros((2, 2)))
