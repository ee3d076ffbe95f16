"""Ctrl-C handling: the first press raises KeyboardInterrupt, so that everything cleans up; more do not disturb that.
SIGTERM, as from `kill` or `timeout`, and SIGHUP, as from a terminal that closes, are handled alike.

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

_UNDER_WAY = threading.RLock()  # held by a thread inside deferred_signals(): leave() waits for it
LEAVING_SECONDS = 2.0  # the longest that leave() waits; writing one file takes a fraction of that
CLEARING_SECONDS = 5.0  # longer than any clean-up: a Ctrl-C after that means that the first was lost
SIGNALS = tuple(getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name))


class Stopped(KeyboardInterrupt):
    """Raised when one of SIGNALS has come: its argument is the signal."""


def listen() -> None:
    """From now on, SIGNALS raise Stopped; more of them are ignored while the first is being cleaned up."""
    raised = -CLEARING_SECONDS

    def once(number: int, frame: FrameType | None) -> None:
        nonlocal raised
        now = time.monotonic()
        if now - raised >= CLEARING_SECONDS:
            raised = now
            raise Stopped(signal.Signals(number))

    for number in SIGNALS:
        if number == signal.SIGINT or signal.getsignal(number) != signal.SIG_IGN:  # as `nohup` ignores SIGHUP
            signal.signal(number, once)


def ending(stop: KeyboardInterrupt) -> tuple[int, str]:
    """The exit code of a command that was stopped, and by what."""
    number = stop.args[0] if isinstance(stop, Stopped) else signal.SIGINT
    return 128 + number, "Ctrl-C" if number == signal.SIGINT else number.name


@contextmanager
def deferred_signals() -> Iterator[None]:
    """Run the body to its end: SIGNALS are handled only after it."""
    if threading.current_thread() is not threading.main_thread():  # signals interrupt only the main thread
        with _UNDER_WAY:
            yield
        return
    came: list[tuple[int, FrameType | None]] = []
    handlers: dict[int, Any] = {
        number: signal.signal(number, lambda number, frame: came.append((number, frame)))
        for number in SIGNALS
        if signal.getsignal(number) != signal.SIG_IGN  # or it would take the place of one that is heard
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
    """End this process without waiting for its threads, except for one inside deferred_signals()."""
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
