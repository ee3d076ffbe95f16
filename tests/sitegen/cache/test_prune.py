"""Pruning the cache: used entries stay however old, unused ones go, and nothing that is being made is touched."""

from __future__ import annotations

import os
import time
from pathlib import Path

from sitegen.cache.files import write
from sitegen.cache.prune import FOLDERS, STAMP, UNUSED, prune
from sitegen.cache.store import DAY, Store


def old(path: Path, days: float) -> Path:
    """A file last used this many days ago."""
    write(path, b"kept")
    moment = time.time() - days * DAY
    os.utime(path, (moment, moment))
    return path


def test_what_nobody_used_for_two_months_goes(tmp_path: Path) -> None:
    """Other files, and folders that the build does not use, stay."""
    stale, recent = old(tmp_path / "compiled/a.zip", 61), old(tmp_path / "compiled/b.zip", 59)
    alone, strange = old(tmp_path / "wheel/0123/c.whl", 100), old(tmp_path / "mine/d.txt", 100)
    assert set(prune(tmp_path)) == {stale, alone}
    assert recent.is_file()
    assert strange.is_file()
    assert not any(path.exists() for path in (stale, alone))


def test_a_use_begins_its_age_anew(tmp_path: Path) -> None:
    """An entry read from a store is neither made again nor removed."""
    store = Store(tmp_path, "frames")
    store.put("a", b"kept")
    path = store.path("a")
    os.utime(path, (time.time() - 100 * DAY,) * 2)
    assert store.get("a", lambda: b"made anew") == b"kept"
    assert prune(tmp_path) == []
    assert path.is_file()


def test_it_looks_once_a_day(tmp_path: Path) -> None:
    prune(tmp_path)
    path = old(tmp_path / FOLDERS[0] / "a", 100)
    assert prune(tmp_path) == []
    assert prune(tmp_path, time.time() + 2 * DAY) == [path]
    assert (tmp_path / STAMP).is_file()


def test_a_folder_just_made_stays_for_what_will_lie_in_it(tmp_path: Path) -> None:
    (tmp_path / "runtime/new").mkdir(parents=True)
    prune(tmp_path)
    assert (tmp_path / "runtime/new").is_dir()
    assert UNUSED == 60 * DAY


def test_a_folder_empty_for_a_day_goes(tmp_path: Path) -> None:
    """It is not among the removed files. A folder that has become empty goes the next time; one that holds a file in
    use stays."""
    alone, recent = old(tmp_path / "wheel/0123/c.whl", 100), old(tmp_path / "wheel/4567/d.whl", 1)
    (tmp_path / "wheel/empty").mkdir()
    for name in ("0123", "4567", "empty"):
        os.utime(tmp_path / "wheel" / name, (time.time() - 2 * DAY,) * 2)
    assert prune(tmp_path) == [alone]
    assert sorted(path.name for path in (tmp_path / "wheel").iterdir()) == ["0123", "4567"]
    assert prune(tmp_path, time.time() + 2 * DAY) == []
    assert [path.name for path in (tmp_path / "wheel").iterdir()] == ["4567"]
    assert recent.is_file()
