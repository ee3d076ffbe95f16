"""Long work that a figure offers beside its frames: done in slices, so that the page stays responsive, with a table as
its result.

A job has parts that do not depend on each other, so that the page can run them in two workers at once. A part is a
generator that yields after every small piece of work. The page requests slice after slice; other requests are answered
in between, and to stop a job the page need only stop asking. The outcomes of any number of parts, from either worker,
make a result. Only plain data is exchanged with the page.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from time import perf_counter
from typing import Any

from widgets.drawing.picture import Panel, Role, number
from widgets.drawing.svg import panel_svg
from widgets.engine.controls import clip, nearest
from widgets.engine.script import headed

SLICE = 0.04  # seconds: a piece is not begun if it would end later than this, should it last as long as the one before


@dataclass(frozen=True)
class Column:
    """A column of numbers. decimals: as shown. timed: whether its values depend on the machine and the moment; a build
    leaves them out."""

    name: str
    label: str
    unit: str = ""
    decimals: int = 0
    timed: bool = False

    def text(self, value: float | None) -> str:
        """The value as shown."""
        return "–" if value is None else number(value, self.decimals)


@dataclass(frozen=True)
class Row:
    """A row of the table. role, dashed, dotted: its mark, drawn like its lines elsewhere. values: one per column."""

    name: str
    label: str
    values: tuple[float | None, ...]
    role: Role = "ink"
    dashed: bool = False
    dotted: bool = False


@dataclass(frozen=True)
class Result:
    """The result of a job. caption: the table's title. heading: that of the rows' names. python: source text that
    reproduces it."""

    caption: str
    heading: str
    columns: tuple[Column, ...]
    rows: tuple[Row, ...]
    panels: tuple[Panel, ...] = ()
    python: str = ""


@dataclass(frozen=True)
class Progress:
    """How far a part of a job has come: as a fraction from 0 to 1 and in words; at 1 also its outcome."""

    fraction: float
    words: str
    outcome: Any = None


@dataclass(frozen=True)
class Job:
    """A job that a figure offers. label: that of its button.

    parts: takes the control values; the names of the parts, the longest last.
    work: takes the control values, the seed and a part's name; the last Progress that it yields has fraction 1 and an
    outcome that JSON can carry.
    result: takes the control values and the outcomes so far by part, in any order, at least one.
    """

    name: str
    label: str
    parts: Callable[[Any], Sequence[str]]
    work: Callable[[Any, int, str], Iterator[Progress]]
    result: Callable[[Any, Mapping[str, Any]], Result]


@dataclass
class Running:
    """The running parts by figure and job, one of each; beginning another drops the one before."""

    now: Callable[[], float] = perf_counter
    works: dict[tuple[str, str], Iterator[Progress]] = field(default_factory=dict)

    def begin(self, figure: str, job: Job, controls: Any, seed: int, part: object) -> None:
        """Begin a part of a job without doing any work yet.

        Raises ValueError if the job has no such part.
        """
        if part not in (names := job.parts(controls)):
            raise ValueError(f"part: {job.name} has no {clip(part)}{nearest(part, names)}")
        self.works[figure, job.name] = job.work(controls, seed, str(part))

    def stop(self, figure: str, job: Job) -> None:
        """Drop the job's part if one is running."""
        self.works.pop((figure, job.name), None)

    def slice(self, figure: str, job: Job) -> dict[str, Any]:
        """Work on a job's part for about `SLICE` seconds or to its end; return its progress as plain data.

        Raises ValueError if the job is not running.
        """
        key = figure, job.name
        if key not in self.works:
            raise ValueError(f"job: {job.name} is not under way")
        start = before = self.now()
        while True:
            try:
                progress = next(self.works[key])
            except BaseException:
                self.works.pop(key)  # a job that failed cannot go on
                raise
            after = self.now()
            if progress.fraction >= 1 or 2 * after - before - start > SLICE:
                break
            before = after
        done = progress.fraction >= 1
        if done:
            self.works.pop(key)
        fraction = round(progress.fraction, 4)
        return {"fraction": fraction, "words": progress.words, "done": done, "outcome": progress.outcome}


def plain(result: Result, prefix: str, timed: bool = True) -> dict[str, Any]:
    """A result as plain data for the page; without `timed`, values that depend on the machine are left out."""
    mask = [timed or not column.timed for column in result.columns]
    rows = []
    for row in result.rows:
        values = [value if visible else None for value, visible in zip(row.values, mask, strict=True)]
        texts = [column.text(value) for column, value in zip(result.columns, values, strict=True)]
        line = " ".join(name for name, on in (("dashed", row.dashed), ("dotted", row.dotted)) if on)
        rows.append(
            {
                "name": row.name,
                "label": row.label,
                "mark": f"{row.role} {line}".strip(),
                "values": values,
                "texts": texts,
            }
        )
    return {
        "caption": result.caption,
        "heading": result.heading,
        "columns": [{"name": c.name, "label": c.label, "unit": c.unit} for c in result.columns],
        "rows": rows,
        "panels": [
            {"name": p.name, "svg": panel_svg(p, f"{prefix}-{p.name}"), "width": p.view.width}
            for p in result.panels
        ],
        "csv": written(result, mask),
        "python": headed(result.python, result.caption),
    }


def written(result: Result, mask: list[bool]) -> str:
    """The table as CSV, with numbers in full precision. (The page's Python has no csv module.)"""
    lines = [[result.heading, *(f"{c.label} ({c.unit})" if c.unit else c.label for c in result.columns)]]
    for row in result.rows:
        values = zip(row.values, mask, strict=True)
        lines.append([row.label, *("" if value is None or not visible else repr(value) for value, visible in values)])
    return "".join(",".join(map(_cell, line)) + "\n" for line in lines)


def _cell(text: str) -> str:
    text = text.replace("\u00a0", " ")
    return '"' + text.replace('"', '""') + '"' if set(text) & set('",\n') else text


def finished(job: Job, controls: Any, seed: int, prefix: str) -> Mapping[str, Any]:
    """Run all parts of a job; return its result as plain data without the values that depend on the machine, for the
    page to show before scripts run.

    Raises ValueError if a part ends without an outcome.
    """
    outcomes = {part: outcome(job, controls, seed, part) for part in job.parts(controls)}
    return plain(job.result(controls, outcomes), prefix, timed=False)


def outcome(job: Job, controls: Any, seed: int, part: str) -> Any:
    """Run a part of a job to its end.

    Raises ValueError if it ends without an outcome.
    """
    *_, last = job.work(controls, seed, part)
    if last.outcome is None:
        raise ValueError(f"job: {part} of {job.name} ended without an outcome")
    return last.outcome
