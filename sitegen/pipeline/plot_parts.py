"""Stored results of slow plots: rerun if their code has changed, else spot-checked by rerunning a sample."""

from __future__ import annotations

import json
import platform
from collections.abc import Iterable, Mapping
from functools import partial
from hashlib import sha256
from pathlib import Path
from typing import Any

from sitegen.cache import pool
from sitegen.cache.memo import Remembered
from sitegen.experiments.sweep_verify import Standing
from sitegen.figures.gallery import Plot
from sitegen.figures.parts import FOLDER, Asked, named
from sitegen.plots.registry import known
from sitegen.problems import Problem
from sitegen.progress import Progress

OFF = 1
"""How much a count may differ: on another processor, a close branch may go the other way."""
NEAR = 1e-3
"""The relative difference allowed in a measurement, for the same reason."""


def long_plots() -> dict[str, Plot]:
    """The plots that are computed in parts, by name."""
    return {name: plot for name, plot in known().items() if plot.parts}


def run_part(name: str, asked: Asked) -> Any:
    """Run one part of a plot and return its result."""
    plot = known()[name]
    assert plot.parts is not None
    return plot.parts.run(asked)


def renew(names: Iterable[str], processes: int, progress: Progress) -> list[str]:
    """Rerun, in parallel processes, the parts of these plots whose stored file is stale. Return the plots rerun."""
    stale = {name: plot.parts for name, plot in long_plots().items() if name in set(names) and plot.parts}
    stale = {name: parts for name, parts in stale.items() if parts.kept() is None}
    every = [(name, asked) for name, parts in stale.items() for asked in parts.asked]
    found: dict[str, dict[Asked, Any]] = {name: {} for name in stale}
    with pool.working([(run_part, each) for each in every], processes) as finished:
        for done, (place, value) in enumerate(finished):
            if isinstance(value, pool.PieceFailed):
                raise value
            name, asked = every[place]
            found[name][asked] = value
            progress("computing plots", done + 1, len(every))
    for name, parts in stale.items():
        parts.keep(found[name])
    return list(stale)


def standing(plots: Mapping[str, Plot] | None = None, cache: Path | None = None) -> Standing:
    """Check the stored results of these plots (None: all) by rerunning one part of each, picked by a hash of them.

    cache: where to remember a part's result for this machine and code; None: nowhere.
    """
    remembered = Remembered(cache, "plots") if cache else None
    wrong, stale, proved = [], [], 0
    for name, plot in (long_plots() if plots is None else plots).items():
        assert plot.parts is not None
        file, found = f"{FOLDER}/{name}.json", plot.parts.kept()
        if found is None:
            again = f"run `python3 build.py sweep --only {name}`"
            stale.append(Problem(file, 0, 0, f"stale: from other code or another numpy, or damaged; {again}"))
            continue
        asked, make = sample(found), plot.parts.run
        given = json.dumps([platform.platform(), platform.processor(), plot.parts.file.read_text("utf-8")])
        value = remembered.answer(given, partial(make, asked)) if remembered else make(asked)
        if alike(found[asked], value):
            proved += 1
        else:
            message = f"{named(asked)!r} is {json.dumps(found[asked])}; the same code gives {json.dumps(value)}"
            wrong.append(Problem(file, 0, 0, message))
    if remembered:
        remembered.keep()
    return Standing(tuple(wrong), tuple(stale), proved)


def sample(found: Mapping[Asked, Any]) -> Asked:
    """One of the parts, picked by a hash of all their results."""
    text = json.dumps([[named(asked), value] for asked, value in found.items()])
    return list(found)[int(sha256(text.encode()).hexdigest(), 16) % len(found)]


def alike(one: Any, other: Any) -> bool:
    """Whether two results of a part agree: counts within OFF, measurements within a fraction NEAR of the first."""
    match one, other:
        case dict(), dict():
            return one.keys() == other.keys() and all(alike(one[key], other[key]) for key in one)
        case list(), list():
            return len(one) == len(other) and all(map(alike, one, other))
        case int(), int():
            return abs(one - other) <= OFF
        case (int() | float()), (int() | float()):
            return abs(one - other) <= NEAR * abs(one)
    return bool(one == other)
