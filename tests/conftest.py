"""Fixtures and options that several test folders share: the built site, and a checkout with a small generator."""

from __future__ import annotations

import os
import shutil
import threading
from collections.abc import Iterator
from pathlib import Path

import pytest
from hypothesis import settings

from sitegen.serve import live

ROOT = Path(__file__).resolve().parents[1]
pytest_plugins = ["tests.recorded"]
# Busy machines exceed the usual 200 ms. The same examples in every run: a failure comes from the change, not the draw.
settings.register_profile("any machine", deadline=None, derandomize=True)
settings.load_profile("any machine")
PATIENCE = 30.0  # seconds until a wait counts as failed

# A generator of one page. It shows the tone set by a module of its own, so that an edit of Python shows too.
BUILD = '''\
import os
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
    __import__("shutil").rmtree(root / "site.old", ignore_errors=True)
    return Report()
'''


def pytest_addoption(parser: pytest.Parser) -> None:
    """The options of the random walk, of the tests of every page, and of tests/hostile."""
    group = parser.getgroup("random walk")
    group.addoption("--walk-steps", type=int, help="actions a page")
    group.addoption("--walk-seed", help="any text")
    group.addoption("--walk-pages", help="names, separated by commas; every page with a figure without it")
    parser.getgroup("pages").addoption("--pages", help="names, separated by commas: tests of every page go to these")
    parser.getgroup("hostile").addoption("--hostile-calls", type=int, help="calls that each hostile test makes, about")


@pytest.fixture(scope="session")
def site() -> Path:
    """The built site. `build.py test` recognises by this fixture which tests need an up-to-date site."""
    folder = Path(os.environ.get("LADDER_SITE", ROOT / "site"))
    assert (folder / "index.html").is_file(), f"no built site in {folder}: run `python3 build.py` first"
    return folder


def copy_file(name: str, folder: Path) -> None:
    """Copy a file of the project to the same path in another folder."""
    (folder / name).parent.mkdir(parents=True, exist_ok=True)
    shutil.copy(ROOT / name, folder / name)


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
