"""Ctrl-C: once ends a command as an exception, so that everything clears up; again disturbs no clearing up.

Standard library only, since it is there before anything is installed.
"""

from __future__ import annotations

import os
import signal
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType
from typing import Any, NoReturn

_UNDER_WAY = threading.RLock()  # of a thread in the middle of what is not cut in two: leave() waits for it
LEAVING_SECONDS = 2.0  # at most; writing one file takes a fraction of that
CLEARING_SECONDS = 5.0  # more than any clearing up takes: a Ctrl-C after that is one that got lost, and is raised again


def listen() -> None:
    """From now on Ctrl-C raises KeyboardInterrupt once; while that is being cleared up, more of them change nothing."""
    raised = -CLEARING_SECONDS

    def once(number: int, frame: FrameType | None) -> None:
        nonlocal raised
        now = time.monotonic()
        if now - raised >= CLEARING_SECONDS:
            raised = now
            raise KeyboardInterrupt

    signal.signal(signal.SIGINT, once)


@contextmanager
def held() -> Iterator[None]:
    """What stands in here is not cut in two: Ctrl-C, or being asked to end, waits until it is done."""
    if threading.current_thread() is not threading.main_thread():  # only that one is interrupted
        with _UNDER_WAY:
            yield
        return
    came: list[tuple[int, FrameType | None]] = []
    numbers = (signal.SIGINT, signal.SIGTERM)
    before: dict[int, Any] = {
        number: signal.signal(number, lambda number, frame: came.append((number, frame))) for number in numbers
    }
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
        for number, frame in came[:1]:
            if callable(before[number]):
                before[number](number, frame)
            elif before[number] is signal.SIG_DFL:
                signal.raise_signal(number)


def leave(code: int) -> NoReturn:
    """End this process without waiting for its threads, but for one that is in the middle of a file."""
    _UNDER_WAY.acquire(timeout=LEAVING_SECONDS)
    os._exit(code)


@contextmanager
def unheard() -> Iterator[None]:
    """Processes that are started in here never hear Ctrl-C: whoever started them ends them."""
    if not hasattr(signal, "pthread_sigmask"):  # Windows
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
