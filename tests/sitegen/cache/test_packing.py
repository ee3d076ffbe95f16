"""Packed copies unpack to the original, whatever is in the cache."""

from __future__ import annotations

import gzip
from pathlib import Path

import brotli
import pytest

from sitegen.cache.files import digest
from sitegen.cache.packing import packed
from sitegen.cache.store import Store

PAGE = b"<p>text</p>" * 3000


def test_packed_copies_hold_the_same(tmp_path: Path) -> None:
    """This also holds for a page that differs from one packed before only in its last or first letter."""
    for data in (PAGE, PAGE[:-1] + b"!", b"!" + PAGE[1:]):
        copies = packed("a/b.html", data, tmp_path)
        assert gzip.decompress(copies["a/b.html.gz"]) == data
        assert brotli.decompress(copies["a/b.html.br"]) == data
        assert copies["a/b.html.gz"][4:8] == b"\0\0\0\0", "no date"
    assert packed("a/b.woff2", data, tmp_path) == {}


@pytest.mark.parametrize("forgery", [b"", b"nothing packed", b"twice", b"another page"])
def test_a_copy_of_another_page_is_not_published(tmp_path: Path, forgery: bytes) -> None:
    """Even if the entry has the hash of its own content: what counts is what the copy unpacks to."""
    right = packed("a.html", PAGE, tmp_path)
    for kind, pack in (("gzip", gzip.compress), ("brotli", brotli.compress)):
        (entry,) = (tmp_path / kind).iterdir()
        store = Store(tmp_path, kind)  # type: ignore[arg-type]
        keys = [digest(PAGE), f"2 {brotli.__version__} {digest(PAGE)}"]
        (key,) = [key for key in keys if store.path(key) == entry]
        store.put(key, {b"twice": pack(PAGE) * 2, b"another page": pack(PAGE[:-1] + b"!")}.get(forgery, forgery))
    assert packed("a.html", PAGE, tmp_path) == right
