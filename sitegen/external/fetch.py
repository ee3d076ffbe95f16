"""Files from outside: pinned in pins.toml, fetched from the first source that has them, verified, kept in a cache.

What is verified is each file that is used, never the archive it came in, so that any source will do. Nothing whose
sha256 differs is ever handed on.
"""

from __future__ import annotations

import fnmatch
import gzip
import hashlib
import os
import subprocess
import sys
import tarfile
import tempfile
import tomllib
import zipfile
import zlib
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path, PurePosixPath
from typing import IO

from sitegen.cache.files import cache_dir, content
from sitegen.cache.store import put_file, used
from sitegen.external.node import environment, npm_command
from sitegen.progress import Progress, quiet

MANIFEST = Path(__file__).with_name("pins.toml")
KEPT_LICENCES = Path(__file__).with_name("licences")
URL_TIMEOUT = 5.0  # seconds a web address may stay silent before the next source is asked
UNPACKED = 256_000_000  # bytes that an npm package may hold: a tar is unpacked up to the last of the files wanted
# What readers of archives raise for what is none, or a broken one.
FAULTS = (OSError, EOFError, RuntimeError, ValueError, zlib.error, zipfile.BadZipFile, tarfile.TarError)

class OutsideError(RuntimeError):
    """A file from outside could not be obtained; the message names the file and every source that was tried."""


@dataclass(frozen=True)
class Source:
    """Where files may come from: `kind` is "npm", "pip" or "url", `spec` a package with its version or an address.

    Files lie in the archive's `folder`; without one, the archive itself is the file. `python` and `platform` choose
    among a package's wheels.
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
    """One file as it must be: its name inside its source's folder, its size in bytes, its sha256 (hex)."""

    name: str
    size: int
    sha256: str

    def fault(self, data: bytes) -> str:
        """What is wrong with `data` as this file; empty when nothing is."""
        found = hashlib.sha256(data).hexdigest()
        if found == self.sha256:
            return ""
        return f"{self.name} has sha256 {found[:16]}… and {len(data)} bytes, not {self.sha256[:16]}… and {self.size}"


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


@dataclass(frozen=True)
class Licence:
    """A licence as the site shows it: what it covers, its SPDX name, its full text."""

    title: str
    version: str
    licence: str
    text: str


def read_manifest(path: Path = MANIFEST) -> dict[str, Bundle]:
    """The bundles of a manifest by name, in its order. Raises OutsideError where it is not well-formed."""
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
                tuple(PinnedFile(_inside(n), f["size"], f["sha256"]) for n, f in entry["files"].items()),
            )
            for name, entry in data["bundle"].items()
        }
    except (KeyError, TypeError, tomllib.TOMLDecodeError) as error:
        raise OutsideError(f"{name}: {type(error).__name__}: {error}") from error


def _inside(name: str) -> str:
    """The name of a file, which lies in its bundle's folder."""
    path = PurePosixPath(name)
    if path.is_absolute() or ".." in path.parts or "\\" in name:
        raise OutsideError(f"{name}: a file's name leads nowhere out of its bundle's folder")
    return name


def _read_source(name: str, entry: dict[str, str | int]) -> Source:
    kind = next(k for k in ("npm", "pip", "url", None) if k is None or k in entry)
    if kind is None:
        raise OutsideError(f"source {name}: one of npm, pip or url is expected")
    extra = {key: str(entry[key]) for key in ("folder", "python", "platform") if key in entry}
    return Source(name, kind, str(entry[kind]), archive_size=int(entry.get("archive_size", 0)), **extra)


def gather(
    names: Iterable[str], *, cache: Path | None = None, progress: Progress = quiet, manifest: Path = MANIFEST
) -> dict[str, Path]:
    """Paths of all files of the named bundles, keyed "bundle/file name", each verified against its pin.

    The files of a bundle lie in one folder under their own names. `cache` defaults to cache_dir().
    Raises OutsideError naming every file that no source has, with what each source answered.
    """
    cache = cache or cache_dir()
    bundles = read_manifest(manifest)
    unknown = sorted(set(names := list(names)) - set(bundles))
    if unknown:
        raise OutsideError(f"{manifest.name} names no bundle {', '.join(unknown)}; it has {', '.join(bundles)}")
    found: dict[str, Path] = {}
    failures: list[str] = []
    for bundle in bundles.values():
        if bundle.name in names:
            home = cache / "outside" / bundle.folder
            failures += _fill(bundle, home, cache, progress)
            found |= {f"{bundle.name}/{file.name}": home / file.name for file in bundle.files}
    if failures:
        raise OutsideError("\n".join(failures))
    return found


