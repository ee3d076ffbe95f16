"""Files as the build writes them: whole or not at all, and packed to the same."""

from __future__ import annotations

import gzip
import os
from pathlib import Path

import brotli
import pytest

from sitegen.files import content, packed, write


def test_a_write_that_fails_leaves_nothing_behind(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """On a full disk the old file stays, and no half of the new one."""
    write(tmp_path / "a", b"old")
    monkeypatch.setattr(os, "replace", lambda source, target: 1 / 0)
    with pytest.raises(ZeroDivisionError):
        write(tmp_path / "a", b"new")
    assert [(path.name, path.read_bytes()) for path in tmp_path.iterdir()] == [("a", b"old")]


def test_packed_copies_hold_the_same(tmp_path: Path) -> None:
    """Also of a page that differs from one packed before in its last letter, or its first, alone."""
    text = b"<p>text</p>" * 3000
    for data in (text, text[:-1] + b"!", b"!" + text[1:]):
        made = packed("a/b.html", data, tmp_path)
        assert gzip.decompress(made["a/b.html.gz"]) == data
        assert brotli.decompress(made["a/b.html.br"]) == data
        assert made["a/b.html.gz"][4:8] == b"\0\0\0\0", "no date"
    assert packed("a/b.woff2", data, tmp_path) == {}


def test_a_file_is_read_again_once_it_has_changed(tmp_path: Path) -> None:
    """Also where its size is the same."""
    path = tmp_path / "a"
    for i, text in enumerate((b"one", b"two")):
        path.write_bytes(text)
        os.utime(path, ns=(i * 10**9, i * 10**9))
        assert content(path) == text
