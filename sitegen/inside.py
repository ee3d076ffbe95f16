"""Runs Python inside Pyodide under Node: on the runtime as it is shipped, or on the complete one it is made from."""

from __future__ import annotations

import gzip
import io
import os
import shutil
import tempfile
import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from sitegen.node import run_node
from sitegen.outside import cache_dir, gather
from sitegen.runtime import RUNNER, RuntimeInfo, assemble


def run_python_in_shipped_runtime(
    code: str, value: Any = None, *, info: RuntimeInfo | None = None, cache: Path | None = None, timeout: float = 600
) -> Any:
    """What `main(text: str) -> str` of `code`, JSON in and out, makes of `value` on the runtime that is shipped.

    `info` defaults to the runtime of this checkout. Raises NodeError with the traceback where the code fails.
    """
    cache = cache or cache_dir()
    if info is None:
        with tempfile.TemporaryDirectory(prefix="ladder-runtime-") as temporary:
            home = _unpacked(assemble(Path(temporary), cache=cache), cache)
    else:
        home = _unpacked(info, cache)
    request = {"folder": str(home), "site": str(home / "site"), "python": code, "input": value}
    return run_node(RUNNER, request, timeout=timeout)


def run_python_in_complete_runtime(
    code: str,
    value: Any = None,
    *,
    mounts: Mapping[str, Path] | None = None,
    cache: Path | None = None,
    timeout: float = 1800,
) -> Any:
    """The same on Pyodide, numpy and Hypothesis as they come, with folders mounted: { path inside: folder outside }."""
    cache = cache or cache_dir()
    outside = gather(["numpy", "pyodide", "hypothesis"], cache=cache)
    wheels = [path for path in outside.values() if path.suffix == ".whl"]
    site = cache / "unpacked" / "+".join(sorted(wheel.stem for wheel in wheels))
    if not site.is_dir():
        with _beside(site) as folder:
            for wheel in wheels:
                with zipfile.ZipFile(wheel) as archive:
                    archive.extractall(folder)
    request = {
        "folder": str(outside["pyodide/pyodide.mjs"].parent),
        "site": str(site),
        "mounts": {inside: str(folder) for inside, folder in (mounts or {}).items()},
        "python": code,
        "input": value,
    }
    return run_node(RUNNER, request, timeout=timeout)


def _unpacked(info: RuntimeInfo, cache: Path) -> Path:
    """The shipped runtime laid out for Node, its packages in `site`; from the cache when it was laid out before."""
    home = cache / "unpacked" / info.version
    if home.is_dir():
        return home
    with _beside(home) as folder:
        for file in info.files:
            source = info.folder / file.name
            if source.suffix != ".pack":
                shutil.copyfile(source, folder / source.name)
            elif source.stem == "python_stdlib":
                (folder / "python_stdlib.zip").write_bytes(gzip.decompress(source.read_bytes()))
            else:
                with zipfile.ZipFile(io.BytesIO(gzip.decompress(source.read_bytes()))) as pack:
                    pack.extractall(folder / "site")
    return home


class _beside:
    """A folder beside its place, renamed into it when all went well."""

    def __init__(self, place: Path) -> None:
        self.place = place

    def __enter__(self) -> Path:
        self.place.parent.mkdir(parents=True, exist_ok=True)
        self.folder = Path(tempfile.mkdtemp(dir=self.place.parent, prefix=".new-"))
        return self.folder

    def __exit__(self, kind: object, *_: object) -> None:
        if kind is None and not self.place.exists():
            os.replace(self.folder, self.place)
        else:
            shutil.rmtree(self.folder, ignore_errors=True)
