"""The page's wheel: solvers and widgets, the same bytes each time.

Its metadata is in page-wheel.toml: from a checkout or an index, pip installs `solvers` only.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache as once
from functools import partial
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from sitegen.cache.code_hash import DATA
from sitegen.cache.files import content, fingerprint
from sitegen.cache.store import Store

ROOT = Path(__file__).resolve().parents[2]
PACKAGES = ("solvers", "widgets")
METADATA = Path(__file__).with_name("page-wheel.toml")
_EPOCH = "315532800"  # 1980-01-01, the first date a zip can hold
_SETUPTOOLS_NEEDED = 77  # as page-wheel.toml requires
# If the environment has the build backend, it is called directly, as pip would call it, in a tenth of the time.
_BACKEND = ("-c", "import sys, setuptools.build_meta as backend; backend.build_wheel(sys.argv[1])")
_PIP = ("-m", "pip", "wheel", "--no-deps", ".", "--wheel-dir")


class WheelError(RuntimeError):
    """The wheel could not be built; the message holds the builder's output."""


@dataclass(frozen=True)
class Archive:
    """A wheel, or another zip: its file's name and its bytes."""

    name: str
    data: bytes


def sources(root: Path = ROOT) -> dict[str, bytes]:
    """The files of our packages in the wheel, by their path in it, sorted."""
    files = {
        path.relative_to(root).as_posix(): content(path)
        for package in PACKAGES
        for path in (root / package).rglob("*")
        if path.suffix in (".py", ".pyi", *DATA) or path.name in ("py.typed", "telecom-loop.LICENSE.txt")
    }
    return dict(sorted(files.items()))


def inputs(root: Path = ROOT) -> dict[str, bytes]:
    """All files that the wheel is built from, by their names."""
    return {**sources(root), "LICENSE": content(root / "LICENSE"), "pyproject.toml": content(METADATA)}


def build_wheel(cache: Path, root: Path = ROOT) -> Archive:
    """The wheel of the checkout at `root`, from the cache if none of its files has changed. Raises WheelError."""
    files = inputs(root)
    # The wheel records the backend's version.
    key = fingerprint([*files.items(), ("setuptools", backend().encode())])
    name, _, data = Store(cache, "wheel").get(key, partial(_build, files)).partition(b"\n")
    return Archive(name.decode(), data)


def _build(files: Mapping[str, bytes]) -> bytes:
    """The wheel of these files: a line with its name, then its bytes."""
    with tempfile.TemporaryDirectory(prefix="ladder-wheel-") as temporary:
        # Built from a copy: no build/ or egg-info is left in the checkout, and its build.py does not shadow a package.
        copy, out = Path(temporary, "source"), Path(temporary, "out")
        for name, data in files.items():
            target = copy / name
            target.parent.mkdir(parents=True, exist_ok=True)
            target.write_bytes(data)
        out.mkdir()
        env = {**os.environ, "SOURCE_DATE_EPOCH": _EPOCH, "PYTHONHASHSEED": "0"}
        command = [sys.executable, "-P", *(_BACKEND if _is_enough(backend()) else _PIP), str(out)]
        result = subprocess.run(command, cwd=copy, env=env, capture_output=True, text=True, check=False)
        wheels = sorted(out.glob("*.whl"))
        if result.returncode != 0 or len(wheels) != 1:
            output = (result.stdout + result.stderr).strip()
            raise WheelError(f"the build exited with code {result.returncode}:\n{output}")
        return wheels[0].name.encode() + b"\n" + wheels[0].read_bytes()


@once
def backend() -> str:
    """The version of the environment's build backend, setuptools; "0" if it has none."""
    try:
        return version("setuptools")
    except PackageNotFoundError:
        return "0"


def _is_enough(setuptools: str) -> bool:
    return int(setuptools.partition(".")[0]) >= _SETUPTOOLS_NEEDED
