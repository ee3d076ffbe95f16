"""The sweep: a thousand seeds of the race, its basins and its curves, run in processes or on a Dask cluster.

Every unit of work is cached by the code that it ran, so an interrupted sweep resumes where it stopped, and after a
change of a method only that method is run again. sweep_plan.py defines what is measured, and the files.
"""

from __future__ import annotations

import importlib
import importlib.util
import io
import json
import sys
import zipfile
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict
from functools import cache as once
from pathlib import Path
from typing import Any

import numpy as np

from sitegen.cache import pool
from sitegen.cache.code_hash import code_text
from sitegen.cache.files import fingerprint, write
from sitegen.cache.store import Store
from sitegen.experiments import sweep_unit
from sitegen.experiments.sweep_plan import FOLDER, Sweep, code_of, racing, split, units
from sitegen.experiments.sweep_unit import Unit, run_unit
from sitegen.progress import Progress

Work = Iterator[tuple[Unit, dict[str, list[float]]]]


def run(
    root: Path, sweep: Sweep, methods: Sequence[str], cache: Path, progress: Progress, resources: int | str
) -> None:
    """Run one sweep for the contestants of `methods` (all if empty) and put their results into its file. resources: see
    `workers`."""
    work: dict[str, list[tuple[tuple[str, ...], Unit]]] = {}
    store, keys = Store(cache, "sweep"), dict[str, str]()
    codes = {c.method: code_of(c, root) for c in racing(methods)}
    for contestant in racing(methods):
        work[contestant.method] = list(units(sweep, contestant))
        for _, unit in work[contestant.method]:
            keys[_key(unit)] = kept_by(unit, codes[contestant.method])
    all_units = [unit for rows in work.values() for _, unit in rows]
    results = {key: json.loads(data) for key, name in keys.items() if (data := store.find(name)) is not None}
    missing = [unit for unit in all_units if _key(unit) not in results]
    done = len(all_units) - len(missing)
    progress(f"sweeping {sweep.name}", done, len(all_units))
    with workers(root, missing, resources) as answers:
        for unit, runs in answers:
            data = json.dumps(runs, separators=(",", ":")).encode()
            store.put(keys[_key(unit)], data)
            results[_key(unit)] = json.loads(data)
            done += 1
            progress(f"sweeping {sweep.name}", done, len(all_units))
    entries = {}
    for method, rows in work.items():
        if code_of(next(c for c in racing() if c.method == method), root) != codes[method]:
            print(f"sweep: {method} was edited while it ran; run the sweep again", file=sys.stderr)
            continue
        entries[method] = {"code": codes[method], "cells": _cells(sweep, rows, results)}
    _put(root, sweep, entries)


def _key(unit: Unit) -> str:
    return json.dumps(asdict(unit), sort_keys=True)


def kept_by(unit: Unit, code: str) -> str:
    """A unit's cache key: a hash of the code that it runs and that runs it, numpy's version and the unit."""
    facts = {"code": code, "runner": _runner(), "numpy": np.__version__, "unit": _key(unit)}
    return fingerprint((name, text.encode()) for name, text in facts.items())


@once
def _runner() -> str:
    """The code that runs a unit."""
    return code_text(Path(sweep_unit.__file__).read_text("utf-8"))


def _cells(sweep: Sweep, rows: Sequence[tuple[tuple[str, ...], Unit]], ran: dict[str, Any]) -> dict[str, Any]:
    """Every cell's result, from its units' runs in the order of the seeds."""
    cells: dict[str, dict[str, list[float]]] = {}
    for names, unit in rows:
        for name, part in zip(names, split(ran[_key(unit)], len(names)), strict=True):
            whole = cells.setdefault(name, {})
            for key, values in part.items():
                whole.setdefault(key, []).extend(values)
    return {name: sweep.keep(cell) for name, cell in cells.items()}


def _put(root: Path, sweep: Sweep, entries: dict[str, Any]) -> None:
    """Write the sweep's file: new entries replace old ones, in the race's order."""
    path = root / FOLDER / f"{sweep.name}.json"
    old_entries = json.loads(path.read_text("utf-8"))["contestants"] if path.is_file() else {}
    whole = {**old_entries, **entries}
    data = {
        "numpy": np.__version__,
        "seeds": len(sweep.seeds),
        "axes": {name: list(values) for name, values in sweep.axes.items()},
        "contestants": {c.method: whole[c.method] for c in racing() if c.method in whole},
    }
    write(path, (_lines(data) + "\n").encode())


