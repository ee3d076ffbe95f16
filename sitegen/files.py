"""Files as the build writes them: atomically, named by their content, kept by what they are made from, packed."""

from __future__ import annotations

import gzip
import hashlib
import os
import tempfile
import time
from collections.abc import Callable, Iterable
from functools import lru_cache
from pathlib import Path, PurePosixPath

import brotli  # type: ignore[import-untyped]

from .stopping import held

PACKED = {".html", ".css", ".js", ".mjs", ".json", ".ipynb", ".svg", ".xml", ".txt", ".wasm", ".webmanifest", ".ico"}
FORMAT = "2"  # of what is kept; raised when the packing changes
DAY = 86_400.0  # seconds
WORTH = 1024  # bytes below which packing saves nothing that a reader would notice


@held()
def write(path: Path, data: bytes) -> None:
    """Write beside, then rename: nobody meets half a file, and a full disk leaves none behind."""
    path.parent.mkdir(parents=True, exist_ok=True)
    descriptor, beside = tempfile.mkstemp(dir=path.parent, prefix=".")
    try:
        with os.fdopen(descriptor, "wb") as file:
            file.write(data)
        os.chmod(beside, 0o644)
        os.replace(beside, path)
    except BaseException:
        Path(beside).unlink(missing_ok=True)
        raise


def kept(path: Path, make: Callable[[], bytes]) -> bytes:
    """The bytes of a file in a cache, whose name tells all that they depend on; made where it is not there."""
    if not used(path):
        write(path, make())
    return path.read_bytes()


def used(path: Path) -> bool:
    """Whether a file of a cache is there; if so, its age begins anew (see prune.py), which is noted once a day."""
    try:
        if time.time() - path.stat().st_mtime > DAY:
            os.utime(path)
    except FileNotFoundError:
        return False
    return True


def content(path: Path) -> bytes:
    """A file's bytes; of one that has neither another date nor another size than before, from memory."""
    facts = path.stat()
    return _content(path, facts.st_mtime_ns, facts.st_size)


@lru_cache(maxsize=1024)
def _content(path: Path, changed: int, size: int) -> bytes:
    return path.read_bytes()


@lru_cache(maxsize=512)
def digest(data: bytes) -> str:
    """The sha256 in hex; of what was asked for a short while ago, from memory."""
    return hashlib.sha256(data).hexdigest()


def short_hash(data: bytes) -> str:
    """Ten hex digits of the content's sha256."""
    return digest(data)[:10]


def hashed_name(name: str, data: bytes) -> str:
    """The name with its content's hash before the ending: 'a/site.css' → 'a/site.0123456789.css'."""
    path = PurePosixPath(name)
    return str(path.with_name(f"{path.stem}.{short_hash(data)}{path.suffix}"))


def packed(name: str, data: bytes, cache: Path) -> dict[str, bytes]:
    """The .gz and .br that belong beside a file, made once for each content; none where they would save nothing."""
    if PurePosixPath(name).suffix not in PACKED or len(data) < WORTH:
        return {}
    home = cache / "brotli" / f"{FORMAT}-{brotli.__version__}"
    small = kept(home / digest(data), lambda: _brotli(data))
    return {name + ".gz": gzipped(data, cache), name + ".br": small}


def gzipped(data: bytes, cache: Path) -> bytes:
    """The data by gzip -9 without a date; data that is gzip already is left as it is."""
    if data[:2] == b"\x1f\x8b":
        return data
    return kept(cache / "gzip" / digest(data), lambda: gzip.compress(data, 9, mtime=0))


def _brotli(data: bytes) -> bytes:
    # Quality 11 takes three times as long as 10 for two bytes in a hundred, and seconds for a megabyte.
    return bytes(brotli.compress(data, quality=10 if len(data) < 1 << 18 else 9))


def fingerprint(files: Iterable[tuple[str, bytes]]) -> str:
    """A hash of names and contents together, whatever their order."""
    found = hashlib.sha256()
    for name, data in sorted(files):
        found.update(f"{name}\0{len(data)}\0".encode() + data)
    return found.hexdigest()
