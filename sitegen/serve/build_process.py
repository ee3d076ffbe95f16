"""A process that waits to build: it has already imported third-party modules, which takes a while, but none of ours.

`serve` keeps one of these ready, so that a build always runs the newest sources and still starts at once. After its
first build it builds again on each request. Run as a script: build_process.py ROOT DEST MODULES (JSON). It prints
"ready"; each line on stdin starts a build, and the end of stdin ends the process; each outcome is one line of JSON on
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
RECENT = 5.0  # seconds; bytecode stores the date of its source in whole seconds


def forget_recent(root: str) -> None:
    """Delete the bytecode of sources just saved: Python would miss another save in the same second with equal size."""
    for name in OURS:
        for path in Path(root, name).rglob("*.py"):
            if time.time() - path.stat().st_mtime < RECENT:
                Path(importlib.util.cache_from_source(str(path))).unlink(missing_ok=True)


def build(root: str, dest: str, state: dict[str, Any]) -> dict[str, Any]:
    """Build the checkout `root` into `dest`. Return the outcome and the names of the third-party modules imported so
    far. state: keeps the memory that the builds share."""
    try:
        from sitegen.cache.memory import Memory
        from sitegen.pipeline.attempt import attempt
        from sitegen.progress import reporting

        with reporting() as progress:
            memory = state.setdefault("memory", Memory())
            report = attempt(Path(root), Path(dest), drafts=True, pack=False, progress=progress, memory=memory)
        outcome = report.plain()
    except Exception:  # the modules that report problems may themselves be broken by an edit
        outcome = {"trouble": traceback.format_exc()}
    skip = (*sys.stdlib_module_names, *OURS, "__main__", "__mp_main__")
    return {**outcome, "modules": [name for name in sys.modules if name.split(".")[0] not in skip]}


def main(root: str, dest: str, modules: str) -> None:
    """Import `modules`, then build once for each line on stdin."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the process that started this one
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(1))  # as an exception, so that a running build cleans up
    for name in json.loads(modules):
        with contextlib.suppress(Exception):  # if it matters, the build reports it
            importlib.import_module(name)
    answers, sys.stdout = sys.stdout, sys.stderr  # so that stray prints are not taken for an answer
    answers.write("ready\n")
    answers.flush()
    sys.path.insert(0, root)
    began = False
    state: dict[str, Any] = {}
    for _ in sys.stdin:
        if not began:
            forget_recent(root)
        began = True
        gc.disable()  # searching a build's many tokens for cycles takes a tenth of its time, so it is done afterwards
        answers.write(json.dumps(build(root, dest, state)) + "\n")
        answers.flush()
        gc.collect()


if __name__ == "__main__":
    code = 0
    try:
        main(*sys.argv[1:])
    except SystemExit:
        code = 1
    # Shutting down a large interpreter takes time, and all that is left to do is what a thread is writing.
    stopping = sys.modules.get("sitegen.stopping")  # missing before the first build: nothing to wait for
    getattr(stopping, "leave", os._exit)(code)
