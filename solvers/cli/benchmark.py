"""`benchmark`: the race's table."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence
from typing import Any

from solvers.cli.common import Bar, Help, printed, program, whole
from solvers.core import validate
from solvers.scenes.rooms import ROOM_SETTINGS
from solvers.studies.benchmark import Line, benchmark, table
from solvers.studies.race import CONTESTANTS, EXTRAS, MAX_STEPS, SEEDS, Contestant, Controls, contestants, racing

MOST_SEEDS = 100_000


def parser() -> argparse.ArgumentParser:
    """The command's arguments."""
    bench = argparse.ArgumentParser(
        prog=program("benchmark"),
        description="Run the race on many seeds and print the table."
        " Without options: all six settings from 45°, then 'combo' from 15°.",
        formatter_class=Help,
    )
    bench.add_argument("--setting", choices=(*ROOM_SETTINGS, "all"), help="the room's setting; 'all' means all six")
    bench.add_argument("--degrees", type=float, default=45.0, help="starting rotation (45)")
    bench.add_argument("--distance", type=float, default=1.43, help="starting translation in u (1.43)")
    bench.add_argument("--noise", type=float, help="σ in u (the setting's own)")
    bench.add_argument("--outliers", type=float, help="replaced fraction of each cloud (the setting's own)")
    bench.add_argument("--overlap", type=float, default=1.0, help="fraction of the room seen by the target (1)")
    bench.add_argument("--density", type=float, default=1.0, help="the source's sampling density, times the usual (1)")
    bench.add_argument("--seeds", type=whole, default=len(SEEDS), help="number of seeds, 40 + 13k each (25)")
    bench.add_argument("--max-steps", type=whole, default=MAX_STEPS, help="step limit (70)")
    names = ", ".join(c.method for c in (*CONTESTANTS, *EXTRAS))
    bench.add_argument("--only", nargs="+", action="extend", metavar="METHOD", help=f"of {names}")
    bench.add_argument("--json", action="store_true", help="print one JSON document instead of the tables")
    return bench


def race(arguments: Sequence[str]) -> int:
    """Run the command; the exit code. Raises ValueError where an argument is wrong."""
    given = parser().parse_args(arguments)
    settings = ROOM_SETTINGS if given.setting in (None, "all") else (given.setting,)
    cases = [(name, given.degrees) for name in settings]
    if given.setting is None and given.degrees == 45.0:
        cases.append(("combo", 15.0))
    chosen = contestants(given.only and [racing(name, "--only").method for name in given.only])
    if validate.count(given.seeds, "--seeds", 1) > MOST_SEEDS:
        raise ValueError(f"--seeds: {given.seeds} is more than the limit of {MOST_SEEDS}")
    validate.count(given.max_steps, "--max-steps")
    found = []
    for name, degrees in cases:
        controls = Controls(degrees, given.distance, name, given.noise, given.outliers, given.overlap, given.density)
        seeds = [40 + 13 * k for k in range(given.seeds)]
        with Bar(name) as bar:
            lines = benchmark(
                controls, seeds=seeds, contestants=chosen, max_steps=given.max_steps, progress=_counted(bar, chosen)
            )
        if given.json:
            found.append({"setting": name, "degrees": degrees, "distance": given.distance, "seeds": given.seeds})
            found[-1]["methods"] = [_told(line) for line in lines]
            continue
        of = "1 seed" if given.seeds == 1 else f"{given.seeds} seeds"
        print(f"{name}, start {degrees:g}° and {given.distance:g} u, {of}")
        print(table(lines) + "\n", flush=True)
    if given.json:
        printed(found)
    return 0


def _counted(bar: Callable[[int, int], None], chosen: Sequence[Contestant]) -> Callable[[Contestant], None]:
    """What shows on a bar how many of the contestants have run."""
    return lambda contestant: bar(chosen.index(contestant), len(chosen))


def _told(line: Line) -> dict[str, Any]:
    """A row of the table by name; angles in degrees, lengths in u."""
    return {
        "method": line.contestant.method,
        "median_rotation_error": line.median_rre,
        "median_translation_error": line.median_rte,
        "turned": line.turned,
        "close": line.close,
        "median_steps": line.median_steps,
        "seconds": line.seconds,
        "stops": line.stops,
    }
