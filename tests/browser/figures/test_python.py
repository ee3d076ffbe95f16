"""Show me the Python: the copied or saved script prints the numbers beside it."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
from playwright.sync_api import expect

from tests.browser.conftest import ROOT, Reader
from tests.browser.figure import Figure


def test_the_python_of_a_dragged_figure_is_saved_and_runs(reader: Callable[..., Reader], tmp_path: Path) -> None:
    """After a drag and two steps, Download saves the script shown, which prints the figure's own readouts."""
    page = reader(reduced_motion="reduce").open("icp.html")
    icp = Figure(page, "fig-nearest").live()
    icp.drag("source", 40, -30)
    icp.button("step").click()
    icp.button("step").click()
    icp.settled()
    icp.root.get_by_text("In words, and in Python").click()
    with page.expect_download() as download:
        icp.root.get_by_role("button", name="Download as .py").click()
    assert download.value.suggested_filename == "icp-fig-nearest.py"
    script = tmp_path / "icp-fig-nearest.py"
    download.value.save_as(script)
    assert script.read_text("utf-8") == icp.root.locator(".figure-python code").text_content()
    process = subprocess.run([sys.executable, script], cwd=ROOT, env={"PYTHONPATH": str(ROOT)}, capture_output=True)
    output = dict(line.split(" ", 1) for line in process.stdout.decode().splitlines())
    texts = {name: icp.readout(name).replace("−", "-") for name in output}
    assert {"rms", "objective", "rotation_error", "translation_error"} == set(output), process.stderr
    for name, value in output.items():
        assert float(value) == pytest.approx(float(texts[name]), abs=0.51 * 10 ** -len(texts[name].partition(".")[2]))


def test_the_python_is_copied(reader: Callable[..., Reader]) -> None:
    """The copied text begins with the line that installs the wheel linked below it, and that wheel exists."""
    visitor = reader(permissions=["clipboard-read", "clipboard-write"])
    page = visitor.open("kabsch.html")
    solve = Figure(page, "fig-solve").seen()
    solve.root.get_by_text("In words, and in Python").click()
    solve.root.get_by_role("button", name="Copy the Python").click()
    expect(solve.root.locator(".figure-status")).to_contain_text("Python copied")
    first, *_ = page.evaluate("navigator.clipboard.readText()").splitlines()
    link = solve.root.locator(".figure-install a")
    assert first == f"# pip install {link.text_content()}"
    address = link.evaluate("link => link.href")
    assert page.evaluate("async (address) => (await fetch(address)).ok", address)
