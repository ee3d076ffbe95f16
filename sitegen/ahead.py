"""Processes for what takes long: one for each core, with one thread each, so that together they keep every core busy.

A build first asks what the cache does not have, has all of it made here at once, and then goes on as if nothing had
been missing. Whoever makes a piece leaves it in the cache; what fails is left to the build, which tries again where it
can say whose mistake it is.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from contextlib import contextmanager
from multiprocessing import get_context
from typing import Any

from .outside import Progress

ONE_THREAD = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS")

Piece = tuple[Callable[..., object], tuple[Any, ...]]
"""A function of a module and what it is called with."""


@contextmanager
def processes(count: int = 0) -> Iterator[ProcessPoolExecutor]:
    """Fresh processes, `count` of them, 0 for one a core. On leaving, what has not begun is dropped."""
    before = {name: os.environ.get(name) for name in ONE_THREAD}
    os.environ.update(dict.fromkeys(ONE_THREAD, "1"))
    pool = ProcessPoolExecutor(count or os.cpu_count(), get_context("spawn"))
    try:
        yield pool
    finally:
        pool.shutdown(cancel_futures=True)
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value


def make(what: str, pieces: Sequence[Piece], progress: Progress) -> None:
    """Make all pieces, begun in their order: the longest first keeps the cores busy to the end. A single one is left to
    whoever needs it, since a process takes a second to start."""
    if len(pieces) < 2:
        return
    with processes(min(len(pieces), os.cpu_count() or 1)) as pool:
        waiting = [pool.submit(function, *given) for function, given in pieces]
        for done, _ in enumerate(as_completed(waiting)):
            progress(what, done, len(pieces))
        progress(what, len(pieces), len(pieces))
