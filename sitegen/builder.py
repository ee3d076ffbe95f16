"""Builds in fresh processes, so that edits of Python count; the next one already waits with other people's modules."""

from __future__ import annotations

import contextlib
import json
import subprocess
import sys
from pathlib import Path

from sitegen.building import Outcome

WAITING = Path(__file__).with_name("waiting.py")
CLEAR_UP_SECONDS = 5.0


class Process:
    """One process for one build (see waiting.py)."""

    def __init__(self, root: Path, dest: Path, modules: list[str]) -> None:
        command = [sys.executable, "-P", str(WAITING), str(root), str(dest), json.dumps(modules)]
        self._child = subprocess.Popen(
            command, cwd=root, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, encoding="utf-8"
        )
        assert self._child.stdin is not None
        assert self._child.stdout is not None
        self._to, self._from = self._child.stdin, self._child.stdout
        self._from.readline()  # it says so when it is ready

    def build(self) -> tuple[Outcome, list[str]]:
        """Let it build; the outcome, and what it had imported of other people's."""
        with contextlib.suppress(OSError):  # where it has died, the missing answer tells
            self._to.write("\n")
            self._to.flush()
        try:
            answer = json.loads(self._from.readline())
        except ValueError:
            why = f"the build ended with code {self._child.wait()}; the terminal says why"
            return Outcome(trouble=why), []
        return Outcome.parsed(answer), answer["modules"]

    def close(self) -> None:
        """End it; a build that is under way clears up."""
        self._child.terminate()
        try:
            self._child.wait(CLEAR_UP_SECONDS)
        except subprocess.TimeoutExpired:
            self._child.kill()
            self._child.wait()
        for pipe in (self._to, self._from):
            with contextlib.suppress(OSError):  # what was about to be written has no reader any more
                pipe.close()


class Builder:
    """Builds the checkout `root` into `dest`, again and again."""

    def __init__(self, root: Path, dest: Path) -> None:
        self.root, self.dest = root, dest
        self._modules: list[str] = []
        self._next = Process(root, dest, self._modules)

    def build(self) -> Outcome:
        """One build, of the sources as they are now; renew() before the next."""
        outcome, modules = self._next.build()
        self._modules = modules or self._modules
        return outcome

    def renew(self) -> None:
        """Have the next process wait; returns when it is ready."""
        self._next.close()
        self._next = Process(self.root, self.dest, self._modules)

    def close(self) -> None:
        """End the process that waits or builds."""
        self._next.close()
