"""Standard streams closed by the caller, as by `>&-` and `2>&-` in a shell: Python then has no object for them."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from solvers.scenes.rooms import room

ROOT = Path(__file__).parents[3]
pytestmark = [
    pytest.mark.native,
    pytest.mark.skipif(os.name == "nt", reason="a file descriptor is closed as POSIX shells do"),
]


def run(folder: Path, closed: int, *arguments: str) -> subprocess.CompletedProcess[str]:
    """Register two clouds with a stream closed."""
    scene = room("noise", seed=40)
    np.save(folder / "a.npy", scene.source)
    np.save(folder / "b.npy", scene.target)
    return subprocess.run(
        [sys.executable, "-m", "solvers", *arguments],
        cwd=folder,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        preexec_fn=lambda: os.close(closed),
        capture_output=True,
        text=True,
        check=False,
    )


def test_a_closed_output_is_no_error(tmp_path: Path) -> None:
    """The exit code still says how the run ended."""
    process = run(tmp_path, 1, "a.npy", "b.npy")
    assert (process.returncode, process.stderr) == (0, "")


def test_without_standard_error_the_output_holds_the_answer_alone(tmp_path: Path) -> None:
    """`print` would write to the output what it cannot write there."""
    process = run(tmp_path, 2, "a.npy", "b.npy", "--json")
    assert process.returncode == 0
    assert json.loads(process.stdout)["status"] == "converged"
    process = run(tmp_path, 2, "a.npy", "missing.npy", "--json")
    assert (process.returncode, process.stdout) == (2, "")
