"""What a process that builds again and again keeps of one build for the next, so that only what changed is made anew.

Nothing is ever declared out of date: an answer stands beside all that it was made of, and counts while that is equal.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Hashable, Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any, TypeVar

from sitegen.problems import Problems

SOURCES = ("templates", "widgets", "solvers", "sitegen", "content/data")
READ = (".md", ".yaml")  # of content/: chapters and lists, which every build reads

T = TypeVar("T")
Stamp = tuple[str, int, int]


class Memory:
    """Answers by name. A name has one answer, the last, so that memory does not grow from edit to edit."""

    def __init__(self) -> None:
        self._state: object = None
        self._known: dict[Hashable, tuple[object, Any]] = {}

    def begin(self, state: object) -> None:
        """Begin a build. state: what every answer is made of beside what it names; with another one all are gone."""
        if self._state != state:
            self._state, self._known = state, {}

    def answer(self, name: Hashable, made_of: object, make: Callable[[], T]) -> T:
        """What `make` gives, which depends on `made_of` alone; that is compared by value, and nobody may change it."""
        if name not in self._known or self._known[name][0] != made_of:
            self._known[name] = made_of, make()
        value: T = self._known[name][1]
        return value

    def told(self, name: Hashable, made_of: object, problems: Problems, make: Callable[[Problems], T]) -> T:
        """The same of what also tells problems, which may depend on those told before: they are told again."""

        def made() -> tuple[T, Problems]:
            own = _before(problems)
            return make(own), own

        value, own = self.answer(name, (made_of, _before(problems)), made)
        problems.take(own)
        return value

    def has_told(self, name: Hashable, made_of: object, problems: Problems) -> bool:
        """Whether `told` would make nothing."""
        return name in self._known and self._known[name][0] == (made_of, _before(problems))


def _before(problems: Problems) -> Problems:
    return Problems([*problems.found], unread={*problems.unread}, unclear={*problems.unclear})


def sources(root: Path) -> frozenset[Stamp]:
    """Name, date and size of all that a process may keep in its memory from build to build: everything but chapters,
    their pictures and lists, and tests, which every build reads anew."""
    return frozenset(stamp for name in SOURCES for stamp in _stamps(root / name))


def state(root: Path) -> frozenset[Stamp]:
    """The same with the chapters' pictures: all of a checkout that a Memory's answers need not name."""
    return sources(root) | {stamp for stamp in _stamps(root / "content") if not stamp[0].endswith(READ)}


def _stamps(home: Path) -> Iterator[Stamp]:
    for folder, folders, files in os.walk(home):
        folders[:] = [one for one in folders if one != "__pycache__"]
        for file in files:
            path = os.path.join(folder, file)
            with suppress(FileNotFoundError):  # removed meanwhile
                facts = os.stat(path)
                yield path, facts.st_mtime_ns, facts.st_size
