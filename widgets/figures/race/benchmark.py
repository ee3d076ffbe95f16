"""The race run to its end on the benchmark's 25 seeds: a table, and a dot for every seed."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict
from functools import lru_cache
from time import perf_counter
from typing import Any, Protocol

import numpy as np

from solvers.core.method import Problem
from solvers.core.pose import Pose
from solvers.core.registry import METHODS
from solvers.core.stepper import advance
from solvers.studies import race as racing
from solvers.studies.benchmark import CLOSE_DEGREES, CLOSE_DISTANCE, Line, line
from solvers.studies.race import SEEDS, race_problem
from widgets.drawing.chart import ABOVE, axes
from widgets.drawing.picture import Label, Mark, Panel, Path, Points, Segments, View
from widgets.engine.jobs import Column, Job, Progress, Result, Row
from widgets.engine.script import called, named
from widgets.figures.race.field import STAND_IN, Entry, field
from widgets.parts.room import SETTINGS

COLUMNS = (
    Column("rre", "Median rotation error", "°", 2),
    Column("rte", "Median translation error", "u", 3),
    Column("turned", f"Within {CLOSE_DEGREES:g}°, of\u00a0{len(SEEDS)}"),
    Column("close", f"Within {CLOSE_DEGREES:g}° and {CLOSE_DISTANCE:g}\u00a0u"),
    Column("steps", "Median steps"),
    Column("time", "Wall time", "ms", timed=True),
)
ROW = 19.0  # px from one solver's strip to the next
PAD = (104.0, 28.0, 12.0, 40.0)


class Settings(Protocol):
    """The race's controls that the benchmark needs."""

    @property
    def setting(self) -> str: ...
    @property
    def ninth(self) -> str: ...
    def race(self) -> racing.Controls: ...


def parts(controls: Settings) -> tuple[str, ...]:
    """The contestants' methods."""
    methods = tuple(entry.contestant.method for entry in field(controls.ninth))
    for method in methods:
        METHODS[method]  # imported now, so that a file that a page cannot load fails before any run
    return methods


def work(controls: Settings, seed: int, part: str) -> Iterator[Progress]:
    """Run a contestant on all seeds in one batch, step by step. The seeds are the benchmark's own, not `seed`."""
    problem, truth = problems(controls.race())
    (contestant,) = (one.contestant for one in field(controls.ninth) if one.contestant.method == part)
    seconds, steps = 0.0, 0
    start = perf_counter()
    batch = contestant.begin(problem)
    seconds += perf_counter() - start
    while not batch.done:
        # The share of runs that have stopped is the best available measure of progress.
        yield Progress(1 - batch.rows.size / batch.steps.size, f"{contestant.label}, step {steps}")
        start = perf_counter()
        batch = advance(batch)
        seconds += perf_counter() - start
        steps += 1
    yield Progress(1.0, contestant.label, outcome(line(contestant, batch, truth, seconds)))


@lru_cache(maxsize=1)
def problems(race: racing.Controls) -> tuple[Problem, Pose]:
    """The benchmark's problems and true poses, which the parts of a job share."""
    return race_problem(race)


def outcome(x: Line) -> dict[str, list[float]]:
    """What the table and the strips show of a contestant, as plain data."""
    values = [x.median_rre, x.median_rte, x.turned, x.close, x.median_steps, 1e3 * x.seconds]
    return {"values": values, "rre": x.rre.tolist(), "rte": x.rte.tolist()}


def numbers(rre: float, rte: float, turned: int, close: int, steps: float, time: float) -> tuple[float, ...]:
    """A row's values with the types that they had before they crossed the page, where 29.0 became 29."""
    return float(rre), float(rte), turned, close, float(steps), float(time)


