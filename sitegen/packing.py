"""Packed copies for hosts: made once for each content, and held to unpack to just that."""

from __future__ import annotations

import gzip
import zlib
from functools import partial
from pathlib import Path, PurePosixPath

import brotli  # type: ignore[import-untyped]

from .files import digest
from .store import Store

PACKED = {".html", ".css", ".js", ".mjs", ".json", ".ipynb", ".svg", ".xml", ".txt", ".wasm", ".webmanifest", ".ico"}
FORMAT = "2"  # of what is kept; raised when the packing changes
WORTH = 1024  # bytes below which packing saves nothing that a reader would notice


def packed(name: str, data: bytes, cache: Path) -> dict[str, bytes]:
    """The .gz and .br that belong beside a file; none where they would save nothing."""
    if PurePosixPath(name).suffix not in PACKED or len(data) < WORTH:
        return {}
    key = f"{FORMAT} {brotli.__version__} {digest(data)}"
    small = Store(cache, "brotli").get(key, partial(_brotli, data), lambda small: _unbrotlied(small) == data)
    return {name + ".gz": gzipped(data, cache), name + ".br": small}


def gzipped(data: bytes, cache: Path) -> bytes:
    """The data by gzip -9 without a date; data that is gzip already is left as it is."""
    if data[:2] == b"\x1f\x8b":
        return data
    make = partial(gzip.compress, data, 9, mtime=0)
    return Store(cache, "gzip").get(f"{FORMAT} {digest(data)}", make, lambda small: _gunzipped(small) == data)


def _brotli(data: bytes) -> bytes:
    # Quality 11 takes three times as long as 10 for two bytes in a hundred, and seconds for a megabyte.
    return bytes(brotli.compress(data, quality=10 if len(data) < 1 << 18 else 9))


def _unbrotlied(small: bytes) -> bytes | None:
    try:
        return bytes(brotli.decompress(small))
    except brotli.error:
        return None


def _gunzipped(small: bytes) -> bytes | None:
    try:
        return gzip.decompress(small)
    except (OSError, EOFError, zlib.error):
        return None
