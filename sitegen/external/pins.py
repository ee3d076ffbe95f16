"""The manifest pins.toml: third-party files by size and sha256, in bundles of one version, and their sources."""

from __future__ import annotations

import hashlib
import tomllib
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path, PurePosixPath
from typing import IO

from sitegen.cache.files import content

MANIFEST = Path(__file__).with_name("pins.toml")


class OutsideError(RuntimeError):
    """A file from outside could not be obtained; the message names the file and every source that was tried."""


@dataclass(frozen=True)
class Source:
    """Where files may come from: `kind` is "npm", "pip" or "url", `spec` a package with its version or an address.

    Files are in the archive's `folder`; without one, the archive itself is the file. `python` and `platform` select
    one of a package's wheels.
    """

    name: str
    kind: str
    spec: str
    folder: str = ""
    archive_size: int = 0
    python: str = "3.12"
    platform: str = ""


@dataclass(frozen=True)
class PinnedFile:
    """One pinned file: its name inside its source's folder, its size in bytes, its sha256 (hex)."""

    name: str
    size: int
    sha256: str

    def fault(self, data: bytes) -> str:
        """What is wrong with `data` as this file; "" if nothing is."""
        digest = hashlib.sha256(data).hexdigest()
        if digest == self.sha256:
            return ""
        actual = f"{digest[:16]}… and {len(data)} bytes"
        return f"{self.name}: expected sha256 {self.sha256[:16]}… and {self.size} bytes, got {actual}"

    def read(self, stream: IO[bytes]) -> bytes:
        """Read the file from a stream, up to one byte more than expected: enough to see that it is not the file."""
        return stream.read(self.size + 1)


@dataclass(frozen=True)
class Bundle:
    """Files that belong together: one version, one licence, the same sources."""

    name: str
    title: str
    version: str
    licence: str
    licence_texts: tuple[str, ...]
    sources: tuple[Source, ...]
    files: tuple[PinnedFile, ...]

    @property
    def folder(self) -> str:
        """The bundle's folder in the cache."""
        return f"{self.name}-{self.version}"


def read_manifest(path: Path = MANIFEST) -> dict[str, Bundle]:
    """The bundles of a manifest by name, in its order. Raises OutsideError if it is not well-formed."""
    return dict(_manifest(path.name, content(path)))


@lru_cache(maxsize=8)
def _manifest(name: str, text: bytes) -> dict[str, Bundle]:
    try:
        data = tomllib.loads(text.decode())
        sources = {name: _read_source(name, entry) for name, entry in data["source"].items()}
        return {
            name: Bundle(
                name,
                entry["title"],
                entry["version"],
                entry["licence"],
                tuple(entry["licence_texts"]),
                tuple(sources[s] for s in entry["sources"]),
                tuple(PinnedFile(_inside_name(n), f["size"], f["sha256"]) for n, f in entry["files"].items()),
            )
            for name, entry in data["bundle"].items()
        }
    except (KeyError, TypeError, tomllib.TOMLDecodeError) as error:
        raise OutsideError(f"{name}: {type(error).__name__}: {error}") from error


def _inside_name(name: str) -> str:
    """A file's name, checked to stay inside its bundle's folder. Raises OutsideError."""
    path = PurePosixPath(name)
    if path.is_absolute() or ".." in path.parts or "\\" in name:
        raise OutsideError(f"{name}: a file name must not lead outside its bundle's folder")
    return name


def _read_source(name: str, entry: dict[str, str | int]) -> Source:
    kind = next(k for k in ("npm", "pip", "url", None) if k is None or k in entry)
    if kind is None:
        raise OutsideError(f"source {name}: expected one of npm, pip or url")
    extra = {key: str(entry[key]) for key in ("folder", "python", "platform") if key in entry}
    return Source(name, kind, str(entry[kind]), archive_size=int(entry.get("archive_size", 0)), **extra)
