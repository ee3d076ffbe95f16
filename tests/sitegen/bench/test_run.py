"""The bench's own arithmetic; its measurements are left to its report."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from sitegen.bench.figures import Followed, rows, with_figures
from sitegen.bench.model import Row
from sitegen.bench.pages import answered, centile
from sitegen.bench.run import table

ROOT = Path(__file__).resolve().parents[3]


@pytest.mark.parametrize(
    ("marks", "delays"),
    [
        ([("input", 0), ("swap", 5)], [5]),
        ([("input", 0), ("input", 3), ("swap", 5), ("swap", 9)], [5, 6]),
        ([("input", 0), ("input", 3), ("input", 4), ("swap", 5), ("swap", 9)], [5, 6, 5]),
        ([("input", 0), ("swap", 2), ("input", 16), ("swap", 17)], [2, 1]),
        ([("swap", 1), ("input", 2)], []),
    ],
)
def test_an_input_waits_for_the_picture_that_shows_it(marks: list[tuple[str, float]], delays: list[float]) -> None:
    """A picture answers the inputs from before it was begun; later ones wait for the next picture, merged or not."""
    assert answered([(f"ladder:{name}", at) for name, at in marks]) == delays


def test_centiles_lie_among_the_values() -> None:
    """95 of the numbers 1 to 100 do not exceed the 95th percentile."""
    values = [float(v) for v in range(1, 101)]
    assert 95 <= centile(values, 95) <= 96


def test_the_table_says_what_is_met() -> None:
    """Aims are upper limits; rows without one are only shown."""
    rows = [Row("a", 3, "ms", 4), Row("b", 5, "ms", 4, "so"), Row("c", 0.1234, "s")]
    lines = table(rows).splitlines()
    assert [line.split() for line in lines[1:]] == [
        ["a", "3", "ms", "≤", "4", "ms", "met"],
        ["b", "5", "ms", "≤", "4", "ms", "missed", "so"],
        ["c", "0.123", "s"],
    ]


def test_each_figure_is_held_to_its_rungs_aim() -> None:
    """16 ms for handles up to rung 3½, 25 ms for the nine panels, none elsewhere nor for a slider; missed frames are
    counted over all figures."""
    rungs = [("icp", "3"), ("surfaces", "3½"), ("race", "6"), ("mmd", "5b")]
    candidates = [Followed(widget, f"{widget}.html", rung, "source", [4.0] * 20, 1, 100) for widget, rung in rungs]
    candidates.append(Followed("atlas", "icp.html", "3", "slider gate", [4.0] * 20, 0, 0, warm_up=7.0))
    assert [row.aim for row in rows(candidates)] == [16.0, 16.0, 25.0, None, None, 1, None]
    assert [row.value for row in rows(candidates)] == [4.0, 4.0, 4.0, 4.0, 4.0, 1.0, 7.0]


def test_a_figure_s_own_share_and_its_control_are_told_apart() -> None:
    """A near rung may take 4 ms and 1.5 times the control figure; for the other rungs these values are only shown."""
    first = Followed("icp", "icp.html", "3", "source", [9.0] * 20, 0, 100, [(2.0, 1.0)] * 20, [6.0] * 20)
    second = Followed("mmd", "mmd.html", "5b", "source", [9.0] * 20, 0, 100, [(4.0, 1.0)] * 20)
    results = {row.what: (row.value, row.aim) for row in rows([first, second])}
    assert results["near rungs, our share of it, 95th percentile, icp.html"] == (3.0, 4.0)
    assert results["near rungs, of the control figure's, 95th percentile, icp.html"] == (1.5, 1.5)
    assert results["our share of it, 95th percentile, mmd.html"] == (5.0, None)
    assert len(results) == 7


def test_pages_with_figures_are_found_in_the_built_site(tmp_path: Path) -> None:
    """A rung without a figure is not opened, nor is a page with a figure that is not a rung."""
    figure, rung = '<figure class="figure" id="fig-a" data-widget="icp">', '<p class="chapter-rung">Rung 1</p>'
    for name, text in (("a", rung + figure), ("b", rung + "<p>figure</p>"), ("c", figure)):
        (tmp_path / f"{name}.html").write_text(text, "utf-8")
    assert with_figures(tmp_path) == ["a.html"]


def test_an_unknown_group_is_a_mistake_of_use() -> None:
    """Reported with the existing names, before anything is built."""
    imports = "import sys; from pathlib import Path; from sitegen.bench.run import bench"
    code = f"{imports}; sys.exit(bench(Path('.'), Path('x'), None, ['drga']))"
    process = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=False)
    assert process.returncode == 2
    assert "unknown group drga; known: paint, tape" in process.stderr


def test_a_browser_that_does_not_start_is_an_error_and_no_skip(tmp_path: Path) -> None:
    """A browser named by the user must start; otherwise the message says what was tried."""
    absent = tmp_path / "absent"
    code = "import sys, pathlib; from sitegen.check import browsers; browsers.chromium(pathlib.Path(sys.argv[1]))"
    command = [sys.executable, "-c", code, str(absent)]
    process = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert process.returncode == 1
    assert f"no Chromium to test with. Tried:\n  --browser-path {absent}: " in process.stderr
