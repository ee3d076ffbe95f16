"""Removes what the other commands created. Standard library only, and run outside .venv, which it may remove."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from contextlib import suppress
from fnmatch import fnmatch
from pathlib import Path

from sitegen.cli import environment

MADE = (
    ".grimp_cache", ".hypothesis", ".import_linter_cache", ".mypy_cache", ".pytest_cache", ".ruff_cache", ".site-*",
    "*.egg-info", "__pycache__", "bench.json", "build", "dist",
)  # fmt: skip
"""What commands leave in the root of a checkout, besides site/ and .venv. `.site-*` are interrupted builds."""
SOURCES = ("sitegen", "solvers", "widgets", "tests")


def clean(root: Path, *, everything: bool = False) -> int:
    """Empty site/ (except for its .gitignore) and remove created files; `everything`: also .venv and the user's cache.
    The exit code is 1 if something cannot be removed, which is reported; the rest is still removed."""
    paths = [path for path in sorted((root / "site").glob("*")) if path.name != ".gitignore"]
    paths += [path for path in sorted(root.iterdir()) if any(fnmatch(path.name, pattern) for pattern in MADE)]
    paths += [path for name in SOURCES for path in (root / name).rglob("__pycache__")]
    code = 0
    if everything:
        if environment.is_inside(root):
            print("clean --all cannot remove the .venv it runs in: use the system python3", file=sys.stderr)
            return 2
        override = os.environ.get("LADDER_CACHE")
        cache = None if override else user_cache(root)
        if override:  # the user's own folder may hold other things
            print(f"kept {override}, the folder named by LADDER_CACHE", file=sys.stderr)
        elif cache is None:
            print("kept the user's cache: it cannot be located without a working .venv", file=sys.stderr)
            code = 1
        else:
            paths.append(cache)
        paths.append(environment.folder(root))
    lines = []
    for path in paths:
        label = path.relative_to(root) if path.is_relative_to(root) else path
        try:
            if path.is_dir() and not path.is_symlink():
                shutil.rmtree(path)
            elif path.exists() or path.is_symlink():
                path.unlink()
            else:
                continue
        except OSError as error:
            print(f"clean: {label} cannot be removed: {error.strerror or error}", file=sys.stderr)
            code = 1
            continue
        lines.append(f"removed {label}")
    if lines:  # printed last, so that a closed pipe does not interrupt the removal
        with suppress(BrokenPipeError):
            print(*lines, sep="\n", flush=True)
    return code


def user_cache(root: Path) -> Path | None:
    """The cache folder of builds, according to the environment; None if that does not work."""
    if not environment.python(root).is_file():
        return None
    asks = "from sitegen.cache.files import cache_dir; print(cache_dir())"
    command = [str(environment.python(root)), "-c", asks]
    result = subprocess.run(command, cwd=root, capture_output=True, text=True, encoding="utf-8", check=False)
    return Path(result.stdout.strip()) if result.returncode == 0 and result.stdout.strip() else None
