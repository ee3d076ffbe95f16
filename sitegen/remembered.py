"""What pure functions found, by the hash of what they were given: one small file of the cache for each function."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

from .files import used, write

SPARE = 60  # entries of earlier builds that are kept beside those of the last one: the file is read at each build


class Remembered:
    """A function's answers, as plain data, from build to build. Its file's name tells the function's version."""

    def __init__(self, cache: Path, name: str) -> None:
        self._path = cache / "remembered" / f"{name}.json"
        self._known: dict[str, Any] = json.loads(self._path.read_text("utf-8")) if used(self._path) else {}
        self._asked: dict[str, Any] = {}

    def answer(self, given: str, make: Callable[[], Any]) -> Any:
        """What `make` finds, which depends on `given` alone."""
        key = hashlib.sha256(given.encode()).hexdigest()[:32]
        if key not in self._asked:
            self._asked[key] = self._known[key] if key in self._known else make()
        return self._asked[key]

    def keep(self) -> None:
        """Write down what is new; what was asked for last stays longest."""
        if self._asked.keys() <= self._known.keys():
            return
        rest = [(key, value) for key, value in self._known.items() if key not in self._asked]
        self._known = dict([*rest[max(0, len(rest) - SPARE) :], *self._asked.items()])
        write(self._path, json.dumps(self._known, ensure_ascii=False).encode())
