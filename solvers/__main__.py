"""`python -m solvers benchmark`: the race's table on the console."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence

from solvers.benchmark import benchmark, table
from solvers.race import CONTESTANTS, EXTRAS, MAX_STEPS, SEEDS, Controls, contestants
from solvers.scenes import ROOM_SETTINGS


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="python -m solvers", description="Point-cloud registration solvers.")
    commands = parser.add_subparsers(dest="command", required=True)
    bench = commands.add_parser(
        "benchmark",
        help="run the race on many seeds and print the table",
        description="Without options: all six settings from 45°, then 'combo' from 15°.",
    )
    bench.add_argument("--setting", choices=(*ROOM_SETTINGS, "all"), help="of the room; 'all' is all six")
    bench.add_argument("--degrees", type=float, default=45.0, help="starting rotation (45)")
    bench.add_argument("--distance", type=float, default=1.43, help="starting translation in u (1.43)")
    bench.add_argument("--noise", type=float, help="σ in u (the setting's own)")
    bench.add_argument("--outliers", type=float, help="replaced fraction of each cloud (the setting's own)")
    bench.add_argument("--overlap", type=float, default=1.0, help="fraction of the room that the target sees (1)")
    bench.add_argument("--density", type=float, default=1.0, help="the source's sampling density against the usual (1)")
    bench.add_argument("--seeds", type=int, default=len(SEEDS), help="how many of the seeds 40 + 13k (25)")
    bench.add_argument("--max-steps", type=int, default=MAX_STEPS, help="cap on the steps (70)")
    names = ", ".join(c.method for c in (*CONTESTANTS, *EXTRAS))
    bench.add_argument("--only", nargs="+", metavar="METHOD", help=f"of {names}")
    return parser


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line; the exit code: 0, or 2 where an argument is wrong."""
    given = _parser().parse_args(arguments)
    settings = ROOM_SETTINGS if given.setting in (None, "all") else (given.setting,)
    cases = [(name, given.degrees) for name in settings]
    if given.setting is None and given.degrees == 45.0:
        cases.append(("combo", 15.0))
    try:
        racing = contestants(given.only)
        for name, degrees in cases:
            controls = Controls(
                degrees, given.distance, name, given.noise, given.outliers, given.overlap, given.density
            )
            lines = benchmark(
                controls, seeds=[40 + 13 * k for k in range(given.seeds)], contestants=racing, max_steps=given.max_steps
            )
            print(f"{name}, start {degrees:g}° and {given.distance:g} u, {given.seeds} seeds")
            print(table(lines) + "\n", flush=True)
    except ValueError as error:
        print(f"solvers: {error}", file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
