"""Jobs: slices stay short and stop when no longer requested, and the table is the same however the job was sliced."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any

import pytest

from widgets.drawing.picture import Panel, Path, View
from widgets.engine.contract import preset
from widgets.engine.host import Host
from widgets.engine.jobs import SLICE, Column, Job, Progress, Result, Row, Running, finished, plain
from widgets.figures.kabsch import WIDGET

COLUMNS = (Column("error", "Error", "°", 2), Column("count", "Count"), Column("time", "Wall time", "ms", timed=True))
PANEL = Panel("dots", "A panel", View(0, 1, 0, 1, width=100), (Path([[0, 0], [1, 1]], "ink"),))


def result_of(n: int) -> Result:
    rows = tuple(
        Row(f"r{i}", 'one, "two"' if i == 0 else f"Row {i}", (i + 1 / 3, i, 7.0), "by-means", dashed=i > 0)
        for i in range(n)
    )
    return Result("On this.", "Solver", COLUMNS, rows, (PANEL,), "print(1)\n")


def counting(controls: Any, seed: int, part: str) -> Iterator[Progress]:
    """Ten pieces."""
    for k in range(1, 11):
        yield Progress(k / 10, f"{part}, piece {k}", {"of": part, "pieces": k} if k == 10 else None)


def counted(controls: Any, outcomes: Mapping[str, Any]) -> Result:
    """A row per part."""
    assert all(outcome == {"of": part, "pieces": 10} for part, outcome in outcomes.items())
    return result_of(len(outcomes))


JOB = Job("count", "Count", lambda controls: ("first", "last"), counting, counted)
CONTROLS = preset(WIDGET).controls


class Clock:
    """A clock that advances at every reading."""

    def __init__(self, step: float) -> None:
        self.time, self.step = 0.0, step

    def __call__(self) -> float:
        self.time += self.step
        return self.time


def all_slices(running: Running, job: Job = JOB) -> list[dict[str, Any]]:
    running.begin("f", job, CONTROLS, 40, "last")
    slices = [running.slice("f", job)]
    while not slices[-1]["done"]:
        slices.append(running.slice("f", job))
    return slices


@pytest.mark.parametrize(("piece", "slices"), [(1e-6, 1), (0.9 * SLICE / 2, 5), (0.6 * SLICE, 10), (3 * SLICE, 10)])
def test_a_slice_begins_no_piece_that_would_make_it_long(piece: float, slices: int) -> None:
    """Short pieces share a slice; two that together exceed a slice do not, nor does a long one."""
    assert len(all_slices(Running(Clock(piece)))) == slices


@pytest.mark.parametrize("piece", [1e-6, 0.6 * SLICE])
def test_the_outcome_does_not_depend_on_the_slices(piece: float) -> None:
    """Whatever the clock says, the last slice has the outcome, and the fraction done grows to one."""
    slices = all_slices(Running(Clock(piece)))
    outcomes = [s["outcome"] for s in slices]
    assert outcomes == [None] * (len(slices) - 1) + [{"of": "last", "pieces": 10}]
    fractions = [s["fraction"] for s in slices]
    assert fractions == sorted(fractions)
    assert fractions[-1] == 1
    assert [s["done"] for s in slices] == [False] * (len(slices) - 1) + [True]


def test_what_was_stopped_or_done_does_not_go_on() -> None:
    running = Running(Clock(SLICE))
    running.begin("f", JOB, CONTROLS, 40, "first")
    running.slice("f", JOB)
    running.stop("f", JOB)
    with pytest.raises(ValueError, match="not under way"):
        running.slice("f", JOB)
    all_slices(running)
    with pytest.raises(ValueError, match="not under way"):
        running.slice("f", JOB)
    running.stop("f", JOB)  # stopping again is not an error


def test_another_begin_begins_anew() -> None:
    running = Running(Clock(SLICE))
    running.begin("f", JOB, CONTROLS, 40, "first")
    assert running.slice("f", JOB)["words"] == "first, piece 1"
    assert running.slice("f", JOB)["words"] == "first, piece 2"
    running.begin("f", JOB, CONTROLS, 40, "last")
    assert running.slice("f", JOB)["words"] == "last, piece 1"


def test_a_part_gets_the_settings_the_seed_and_its_name() -> None:
    """Those of the record that the page sends."""
    arguments = []

    def work(controls: Any, seed: int, part: str) -> Iterator[Progress]:
        arguments.append((controls, seed, part))
        yield Progress(1.0, "done", [])

    record = replace(preset(WIDGET, "default", {"noise": 0.25}), seed=53)
    host = Host({"kabsch": replace(WIDGET, jobs=(replace(JOB, work=work),))})
    query = {"figure": "f", "record": record.plain(), "job": "count", "do": "begin", "part": "last"}
    assert json.loads(host.job(json.dumps(query)))["done"]
    assert arguments == [(record.controls, 53, "last")]


def test_a_part_that_fails_is_over() -> None:
    def work(controls: Any, seed: int, part: str) -> Iterator[Progress]:
        yield Progress(0.5, "half")
        raise RuntimeError("broken")

    running, job = Running(Clock(SLICE)), replace(JOB, work=work)
    running.begin("f", job, CONTROLS, 40, "first")
    running.slice("f", job)
    with pytest.raises(RuntimeError, match="broken"):
        running.slice("f", job)
    with pytest.raises(ValueError, match="not under way"):
        running.slice("f", job)


def test_what_a_machine_takes_is_left_out_of_a_build() -> None:
    """The table in a built page has no times, neither as shown nor in its CSV; everything else is equal."""
    build, live = finished(JOB, CONTROLS, 40, "f-count"), plain(result_of(2), "f-count")
    assert [row["texts"] for row in build["rows"]] == [["0.33", "0", "–"], ["1.33", "1", "–"]]
    assert [row["texts"] for row in live["rows"]] == [["0.33", "0", "7"], ["1.33", "1", "7"]]
    assert build["rows"][1]["values"] == [4 / 3, 1, None]
    assert {k: v for k, v in build.items() if k not in ("rows", "csv")} == {
        k: v for k, v in live.items() if k not in ("rows", "csv")
    }
    assert [row["mark"] for row in live["rows"]] == ["by-means", "by-means dashed"]
    assert build["panels"][0]["svg"].startswith("<svg")
    silent = replace(JOB, work=lambda controls, seed, part: iter([Progress(1, "done")]))
    with pytest.raises(ValueError, match="first of count ended without an outcome"):
        finished(silent, CONTROLS, 40, "f")


def test_csv_is_read_back_in_full() -> None:
    """Any CSV reader gets the names, including commas and quotes, and every digit of the numbers."""
    table = list(csv.reader(io.StringIO(plain(result_of(2), "f")["csv"])))
    assert table[0] == ["Solver", "Error (°)", "Count", "Wall time (ms)"]
    assert table[1][0] == 'one, "two"'
    assert [float(v) for v in table[2][1:]] == [4 / 3, 1.0, 7.0]
    assert list(csv.reader(io.StringIO(finished(JOB, CONTROLS, 40, "f")["csv"])))[1][3] == ""


def test_the_host_runs_jobs_of_its_widgets() -> None:
    """Parts, begin, continue, stop and result, as JSON; an unknown job or part or an invalid record is named."""
    host = Host({"kabsch": replace(WIDGET, jobs=(JOB,))})
    record = preset(WIDGET).plain()

    def ask(**changes: Any) -> Any:
        return json.loads(
            host.job(json.dumps({"figure": "f", "record": record, "job": "count", "do": "begin", **changes}))
        )

    assert ask(do="parts") == ["first", "last"]
    last = ask(part="last")
    while not last["done"]:
        last = ask(do="go on")
    assert last["outcome"] == {"of": "last", "pieces": 10}
    table = ask(do="result", outcomes={"last": last["outcome"]})
    assert table == json.loads(json.dumps(plain(result_of(1), "f-count")))
    ask(part="first")
    assert ask(do="stop") is None
    with pytest.raises(ValueError, match="not under way"):
        ask(do="go on")
    with pytest.raises(ValueError, match="did you mean 'count'"):
        ask(job="cuont")
    with pytest.raises(ValueError, match="did you mean 'first'"):
        ask(part="frist")
    with pytest.raises(ValueError, match="count has no None"):
        ask()
    with pytest.raises(ValueError, match="seed"):
        ask(record={**record, "seed": -1})
