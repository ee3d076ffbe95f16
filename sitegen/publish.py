"""Files → the published folder: written beside, packed, then put in the old one's place."""

from __future__ import annotations

import os
import shutil
import tempfile
from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from .files import packed
from .outside import Progress
from .runtime import RuntimeInfo


def publish(
    files: Mapping[str, bytes],
    started: RuntimeInfo | None,
    dest: Path,
    pack: bool,
    cache: Path,
    progress: Progress,
) -> None:
    """Write all files into a folder beside `dest`, then put that in its place."""
    dest.parent.mkdir(parents=True, exist_ok=True)
    beside = Path(tempfile.mkdtemp(prefix=f".{dest.name}-", dir=dest.parent))
    beside.chmod(0o755)
    try:
        with ThreadPoolExecutor(os.cpu_count()) as threads:  # packing lets other threads run meanwhile
            runtime = threads.submit(_copy_runtime, started, beside / "runtime", pack, cache) if started else None
            written = [threads.submit(_write, beside, name, data, pack, cache) for name, data in files.items()]
            for i, each in enumerate(written):
                progress("writing pages", i, len(files))
                each.result()
            if runtime is not None:
                runtime.result()
        progress("writing pages", len(files), len(files))
        if (dest / ".gitignore").is_file():  # the folder's own, which is in git and not of the build
            shutil.copyfile(dest / ".gitignore", beside / ".gitignore")
        _exchange(beside, dest)
    finally:
        shutil.rmtree(beside, ignore_errors=True)


def _write(folder: Path, name: str, data: bytes, pack: bool, cache: Path) -> None:
    for each, bytes_ in {name: data, **(packed(name, data, cache) if pack else {})}.items():
        (folder / each).parent.mkdir(parents=True, exist_ok=True)
        (folder / each).write_bytes(bytes_)


def _copy_runtime(started: RuntimeInfo, folder: Path, pack: bool, cache: Path) -> None:
    for name in [*(file.name for file in started.files), started.wheel]:
        _write(folder, name, (started.folder / name).read_bytes(), pack, cache)


def _exchange(beside: Path, dest: Path) -> None:
    """Put the new folder in the old one's place; where that fails or is cut off half way, the old one comes back."""
    old = beside.with_name(beside.name + "-old")
    try:
        if dest.exists():
            os.replace(dest, old)
        os.replace(beside, dest)
    except BaseException:
        if old.exists() and not dest.exists():
            os.replace(old, dest)
        raise
    shutil.rmtree(old, ignore_errors=True)
