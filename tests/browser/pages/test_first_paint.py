"""Reading comes first: figures come alive once the page is painted, and at once where a figure is what is asked for."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest
from playwright.sync_api import Page

from sitegen.bench.pages import until
from tests.browser.conftest import Reader

# How many figures are alive when the page's script hands itself out, before any other task, at the first frame, and in
# the end; and when that is.
WATCH = """() => {
  const shifts = window.shifts = [];
  new PerformanceObserver(list => shifts.push(...list.getEntries().map(each => each.value)))
    .observe({type: 'layout-shift', buffered: true});
  let ladder;
  Object.defineProperty(globalThis, 'Ladder', {
    configurable: true,
    get: () => ladder,
    set(made) {
      ladder = made;
      window.came = {before: made.figures.size};
      queueMicrotask(() => queueMicrotask(() => { came.atOnce = made.figures.size; }));
      requestAnimationFrame(() => { came.atFrame = made.figures.size; });
      made.alive.then(() => Object.assign(came, {alive: made.figures.size, at: performance.now()}));
    },
  });
}"""


def came(page: Page) -> dict[str, Any]:
    """What WATCH has seen, once the figures are alive and the page has been painted."""
    until(page, "globalThis.came?.at && performance.getEntriesByName('first-contentful-paint').length")
    return page.evaluate("came")  # type: ignore[no-any-return]


@pytest.mark.parametrize("path", ["kabsch.html", "race.html"])
def test_a_page_is_painted_before_its_figures_come_alive(reader: Callable[..., Reader], path: str) -> None:
    one = reader()
    page = one.page()
    page.add_init_script(f"({WATCH})()")
    page.goto(f"{one.origin}/{path}")
    seen = came(page)
    assert (seen["before"], seen["atOnce"], seen["atFrame"]) == (0, 0, 0)
    assert page.evaluate("performance.getEntriesByName('first-contentful-paint')[0].startTime") < seen["at"]
    assert seen["alive"] == page.locator("figure.figure:has(> script.figure-record)").count() > 0
    page.evaluate("document.fonts.ready")
    assert page.evaluate("shifts") == []


@pytest.mark.parametrize("path", ["kabsch.html#fig-mirror", "slides-kabsch.html"])
def test_figures_that_are_asked_for_come_alive_at_once(reader: Callable[..., Reader], path: str) -> None:
    one = reader()
    page = one.page()
    page.add_init_script(f"({WATCH})()")
    page.goto(f"{one.origin}/{path}")
    seen = came(page)
    assert seen["atOnce"] == seen["alive"] > 0
