"""The bench's table in the docs: every promise of the project, with its target and the last measurement.

Sizes, counts and equalities are tests: such a line names the test that checks it. `bench --keep` writes the table, and
its headlines into the README.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from sitegen.bench.model import Row, number
from sitegen.cache.files import write

PAGE = "content/docs/performance.md"
README = "README.md"
# A link definition that nothing uses: the one kind of hidden text in Markdown that needs no HTML.
MARKS = ("[//]: # (what `build.py bench --keep` writes begins)", "[//]: # (and ends)")
COLD = "runtime start, cold"  # with the stock start, it shows how fast the machine is
HELD = "Checked by tests, at every run unless an option is named:"
SHOWN = ("what", "target", "measured", "result")


@dataclass(frozen=True)
class Line:
    """A line of the table. aim: the target in words, if it is not that of the rows. rows: prefixes of the names of its
    rows in the bench; of several rows the one farthest from its target is shown. tests: the tests that check it.
    headline: whether it is in the README too."""

    what: str
    aim: str
    rows: tuple[str, ...] = ()
    tests: tuple[str, ...] = ()
    headline: bool = False


LINES = (
    Line(
        "a page before any script runs", "text, mathematics and every figure are there",
        tests=("tests/browser/pages/test_static.py::test_every_page_is_complete_without_scripts",),
    ),
    Line("the heaviest page, compressed, without tapes", "", ("heaviest page",)),
    Line("largest contentful paint, loopback", "", ("largest contentful paint",)),
    Line("layout shift until Python is up", "", ("layout shift",)),
    Line("a figure's first answer after a click, cold, from its tape", "", ("first answer",), headline=True),
    Line("start of the runtime against stock Pyodide with numpy", "", ("runtime start against",), headline=True),
    Line("the same on a later visit", "", ("runtime start, on a later",)),
    Line("the runtime's files, gzip", "", ("runtime, compressed",)),
    Line("a drag to its picture, 95th percentile, rungs 1 to 3½", "", ("near rungs, input",), headline=True),
    Line("of which Python and the page's scripts", "", ("near rungs, our share",)),
    Line(
        "a drag, relative to a control figure whose worker returns stored frames", "", ("near rungs, of the",)
    ),
    Line("a drag or a step of the race's nine panels to its picture", "", ("nine panels, a", "nine panels, input")),
    Line("five more scans on a drive's map, press to swapped picture", "", ("the drive's map, a press",)),
    Line("frames missed in a drag", "", ("frames missed",)),
    Line("heat map after a control moves: coarse", "", ("heat map, coarse",)),
    Line("the same: full, refined, interruptible", "", ("heat map, full",)),
    Line("benchmark of 25 seeds and nine solvers in the tab", "", ("25-seed benchmark",), headline=True),
    Line("its *Stop*", "", ("Stop of the benchmark",)),
    Line("the same benchmark, natively", "", ("the same, natively",)),
    Line("rigid CPD, 100 × 100, relative to pycpd", "", ("rigid CPD, 100 × 100, equal",), headline=True),
    Line("rigid CPD, 1000 × 1000, relative to pycpd", "", ("rigid CPD, 1000 × 1000, equal",)),
    Line(
        "memory of rigid CPD, 1000 × 1000", "blocks, not the matrix of 8 MB", ("rigid CPD, 1000 × 1000, memory",),
        ("tests/solvers/numerics/test_gaussians.py::test_memory_is_that_of_a_block",),
    ),
    Line("branch and bound, a proof to 1e-3 u² in any of the race's six rooms", "", ("proof to",)),
    Line("such a proof in the tab", "", ("  'clean', in", "  'noise', in", "  'combo', in")),
    Line("the search figure's *Run*, to its proof", "", ("the search figure's Run",)),
    Line("224 pairs of a real drive chained", "", ("the drive chained, natively",)),
    Line("the drive chained in the tab", "", ("the drive chained, in the tab",)),
    Line("nearest-neighbour ICP, 10⁵ points in space, against small_gicp on one thread", "", ("ICP, 10⁵",)),
    Line("clean build, runtime cached", "", ("clean build",)),
    Line("a chapter saved to the page that shows it", "", ("a chapter saved",)),
    Line(
        "native against browser", "the same steps, ends and bytes of every frame",
        tests=(
            "tests/pyodide/test_equality.py::test_one_step_is_the_same_in_the_page",
            "tests/pyodide/test_equality.py::test_the_race_ends_the_same_in_the_page",
            "tests/browser/figures/test_live.py::test_live_frames_are_the_build_s_byte_for_byte",
        ),
    ),
    Line(
        "two builds of one commit on one machine", "identical",
        tests=("tests/sitegen/pipeline/test_real_site.py::test_two_builds_of_the_site_are_the_same_bytes",),
    ),
    Line("requests to another origin", "", ("requests to another",)),
    Line(
        "offline, the server gone after the first visit",
        "every page opens, and a figure of a page never visited answers",
        tests=(
            "tests/browser/runtime/test_offline.py::test_every_page_of_the_site_is_kept",
            "tests/browser/runtime/test_offline.py::test_a_figure_of_a_page_never_visited_answers_without_the_server",
        ),
    ),
    Line(
        "axe-core, light at 1280 px and dark at 390 px", "0 violations",
        tests=("tests/browser/accessibility/test_axe.py::test_axe_finds_nothing_on_any_page",),
    ),
    Line(
        "everything a pointer does", "also by keyboard and touch",
        tests=(
            "tests/browser/figures/test_live.py::test_everything_by_keyboard_alone",
            "tests/browser/figures/test_live.py::test_touch_drags_a_handle_and_scrolls_past_a_figure",
        ),
    ),
    Line(
        "hostile input", "a clear error or `degenerate`; no NaN, no hang",
        tests=(
            "tests/solvers/test_hostile.py::test_every_method_survives_any_finite_pairs",
            "tests/solvers/test_hostile.py::test_what_is_no_input_is_refused_by_name",
        ),
    ),
    Line(
        "1,000 drags and picks", "no growth of the worker's heap",
        tests=("tests/browser/figures/test_growth.py::test_a_thousand_actions_leave_the_worker_s_heap_alone",),
    ),
    Line(
        "Chromium, Firefox and WebKit, with `--engines`", "static, tape, live, drag, offline",
        tests=tuple(
            f"tests/browser/engines/test_engines.py::{name}"
            for name in (
                "test_every_page_is_complete_without_scripts",
                "test_the_tape_answers_before_python_is_up",
                "test_python_answers_with_the_build_s_bytes",
                "test_pointer_and_keys_drag_a_handle",
                "test_everything_works_with_the_server_gone",
            )
        ),
    ),
)  # fmt: skip


def keep(root: Path, rows: Sequence[Row], machine: Mapping[str, Any]) -> None:
    """Write the table into the docs and its headlines into the README, between their marks. Raises ValueError if a file
    has no marks or a line no row; then neither file changes."""
    sections = {PAGE: markdown(rows, machine), README: headlines(rows)}
    texts = {root / name: _between_marks(root / name, text) for name, text in sections.items()}
    for path, text in texts.items():
        write(path, text.encode())


def _between_marks(path: Path, text: str) -> str:
    head, begins, body = path.read_text("utf-8").partition(MARKS[0])
    _, ends, tail = body.partition(MARKS[1])
    if not begins or not ends:
        raise ValueError(f"{path.name}: missing marks of the bench's table: {' … '.join(MARKS)}")
    return f"{head}{begins}\n\n{text}\n\n{ends}{tail}"


def headlines(rows: Sequence[Row]) -> str:
    """The headline rows of the table, and how many of all targets are missed."""
    results = [_cells(line, rows)[-1] for line in LINES if line.rows]
    missed, total = results.count("missed"), results.count("missed") + results.count("met")
    table = _table([_cells(line, rows) for line in LINES if line.headline])
    return f"{table}\n\nOf {total} measured targets {missed} are missed: [all of them]({PAGE})."


def markdown(rows: Sequence[Row], machine: Mapping[str, Any]) -> str:
    """The table, where and when it was measured, and what tests check. Raises ValueError for a line without a row."""
    table = _table([_cells(line, rows) for line in LINES if line.rows])
    conditions = f"{machine['cores']} cores, {machine['system']}, Python {machine['python']}, {machine['browser']}"
    colds = (row for row in rows if row.what == COLD)
    speed = "".join(f" A cold start of the runtime took {_value_text(row)} there; {row.note}." for row in colds)
    revision = f"{str(machine['time']).split()[0]} at {str(machine['commit'])[:10]}"
    guarantees = "\n".join(map(_guarantee, (line for line in LINES if line.tests)))
    return f"{table}\n\nMeasured on {revision}: {conditions}.{speed}\n\n{HELD}\n\n{guarantees}"


def _table(rows: Sequence[tuple[str, ...]]) -> str:
    return "\n".join(f"| {' | '.join(row)} |" for row in [SHOWN, tuple("---" for _ in SHOWN), *rows])


def _guarantee(line: Line) -> str:
    """A line of the list below the table: the tests' names would make any column too wide."""
    names = ", ".join(f"`{test.rpartition('::')[2]}`" for test in line.tests)
    return f"- {line.what}: {line.aim}. {names}"


def _cells(line: Line, rows: Sequence[Row]) -> tuple[str, str, str, str]:
    matches = [row for row in rows if row.what.startswith(line.rows)]
    if not matches:
        raise ValueError(f"missing measurement for {line.what!r}: no row starts with {' or '.join(line.rows)}")
    worst = max(matches, key=_strain)
    verdict = {True: "met", False: "missed", None: "held" if line.tests else ""}[worst.met]
    aim = "" if worst.aim is None else f"{'≤ ' * bool(worst.aim)}{number(worst.aim)} {worst.unit}".strip()
    return line.what, line.aim or aim, _value_text(worst), verdict


def _value_text(row: Row) -> str:
    return f"{number(row.value)} {row.unit}".strip()


def _strain(row: Row) -> float:
    """A value relative to its target; the value itself if the target is zero or missing."""
    return row.value / row.aim if row.aim else row.value
