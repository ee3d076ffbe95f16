"""`check` without its command. Not in conftest.py, through which all of tests/sitegen would depend on the checks."""

from __future__ import annotations

from pathlib import Path

from sitegen.cache.files import cache_dir
from sitegen.check.html import read_pages
from sitegen.check.rules import check_pages
from sitegen.problems import Problem


def check_site(site: Path, cache: Path | None = None) -> list[Problem]:
    """All problems of a built site, in order. cache: where results of pages are kept; by default with the user's."""
    return check_pages(site, read_pages(site), cache or cache_dir())
