"""Checks that the sweep's files still match the solvers: made by the current code, and right when a sample is rerun."""

from __future__ import annotations

import json
import platform
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np

from sitegen.cache.memo import Remembered
from sitegen.experiments import sweep_plan, sweep_unit
from sitegen.experiments.sweep_plan import FOLDER, SWEEPS, Sweep, code_of, flags, racing
from sitegen.experiments.sweep_unit import BATCH, Unit, close, run_unit
from sitegen.problems import Problem
from solvers.studies.race import Contestant

OFF = 1
"""How many runs of a sample may differ: on another processor, a close decision may go the other way."""


@dataclass(frozen=True)
class Standing:
    """The state of stored results. wrong: results that differ from the code's. stale: results of other code, or missing
    ones. proved: how many runs, or parts, were repeated and agreed; ran: how many samples were run now."""

    wrong: tuple[Problem, ...]
    stale: tuple[Problem, ...]
    proved: int
    ran: int = 0


def standing(root: Path, sweeps: Sequence[Sweep] = SWEEPS, cache: Path | None = None) -> Standing:
    """Read every file of the sweep and rerun a sample of each contestant's part that was made by the current code.

    cache: remembers the outcome of a sample for this machine, these results and this code; None to remember nothing.
    """
    memo = Remembered(cache, "sweep") if cache else None
    ran: list[str] = []
    wrong: list[Problem] = []
    stale: list[Problem] = []
    proved = 0
    codes = {contestant.method: code_of(contestant, root) for contestant in racing()}
    for sweep in sweeps:
        name = f"{FOLDER}/{sweep.name}.json"
        command = f"run `python3 build.py sweep --only {sweep.name}`"
        path = root / name
        data: Any = json.loads(path.read_text("utf-8")) if path.is_file() else {"numpy": "", "contestants": {}}
        old = []
        for contestant in racing():
            entry = data["contestants"].get(contestant.method, {})
            if entry.get("code") != codes[contestant.method] or list(entry["cells"]) != list(sweep.cells):
                old.append(contestant.label)
            elif data["numpy"] == np.__version__:
                make = partial(_sample, sweep, contestant, entry["cells"], ran)
                of, off = memo.answer(_inputs(sweep, contestant, entry), make) if memo else make()
                if off > OFF:
                    message = f"{contestant.label}: {off} of {of} repeated runs end differently with the same code"
                    wrong.append(Problem(name, 0, 0, message))
                else:
                    proved += of - off
        if old:
            message = f"stale: from other code or settings ({', '.join(old)}); {command}"
            stale.append(Problem(name, 0, 0, message))
        elif data["numpy"] != np.__version__:
            message = f"stale: numpy was {data['numpy']} and is {np.__version__}; {command}"
            stale.append(Problem(name, 0, 0, message))
    if memo:
        memo.keep()
    return Standing(tuple(wrong), tuple(stale), proved, len(ran))


def _sample(
    sweep: Sweep, contestant: Contestant, cells: Mapping[str, Any], ran: list[str]
) -> tuple[int, int]:
    ran.append(contestant.method)
    return sample(sweep, contestant, cells)


def _inputs(sweep: Sweep, contestant: Contestant, entry: Mapping[str, Any]) -> str:
    """Everything that a sample's outcome depends on; the entry holds the hash of the solver's code."""
    machine = [platform.platform(), platform.processor(), np.__version__]
    runner = [Path(str(module.__file__)).read_text("utf-8") for module in (sweep_plan, sweep_unit)]
    plan = [contestant.method, sweep.name, sweep.cells, sweep.seeds, sweep.block]
    return json.dumps([machine, runner, plan, entry], sort_keys=True, default=str)


def sample(sweep: Sweep, contestant: Contestant, cells: Mapping[str, Any]) -> tuple[int, int]:
    """Rerun one batch of one cell, chosen by a hash of the results: the number of runs, and how many end
    differently."""
    digest = int(sha256(json.dumps(cells, sort_keys=True).encode()).hexdigest(), 16)
    name = sorted(sweep.cells)[digest % len(sweep.cells)]
    count = len(sweep.seeds)
    first = BATCH * (digest // len(sweep.cells) % -(-count // BATCH))
    old = flags(cells[name]["bits"], count)[first : first + BATCH]
    new = close(run_unit(Unit(contestant.method, (sweep.cells[name],), sweep.seeds[first : first + BATCH])))
    return len(old), sum(a != b for a, b in zip(old, new, strict=True))
