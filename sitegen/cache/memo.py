"""What pure functions found, by the hash of what they were given: one entry of the cache for each function."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable
from functools import cached_property
from pathlib import Path
from typing import Any

from sitegen.cache.store import Store

SPARE = 60  # answers of earlier builds that are kept beside those of the last one: all are read at each build


class Remembered:
    """A function's answers, as plain data, from build to build. The name tells the function's version."""

    def __init__(self, cache: Path, name: str, spare: int | None = None) -> None:
        self._store, self._name, self._spare = Store(cache, "remembered"), name, SPARE if spare is None else spare
        self._asked: dict[str, Any] = {}

    @cached_property
    def _known(self) -> dict[str, Any]:
        """What was kept, read when it is first asked for."""
        entries: dict[str, Any] = json.loads(self._store.find(self._name) or "{}")
        return entries

    def knows(self, question: str) -> bool:
        """Whether the answer is there."""
        return _key(question) in self._known

    def answer(self, question: str, make: Callable[[], Any]) -> Any:
        """What `make` finds, which depends on `question` alone."""
        key = _key(question)
        if key not in self._asked:
            self._asked[key] = self._known[key] if key in self._known else make()
        return self._asked[key]

    def keep(self) -> None:
        """Write down what is new; what was asked for last stays longest."""
        if not self._asked or self._asked.keys() <= self._known.keys():
            return
        rest = [(key, value) for key, value in self._known.items() if key not in self._asked]
        self._known = dict([*rest[max(0, len(rest) - self._spare) :], *self._asked.items()])
        self._store.put(self._name, json.dumps(self._known, ensure_ascii=False).encode())


def _key(question: str) -> str:
    return hashlib.sha256(question.encode()).hexdigest()[:32]
