"""Long work that a figure offers beside its frames: done in slices, so that the page stays responsive, with a table as
its result.

A job is a generator that yields after every small piece of work. The page requests slice after slice; other requests
are answered in between, and to stop a job the page need only stop asking. Only plain data is exchanged with the page.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from time import perf_counter
from typing import Any

from widgets.drawing.picture import Panel, Role, number
from widgets.drawing.svg import panel_svg
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
    """How far a job has come: as a fraction from 0 to 1 and in words; and the result so far, if there is a new one."""

    part: float
    words: str
    result: Result | None = None


@dataclass(frozen=True)
class Job:
    """A job that a figure offers. label: that of its button. work: takes the control values and the seed; the last
    Progress that it yields has part 1."""

    name: str
    label: str
    work: Callable[[Any, int], Iterator[Progress]]


@dataclass
class Running:
    """The running jobs by figure and name; beginning one that is already running restarts it."""

    now: Callable[[], float] = perf_counter
    works: dict[tuple[str, str], Iterator[Progress]] = field(default_factory=dict)

    def begin(self, figure: str, job: Job, controls: Any, seed: int) -> None:
        """Begin a job without doing any work yet."""
        self.works[figure, job.name] = job.work(controls, seed)

    def stop(self, figure: str, job: Job) -> None:
        """Drop the job if it is running."""
        self.works.pop((figure, job.name), None)

    def slice(self, figure: str, job: Job) -> dict[str, Any]:
        """Work on a job for about `SLICE` seconds or until it has a result; return its progress as plain data.

        Raises ValueError if the job is not running.
        """
        key = figure, job.name
        if key not in self.works:
            raise ValueError(f"job: {job.name} is not under way")
        start = before = self.now()
        result = None
        while True:
            try:
                progress = next(self.works[key])
            except BaseException:
                self.works.pop(key)  # a job that failed cannot go on
                raise
            result = progress.result or result
            after = self.now()
            # After a result something else begins, and the last piece says nothing about how long that takes.
            if progress.part >= 1 or progress.result or 2 * after - before - start > SLICE:
                break
            before = after
        done = progress.part >= 1
        if done:
            self.works.pop(key)
        payload = None if result is None else plain(result, f"{figure}-{job.name}")
        return {"part": round(progress.part, 4), "words": progress.words, "done": done, "result": payload}


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
    """Run a job to its end; return its result as plain data without the values that depend on the machine, for the page
    to show before scripts run.

    Raises ValueError if it ends without a result.
    """
    result = None
    for progress in job.work(controls, seed):
        result = progress.result or result
    if result is None:
        raise ValueError(f"job: {job.name} ended without a result")
    return plain(result, prefix, timed=False)
