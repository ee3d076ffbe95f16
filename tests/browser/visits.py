"""One visit of every page serves all rules for pages: loading a page and its Python is what costs.

A check yields the faults of the page that it is given and leaves the page to the next check. A separate test reports
what each check found on all pages.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Protocol

from playwright.sync_api import Error, Page

Check = Callable[[Page, str], Iterable[str]]  # an open page and its name → its faults
Found = Mapping[str, list[str]]  # a check's name → its findings
QUIET = "quiet"  # the name for the browser's unexpected complaints and requests to other origins


class Visitor(Protocol):
    """A reader of tests/browser/conftest.py."""

    wrong: list[str]
    foreign: list[str]

    def open(self, path: str = ...) -> Page: ...
    def unexpected(self) -> list[str]: ...


def findings(visitor: Visitor, pages: Sequence[str], checks: Mapping[str, Check]) -> Found:
    """What each check finds, in their order. A check that fails yields its failure after anything that it has found."""
    result: dict[str, list[str]] = {name: [] for name in (*checks, QUIET)}
    for path in pages:
        page = visitor.open(path)
        for name, check in checks.items():
            try:
                for fault in check(page, path):
                    result[name].append(f"{path}: {fault}")
            except (AssertionError, Error) as error:
                result[name].append(f"{path}: {error}")
        page.close()
        result[QUIET] += [f"{path}: {fault}" for fault in [*visitor.unexpected(), *visitor.foreign]]
        visitor.wrong.clear()
        visitor.foreign.clear()
    return result
