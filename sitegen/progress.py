"""Progress of long tasks: bars on a terminal, plain lines in a log."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from tqdm import tqdm

LOG_SECONDS = 10.0
BYTES = 100_000  # totals from here on are taken as bytes: no other count comes near


@contextmanager
def reporting() -> Iterator[Progress]:
    """A Progress that reports on stderr and clears its bar at the end."""
    show = _Bars() if sys.stderr.isatty() else _Lines()
    try:
        yield show
    finally:
        show.close()


class _Bars:
    """One bar for the current task, removed when the task is done."""

    def __init__(self) -> None:
        self._task = ""
        self._bar: tqdm[Any] | None = None

    def __call__(self, task: str, done: int, total: int) -> None:
        if self._bar is None or task != self._task:
            self.close()
            size = total >= BYTES
            self._task = task
            options: dict[str, Any] = {"unit": "B" if size else "", "unit_scale": size, "leave": False, "delay": 0.3}
            self._bar = tqdm(desc=task, total=total or None, **options)
        self._bar.total = total or None
        self._bar.update(done - self._bar.n)
        if total and done >= total:
            self.close()

    def close(self) -> None:
        if self._bar is not None:
            self._bar.close()
            self._bar = None


class _Lines:
    """A line for every ten seconds that a task takes, and a last one when such a task is done."""

    def __init__(self) -> None:
        self._task = ""
        self._last = 0.0
        self._spoke = False

    def __call__(self, task: str, done: int, total: int) -> None:
        now = time.monotonic()
        if task != self._task:
            self._task, self._last, self._spoke = task, now, False
        ends = bool(total) and done >= total
        if now - self._last >= LOG_SECONDS or (ends and self._spoke):
            scale, unit = (1e6, " MB") if total >= BYTES else (1.0, "")
            digits = 1 if unit else 0
            print(f"{task}: {done / scale:.{digits}f} of {total / scale:.{digits}f}{unit}", file=sys.stderr, flush=True)
            self._last, self._spoke = now, True

    def close(self) -> None:
        """Do nothing: plain lines leave nothing open."""


# The current task, the amount done and the total, in pieces or in bytes; the total is 0 if it is unknown.
Progress = Callable[[str, int, int], None]


def quiet(task: str, done: int, total: int) -> None:
    """A Progress that shows nothing."""