def result(controls: Settings, outcomes: Mapping[str, Any]) -> Result:
    """The table and the strips of all runs so far."""
    race = controls.race()
    entries = [one for one in field(controls.ninth) if one.contestant.method in outcomes]
    known = [outcomes[one.contestant.method] for one in entries]
    rows = tuple(
        Row(one.contestant.method, one.contestant.label, numbers(*x["values"]), one.role, one.dashed, one.dotted)
        for one, x in zip(entries, known, strict=True)
    )
    panels = (
        strips("rre", ("Rotation", "°"), entries, [x["rre"] for x in known], (0.001, 180.0), CLOSE_DEGREES),
        strips("rte", ("Translation", "\u00a0u"), entries, [x["rte"] for x in known], (0.001, 10.0), CLOSE_DISTANCE),
    )
    return Result(caption(race), "Solver", COLUMNS, rows, panels, python(race, controls.ninth))


def caption(race: racing.Controls) -> str:
    """A caption that says what was run."""
    noise, outliers = race.noise or 0.0, 100 * (race.outliers or 0.0)
    return (
        f"{len(SEEDS)} seeds, {SEEDS[0]} to {SEEDS[-1]}: {SETTINGS[race.setting].lower()}, start {race.degrees:g}° and"
        f" {race.distance:g} u, σ {noise:g} u, {outliers:g} % outliers, {100 * race.overlap:g} % overlap,"
        f" density {race.density:g}"
    )


def strips(
    name: str, quantity: tuple[str, str], entries: Sequence[Entry],
    errors: Sequence[Sequence[float]], span: tuple[float, float], close: float,
) -> Panel:  # fmt: skip
    """A strip per solver with a dot per seed, on a logarithmic axis; a bar at the median, a line at the threshold.

    quantity: the name of the error and its unit. Errors outside `span` are drawn at its end.
    """
    what, unit = quantity
    low, high = (float(np.log10(v)) for v in span)
    view = View(low, high, -9.0, 0.0, 480.0, PAD[1] + PAD[3] + 9 * ROW, PAD)
    exponents = np.arange(np.ceil(low), np.floor(high) + 1)
    marks: list[Mark] = [*axes(view, [], [], [])]
    marks.append(
        Segments([[x, 0.0] for x in exponents], [[x, -9.0] for x in exponents], "guide", weight=[0.3] * len(exponents))
    )
    marks += [Label([x, -9.0], f"{10.0**x:g}", "guide", "middle", dy=15) for x in exponents]
    label = f"{what} error of every seed, {unit.strip()}"
    title = Label([low, 0.0], f"{what} error, {unit.strip()}", "guide", dy=-ABOVE, fixed=True)
    key = Label([high, 0.0], f"bar: median; dashed: {close:g}{unit}", "guide", "end", dy=-ABOVE, fixed=True)
    marks += [title, key]  # more would not fit on the line
    marks.append(Segments([np.log10(close), 0.0], [np.log10(close), -9.0], "truth", dashed=True))
    for k, (entry, error) in enumerate(zip(entries, errors, strict=True)):
        middle = -0.5 - k
        place = np.log10(np.clip(error, *span))
        # Five rows, in the order of the seeds, so that equal errors do not hide each other.
        beside = middle + 0.13 * (np.arange(len(place)) * 2 % 5 - 2)
        marks.append(Points(np.stack([place, beside], axis=1), entry.role, radius=2.5, weight=[0.65] * len(place)))
        median = float(np.median(place))
        marks.append(Path([[median, middle - 0.42], [median, middle + 0.42]], "ink", thick=True))
        marks.append(Label([low, middle], entry.short, entry.role, "end", dx=-8, dy=4))
    return Panel(name, label, view, tuple(marks), grid=False)


def python(race: racing.Controls, ninth: str) -> str:
    """A script that computes the same table."""
    lines = ["from solvers.benchmark import benchmark, table", "from solvers.race import Controls", ""]
    more = ""
    if ninth != STAND_IN:
        lines[1] = "from solvers.race import CONTESTANTS, Controls, contestants"
        lines.append(f"nine = (*CONTESTANTS[:8], *contestants([{ninth!r}]))")
        more = ", contestants=nine"
    lines += [
        *called("controls = Controls", *named(asdict(race))),
        f"print(table(benchmark(controls{more})))",
    ]
    return "\n".join(lines) + "\n"


BENCHMARK = Job("benchmark", f"Run on {len(SEEDS)} seeds", parts, work, result)
