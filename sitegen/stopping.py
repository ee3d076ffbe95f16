"""Ctrl-C handling: the first press raises KeyboardInterrupt, so that everything cleans up; more do not disturb that.

Uses the standard library only, since it runs before anything is installed.
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

_UNDER_WAY = threading.RLock()  # held by a thread inside held(): leave() waits for it
LEAVING_SECONDS = 2.0  # the longest that leave() waits; writing one file takes a fraction of that
CLEARING_SECONDS = 5.0  # longer than any clean-up: a Ctrl-C after that means that the first was lost


def listen() -> None:
    """From now on, Ctrl-C raises KeyboardInterrupt; more of them are ignored while the first is being cleaned up."""
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
    """Run the body to its end: SIGINT and SIGTERM are handled only after it."""
    if threading.current_thread() is not threading.main_thread():  # signals interrupt only the main thread
        with _UNDER_WAY:
            yield
        return
    came: list[tuple[int, FrameType | None]] = []
    numbers = (signal.SIGINT, signal.SIGTERM)
    handlers: dict[int, Any] = {
        number: signal.signal(number, lambda number, frame: came.append((number, frame))) for number in numbers
    }
    try:
        yield
    finally:
        for number, handler in handlers.items():
            signal.signal(number, handler)
        for number, frame in came[:1]:
            if callable(handlers[number]):
                handlers[number](number, frame)
            elif handlers[number] is signal.SIG_DFL:
                signal.raise_signal(number)


def leave(code: int) -> NoReturn:
    """End this process without waiting for its threads, except for one inside held()."""
    _UNDER_WAY.acquire(timeout=LEAVING_SECONDS)
    os._exit(code)


@contextmanager
def unheard() -> Iterator[None]:
    """Shield processes started in here from Ctrl-C: whoever started them ends them."""
    if not hasattr(signal, "pthread_sigmask"):  # Windows
        yield
        return
    mask = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, mask)
