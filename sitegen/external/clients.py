"""The clients that fetch pinned files: a web address, npm and pip, each with progress and limits."""

from __future__ import annotations

import gzip
import os
import subprocess
import sys
import tarfile
import tempfile
import zipfile
import zlib
from collections.abc import Callable, Sequence
from pathlib import Path

from sitegen.external.node import environment, npm_command
from sitegen.external.pins import OutsideError, PinnedFile, Source
from sitegen.progress import Progress

URL_TIMEOUT = 5.0  # seconds that a web address may stay silent before the next source is tried
UNPACKED = 256_000_000  # bytes, the limit for an npm package: its tar is unpacked up to the last file needed
# What readers of archives raise for broken archives or other files.
FAULTS = (OSError, EOFError, RuntimeError, ValueError, zlib.error, zipfile.BadZipFile, tarfile.TarError)


def fetched(source: Source, files: Sequence[PinnedFile], progress: Progress) -> dict[str, bytes]:
    """Fetch those of the files that a source has, by name, not yet verified. Raises one of FAULTS."""
    return _FETCH[source.kind](source, files, progress)


def _from_url(source: Source, files: Sequence[PinnedFile], progress: Progress) -> dict[str, bytes]:
    import urllib.request  # takes a tenth of a second, and most builds fetch nothing

    contents = {}
    for file in files:
        with urllib.request.urlopen(source.spec + file.name, timeout=URL_TIMEOUT) as answer:
            parts: list[bytes] = []
            count = 0
            # One byte more than expected is enough to see that it is not the file.
            while part := answer.read(min(1 << 16, file.size + 1 - count)):
                parts.append(part)
                count += len(part)
                progress(file.name, count, file.size)
        contents[file.name] = b"".join(parts)
    return contents


def _from_npm(source: Source, files: Sequence[PinnedFile], progress: Progress) -> dict[str, bytes]:
    with tempfile.TemporaryDirectory(prefix="ladder-npm-") as temporary:
        directory = Path(temporary)
        (directory / "out").mkdir()
        # Its own cache, so that progress can be measured and nothing is left afterwards.
        folders: list[str | Path] = ["--cache", directory / "cache", "--pack-destination", directory / "out"]
        command = npm_command("pack", source.spec, *folders, "--silent", "--ignore-scripts")
        _download(command, directory, source, progress)
        members = {f"{source.folder}/{file.name}": file for file in files}
        contents: dict[str, bytes] = {}
        package = _only_file(directory / "out", source)
        with _Limited(package) as stream, tarfile.open(fileobj=stream, mode="r|") as archive:
            for member in archive:
                file = members.get(member.name)
                if file is not None and member.isfile() and (data := archive.extractfile(member)):
                    contents[file.name] = file.read(data)
                if len(contents) == len(members):
                    break
        return contents


class _Limited(gzip.GzipFile):
    """A gzip file of at most UNPACKED bytes: a small one can unpack to any size."""

    def read(self, size: int | None = -1) -> bytes:
        """Read up to `size` bytes. Raises OutsideError beyond UNPACKED."""
        data = super().read(size)
        if self.tell() > UNPACKED:
            raise OutsideError(f"it unpacks to more than {UNPACKED / 1e6:.0f} MB")
        return data


def _from_pip(source: Source, files: Sequence[PinnedFile], progress: Progress) -> dict[str, bytes]:
    with tempfile.TemporaryDirectory(prefix="ladder-pip-") as temporary:
        directory = Path(temporary)
        (directory / "out").mkdir()
        # The wheel is only opened as an archive here, so it may be for another Python than ours.
        options = ["--no-deps", "--only-binary=:all:", "--no-cache-dir", "--retries", "2"]
        options += ["--python-version", source.python, *(["--platform", source.platform] if source.platform else [])]
        pip = [sys.executable, "-P", "-m", "pip", "download", "--dest", str(directory / "out")]
        _download([*pip, *options, source.spec], directory, source, progress)
        wheel = _only_file(directory / "out", source)
        if source.folder:
            return _members(wheel, source.folder, files)
        with wheel.open("rb") as stream:
            return {file.name: file.read(stream) for file in files if file.name == wheel.name}


def _members(wheel: Path, folder: str, files: Sequence[PinnedFile]) -> dict[str, bytes]:
    """Those of the files that are in a folder of the wheel."""
    contents = {}
    with zipfile.ZipFile(wheel) as archive:
        members = set(archive.namelist())
        for file in files:
            if (name := f"{folder}/{file.name}") in members:
                with archive.open(name) as member:
                    contents[file.name] = file.read(member)
    return contents


_FETCH: dict[str, Callable[[Source, Sequence[PinnedFile], Progress], dict[str, bytes]]] = {
    "url": _from_url,
    "npm": _from_npm,
    "pip": _from_pip,
}


def _only_file(folder: Path, source: Source) -> Path:
    files = [p for p in folder.iterdir() if p.is_file()]
    if len(files) != 1:
        raise OutsideError(f"expected one archive of {source.spec}, got {len(files)}")
    return files[0]


def _download(command: Sequence[str], directory: Path, source: Source, progress: Progress) -> None:
    """Run a package client in `directory`; progress is the size of the files in it, which the clients do not report."""
    env = environment({"TMPDIR": str(directory), "TEMP": str(directory), "TMP": str(directory)})
    log = directory / "log"
    with log.open("wb") as out:
        process = subprocess.Popen(command, cwd=directory, env=env, stdin=subprocess.DEVNULL, stdout=out, stderr=out)
        try:
            while True:
                try:
                    process.wait(timeout=0.25)
                    break
                except subprocess.TimeoutExpired:
                    progress(source.spec, min(_weight(directory), source.archive_size), source.archive_size)
        finally:
            if process.poll() is None:
                process.kill()
                process.wait()
    if process.returncode != 0:
        output = log.read_text("utf-8", errors="replace").strip().splitlines()
        raise OutsideError(f"its client exited with code {process.returncode}: " + " | ".join(output[-3:]))
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
