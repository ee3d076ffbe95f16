"""Files → the published folder: written beside, packed, then put in the old one's place."""

from __future__ import annotations

import os
import shutil
import tempfile
from collections.abc import Mapping
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
        for i, (name, data) in enumerate(files.items()):
            progress("writing pages", i, len(files))
            for each, bytes_ in {name: data, **(packed(name, data, cache) if pack else {})}.items():
                (beside / each).parent.mkdir(parents=True, exist_ok=True)
                (beside / each).write_bytes(bytes_)
        progress("writing pages", len(files), len(files))
        if started:
            _copy_runtime(started, beside / "runtime", pack, cache)
        if (dest / ".gitignore").is_file():  # the folder's own, which is in git and not of the build
            shutil.copyfile(dest / ".gitignore", beside / ".gitignore")
        _exchange(beside, dest)
    finally:
        shutil.rmtree(beside, ignore_errors=True)


def _copy_runtime(started: RuntimeInfo, folder: Path, pack: bool, cache: Path) -> None:
    for name in [*(file.name for file in started.files), started.wheel]:
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(started.folder / name, folder / name)
        if pack:
            for each, data in packed(name, (folder / name).read_bytes(), cache).items():
                (folder / each).write_bytes(data)


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
