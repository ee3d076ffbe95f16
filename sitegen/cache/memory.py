"""Results that a process keeps from one build to the next, so that only what has changed is made again.

There is no invalidation: an answer is stored with everything that it was made of, and is valid while that is equal.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Hashable, Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any, TypeVar

from sitegen.problems import Problems

SOURCES = ("templates", "widgets", "solvers", "sitegen", "content/data")
READ = (".md", ".yaml")  # in content/: chapters and lists, which every build reads

T = TypeVar("T")
Stamp = tuple[str, int, int]


class Memory:
    """Answers by name. Only the last answer of each name is kept, so that memory does not grow with every edit."""

    def __init__(self) -> None:
        self._state: object = None
        self._answers: dict[Hashable, tuple[object, Any]] = {}

    def begin(self, state: object) -> None:
        """Begin a build. state: the inputs common to all answers; if it has changed, all answers are dropped."""
        if self._state != state:
            self._state, self._answers = state, {}

    def answer(self, name: Hashable, made_of: object, make: Callable[[], T]) -> T:
        """The result of `make`, reused while its inputs `made_of` compare equal; nobody may change it."""
        if name not in self._answers or self._answers[name][0] != made_of:
            self._answers[name] = made_of, make()
        value: T = self._answers[name][1]
        return value

    def told(self, name: Hashable, made_of: object, problems: Problems, make: Callable[[Problems], T]) -> T:
        """Like `answer`, for a `make` that also reports problems, which may depend on those found before. A reused
        answer reports its problems again."""

        def make_both() -> tuple[T, Problems]:
            faults = _snapshot(problems)
            return make(faults), faults

        value, faults = self.answer(name, (made_of, _snapshot(problems)), make_both)
        problems.take(faults)
        return value

    def has_told(self, name: Hashable, made_of: object, problems: Problems) -> bool:
        """Whether `told` would reuse its answer."""
        return name in self._answers and self._answers[name][0] == (made_of, _snapshot(problems))


def _snapshot(problems: Problems) -> Problems:
    return Problems([*problems.found], unread={*problems.unread}, unclear={*problems.unclear})


def sources(root: Path) -> frozenset[Stamp]:
    """Path, date and size of every file that a process may keep in memory between builds: all but chapters, their
    pictures and lists, and tests, which every build reads again."""
    return frozenset(stamp for name in SOURCES for stamp in _stamps(root / name))


def state(root: Path) -> frozenset[Stamp]:
    """`sources` and the chapters' pictures: all files of a checkout that a Memory's answers need not list as inputs."""
    return sources(root) | {stamp for stamp in _stamps(root / "content") if not stamp[0].endswith(READ)}


def _stamps(home: Path) -> Iterator[Stamp]:
    for folder, folders, files in os.walk(home):
        folders[:] = [name for name in folders if name != "__pycache__"]
        for file in files:
            path = os.path.join(folder, file)
            with suppress(FileNotFoundError):  # removed in the meantime
                facts = os.stat(path)
                yield path, facts.st_mtime_ns, facts.st_size
