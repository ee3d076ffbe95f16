"""A process that waits for one build: it has imported other people's modules, which takes a while, and none of ours.

`serve` keeps one of these ready, so that a build always runs the newest sources and still begins at once. Run as a
script: waiting.py ROOT DEST MODULES (JSON). It says "ready"; a line on stdin starts the build, its end without one ends
the process; the outcome is one line of JSON on stdout.
"""

import contextlib
import importlib
import importlib.util
import json
import os
import signal
import sys
import time
import traceback
from pathlib import Path

OURS = ("sitegen", "widgets", "solvers", "tests")


RECENT = 5.0  # seconds; what Python knows of a source's age is whole seconds


def forget_recent(root: str) -> None:
    """Drop the bytecode of sources saved just now: another save within the second, of equal size, would not count."""
    for name in OURS:
        for path in Path(root, name).rglob("*.py"):
            if time.time() - path.stat().st_mtime < RECENT:
                Path(importlib.util.cache_from_source(str(path))).unlink(missing_ok=True)


def main(root: str, dest: str, modules: str) -> None:
    """Import `modules`, wait, build the checkout `root` into `dest`, say how it went and what it had imported."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the process that started this one
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(1))  # as an exception, so that a build under way clears up
    for name in json.loads(modules):
        with contextlib.suppress(Exception):  # if it matters, the build will say so
            importlib.import_module(name)
    print("ready", flush=True)
    if not sys.stdin.readline():
        return
    answers, sys.stdout = sys.stdout, sys.stderr  # nothing printed on the way is taken for the answer
    sys.path.insert(0, root)
    try:
        forget_recent(root)
        from sitegen.building import attempt
        from sitegen.progress import shown

        with shown() as progress:
            outcome = attempt(Path(root), Path(dest), progress=progress).plain()
    except Exception:  # the very modules that tell of problems may be what is being edited
        outcome = {"trouble": traceback.format_exc()}
    known = (*sys.stdlib_module_names, *OURS, "__main__", "__mp_main__")
    outcome["modules"] = [name for name in sys.modules if name.split(".")[0] not in known]
    answers.write(json.dumps(outcome) + "\n")
    answers.flush()
    os._exit(0)  # taking a large interpreter apart takes time, and nothing is left to be done


if __name__ == "__main__":
    main(*sys.argv[1:])
