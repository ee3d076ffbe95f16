"""What the sweep measures, and the small files that it writes: content/data/sweep/{table,basins,curves}.json.

Each contestant's part of a file carries a hash of the solver code that it ran, so that a change of one method makes
only the affected parts stale. Success is stored seed by seed, as bits in hexadecimal, most significant first: any of it
can be run again and compared.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from sitegen.cache.code_hash import closure, code_text, method_modules, reached
from sitegen.cache.files import fingerprint
from sitegen.experiments.sweep_unit import Unit, close, turned
from solvers.core.status import Status
from solvers.scenes.rooms import ROOM_SETTINGS
from solvers.studies.race import CONTESTANTS, Contestant
from solvers.studies.seeds import seeds

FOLDER = "content/data/sweep"
RESAMPLES = 2000
Found = Mapping[str, Sequence[float]]
Cell = dict[str, Any]


@dataclass(frozen=True)
class Sweep:
    """One file of results: cells by name, each one setting of the race's controls, all on the same seeds.

    name: of the file. cells: name → controls. seeds: the seeds of each cell. block: how many of them make a unit of
    work. keep: reduces a cell's runs to what is stored. axes: the values in the cells' names, for readers of the file.
    """

    name: str
    cells: Mapping[str, Mapping[str, Any]]
    seeds: tuple[int, ...]
    block: int
    keep: Callable[[Found], Cell]
    axes: Mapping[str, Sequence[Any]]


def bits(flags: Sequence[bool]) -> str:
    """Flags as hexadecimal digits, four flags per digit, padded with zeros at the end."""
    filled = [*flags, *[False] * (-len(flags) % 4)]
    nibbles = (filled[i : i + 4] for i in range(0, len(filled), 4))
    return "".join(f"{sum(flag << (3 - k) for k, flag in enumerate(nibble)):x}" for nibble in nibbles)


def flags(digits: str, count: int) -> list[bool]:
    """The flags that bits() wrote."""
    return [bool(int(digit, 16) >> (3 - k) & 1) for digit in digits for k in range(4)][:count]


def bootstrap(values: Sequence[float], statistic: Callable[[Any], Any]) -> list[float]:
    """A statistic of the values and its 95 % percentile interval over seeded resamples (Efron 1979): [value, low,
    high].

    statistic: a function that reduces the last axis.
    """
    data = np.asarray(values, dtype=np.float64)
    rng = np.random.default_rng(len(data))
    blocks = (rng.integers(0, len(data), (200, len(data))) for _ in range(RESAMPLES // 200))
    estimates = np.concatenate([statistic(data[rows]) for rows in blocks])
    low, high = np.quantile(estimates, (0.025, 0.975))
    return [round(float(value), 4) for value in (statistic(data), low, high)]


def _median(values: Any) -> Any:
    return np.median(values, axis=-1)


def keep_row(runs: Found) -> Cell:
    """A cell of the table: medians with intervals, how runs stopped, success seed by seed."""
    stops = np.bincount(np.asarray(runs["status"], dtype=np.int64), minlength=len(Status))
    return {
        "rre": bootstrap(runs["rre"], _median),
        "rte": bootstrap(runs["rte"], _median),
        "steps": bootstrap(runs["steps"], _median),
        "turned": sum(turned(runs)),
        "stops": {Status(k).label: int(n) for k, n in enumerate(stops) if n},
        "bits": bits(close(runs)),
    }


def keep_bits(runs: Found) -> Cell:
    """Success seed by seed."""
    return {"bits": bits(close(runs))}


ROTATIONS = tuple(range(-165, 181, 15))
DISTANCES = (0.0, 0.5, 1.0, 1.5, 2.0, 2.5, 3.0)
BASIN_SETTINGS = ("clean", "combo")
CURVES: dict[str, tuple[float, ...]] = {
    "noise": (0.0, 0.02, 0.05, 0.08, 0.11, 0.15, 0.2, 0.3),
    "outliers": (0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7),
    "overlap": (1.0, 0.9, 0.8, 0.7, 0.6, 0.5, 0.4, 0.3),
    "density": (0.25, 0.5, 0.75, 1.0, 1.5, 2.0, 3.0),
}
SWEEPS = (
    Sweep(
        "table",
        {setting: {"setting": setting} for setting in ROOM_SETTINGS},
        seeds(1000),
        100,
        keep_row,
        {"setting": ROOM_SETTINGS},
    ),
    Sweep(
        "basins",
        {
            f"{setting} {degrees:d} {distance:g}": {"setting": setting, "degrees": degrees, "distance": distance}
            for setting, degrees, distance in itertools.product(BASIN_SETTINGS, ROTATIONS, DISTANCES)
        },
        seeds(10),
        10,
        keep_bits,
        {"setting": BASIN_SETTINGS, "degrees": ROTATIONS, "distance": DISTANCES},
    ),
    Sweep(
        "curves",
        {f"{control} {value:g}": {"setting": "clean", control: value} for control, v in CURVES.items() for value in v},
        seeds(100),
        100,
        keep_bits,
        CURVES,
    ),
)


def code_of(contestant: Contestant, root: Path) -> str:
    """A hash of the code that a contestant's runs execute (its method's modules, scenes, the loop, metrics) and of its
    options."""
    modules = method_modules(contestant.method)
    core = [f"solvers.core.{name}" for name in ("pose", "status", "stepper")]
    common = {"solvers.scenes.rooms", "solvers.metrics", *core}
    files = closure(modules | common, root, skip=["solvers.core.registry"])
    race = reached((root / "solvers" / "studies" / "race.py").read_text("utf-8"), ["race_problem", "MAX_STEPS"])
    pieces = [(name, code_text(path.read_text("utf-8")).encode()) for name, path in files.items()]
    pieces += [(f"race.{name}", text.encode()) for name, text in race.items()]
    options = repr(sorted((name, value) for name, value in contestant.options.items()))
    return fingerprint([*pieces, ("contestant", f"{contestant.method} {options}".encode())])[:16]


def racing(names: Sequence[str] = ()) -> list[Contestant]:
    """The contestants of these methods; all if empty."""
    return [c for c in CONTESTANTS if not names or c.method in names]


def units(sweep: Sweep, contestant: Contestant) -> Iterator[tuple[tuple[str, ...], Unit]]:
    """A contestant's units of work, each with the names of its cells."""
    blocks = [sweep.seeds[i : i + sweep.block] for i in range(0, len(sweep.seeds), sweep.block)]
    for names in _together(sweep):
        points = tuple(sweep.cells[name] for name in names)
        for block in blocks:
            yield names, Unit(contestant.method, points, block)


def _together(sweep: Sweep) -> list[tuple[str, ...]]:
    """The cells in groups, so that a unit has about a hundred runs."""
    size = max(1, 100 // sweep.block)
    names = list(sweep.cells)
    return [tuple(names[i : i + size]) for i in range(0, len(names), size)]


def split(runs: Found, count: int) -> list[dict[str, list[float]]]:
    """Split a unit's runs by cell."""
    size = len(runs["rre"]) // count
    return [{name: list(values[i * size : (i + 1) * size]) for name, values in runs.items()} for i in range(count)]
