"""Compressed copies for hosts: made once for each content, and checked to decompress to it."""

from __future__ import annotations

import gzip
import zlib
from collections.abc import Callable
from functools import partial
from pathlib import Path, PurePosixPath

import brotli  # type: ignore[import-untyped]

from sitegen.cache.files import digest
from sitegen.cache.store import Store, anything

PACKED = {".html", ".css", ".js", ".mjs", ".json", ".ipynb", ".svg", ".xml", ".txt", ".wasm", ".webmanifest", ".ico"}
FORMAT = "2"  # of the entries; raised when the packing changes
WORTH = 1024  # bytes; below this, packing saves nothing that a reader would notice
FAULTS = (OSError, EOFError, zlib.error, brotli.error)  # raised when unpacking data that is not packed or is truncated


def packed(name: str, data: bytes, cache: Path) -> dict[str, bytes]:
    """The .gz and .br copies of a file; none if they would save nothing."""
    if PurePosixPath(name).suffix not in PACKED or len(data) < WORTH:
        return {}
    key = f"{FORMAT} {brotli.__version__} {digest(data)}"
    small = Store(cache, "brotli").get(key, partial(_brotli, data), partial(_is_packed, data, brotli.decompress))
    return {name + ".gz": gzipped(data, cache, partial(_is_packed, data, gzip.decompress)), name + ".br": small}


def gzipped(data: bytes, cache: Path, is_valid: Callable[[bytes], bool] = anything) -> bytes:
    """The data compressed as by gzip -9, without a date; data that is already gzipped is returned unchanged."""
    if data[:2] == b"\x1f\x8b":
        return data
    return Store(cache, "gzip").get(digest(data), partial(gzip.compress, data, 9, mtime=0), is_valid)


def _brotli(data: bytes) -> bytes:
    # Quality 11 takes three times as long as 10 to save 2 %, and seconds for a megabyte.
    return bytes(brotli.compress(data, quality=10 if len(data) < 1 << 18 else 9))


def _is_packed(data: bytes, unpack: Callable[[bytes], bytes], small: bytes) -> bool:
    """Whether a packed copy holds the data. Unpacking takes a hundredth of the time of packing."""
    try:
        return unpack(small) == data
    except FAULTS:
        return False
