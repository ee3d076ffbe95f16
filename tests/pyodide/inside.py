"""Runs Python inside Pyodide under Node: in the shipped runtime, or in the complete one that it is built from."""

from __future__ import annotations

import gzip
import re
import sysconfig
import tempfile
from collections.abc import Mapping
from pathlib import Path, PurePosixPath
from typing import Any

from sitegen.cache.files import cache_dir, write
from sitegen.external.fetch import gather
from sitegen.external.node import run_node
from sitegen.runtime.assemble import HERE, RUNNER, RuntimeInfo, mounted
from sitegen.runtime.reuse import assembled

ROOT = HERE.parents[1]
SUITE = Path(__file__).with_name("suite.py")


def run_python_in_shipped_runtime(
    code: str, value: Any = None, *, info: RuntimeInfo | None = None, cache: Path | None = None, timeout: float = 600
) -> Any:
    """Call `main(text: str) -> str` of `code` in the shipped runtime with `value`, JSON in and out; return its result.

    `info` defaults to the runtime of this checkout. Raises NodeError with the traceback if the code fails.
    """
    info = info or assembled(cache=cache)
    files = {PurePosixPath(file.name).name: info.contents[file.name] for file in (*info.files, *info.later)}
    packs = {name: gzip.decompress(data) for name, data in files.items() if name.endswith(".pack")}
    with tempfile.TemporaryDirectory(prefix="ladder-inside-") as temporary:
        home = Path(temporary)
        for name in files.keys() - packs.keys():
            write(home / name, files[name])
        library = packs.pop("python_stdlib.pack")
        request = {"folder": temporary, **mounted(library, packs.values(), home), "python": code, "input": value}
        return run_node(RUNNER, request, timeout=timeout, attempts=1)


def run_python_in_complete_runtime(
    code: str,
    value: Any = None,
    *,
    mounts: Mapping[str, Path] | None = None,
    cache: Path | None = None,
    timeout: float = 1800,
) -> Any:
    """The same with unmodified Pyodide, numpy and Hypothesis, and folders mounted: { path inside: folder outside }."""
    outside = gather(["numpy", "pyodide", "hypothesis"], cache=cache or cache_dir())
    wheels = [path.read_bytes() for path in outside.values() if path.suffix == ".whl"]
    with tempfile.TemporaryDirectory(prefix="ladder-inside-") as temporary:
        request = {
            "folder": str(outside["pyodide/pyodide.mjs"].parent),
            **mounted(outside["pyodide/python_stdlib.zip"].read_bytes(), wheels, Path(temporary)),
            "mounts": {inside: str(folder) for inside, folder in (mounts or {}).items()},
            "python": code,
            "input": value,
        }
        return run_node(RUNNER, request, timeout=timeout, attempts=1)


def assert_the_suite_passes(folder: str) -> None:
    """Run a folder's tests inside the complete runtime, except those marked native, and check that they pass."""
    answer = run_python_in_complete_runtime(
        SUITE.read_text("utf-8"),
        # Leave out the conftest above, which belongs to the site: these tests need only its plugin.
        {"args": [folder, f"--confcutdir={folder}", "-p", "tests.recorded", "-m", "not native", "-q"]},
        mounts={"/repo": ROOT, "/venv": Path(sysconfig.get_path("purelib"))},
    )
    assert answer["code"] == 0, answer["output"]
    assert re.search(r"\b[1-9]\d* passed", answer["output"]), answer["output"]
