"""The project's own content builds to the same bytes elsewhere, without any cached drawings."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path
from typing import get_args

from sitegen.cache.files import cache_dir
from sitegen.cache.store import Kind
from sitegen.pipeline.build import build
from tests.sitegen.conftest import contents

ROOT = Path(__file__).resolve().parents[3]
# Kinds that take minutes, or whose sameness has its own test; everything else that a build caches is made anew.
KEPT = ("brotli", "bundles", "compiled", "fonts", "gzip", "plots", "sweep", "wheel")
LEFT = (".venv", "__pycache__", ".hypothesis", ".mypy_cache", ".pytest_cache", ".ruff_cache")
BUILD = """
import sys
from pathlib import Path
root, dest, cache = map(Path, sys.argv[1:])
sys.path.insert(0, str(root))
import sitegen
from sitegen.pipeline.build import build
assert Path(sitegen.__file__).is_relative_to(root)
assert "index.html" in build(root, dest, pack=False, cache=cache).pages
"""


def ignore(folder: str, names: list[str]) -> list[str]:
    """The names in a checkout's folder that are not sources."""
    site = Path(folder) == ROOT / "site"
    return [name for name in names if name in LEFT or (site and name != ".gitignore")]


def test_two_builds_of_the_site_are_the_same_bytes(tmp_path: Path) -> None:
    """The second is built from a copy in another folder, with another hash seed, temporary folder, time zone and
    language, and a cold cache."""
    build(ROOT, tmp_path / "one", pack=False)
    copy, cold, temporary = tmp_path / "a copy" / "of it", tmp_path / "cache", tmp_path / "temporary"
    shutil.copytree(ROOT, copy, ignore=ignore)
    cold.mkdir()
    temporary.mkdir()
    for folder in cache_dir().iterdir():
        if folder.is_dir() and (folder.name in KEPT or folder.name not in get_args(Kind)):
            (cold / folder.name).symlink_to(folder, target_is_directory=True)
    environment = {"PYTHONHASHSEED": "20261", "TZ": "Pacific/Auckland", "LC_ALL": "C"}
    environment |= dict.fromkeys(("TMPDIR", "TEMP", "TMP"), str(temporary))
    words = [sys.executable, "-P", "-c", BUILD, str(copy), str(tmp_path / "two"), str(cold)]
    subprocess.run(words, cwd=temporary, env={**os.environ, **environment}, check=True)
    one, two = contents(tmp_path / "one"), contents(tmp_path / "two")
    assert set(one) == set(two)
    assert [name for name, data in one.items() if data != two[name]] == []
