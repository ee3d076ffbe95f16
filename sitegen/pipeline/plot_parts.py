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
from sitegen.figures.parts import FOLDER, Arguments, named
from sitegen.plots.registry import all_plots
from sitegen.problems import Problem
from sitegen.progress import Progress

OFF = 1
"""How much a count may differ: on another processor, a close branch may go the other way."""
NEAR = 1e-3
"""The relative difference allowed in a measurement, for the same reason."""


def long_plots() -> dict[str, Plot]:
    """The plots that are computed in parts, by name."""
    return {name: plot for name, plot in all_plots().items() if plot.parts}


def run_part(name: str, arguments: Arguments) -> Any:
    """Run one part of a plot and return its result."""
    plot = all_plots()[name]
    assert plot.parts is not None
    return plot.parts.run(arguments)


def renew(names: Iterable[str], processes: int, progress: Progress) -> list[str]:
    """Rerun, in parallel processes, the parts of these plots whose stored file is stale. Return the plots rerun."""
    stale = {name: plot.parts for name, plot in long_plots().items() if name in set(names) and plot.parts}
    stale = {name: parts for name, parts in stale.items() if parts.stored() is None}
    pieces = [(name, arguments) for name, parts in stale.items() for arguments in parts.arguments]
    results: dict[str, dict[Arguments, Any]] = {name: {} for name in stale}
    with pool.working([(run_part, piece) for piece in pieces], processes) as finished:
        for count, (index, value) in enumerate(finished):
            if isinstance(value, pool.PieceFailed):
                raise value
            name, arguments = pieces[index]
            results[name][arguments] = value
            progress("computing plots", count + 1, len(pieces))
    for name, parts in stale.items():
        parts.store(results[name])
    return list(stale)


def standing(plots: Mapping[str, Plot] | None = None, cache: Path | None = None) -> Standing:
    """Check the stored results of these plots (None: all) by rerunning one part of each, picked by a hash of them.

    cache: where to remember a part's result for this machine and code; None: nowhere.
    """
    remembered = Remembered(cache, "plots") if cache else None
    wrong, stale, proved = [], [], 0
    for name, plot in (long_plots() if plots is None else plots).items():
        assert plot.parts is not None
        file, results = f"{FOLDER}/{name}.json", plot.parts.stored()
        if results is None:
            command = f"run `python3 build.py sweep --only {name}`"
            stale.append(Problem(file, 0, 0, f"stale: from other code or another numpy, or damaged; {command}"))
            continue
        arguments, make = sample(results), plot.parts.run
        inputs = json.dumps([platform.platform(), platform.processor(), plot.parts.file.read_text("utf-8")])
        value = remembered.answer(inputs, partial(make, arguments)) if remembered else make(arguments)
        if alike(results[arguments], value):
            proved += 1
        else:
            reference = json.dumps(results[arguments])
            message = f"{named(arguments)!r} is {reference}; the same code gives {json.dumps(value)}"
            wrong.append(Problem(file, 0, 0, message))
    if remembered:
        remembered.keep()
    return Standing(tuple(wrong), tuple(stale), proved)


def sample(results: Mapping[Arguments, Any]) -> Arguments:
    """One of the parts, picked by a hash of all their results."""
    text = json.dumps([[named(arguments), value] for arguments, value in results.items()])
    return list(results)[int(sha256(text.encode()).hexdigest(), 16) % len(results)]


def alike(first: Any, second: Any) -> bool:
    """Whether two results of a part agree: counts within OFF, measurements within a fraction NEAR of the first."""
    match first, second:
        case dict(), dict():
            return first.keys() == second.keys() and all(alike(first[key], second[key]) for key in first)
        case list(), list():
            return len(first) == len(second) and all(map(alike, first, second))
        case int(), int():
            return abs(first - second) <= OFF
        case (int() | float()), (int() | float()):
            return abs(first - second) <= NEAR * abs(first)
    return bool(first == second)
