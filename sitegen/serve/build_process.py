"""A process that waits for builds: it has imported other people's modules, which takes a while, and none of ours.

`serve` keeps one of these ready, so that a build always runs the newest sources and still begins at once; once it has
built, it builds again for as long as it is asked to. Run as a script: build_process.py ROOT DEST MODULES (JSON). It
says "ready"; each line on stdin starts a build, the end of stdin ends the process; an outcome is one line of JSON on
stdout.
"""

import contextlib
import gc
import importlib
import importlib.util
import json
import os
import signal
import sys
import time
import traceback
from pathlib import Path
from typing import Any

OURS = ("sitegen", "widgets", "solvers", "tests")
RECENT = 5.0  # seconds; what Python knows of a source's age is whole seconds


def forget_recent(root: str) -> None:
    """Drop the bytecode of sources saved just now: another save within the second, of equal size, would not count."""
    for name in OURS:
        for path in Path(root, name).rglob("*.py"):
            if time.time() - path.stat().st_mtime < RECENT:
                Path(importlib.util.cache_from_source(str(path))).unlink(missing_ok=True)


def build(root: str, dest: str, state: dict[str, Any]) -> dict[str, Any]:
    """Build the checkout `root` into `dest`: how it went, and the modules of other people that it has imported. kept:
    holds the builds' memory."""
    try:
        from sitegen.cache.memory import Memory
        from sitegen.pipeline.attempt import attempt
        from sitegen.progress import shown

        with shown() as progress:
            memory = state.setdefault("memory", Memory())
            report = attempt(Path(root), Path(dest), drafts=True, pack=False, progress=progress, memory=memory)
        outcome = report.plain()
    except Exception:  # the very modules that tell of problems may be what is being edited
        outcome = {"trouble": traceback.format_exc()}
    skip = (*sys.stdlib_module_names, *OURS, "__main__", "__mp_main__")
    return {**outcome, "modules": [name for name in sys.modules if name.split(".")[0] not in skip]}


def main(root: str, dest: str, modules: str) -> None:
    """Import `modules`, and build whenever a line asks for it."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the process that started this one
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(1))  # as an exception, so that a build under way clears up
    for name in json.loads(modules):
        with contextlib.suppress(Exception):  # if it matters, the build will say so
            importlib.import_module(name)
    answers, sys.stdout = sys.stdout, sys.stderr  # nothing printed on the way is taken for the answer
    answers.write("ready\n")
    answers.flush()
    sys.path.insert(0, root)
    began = False
    state: dict[str, Any] = {}
    for _ in sys.stdin:
        if not began:
            forget_recent(root)
        began = True
        gc.disable()  # looking for cycles in a build's many tokens takes a tenth of its time; it is done afterwards
        answers.write(json.dumps(build(root, dest, state)) + "\n")
        answers.flush()
        gc.collect()


if __name__ == "__main__":
    code = 0
    try:
        main(*sys.argv[1:])
    except SystemExit:
        code = 1
    # Taking a large interpreter apart takes time, and nothing is left to be done but what a thread is writing.
    stopping = sys.modules.get("sitegen.stopping")  # there is nothing to wait for where no build has brought it
    getattr(stopping, "leave", os._exit)(code)
