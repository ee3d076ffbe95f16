"""One visit of every page for all that holds of every page: a page's load, and its Python's, are what costs.

A check tells what is wrong with the page that it is given, and leaves it to the next. What it found, on all pages, a
test of its own tells.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Protocol

from playwright.sync_api import Error, Page

Check = Callable[[Page, str], Iterable[str]]  # an open page and its name → what is wrong
Found = Mapping[str, list[str]]  # a check's name → what it found
QUIET = "quiet"  # under this name: what the browser complains of, and what it asks of others, unasked


class Visitor(Protocol):
    """A reader of tests/browser/conftest.py."""

    wrong: list[str]
    foreign: list[str]

    def open(self, path: str = ...) -> Page: ...
    def unexpected(self) -> list[str]: ...


def found_on(one: Visitor, pages: Sequence[str], checks: Mapping[str, Check]) -> Found:
    """What each check finds, taken in their order. One that fails has found that it did, and what came before."""
    result: dict[str, list[str]] = {name: [] for name in (*checks, QUIET)}
    for path in pages:
        page = one.open(path)
        for name, check in checks.items():
            try:
                for each in check(page, path):
                    result[name].append(f"{path}: {each}")
            except (AssertionError, Error) as error:
                result[name].append(f"{path}: {error}")
        page.close()
        result[QUIET] += [f"{path}: {each}" for each in [*one.unexpected(), *one.foreign]]
        one.wrong.clear()
        one.foreign.clear()
    return result