def licences(names: Iterable[str], *, cache: Path | None = None, manifest: Path = MANIFEST) -> list[Licence]:
    """The licences of the named bundles with their full texts, in the manifest's order; gathers what is missing."""
    wanted = set(names)
    gathered = gather(wanted, cache=cache, manifest=manifest)
    result = []
    for bundle in read_manifest(manifest).values():
        if bundle.name not in wanted:
            continue
        paths = [gathered[f"{bundle.name}/{file.name}"] for file in bundle.files]
        texts = [text for entry in bundle.licence_texts for text in _licence_texts(entry, bundle, paths)]
        if not texts:
            raise OutsideError(f"no licence text found for {bundle.title} ({', '.join(bundle.licence_texts)})")
        result.append(Licence(bundle.title, bundle.version, bundle.licence, "\n\n".join(texts)))
    return result


def _licence_texts(entry: str, bundle: Bundle, paths: Sequence[Path]) -> list[str]:
    how, _, what = entry.partition(":")
    if how == "kept":
        return [(KEPT_LICENCES / what).read_text("utf-8").strip()]
    if how == "file":
        return [p.read_text("utf-8").strip() for f, p in zip(bundle.files, paths, strict=True) if f.name == what]
    with zipfile.ZipFile(paths[0]) as archive:
        members = sorted(m for m in archive.namelist() if fnmatch.fnmatch(m, what) and not m.endswith("/"))
        return [f"{m}\n\n{archive.read(m).decode('utf-8').strip()}" for m in members]


def _fill(bundle: Bundle, home: Path, cache: Path, progress: Progress) -> list[str]:
    """Bring a bundle's folder in order; what could not be obtained, as messages."""
    tried: list[str] = []
    missing = []
    for file in bundle.files:
        fault = _kept_fault(file, home / file.name)
        if fault is not None:
            missing.append(file)
        if fault:
            tried.append(f"the cache: {fault}")
    for source in bundle.sources:
        if not missing:
            break
        try:
            taken = _FETCH[source.kind](source, missing, progress)
        except FAULTS as error:
            tried.append(f"{source.name} ({source.spec}): {error}")
            continue
        for file in list(missing):
            data = taken.get(file.name)
            fault = f"it has no {file.name}" if data is None else file.fault(data)
            if data is None or fault:
                tried.append(f"{source.name} ({source.spec}): {fault}")
            else:
                try:
                    put_file(home / file.name, data, cache)
                except OSError as error:
                    tried.append(f"the cache: {error.filename}: {error.strerror}")
                    break
                missing.remove(file)
    said = "".join(f"\n  {line}" for line in tried or ["no source is named"])
    return [f"{bundle.title} {bundle.version}: {file.name} could not be obtained{said}" for file in missing]


def _kept_fault(file: PinnedFile, path: Path) -> str | None:
    """What is wrong with a file in the cache: None for nothing, "" where there is none."""
    if not used(path):
        return ""
    try:
        with path.open("rb") as kept:
            return file.fault(_read(kept, file)) or None
    except OSError as error:
        return f"{path}: {error.strerror}"


def _read(stream: IO[bytes], file: PinnedFile) -> bytes:
    """A file from wherever it may be; one byte more than expected is enough to see that it is not the file."""
    return stream.read(file.size + 1)


def _from_url(source: Source, files: Sequence[PinnedFile], progress: Progress) -> dict[str, bytes]:
    import urllib.request  # with TLS and all: a tenth of a second, and most builds fetch nothing

    taken = {}
    for file in files:
        with urllib.request.urlopen(source.spec + file.name, timeout=URL_TIMEOUT) as answer:
            parts: list[bytes] = []
            done = 0
            # One byte more than expected is enough to see that it is not the file.
            while part := answer.read(min(1 << 16, file.size + 1 - done)):
                parts.append(part)
                done += len(part)
                progress(file.name, done, file.size)
        taken[file.name] = b"".join(parts)
    return taken


