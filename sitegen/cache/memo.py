"""Results of pure functions, keyed by a hash of their input: one cache entry per function."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable
from functools import cached_property
from pathlib import Path
from typing import Any

from sitegen.cache.store import Store

SPARE = 60  # how many answers of earlier builds to keep besides the last build's; every build reads them all


class Remembered:
    """A function's answers, as plain data, kept between builds. The name includes the function's version."""

    def __init__(self, cache: Path, name: str, spare: int | None = None) -> None:
        self._store, self._name, self._spare = Store(cache, "remembered"), name, SPARE if spare is None else spare
        self._recent: dict[str, Any] = {}

    @cached_property
    def _answers(self) -> dict[str, Any]:
        """The stored answers, read on first use."""
        entries: dict[str, Any] = json.loads(self._store.find(self._name) or "{}")
        return entries

    def knows(self, question: str) -> bool:
        """Whether the answer is stored."""
        return _key(question) in self._answers

    def answer(self, question: str, make: Callable[[], Any]) -> Any:
        """The stored answer, or else the result of `make`, which must depend on `question` alone."""
        key = _key(question)
        if key not in self._recent:
            self._recent[key] = self._answers[key] if key in self._answers else make()
        return self._recent[key]

    def keep(self) -> None:
        """Store the answers if any are new; those used least recently are dropped first."""
        if not self._recent or self._recent.keys() <= self._answers.keys():
            return
        unused = [(key, value) for key, value in self._answers.items() if key not in self._recent]
        self._answers = dict([*unused[max(0, len(unused) - self._spare) :], *self._recent.items()])
        self._store.put(self._name, json.dumps(self._answers, ensure_ascii=False).encode())


def _key(question: str) -> str:
    return hashlib.sha256(question.encode()).hexdigest()[:32]
