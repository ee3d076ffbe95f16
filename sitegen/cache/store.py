"""What builds keep: one entry for each thing made, by the hash of what it is made of, held to a hash of its own.

An entry that is cut short, changed, exchanged for another or unreadable counts as none: it is made again. Entries are
written beside and renamed, so that builds of several processes can share a cache.
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
SEAL = 32  # bytes of the hash before an entry's own


def anything(data: bytes) -> bool:
    """What an entry has to hold to where its hash is all that can be asked of it."""
    return True


@dataclass(frozen=True)
class Store:
    """The entries of one kind in a cache: bytes, each by its key, a text that says all that they depend on."""

    cache: Path
    kind: Kind

    def get(self, key: str, make: Callable[[], bytes], holds: Callable[[bytes], bool] = anything) -> bytes:
        """The entry; made where there is none, or one for which `holds` is false."""
        data = self.find(key)
        if data is None or not holds(data):
            data = make()
            self.put(key, data)
        return data

    def has(self, key: str) -> bool:
        """Whether there is an entry, whole or not."""
        return self.path(key).is_file()

    def find(self, key: str) -> bytes | None:
        """The entry; None where there is none. One that has not changed since it was last read is the same object."""
        path = self.path(key)
        facts = _used(path)
        if facts is None:
            return None
        memory = _memory(path)
        for then, data in memory:
            if then == facts:
                return data
        data = _read(path)
        memory[:] = [(facts, data)]
        return data

    def put(self, key: str, data: bytes) -> None:
        """Keep an entry. One that cannot be kept is made again by the next build (see unwritable)."""
        path = self.path(key)
        with suppress(OSError):
            put_file(path, _seal(path, data) + data, self.cache)

    def path(self, key: str) -> Path:
        """The entry's file."""
        return self.cache / self.kind / hashlib.sha256(key.encode()).hexdigest()[:40]


def _seal(path: Path, data: bytes) -> bytes:
    """The hash of an entry, its place included."""
    hasher = hashlib.sha256(f"{path.parent.name}/{path.name}\0".encode())
    hasher.update(data)
    return hasher.digest()


def _read(path: Path) -> bytes | None:
    """What stands behind the hash, if it is the hash of that."""
    try:
        with path.open("rb") as file:
            seal, data = file.read(SEAL), file.read()
    except OSError:
        return None
    return data if seal == _seal(path, data) else None


@lru_cache(maxsize=512)
def _memory(path: Path) -> list[tuple[tuple[int, int], bytes | None]]:
    """Where it is remembered what a file last held: its date and size then, and the entry."""
    return []


def used(path: Path) -> bool:
    """Whether a file of a cache is there; if so, its age begins anew (see prune.py), which is noted once a day."""
    return _used(path) is not None


def _used(path: Path) -> tuple[int, int] | None:
    """The date and the size of a file that is there, noted as used."""
    try:
        facts = path.stat()
        if not stat.S_ISREG(facts.st_mode):  # reading a pipe would wait for ever
            return None
        if time.time() - facts.st_mtime > DAY:
            with suppress(OSError):  # of somebody else's cache, which we may only read
                os.utime(path)
                facts = path.stat()
    except OSError:
        return None
    return facts.st_mtime_ns, facts.st_size


def put_file(path: Path, data: bytes, cache: Path) -> None:
    """Write a file of the cache, also where a folder stands in its place, or a file in the place of its folder."""
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
    """Why nothing can be kept in a cache; "" where it can."""
    try:
        cache.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=cache) as file:
            file.write(b"full?")
    except OSError as error:
        return str(error.strerror)
    return ""
