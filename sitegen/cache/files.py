"""File helpers of the build: atomic writes, hashes of contents, and names that contain them."""

from __future__ import annotations

import hashlib
import os
import tempfile
from collections.abc import Iterable
from functools import lru_cache
from pathlib import Path, PurePosixPath

import platformdirs

from sitegen.stopping import deferred_signals


@deferred_signals()
def write(path: Path, data: bytes) -> None:
    """Write to a temporary file, then rename: no reader sees a partial file, and a full disk leaves none behind."""
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


def content(path: Path) -> bytes:
    """A file's bytes, from memory if its date and size have not changed since it was last read."""
    facts = path.stat()
    return _content(path, facts.st_mtime_ns, facts.st_size)


@lru_cache(maxsize=1024)
def _content(path: Path, mtime: int, size: int) -> bytes:
    return path.read_bytes()


@lru_cache(maxsize=512)
def digest(data: bytes) -> str:
    """The sha256 in hex; recent digests come from memory."""
    return hashlib.sha256(data).hexdigest()


def short_hash(data: bytes) -> str:
    """Ten hex digits of the content's sha256."""
    return digest(data)[:10]


def hashed_name(name: str, data: bytes) -> str:
    """The name with the content's hash before its suffix: 'a/site.css' → 'a/site.0123456789.css'."""
    path = PurePosixPath(name)
    return str(path.with_name(f"{path.stem}.{short_hash(data)}{path.suffix}"))


def fingerprint(files: Iterable[tuple[str, bytes]]) -> str:
    """A hash of names and contents together, independent of their order."""
    hasher = hashlib.sha256()
    for name, data in sorted(files):
        hasher.update(f"{name}\0{len(data)}\0".encode() + data)
    return hasher.hexdigest()


def cache_dir() -> Path:
    """The cache folder: LADDER_CACHE, or this project's folder in the user's cache."""
    return Path(os.environ.get("LADDER_CACHE") or platformdirs.user_cache_dir("registration-ladder"))
