"""The build cache: one entry per artefact, keyed by a hash of its inputs and checked against a hash of its contents.

An entry that is truncated, altered, swapped with another or unreadable counts as missing and is made again. Entries
are written to a temporary file and renamed, so that several processes can share a cache.
"""

from __future__ import annotations

import hashlib
import os
import shutil
import stat
import tempfile
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Literal

from sitegen.cache.files import write

DAY = 86_400.0  # seconds
Kind = Literal[
    "brotli", "bundles", "compiled", "drawings", "emblem", "fonts", "frames", "gzip", "notebooks", "plots",
    "remembered", "runtime", "sweep", "templates", "wheel",
]  # fmt: skip
SEAL = 32  # bytes of the hash that precedes an entry's data


def anything(data: bytes) -> bool:
    """Accept any entry: the check for data that can be checked only by its hash."""
    return True


@dataclass(frozen=True)
class Store:
    """The entries of one kind in a cache: bytes, each under a key, which is a text that lists all their inputs."""

    cache: Path
    kind: Kind

    def get(self, key: str, make: Callable[[], bytes], is_valid: Callable[[bytes], bool] = anything) -> bytes:
        """Return the entry; make and store it if it is missing or `is_valid` rejects it."""
        data = self.find(key)
        if data is None or not is_valid(data):
            data = make()
            self.put(key, data)
        return data

    def has(self, key: str) -> bool:
        """Whether an entry exists, even a damaged one."""
        return self.path(key).is_file()

    def find(self, key: str) -> bytes | None:
        """The entry; None if it is missing or damaged. An entry unchanged since it was last read is the same object."""
        path = self.path(key)
        facts = _touch(path)
        if facts is None:
            return None
        memory = _memory(path)
        for stamp, data in memory:
            if stamp == facts:
                return data
        data = _read(path)
        memory[:] = [(facts, data)]
        return data

    def put(self, key: str, data: bytes) -> None:
        """Store an entry. If that fails, the next build makes it again (see unwritable)."""
        path = self.path(key)
        with suppress(OSError):
            put_file(path, _seal(path, data) + data, self.cache)

    def path(self, key: str) -> Path:
        """The entry's file."""
        return self.cache / self.kind / hashlib.sha256(key.encode()).hexdigest()[:40]


def _seal(path: Path, data: bytes) -> bytes:
    """The hash of an entry's place and data."""
    hasher = hashlib.sha256(f"{path.parent.name}/{path.name}\0".encode())
    hasher.update(data)
    return hasher.digest()


def _read(path: Path) -> bytes | None:
    """The data of an entry; None if it cannot be read or its hash does not match."""
    try:
        with path.open("rb") as file:
            seal, data = file.read(SEAL), file.read()
    except OSError:
        return None
    return data if seal == _seal(path, data) else None


@lru_cache(maxsize=512)
def _memory(path: Path) -> list[tuple[tuple[int, int], bytes | None]]:
    """A mutable slot for what a file last held: its date and size at the time, and the entry."""
    return []


def used(path: Path) -> bool:
    """Whether a file of a cache exists. If so, its date is updated, at most once a day, to keep it from prune.py."""
    return _touch(path) is not None


def _touch(path: Path) -> tuple[int, int] | None:
    """A file's date and size, after marking it as used; None if it is missing."""
    try:
        facts = path.stat()
        if not stat.S_ISREG(facts.st_mode):  # reading a pipe would block for ever
            return None
        if time.time() - facts.st_mtime > DAY:
            with suppress(OSError):  # another user's cache, which we may only read
                os.utime(path)
                facts = path.stat()
    except OSError:
        return None
    return facts.st_mtime_ns, facts.st_size


def put_file(path: Path, data: bytes, cache: Path) -> None:
    """Write a file of the cache, replacing a folder of its name or a file where its folder should be."""
    try:
        write(path, data)
    except OSError:
        for folder in path.relative_to(cache).parents[:-1]:
            if os.path.lexists(cache / folder) and not (cache / folder).is_dir():
                (cache / folder).unlink()
        if path.is_dir() and not path.is_symlink():
            shutil.rmtree(path)
        write(path, data)


def unwritable(cache: Path) -> str:
    """Why nothing can be written to a cache; "" if it can."""
    try:
        cache.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=cache) as file:
            file.write(b"full?")
    except OSError as error:
        return str(error.strerror)
    return ""
