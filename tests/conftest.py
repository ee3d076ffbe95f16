"""What all test folders share: their options, and the built site."""

from __future__ import annotations

import os
import shutil
from pathlib import Path

import pytest
from hypothesis import settings

ROOT = Path(__file__).resolve().parents[1]
pytest_plugins = ["tests.recorded"]
# Busy machines exceed the usual 200 ms. The same examples in every run: a failure comes from the change, not the draw.
settings.register_profile("any machine", deadline=None, derandomize=True)
settings.load_profile("any machine")


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
