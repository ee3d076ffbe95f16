"""Cache pruning: files, whether fetched or made by builds, that have not been used for 60 days are removed.

Using a file of the cache updates its date (store.used). Pruning is safe while another build is running: that updates a
file's date before reading it, and the files that it writes are new, so it loses neither.
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
    """Remove files not used for `UNUSED` seconds, and empty folders, at most once a day. Return the removed files."""
    now = time.time() if now is None else now
    stamp = cache / STAMP
    if stamp.is_file() and now - stamp.stat().st_mtime < DAY:
        return []
    with suppress(OSError):  # a read-only cache
        put_file(stamp, b"", cache)
    removals = []
    for name in FOLDERS:
        for path in sorted((cache / name).rglob("*"), reverse=True):  # a folder comes after its contents
            with suppress(OSError):  # already gone, in use on Windows, or a folder that is not empty
                if _remove(path, now):
                    removals.append(path)
    return removals


def _remove(path: Path, now: float) -> bool:
    """Remove a file if it is old and return whether it was; an old empty folder is removed too, but returns False."""
    if not path.is_dir():
        if now - path.stat().st_mtime <= UNUSED:
            return False
        path.unlink()
        return True
    if now - path.stat().st_mtime > DAY:  # another build may just have made it
        path.rmdir()
    return False
