"""Files → the published folder: written to a temporary folder, packed, then swapped in."""

from __future__ import annotations

import errno
import os
import shutil
import stat
import tempfile
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path

from sitegen.cache import pool
from sitegen.cache.packing import packed
from sitegen.problems import BuildFailed, Problem
from sitegen.progress import Progress
from sitegen.runtime.assemble import RuntimeInfo
from sitegen.stopping import deferred_signals


def clear(dest: Path) -> None:
    """Check that `dest` can be replaced: raises BuildFailed if it is a file or a link, which a build would displace, or
    a file system's root, which cannot be moved."""
    kind = "a link" if dest.is_symlink() else "a file" if dest.exists() and not dest.is_dir() else ""
    if kind or os.path.ismount(dest):
        state = f"{kind}: move or rename it first" if kind else "a mount point: unmount it first"
        message = f"expected a folder to build in, got {state}"
        raise BuildFailed([Problem(dest.name, 0, 0, message)])


def publish(
    files: Mapping[str, bytes],
    runtime: RuntimeInfo | None,
    dest: Path,
    pack: bool,
    cache: Path,
    progress: Progress,
) -> None:
    """Write all files into a folder beside `dest`, then move it to `dest`. Raises BuildFailed as `clear` does."""
    clear(dest)
    dest.parent.mkdir(parents=True, exist_ok=True)
    beside = Path(tempfile.mkdtemp(prefix=f".{dest.name}-", dir=dest.parent))
    try:
        beside.chmod(0o755)
        _fill(beside, {**contents(runtime), **files}, dest, pack, cache, progress)
        if (dest / ".gitignore").is_file():  # it is tracked in git and not made by the build
            shutil.copyfile(dest / ".gitignore", beside / ".gitignore")
        with deferred_signals():
            _exchange(beside, dest)
    finally:
        with deferred_signals():
            shutil.rmtree(beside, ignore_errors=True)


def contents(runtime: RuntimeInfo | None) -> dict[str, bytes]:
    """The runtime's files by their names on the site."""
    return {f"runtime/{name}": data for name, data in runtime.contents.items()} if runtime else {}


def _fill(
    folder: Path, files: Mapping[str, bytes], old: Path, pack: bool, cache: Path, progress: Progress
) -> None:
    """Write the files; hard-link those that `old` already has. The threads only pack, so once this returns or raises,
    nothing more is written."""
    for parent in {(folder / name).parent for name in files}:
        parent.mkdir(parents=True, exist_ok=True)
    with pool.threads() as threads:
        packs = [threads.submit(packed, name, data, cache) for name, data in files.items()] if pack else []
        for i, (name, data) in enumerate(files.items()):
            progress("writing pages", i, len(files))
            for path, bytes_ in {name: data, **(packs[i].result() if pack else {})}.items():
                if not _link(old / path, folder / path, bytes_):
                    (folder / path).write_bytes(bytes_)
    progress("writing pages", len(files), len(files))


def _link(old: Path, new: Path, data: bytes) -> bool:
    """Hard-link `old` to `new` if it holds these bytes, which saves writing them. Return whether that worked."""
    try:
        facts = old.lstat()
        if not stat.S_ISREG(facts.st_mode) or facts.st_size != len(data) or old.read_bytes() != data:
            return False
        os.link(old, new)
    except OSError:  # the file is missing, or the file system has no hard links
        return False
    return True


def _exchange(beside: Path, dest: Path) -> None:
    """Replace the old folder by the new one; if that fails halfway, restore the old one. Another build may do the same
    at the same time: the last one's site stays."""
    old = beside.with_name(beside.name + "-old")
    try:
        while True:
            with suppress(FileNotFoundError):  # there is none yet, or another build has just moved it
                os.replace(dest, old)
            try:
                os.replace(beside, dest)
                break
            except OSError as error:
                if error.errno not in (errno.ENOTEMPTY, errno.EEXIST):
                    raise
            shutil.rmtree(old, ignore_errors=True)  # another build has put its site there since
    except BaseException:
        if old.exists() and not dest.exists():
            os.replace(old, dest)
        raise
    shutil.rmtree(old, ignore_errors=True)
