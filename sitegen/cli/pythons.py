"""`test --pythons`: the build and the solvers' tests with every other suitable Python on this machine.

Each runs as on a fresh machine: in a copy of the checkout, with its own .venv, and with a cache that holds only the
files from outside and the plots' results, so that the build makes everything else with that Python. (The results would
take two minutes per Python; the solvers that compute them are tested anyway.)
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from sitegen.cli.clean import MADE

LEAST = (3, 11)
ASKS = "import sys, importlib.util as u; print(*sys.version_info[:4], u.find_spec('ensurepip') is not None)"
TESTS = "tests/solvers"
KEPT = ("outside", "plots")  # folders of the cache
NOT_COPIED = (".git", ".venv", "site", *MADE)  # in the root of the checkout


@dataclass(frozen=True, order=True)
class Interpreter:
    """A Python on this machine. `can_set_up`: whether it has ensurepip, which environments need."""

    version: tuple[int, int, int]
    can_set_up: bool
    path: Path

    @property
    def name(self) -> str:
        """Its version as text, such as 3.12.4."""
        return ".".join(map(str, self.version))


def candidates(environ: Mapping[str, str]) -> list[Path]:
    """Paths that may be Pythons: python3 and python3.N on the PATH, and all of pyenv's."""
    paths = []
    for folder in map(Path, environ.get("PATH", "").split(os.pathsep)):
        if folder.is_dir():
            paths += [path for path in sorted(folder.iterdir()) if re.fullmatch(r"python3(\.\d+)?(\.exe)?", path.name)]
    pyenv = Path(environ.get("PYENV_ROOT") or Path.home() / ".pyenv")
    return [*paths, *sorted(pyenv.glob("versions/*/bin/python3"))]


def interpreters(paths: Iterable[Path]) -> list[Interpreter]:
    """The released Pythons among `paths` that are new enough, the newest of each minor version. Paths that do not
    answer (a shim for an inactive version) and release candidates are skipped."""
    newest: dict[tuple[int, int], Interpreter] = {}
    for path in paths:
        try:
            command = [str(path), "-I", "-c", ASKS]
            result = subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)
        except (OSError, subprocess.TimeoutExpired):
            continue
        match = re.fullmatch(r"(\d+) (\d+) (\d+) final (True|False)", result.stdout.strip())
        if result.returncode != 0 or match is None:
            continue
        interpreter = Interpreter((int(match[1]), int(match[2]), int(match[3])), match[4] == "True", path)
        minor = interpreter.version[:2]
        if minor >= LEAST and (minor not in newest or _rank(interpreter) > _rank(newest[minor])):
            newest[minor] = interpreter
    return sorted(newest.values())


def _rank(interpreter: Interpreter) -> tuple[bool, tuple[int, int, int]]:
    return interpreter.can_set_up, interpreter.version


def test_pythons(root: Path) -> int:
    """Print the Pythons found and try each, except this one's own version; the exit code is 1 if one fails."""
    this = tuple(sys.version_info[:2])
    pythons = interpreters(candidates(os.environ))
    others = [p for p in pythons if p.version[:2] != this and p.can_set_up]
    print(f"this Python is {'.'.join(map(str, sys.version_info[:3]))}, which `build.py test` has already tested")
    for python in pythons:
        if python.version[:2] != this and not python.can_set_up:
            print(f"skipped {python.path}, Python {python.name}: without ensurepip it cannot create a .venv")
    print(f"to try: {', '.join(f'{p.name} ({p.path})' for p in others) or 'none'}", flush=True)
    failures = [p for p in others if not works(root, p)]
    for python in others:
        outcome = "FAILED (see above)" if python in failures else "builds the site, solver tests pass"
        print(f"Python {python.name}: {outcome}")
    return 1 if failures else 0


def works(root: Path, interpreter: Interpreter) -> bool:
    """Whether a copy of the checkout sets itself up, builds and passes the solvers' tests with this Python."""
    from sitegen.cache.files import cache_dir

    with tempfile.TemporaryDirectory(prefix="ladder-python-") as temporary:
        copy, cache = Path(temporary, "checkout"), Path(temporary, "cache")
        copied(root, copy)
        for kind in KEPT:
            if (cache_dir() / kind).is_dir():
                shutil.copytree(cache_dir() / kind, cache / kind)
        env = {name: value for name, value in os.environ.items() if name not in ("VIRTUAL_ENV", "PYTHONPATH")}
        env["LADDER_CACHE"] = str(cache)
        return all(_run([str(interpreter.path), *words], copy, env, interpreter) for words in steps())


def copied(root: Path, copy: Path) -> None:
    """Copy the checkout in its current state, edits included, without the files that its commands created."""

    def left_out(folder: str, names: list[str]) -> set[str]:
        patterns = NOT_COPIED if Path(folder) == root else ("__pycache__",)
        return set(shutil.ignore_patterns(*patterns)(folder, names))

    shutil.copytree(root, copy, ignore=left_out, symlinks=True)
    (copy / "site").mkdir()
    shutil.copy(root / "site" / ".gitignore", copy / "site")


def steps() -> list[list[str]]:
    """The commands for each Python: the README's first one, then the solvers' tests."""
    return [["build.py"], ["build.py", "test", f"-n{min(4, os.cpu_count() or 1)}", "--dist=loadfile", TESTS]]


def _run(command: Sequence[str], folder: Path, env: Mapping[str, str], interpreter: Interpreter) -> bool:
    words = " ".join(command[1:])
    label = f"== Python {interpreter.name}: {words}"
    print(label, flush=True)
    began = time.monotonic()
    code = subprocess.run(command, cwd=folder, env=env, stdin=subprocess.DEVNULL, check=False).returncode
    print(f"{label} exited with code {code} after {time.monotonic() - began:.0f} s", flush=True)
    return code == 0
