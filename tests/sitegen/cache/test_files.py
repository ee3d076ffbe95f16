"""The build writes a file completely or not at all."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from sitegen.cache.files import content, write


def test_a_write_that_fails_leaves_nothing_behind(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """On a full disk the old file stays, and no part of the new one is left."""
    write(tmp_path / "a", b"old")
    monkeypatch.setattr(os, "replace", lambda source, target: 1 / 0)
    with pytest.raises(ZeroDivisionError):
        write(tmp_path / "a", b"new")
    assert [(path.name, path.read_bytes()) for path in tmp_path.iterdir()] == [("a", b"old")]


def test_a_file_is_read_again_once_it_has_changed(tmp_path: Path) -> None:
    """Even if its size is the same."""
    path = tmp_path / "a"
    for i, text in enumerate((b"one", b"two")):
        path.write_bytes(text)
        os.utime(path, ns=(i * 10**9, i * 10**9))
        assert content(path) == text
