"""The whole site as one folder in a zip, for reading from disk.

Members are added from the cache, as they were compressed for hosts: the standard library's zipfile can only compress
them again, which would be the slowest step of a build.
"""

from __future__ import annotations

import re
import struct
import zlib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path, PurePosixPath

from sitegen.cache import pool
from sitegen.cache.packing import PACKED, WORTH, gzipped

NOON = (0, 0x0021)  # midnight of 1980-01-01, the first date that a zip can hold: the same files give the same bytes
STORED, DEFLATED = 0, 8
VERSION = 20
GZIP_HEAD, GZIP_TAIL = 10, 8  # bytes around the deflated data in a gzip file without name or comment


@dataclass(frozen=True)
class Download:
    """A file for readers to download: its name on the site and its bytes."""

    name: str
    data: bytes

    @property
    def size(self) -> str:
        """Its size, as shown to readers."""
        return f"{len(self.data) / 1e6:.1f} MB"


def folder_name(title: str) -> str:
    """The name of a site's folder: its title in lower-case ASCII letters, digits and hyphens."""
    return re.sub(r"[^a-z0-9]+", "-", title.lower()).strip("-") or "site"


def archive(folder: str, files: Mapping[str, bytes], cache: Path) -> bytes:
    """A zip of the files (name → content) in one folder. Names must be ASCII."""
    body: list[bytes] = []
    at, directory = 0, bytearray()
    names = sorted(files)
    with pool.threads() as threads:
        members = list(threads.map(lambda name: _pack(name, files[name], cache), names))
    for name, (method, packed) in zip(names, members, strict=True):
        member, data = f"{folder}/{name}".encode("ascii"), files[name]
        facts = struct.pack(
            "<5H3L2H", VERSION, 0, method, *NOON, zlib.crc32(data), len(packed), len(data), len(member), 0
        )
        made_by, details = struct.pack("<H", VERSION), struct.pack("<3H2L", 0, 0, 0, 0, at)
        directory += b"PK\1\2" + made_by + facts + details + member
        body += [b"PK\3\4" + facts + member, packed]
        at += len(body[-2]) + len(packed)
    end = struct.pack("<4H2LH", 0, 0, len(files), len(files), len(directory), at, 0)
    return b"".join([*body, directory, b"PK\5\6" + end])


def _pack(name: str, data: bytes, cache: Path) -> tuple[int, bytes]:
    """A member's compression method and bytes; stored as it is if compressing saves nothing."""
    if PurePosixPath(name).suffix not in PACKED or len(data) < WORTH:
        return STORED, data
    return DEFLATED, gzipped(data, cache)[GZIP_HEAD:-GZIP_TAIL]