def _lines(data: dict[str, Any]) -> str:
    """Compact JSON with one line per contestant and cell, so that a diff shows what has changed."""
    head = {name: value for name, value in data.items() if name != "contestants"}
    parts = []
    for method, entry in data["contestants"].items():
        cells = ",\n".join(f"{json.dumps(name)}:{_short(cell)}" for name, cell in entry["cells"].items())
        parts.append(f'{json.dumps(method)}:{{"code":{json.dumps(entry["code"])},"cells":{{\n{cells}}}}}')
    return f'{_short(head)[:-1]},"contestants":{{\n' + ",\n".join(parts) + "}}"


def _short(value: Any) -> str:
    return json.dumps(value, ensure_ascii=False, separators=(",", ":"))


@contextmanager
def workers(root: Path, jobs: Sequence[Unit], resources: int | str) -> Iterator[Work]:
    """Run the units and yield their results in the order of completion; leaving the context cancels the rest.

    resources: the number of processes, 0 for one per core, or the address of a Dask cluster.
    """
    if isinstance(resources, str):
        with _cluster(root, jobs, resources) as answers:
            yield answers
    elif resources == 1 or len(jobs) < 2:
        yield ((unit, run_unit(unit)) for unit in jobs)
    else:
        with _processes(jobs, resources) as answers:
            yield answers


@contextmanager
def _processes(jobs: Sequence[Unit], count: int) -> Iterator[Work]:
    with pool.working([(run_unit, (unit,)) for unit in jobs], count) as answers:
        yield ((jobs[i], _sound(result)) for i, result in answers)


def _sound(result: Any) -> dict[str, list[float]]:
    """A unit's result; raises its error if it failed."""
    if isinstance(result, pool.PieceFailed):
        raise result
    return dict(result)


@contextmanager
def _cluster(root: Path, jobs: Sequence[Unit], scheduler: str) -> Iterator[Work]:
    """Run the units on the workers of a Dask cluster, which get our sources and must have the same numpy."""
    distributed: Any = importlib.import_module("distributed")
    with distributed.Client(scheduler, timeout=20) as client:
        theirs = set(client.run(_installer(_pack(root))).values())
        if theirs - {np.__version__}:
            raise RuntimeError(f"the cluster's workers have numpy {', '.join(sorted(theirs))}, we {np.__version__}")
        futures = client.map(run_unit, jobs, pure=False)
        by_key = {future.key: unit for future, unit in zip(futures, jobs, strict=True)}
        yield ((by_key[future.key], result) for future, result in distributed.as_completed(futures, with_results=True))


def _pack(root: Path) -> bytes:
    """The code that a unit runs, as a zip that Python can import from."""
    ours = [root / "sitegen" / name for name in ("__init__.py", "experiments/__init__.py", "experiments/sweep_unit.py")]
    files = [*sorted((root / "solvers").rglob("*.py")), *ours]
    whole = io.BytesIO()
    with zipfile.ZipFile(whole, "w") as archive:
        for file in files:
            archive.write(file, file.relative_to(root).as_posix())
    return whole.getvalue()


def _installer(archive: bytes) -> Callable[[], str]:
    """A function that installs these sources on a worker and returns the version of its numpy.

    A nested function is sent as code: the worker does not need our package to receive it.
    """

    def install() -> str:
        import importlib
        import sys
        import tempfile
        from pathlib import Path

        import numpy

        if "sitegen.experiments.sweep" not in sys.modules:  # a worker in this process has them
            for name in [name for name in sys.modules if name.partition(".")[0] in ("solvers", "sitegen")]:
                del sys.modules[name]  # those of an earlier sweep
            path = Path(tempfile.mkdtemp(prefix="ladder-sweep-")) / "sources.zip"
            path.write_bytes(archive)
            sys.path.insert(0, str(path))
            importlib.invalidate_caches()
        return numpy.__version__

    return install
