"""`benchmark`: the race's table."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence
from typing import Any

from solvers.cli.common import Bar, Help, printed, program, whole
from solvers.core import validate
from solvers.core.amounts import amount
from solvers.scenes.rooms import ROOM_SETTINGS
from solvers.studies.benchmark import Line, benchmark, table
from solvers.studies.race import CONTESTANTS, EXTRAS, MAX_STEPS, SEEDS, Contestant, Controls, contestants, racing
from solvers.studies.seeds import seeds

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
    """Run the command and return its exit code. Raises ValueError if an argument is wrong."""
    args = parser().parse_args(arguments)
    settings = ROOM_SETTINGS if args.setting in (None, "all") else (args.setting,)
    cases = [(name, args.degrees) for name in settings]
    if args.setting is None and args.degrees == 45.0:
        cases.append(("combo", 15.0))
    entrants = contestants(args.only and [racing(name, "--only").method for name in args.only])
    if validate.count(args.seeds, "--seeds", 1) > MOST_SEEDS:
        raise ValueError(f"--seeds: {args.seeds} is more than the limit of {MOST_SEEDS}")
    validate.count(args.max_steps, "--max-steps")
    tables = []
    for name, degrees in cases:
        controls = Controls(degrees, args.distance, name, args.noise, args.outliers, args.overlap, args.density)
        with Bar(name) as bar:
            lines = benchmark(
                controls, seeds=seeds(args.seeds), contestants=entrants, max_steps=args.max_steps,
                progress=_counted(bar, entrants),
            )  # fmt: skip
        if args.json:
            tables.append({"setting": name, "degrees": degrees, "distance": args.distance, "seeds": args.seeds})
            tables[-1]["methods"] = [_told(line) for line in lines]
            continue
        print(f"{name}, start {degrees:g}° and {args.distance:g} u, {amount(args.seeds, 'seed')}")
        print(table(lines) + "\n", flush=True)
    if args.json:
        printed(tables)
    return 0


def _counted(bar: Callable[[int, int], None], entrants: Sequence[Contestant]) -> Callable[[Contestant], None]:
    """A callback that shows on a bar how many of the contestants have run."""
    return lambda contestant: bar(entrants.index(contestant), len(entrants))


def _told(line: Line) -> dict[str, Any]:
    """A row of the table, its values by name; angles in degrees, lengths in u."""
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
