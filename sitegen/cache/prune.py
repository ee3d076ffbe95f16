"""The cache of outside files and of what builds have made: what nobody has used for two months goes.

Whoever takes a file from the cache notes the use by its date (store.used). Another build may be at work meanwhile: it
has noted its use before it reads, and what it is just writing is new; so neither is taken away.
"""

from __future__ import annotations

import time
from contextlib import suppress
from pathlib import Path
from typing import get_args

from sitegen.cache.store import DAY, Kind, put_file

UNUSED = 60 * DAY
FOLDERS = (*get_args(Kind), "outside")
STAMP = "pruned"


def prune(cache: Path, now: float | None = None) -> list[Path]:
    """Remove what has not been used for `UNUSED` seconds, and folders left empty; looks once a day. What is gone."""
    now = time.time() if now is None else now
    stamp = cache / STAMP
    if stamp.is_file() and now - stamp.stat().st_mtime < DAY:
        return []
    with suppress(OSError):  # a cache that we may only read
        put_file(stamp, b"", cache)
    removals = []
    for name in FOLDERS:
        for path in sorted((cache / name).rglob("*"), reverse=True):  # what a folder holds comes before it
            with suppress(OSError):  # gone already, in use on Windows, or a folder that holds something
                if _removed(path, now):
                    removals.append(path)
    return removals


def _removed(path: Path, now: float) -> bool:
    """Whether a file was old and has been removed; an old folder is, too, but does not count."""
    if not path.is_dir():
        if now - path.stat().st_mtime <= UNUSED:
            return False
        path.unlink()
        return True
    if now - path.stat().st_mtime > DAY:  # another build may just have made it
        path.rmdir()
    return False
