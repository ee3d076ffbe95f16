"""Builds in a separate process, which is reused, with all it has in memory, for as long as no code has changed.

After an edit of code, a new process takes over; it is already waiting, with third-party modules imported.
"""

from __future__ import annotations

import contextlib
import json
import subprocess
import sys
from pathlib import Path

from sitegen.cache.memory import Stamp, sources
from sitegen.pipeline.attempt import Outcome

BUILD_PROCESS = Path(__file__).with_name("build_process.py")
CLEAR_UP_SECONDS = 5.0


class Process:
    """A process that builds (see build_process.py)."""

    def __init__(self, root: Path, dest: Path, modules: list[str]) -> None:
        command = [sys.executable, "-P", str(BUILD_PROCESS), str(root), str(dest), json.dumps(modules)]
        self._child = subprocess.Popen(
            command,
            cwd=root,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            encoding="utf-8",
            process_group=0,  # Ctrl-C is for the process that started this one
        )
        assert self._child.stdin is not None
        assert self._child.stdout is not None
        self._to, self._from = self._child.stdin, self._child.stdout
        try:
            self._from.readline()  # "ready"
        except BaseException:
            self.close()
            raise

    def build(self) -> tuple[Outcome, list[str]]:
        """Have it build. Return the outcome and the names of the third-party modules that it has imported."""
        with contextlib.suppress(OSError):  # if it has died, the missing answer shows it
            self._to.write("\n")
            self._to.flush()
        try:
            answer = json.loads(self._from.readline())
        except ValueError:
            message = f"the build exited with code {self._child.wait()}; see the terminal"
            return Outcome(trouble=message), []
        return Outcome.parsed(answer), answer["modules"]

    def close(self) -> None:
        """End the process; a running build cleans up."""
        self._child.terminate()
        try:
            self._child.wait(CLEAR_UP_SECONDS)
        except subprocess.TimeoutExpired:
            self._child.kill()
            self._child.wait()
        for pipe in (self._to, self._from):
            with contextlib.suppress(OSError):  # unwritten data has lost its reader
                pipe.close()


class Builder:
    """Builds the checkout `root` into `dest`, again and again."""

    def __init__(self, root: Path, dest: Path) -> None:
        self.root, self.dest = root, dest
        self._modules: list[str] = []
        self._code: frozenset[Stamp] = frozenset()  # the sources as the current process has read them
        self._at_work: Process | None = None
        self._next: Process | None = Process(root, dest, self._modules)

    def build(self) -> Outcome:
        """Build the current sources; call renew() before the next build."""
        code = sources(self.root)
        if self._at_work is None or code != self._code:
            self._end_work()
            self._at_work, self._next, self._code = self._next or self._fresh(), None, code
        outcome, modules = self._at_work.build()
        self._modules = modules or self._modules
        if outcome.trouble:  # ending the process discards half-imported modules and bad memory
            self._end_work()
        return outcome

    def renew(self) -> None:
        """Make sure that the next process is waiting; return when it is ready."""
        self._next = self._next or self._fresh()

    def close(self) -> None:
        """End both processes."""
        self._end_work()
        if self._next is not None:
            self._next.close()

    def _fresh(self) -> Process:
        return Process(self.root, self.dest, self._modules)

    def _end_work(self) -> None:
        if self._at_work is not None:
            self._at_work.close()
            self._at_work = None
