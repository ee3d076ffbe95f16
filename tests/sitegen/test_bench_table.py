"""The bench's table in the README: every line has its test or its measurement, and says truly what is met."""

from __future__ import annotations

from pathlib import Path

import pytest

from sitegen.bench import Row
from sitegen.bench_table import LINES, MARKS, keep
from sitegen.claims import read_tests

ROOT = Path(__file__).resolve().parents[2]
MACHINE = {
    "cores": 2, "system": "Linux", "python": "3.11.7", "browser": "Chromium 140", "time": "2026-01-02 03:04:05 +0000",
    "commit": "0123456789abcdef",
}  # fmt: skip
MEASURED = [Row(start, 1.0, "ms", 2.0) for line in LINES for start in line.rows]


def kept(tmp_path: Path, rows: list[Row]) -> list[list[str]]:
    """The cells of the table that a README between two paragraphs gets."""
    readme = tmp_path / "README.md"
    readme.write_text(f"before\n\n{MARKS[0]}\nwhat stood here\n{MARKS[1]}\n\nafter\n", "utf-8")
    keep(readme, rows, MACHINE)
    text = readme.read_text("utf-8")
    assert text.startswith("before\n\n")
    assert text.endswith("\n\nafter\n")
    assert "what stood here" not in text
    assert "Measured on 2026-01-02 at 0123456789: 2 cores, Linux, Python 3.11.7, Chromium 140." in text
    return [line.strip("| ").split(" | ") for line in text.splitlines() if line.startswith("|")][2:]


def test_the_tests_that_lines_name_are_there_and_the_readme_has_its_place(tmp_path: Path) -> None:
    named = {test for line in LINES for test in line.tests}
    assert named <= set(read_tests(ROOT, {test.partition("::")[0] for test in named}, tmp_path))
    assert all(line.rows or line.tests for line in LINES)
    readme = (ROOT / "README.md").read_text("utf-8")
    assert [readme.count(mark) for mark in MARKS] == [1, 1]


def test_a_line_shows_what_is_farthest_from_its_aim(tmp_path: Path) -> None:
    """A row over its aim makes its line a missed one, whatever the others say; every line stands there once."""
    late = Row("first answer, of some page", 3.14159, "ms", 2.0)
    cells = {row[0]: row[2:] for row in kept(tmp_path, [*MEASURED, late])}
    assert set(cells) == {line.what for line in LINES}
    of_it = next(line.what for line in LINES if "first answer" in line.rows)
    assert cells[of_it] == ["3.14 ms", "missed"]
    assert [cells[line.what][1] for line in LINES if line.rows and line.what != of_it] == ["met"] * (
        sum(bool(line.rows) for line in LINES) - 1
    )
    assert all(cells[line.what][1] == "held" for line in LINES if not line.rows)


def test_a_cold_start_tells_how_quick_the_machine_is(tmp_path: Path) -> None:
    """Under the table, with that of the stock runtime."""
    kept(tmp_path, [*MEASURED, Row("runtime start, cold", 900.0, "ms", None, "that of the stock one 2500 ms")])
    text = (tmp_path / "README.md").read_text("utf-8")
    assert "Chromium 140. A cold start of the runtime took 900 ms there; that of the stock one 2500 ms." in text


def test_a_line_that_nothing_measured_is_an_error(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="nothing was measured for 'clean build"):
        kept(tmp_path, [row for row in MEASURED if row.what != "clean build"])


def test_a_readme_without_a_place_is_an_error(tmp_path: Path) -> None:
    readme = tmp_path / "README.md"
    readme.write_text("text", "utf-8")
    with pytest.raises(ValueError, match="marks"):
        keep(readme, MEASURED, MACHINE)
    assert readme.read_text("utf-8") == "text"
