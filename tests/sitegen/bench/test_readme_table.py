"""The bench's table in the docs: every line has its test or its measurement, and is right about what is met."""

from __future__ import annotations

from pathlib import Path

import pytest

from sitegen.bench.model import Row
from sitegen.bench.readme_table import LINES, MARKS, PAGE, README, keep
from sitegen.chapters.claims import read_tests

ROOT = Path(__file__).resolve().parents[3]
MACHINE = {
    "cores": 2, "system": "Linux", "python": "3.11.7", "browser": "Chromium 140", "time": "2026-01-02 03:04:05 +0000",
    "commit": "0123456789abcdef",
}  # fmt: skip
MEASURED = [Row(start, 1.0, "ms", 2.0) for line in LINES for start in line.rows]


def cells(text: str) -> list[list[str]]:
    """The cells of a Markdown table, without its head."""
    return [line.strip("| ").split(" | ") for line in text.splitlines() if line.startswith("|")][2:]


def table_of(tmp_path: Path, rows: list[Row]) -> list[list[str]]:
    """The cells of the table written into the page between two paragraphs; the README gets its headlines likewise."""
    for name in (PAGE, README):
        path = tmp_path / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(f"before\n\n{MARKS[0]}\nwhat stood here\n{MARKS[1]}\n\nafter\n", "utf-8")
    keep(tmp_path, rows, MACHINE)
    for name in (PAGE, README):
        text = (tmp_path / name).read_text("utf-8")
        assert text.startswith(f"before\n\n{MARKS[0]}\n\n|")
        assert text.endswith(f"\n\n{MARKS[1]}\n\nafter\n")
        assert "what stood here" not in text
    text = (tmp_path / PAGE).read_text("utf-8")
    assert "Measured on 2026-01-02 at 0123456789: 2 cores, Linux, Python 3.11.7, Chromium 140." in text
    return cells(text)


def test_the_tests_that_lines_name_are_there_and_the_files_have_their_places(tmp_path: Path) -> None:
    names = {test for line in LINES for test in line.tests}
    assert names <= set(read_tests(ROOT, {test.partition("::")[0] for test in names}, tmp_path))
    assert all(line.rows or line.tests for line in LINES)
    for name in (PAGE, README):
        text = (ROOT / name).read_text("utf-8")
        assert [text.count(mark) for mark in MARKS] == [1, 1], name


def test_the_headlines_are_lines_of_the_table() -> None:
    """The README's current headlines are lines of the page: `bench --keep` writes both."""
    page, readme = ((ROOT / name).read_text("utf-8").partition(MARKS[0])[2] for name in (PAGE, README))
    rows = cells(readme.partition(MARKS[1])[0])
    assert [row[0] for row in rows] == [line.what for line in LINES if line.headline]
    assert not [row for row in rows if row not in cells(page)]
    marks = [row[3] for row in cells(page) if len(row) > 3]
    count = f"Of {marks.count('met') + marks.count('missed')} measured targets {marks.count('missed')} are missed"
    assert count in readme


def test_a_line_shows_what_is_farthest_from_its_aim(tmp_path: Path) -> None:
    """One row over its aim makes its line missed, whatever the others say; every line appears once."""
    slow = Row("first answer, of some page", 3.14159, "ms", 2.0)
    results = {row[0]: row[2:] for row in table_of(tmp_path, [*MEASURED, slow])}
    assert set(results) == {line.what for line in LINES if line.rows}
    title = next(line.what for line in LINES if "first answer" in line.rows)
    assert results[title] == ["3.14 ms", "missed"]
    assert {results[line.what][1] for line in LINES if line.rows and line.what != title} == {"met"}


def test_what_tests_hold_is_listed_with_their_names(tmp_path: Path) -> None:
    """Under the table, since its columns have no room for the names of tests."""
    table = table_of(tmp_path, [Row(row.what, row.value, row.unit) for row in MEASURED])
    assert [row[0] for row in table if row[3:] == ["held"]] == ["memory of rigid CPD, 1000 × 1000"]
    text = (tmp_path / PAGE).read_text("utf-8")
    items = [line for line in text.splitlines() if line.startswith("- ")]
    assert [line.split(": ")[0].removeprefix("- ") for line in items] == [line.what for line in LINES if line.tests]
    assert items[0].endswith(". `test_every_page_is_complete_without_scripts`")


def test_a_cold_start_tells_how_quick_the_machine_is(tmp_path: Path) -> None:
    """Under the table, together with the stock runtime's."""
    table_of(tmp_path, [*MEASURED, Row("runtime start, cold", 900.0, "ms", None, "that of the stock one 2500 ms")])
    text = (tmp_path / PAGE).read_text("utf-8")
    assert "Chromium 140. A cold start of the runtime took 900 ms there; that of the stock one 2500 ms." in text


def test_a_line_that_nothing_measured_is_an_error(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="missing measurement for 'clean build"):
        table_of(tmp_path, [row for row in MEASURED if row.what != "clean build"])


def test_a_file_without_a_place_is_an_error(tmp_path: Path) -> None:
    """The other file then stays as it was."""
    before = table_of(tmp_path, MEASURED)
    (tmp_path / README).write_text("text", "utf-8")
    with pytest.raises(ValueError, match="marks"):
        keep(tmp_path, [Row(row.what, 9.0, row.unit, row.aim) for row in MEASURED], MACHINE)
    assert (tmp_path / README).read_text("utf-8") == "text"
    assert cells((tmp_path / PAGE).read_text("utf-8")) == before
