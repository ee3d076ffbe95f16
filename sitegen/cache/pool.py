"""A pool of worker processes for slow work: one per core with one thread each, which together keep every core busy.

A build first finds out what the cache lacks, has all of it made here at once, and then goes on as if nothing had been
missing. Workers leave what they make in the cache. What fails is left to the build, which tries again at a point where
it can say whose mistake it is.

Each worker has a pipe of its own and shares nothing: so a terminated worker cannot hold a lock, and a worker whose
parent has died ends.
"""

from __future__ import annotations

import os
import signal
import sys
import time
import traceback
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager, suppress
from multiprocessing import get_context, resource_tracker
from multiprocessing.connection import Connection, wait
from multiprocessing.context import SpawnProcess
from typing import Any, cast

from sitegen.progress import Progress
from sitegen.stopping import SIGNALS, deferred_signals, unheard

ONE_THREAD = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS")
CLEAR_UP_SECONDS = 0.4  # a worker's time to clean up when it is terminated in the middle of a piece

Piece = tuple[Callable[..., object], tuple[Any, ...]]
"""A module-level function and its arguments."""


class PieceFailed(RuntimeError):
    """A piece could not be made; the message is its traceback."""


@contextmanager
def working(pieces: Sequence[Piece], count: int = 0) -> Iterator[Iterator[tuple[int, Any]]]:
    """Yield an iterator over (index, result) of the pieces, in the order in which `count` new processes finish them (0:
    one per core). The result of a failed piece is a PieceFailed. On exit, the workers are terminated."""
    crew: dict[Connection, SpawnProcess] = {}
    try:
        yield _results(pieces, min(count or os.cpu_count() or 1, len(pieces)), crew)
    finally:
        with deferred_signals():
            _end(crew)


def make(task: str, pieces: Sequence[Piece], progress: Progress) -> None:
    """Make all pieces, started in order: with the longest first, the cores stay busy to the end. A single piece is left
    to whoever needs it, since a process takes a second to start."""
    if len(pieces) < 2:
        return
    with working(pieces) as results:
        for count, _ in enumerate(results):
            progress(task, count, len(pieces))
        progress(task, len(pieces), len(pieces))


@contextmanager
def threads(spared: int = 0) -> Iterator[ThreadPoolExecutor]:
    """A thread pool with one thread per core, minus `spared`, for work that releases the GIL. Leaving by an exception
    waits for none of them."""
    pool = ThreadPoolExecutor(max(1, (os.cpu_count() or 1) - spared))
    try:
        yield pool
    except BaseException:
        pool.shutdown(wait=False, cancel_futures=True)
        raise
    pool.shutdown()


def _results(
    pieces: Sequence[Piece], count: int, crew: dict[Connection, SpawnProcess]
) -> Iterator[tuple[int, Any]]:
    todo = list(enumerate(pieces))[::-1]
    busy: dict[Connection, int] = {}

    def hand_on(to: Connection) -> None:
        if todo:
            busy[to], piece = todo.pop()
            with suppress(OSError):  # if it has died, the missing answer shows it
                to.send(piece)

    for connection in [_start_process(crew) for _ in range(count)]:
        hand_on(connection)
    while busy:
        for ready in cast(list[Connection], wait(list(busy))):
            i = busy.pop(ready)
            try:
                result = ready.recv()
            except (EOFError, OSError):
                result = PieceFailed("its process died")
                crew.pop(ready).join()
                if todo:
                    hand_on(_start_process(crew))
            else:
                hand_on(ready)
            yield i, result


def _start_process(crew: dict[Connection, SpawnProcess]) -> Connection:
    """Start a new process and return the pipe to it."""
    resource_tracker.ensure_running()  # otherwise the first start does it, which unblocks signals in the middle
    environment = {name: os.environ.get(name) for name in ONE_THREAD}
    with deferred_signals(), unheard():
        os.environ.update(dict.fromkeys(ONE_THREAD, "1"))
        context = get_context("spawn")
        ours, theirs = context.Pipe()
        process = context.Process(target=_work, args=(theirs,), daemon=True)
        process.start()
        theirs.close()
        crew[ours] = process
        for name, value in environment.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value
    return ours


def _end(crew: dict[Connection, SpawnProcess]) -> None:
    """Terminate all processes, even in the middle of a piece."""
    deadline = time.monotonic() + CLEAR_UP_SECONDS
    for pipe, process in crew.items():
        process.terminate()
        pipe.close()
    for process in crew.values():
        process.join(max(0.0, deadline - time.monotonic()))
    for process in crew.values():
        process.kill()
        process.join()


def _work(pipe: Connection) -> None:
    """Make the pieces that arrive through the pipe, until it is closed."""
    for number in SIGNALS:  # SIGHUP comes to the whole group; so does SIGINT, which unheard() cannot always block
        signal.signal(number, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(1))  # as an exception, so that no partial file is left
    with suppress(EOFError, OSError):
        while True:
            function, arguments = pipe.recv()
            try:
                result = function(*arguments)
            except Exception:
                result = PieceFailed(traceback.format_exc())
            pipe.send(result)