def _from_npm(source: Source, files: Sequence[PinnedFile], progress: Progress) -> dict[str, bytes]:
    with tempfile.TemporaryDirectory(prefix="ladder-npm-") as temporary:
        here = Path(temporary)
        (here / "out").mkdir()
        # A cache of its own, so that what has arrived can be seen and is gone afterwards.
        folders: list[str | Path] = ["--cache", here / "cache", "--pack-destination", here / "out"]
        _download(npm_command("pack", source.spec, *folders, "--silent", "--ignore-scripts"), here, source, progress)
        wanted = {f"{source.folder}/{file.name}": file for file in files}
        taken: dict[str, bytes] = {}
        package = _only_file(here / "out", source)
        with _Limited(package) as stream, tarfile.open(fileobj=stream, mode="r|") as archive:
            for member in archive:
                file = wanted.get(member.name)
                if file is not None and member.isfile() and (found := archive.extractfile(member)):
                    taken[file.name] = _read(found, file)
                if len(taken) == len(wanted):
                    break
        return taken


class _Limited(gzip.GzipFile):
    """A gzip file of at most UNPACKED bytes: a small one can unpack to any size."""

    def read(self, size: int | None = -1) -> bytes:
        """So many of its bytes. Raises OutsideError."""
        data = super().read(size)
        if self.tell() > UNPACKED:
            raise OutsideError(f"it unpacks to more than {UNPACKED / 1e6:.0f} MB")
        return data


def _from_pip(source: Source, files: Sequence[PinnedFile], progress: Progress) -> dict[str, bytes]:
    with tempfile.TemporaryDirectory(prefix="ladder-pip-") as temporary:
        here = Path(temporary)
        (here / "out").mkdir()
        # A wheel is only opened as an archive here, so the Python it is meant for need not be ours.
        options = ["--no-deps", "--only-binary=:all:", "--no-cache-dir", "--retries", "2"]
        options += ["--python-version", source.python, *(["--platform", source.platform] if source.platform else [])]
        pip = [sys.executable, "-P", "-m", "pip", "download", "--dest", str(here / "out")]
        _download([*pip, *options, source.spec], here, source, progress)
        wheel = _only_file(here / "out", source)
        if source.folder:
            return _members(wheel, source.folder, files)
        with wheel.open("rb") as stream:
            return {file.name: _read(stream, file) for file in files if file.name == wheel.name}


def _members(wheel: Path, folder: str, files: Sequence[PinnedFile]) -> dict[str, bytes]:
    """Those of the files that a folder of the wheel holds."""
    taken = {}
    with zipfile.ZipFile(wheel) as archive:
        members = set(archive.namelist())
        for file in files:
            if (name := f"{folder}/{file.name}") in members:
                with archive.open(name) as member:
                    taken[file.name] = _read(member, file)
    return taken


_FETCH: dict[str, Callable[[Source, Sequence[PinnedFile], Progress], dict[str, bytes]]] = {
    "url": _from_url,
    "npm": _from_npm,
    "pip": _from_pip,
}


def _only_file(folder: Path, source: Source) -> Path:
    found = [p for p in folder.iterdir() if p.is_file()]
    if len(found) != 1:
        raise OutsideError(f"one archive of {source.spec} was expected, {len(found)} came")
    return found[0]


def _download(command: Sequence[str], here: Path, source: Source, progress: Progress) -> None:
    """Run a package client in `here`; progress is what has come to lie there, since the clients tell no machine."""
    env = environment({"TMPDIR": str(here), "TEMP": str(here), "TMP": str(here)})
    log = here / "log"
    with log.open("wb") as out:
        process = subprocess.Popen(command, cwd=here, env=env, stdin=subprocess.DEVNULL, stdout=out, stderr=out)
        try:
            while True:
                try:
                    process.wait(timeout=0.25)
                    break
                except subprocess.TimeoutExpired:
                    progress(source.spec, min(_weight(here), source.archive_size), source.archive_size)
        finally:
            if process.poll() is None:
                process.kill()
                process.wait()
    if process.returncode != 0:
        said = log.read_text("utf-8", errors="replace").strip().splitlines()
        raise OutsideError(f"its client ended with code {process.returncode}: " + " | ".join(said[-3:]))
    progress(source.spec, source.archive_size, source.archive_size)


def _weight(folder: Path) -> int:
    total = 0
    for root, _, names in os.walk(folder):
        for name in names:
            try:
                total += os.stat(os.path.join(root, name)).st_size
            except OSError:  # moved or removed by the client meanwhile
                continue
    return total
