"""A visit reports the findings of each check and goes on; the tests of every page rely on that."""

from __future__ import annotations

from collections.abc import Callable, Iterator

from playwright.sync_api import Page

from tests.browser.conftest import Reader
from tests.browser.visits import QUIET, findings


def test_what_is_wrong_is_told_of_its_page_and_check(reader: Callable[..., Reader]) -> None:
    """A check's yields, its failure even half-way, and the browser's complaints; other checks find nothing."""

    def fails(page: Page, path: str) -> Iterator[str]:
        yield "the first"
        assert path == "references.html", "not this one"
        page.evaluate("() => { throw new Error('thrown'); }")

    def complains(page: Page, path: str) -> Iterator[str]:
        page.evaluate("path => console.error('of ' + path)", path)
        yield from ()

    checks = {"fails": fails, "complains": complains, "finds nothing": lambda page, path: []}
    result = findings(reader(), ["404.html", "references.html"], checks)
    first, second, third, fourth = result["fails"]
    assert first == "404.html: the first"
    assert second.startswith("404.html: not this one")
    assert third == "references.html: the first"
    assert fourth.startswith("references.html: ")
    assert "thrown" in fourth
    assert result["complains"] == result["finds nothing"] == []
    assert result[QUIET] == ["404.html: console: of 404.html", "references.html: console: of references.html"]
