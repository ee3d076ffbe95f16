"""`sweep`: updates the repository's stored results of long runs: the race's sweeps and the long plots."""

from __future__ import annotations

import importlib.util
import sys
from collections.abc import Sequence
from pathlib import Path

from sitegen.cache.files import cache_dir
from sitegen.experiments.sweep import run
from sitegen.experiments.sweep_plan import FOLDER, SWEEPS, racing
from sitegen.pipeline.plot_parts import long_plots, renew
from sitegen.progress import reporting


def sweep(root: Path, processes: int, scheduler: str, only: Sequence[str], methods: Sequence[str]) -> int:
    """Run what is missing or stale and write the files. If methods are named, no plot is run, as each uses several.

    The exit code is 2 for names that do not exist or do not go together.
    """
    sweeps, plots, contestants = [s.name for s in SWEEPS], list(long_plots()), [c.method for c in racing()]
    wrong = sorted({*only} - {*sweeps, *plots} | {*methods} - {*contestants})
    if wrong:
        available = ", ".join([*sweeps, *plots, *contestants])
        print(f"sweep: unknown {', '.join(wrong)}; known: {available}", file=sys.stderr)
        return 2
    alone = [name for name in plots if name in only and methods]
    if alone:
        print(f"sweep: --methods cannot be combined with {', '.join(alone)}: a plot runs whole", file=sys.stderr)
        return 2
    if scheduler and importlib.util.find_spec("distributed") is None:
        print("sweep: --scheduler needs dask: `pip install 'dask[distributed]'`", file=sys.stderr)
        return 2
    with reporting() as progress:
        for experiment in SWEEPS:
            if experiment.name in (only or sweeps):
                run(root, experiment, methods, cache_dir(), progress, scheduler or processes)
                path = root / FOLDER / f"{experiment.name}.json"
                print(f"{path.relative_to(root)}: {path.stat().st_size / 1000:.0f} kB", flush=True)
        for name in renew([name for name in plots if name in (only or plots) and not methods], processes, progress):
            print(f"{name}: computed", flush=True)
    return 0
