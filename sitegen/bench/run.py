"""`bench`: measures the project's promises and prints the results beside their targets; slow results never fail it.

A group is a function from a Bench to rows; new ones are added to `groups`. Absolute times depend on the machine; ratios
are measured side by side in one run.
"""

from __future__ import annotations

import json
import os
import platform
import subprocess
import sys
import time
import traceback
from collections.abc import Callable, Sequence
from dataclasses import asdict
from pathlib import Path

from sitegen.bench.model import Bench, Row, number
from sitegen.check.browsers import BrowserMissing, chromium
from sitegen.pipeline.attempt import attempt, tell
from sitegen.progress import reporting


def groups() -> dict[str, Callable[[Bench], list[Row]]]:
    """The groups by name, in the order of the table."""
    from sitegen.bench import beyond, builds, figures, pages, solvers

    return {
        "paint": pages.paint,
        "tape": pages.tape,
        "start": builds.start,
        "drag": figures.drag,
        "heat": pages.heat,
        "nine": pages.nine,
        "map": pages.playing_map,
        "sizes": builds.sizes,
        "build": builds.build_times,
        "race": solvers.race,
        "search": beyond.search,
        "drive": beyond.drive,
        "peers": solvers.peers,
    }


def bench(root: Path, out: Path, browser_path: Path | None, only: Sequence[str], keeps: bool = False) -> int:
    """Build, measure, print and write the results; with `keeps` also the docs' table, which needs every group.

    The exit code is 1 if something cannot be measured, 2 for an unknown group.
    """
    available = groups()
    unknown = [name for name in only if name not in available]
    if unknown:
        print(f"bench: unknown group {', '.join(unknown)}; known: {', '.join(available)}", file=sys.stderr)
        return 2
    with reporting() as progress:
        outcome = attempt(root, root / "site", progress=progress)
    tell(outcome, root / "site")
    if not outcome.good:
        return 1
    try:
        subject = Bench(root, root / "site", chromium(browser_path))
    except BrowserMissing as error:
        print(error, file=sys.stderr)
        return 1
    results: dict[str, list[Row]] = {}
    failures: dict[str, str] = {}
    for name in only or available:
        print(f"measuring {name}", file=sys.stderr, flush=True)
        try:
            results[name] = available[name](subject)
        except Exception as error:  # one group's failure does not stop the others
            traceback.print_exc()
            failures[name] = f"{type(error).__name__}: {error}"
    rows = [row for group in results.values() for row in group]
    print(table(rows))
    for name, reason in failures.items():
        print(f"{name} could not be measured: {reason.splitlines()[0]}")
    system = machine(root, subject)
    data = {"machine": system, "groups": {n: list(map(asdict, r)) for n, r in results.items()}}
    out.write_text(json.dumps({**data, "failed": failures}, indent=1, ensure_ascii=False) + "\n", "utf-8")
    if keeps and not failures:
        from sitegen.bench.readme_table import keep

        keep(root, rows, system)
    return 1 if failures else 0


def table(rows: Sequence[Row]) -> str:
    """The rows as text: what, measured, target, whether it is met."""
    lines = [("what", "measured", "target", "")]
    for row in rows:
        aim = "" if row.aim is None else f"≤ {number(row.aim)} {row.unit}"
        mark = "" if row.met is None else "met" if row.met else "missed"
        lines.append((row.what, f"{number(row.value)} {row.unit}", aim, mark))
    widths = [max(len(line[i]) for line in lines) for i in range(3)]
    notes = ["", *(row.note for row in rows)]
    return "\n".join(
        "  ".join([label.ljust(widths[0]), value.rjust(widths[1]), aim.rjust(widths[2]), mark.ljust(6), note]).rstrip()
        for (label, value, aim, mark), note in zip(lines, notes, strict=True)
    )


def machine(root: Path, subject: Bench) -> dict[str, str | int]:
    """The time, commit, machine, Python and browser of the measurement."""
    commit = subprocess.run(["git", "rev-parse", "HEAD"], cwd=root, capture_output=True, text=True, check=False)
    version = subprocess.run([str(subject.chromium), "--version"], capture_output=True, text=True, check=False)
    return {
        "time": time.strftime("%Y-%m-%d %H:%M:%S %z"),
        "commit": commit.stdout.strip(),
        "system": platform.platform(),
        "cores": os.cpu_count() or 0,
        "python": platform.python_version(),
        "browser": version.stdout.strip(),
    }
