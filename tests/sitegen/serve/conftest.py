"""A checkout with a small generator, and its site as `serve` shows it."""

from __future__ import annotations

import shutil
import threading
from collections.abc import Iterator
from pathlib import Path

import pytest

from sitegen.serve import live
from tests.conftest import ROOT, copy_file

PATIENCE = 30.0  # seconds until a wait counts as failed

# A generator of one page. It shows the tone set by a module of its own, so that an edit of Python shows too.
BUILD = '''\
import os
import shutil
from dataclasses import dataclass
from sitegen.problems import BuildFailed, Problem
from sitegen.tone import TONE

POLICY = "default-src 'none'; script-src 'self'; style-src 'self'; connect-src 'self'"

@dataclass
class Report:
    pages: tuple = ("index.html",)
    warnings: tuple = ()
    sources: tuple = (("content/page.md", "index.html"),)

def build(root, dest, *, strict=False, drafts=False, pack=True, progress=None, memory=None):
    text = (root / "content" / "page.md").read_text("utf-8")
    if "wrong" in text:
        raise BuildFailed([Problem("content/page.md", 1, 1 + text.index("wrong"), "this is wrong")])
    beside = dest.with_name("site.beside")
    beside.mkdir()
    head = "<!doctype html><html><head><title>x</title></head>"
    (beside / "index.html").write_text(f"{head}<body>{text}{TONE}{' A draft.' * drafts}</body><!--{os.getpid()}-->")
    (beside / "_headers").write_text(f"/*\\n  Content-Security-Policy: {POLICY}\\n  Cache-Control: immutable")
    (beside / "code.mjs").write_text("export {};")
    if dest.exists():
        os.rename(dest, root / "site.old")
        if (root / "slowly").exists():  # the moment in which there is no site, held open until the test has asked
            (root / "swapping").touch()
            while (root / "slowly").exists():
                pass
    os.rename(beside, dest)
    shutil.rmtree(root / "site.old", ignore_errors=True)
    return Report()
'''


@pytest.fixture
def small_checkout(tmp_path: Path) -> Path:
    (tmp_path / "content").mkdir()
    (tmp_path / "content" / "page.md").write_text("first", "utf-8")
    for name in ("__init__", "problems", "progress", "stopping", "pipeline/__init__", "pipeline/attempt"):
        copy_file(f"sitegen/{name}.py", tmp_path)
    for room in ("sitegen/cache", "sitegen/external"):
        shutil.copytree(ROOT / room, tmp_path / room, ignore=shutil.ignore_patterns("__pycache__"))
    (tmp_path / "sitegen" / "pipeline" / "build.py").write_text(BUILD, "utf-8")
    (tmp_path / "sitegen" / "tone.py").write_text("TONE = '.'\n", "utf-8")
    return tmp_path


@pytest.fixture
def live_site(small_checkout: Path) -> Iterator[live.LiveSite]:
    site = live.LiveSite(small_checkout, small_checkout / "site")
    assert site.rebuild().good
    watcher = threading.Thread(target=site.watch)
    watcher.start()
    yield site
    site.stop()
    watcher.join(PATIENCE)
    assert not watcher.is_alive()
    site.close()
