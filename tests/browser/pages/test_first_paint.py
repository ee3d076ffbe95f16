"""Reading comes first: blocks far below are laid out, and figures come alive, once the page is painted; or at once, if
something below is requested."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest
from playwright.sync_api import Page

from sitegen.bench.pages import until
from tests.browser.conftest import Reader

# The number of live figures when the page's script exposes itself, before any other task, at the first frame, and at
# the end, with its time; the number of blocks without layout in the first frame and at the end.
WATCH = """() => {
  const unlaid = () => [...document.querySelectorAll('.text > *')]
    .filter(e => getComputedStyle(e).contentVisibility === 'auto').length;
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
      requestAnimationFrame(() => Object.assign(came, {atFrame: made.figures.size, without: unlaid()}));
      made.alive.then(() => Object.assign(came, {alive: made.figures.size, at: performance.now(), left: unlaid()}));
    },
  });
}"""


# The layout shifts so far. A frame's shifts are reported after it.
MOVED = """async () => {
  await document.fonts.ready;
  for (let frame = 0; frame < 2; frame++) await new Promise(requestAnimationFrame);
  await new Promise(done => setTimeout(done));
  return shifts;
}"""


def watch(visitor: Reader, path: str) -> Page:
    """A page opened with WATCH in it."""
    page = visitor.page()
    page.add_init_script(f"({WATCH})()")
    page.goto(f"{visitor.origin}/{path}")
    return page


def observations(page: Page) -> dict[str, Any]:
    """The observations of WATCH, once the figures are alive and the page has been painted."""
    until(page, "globalThis.came?.at && performance.getEntriesByName('first-contentful-paint').length")
    return page.evaluate("came")  # type: ignore[no-any-return]


def painted_first(page: Page) -> bool:
    """Whether the page was painted before its figures came alive."""
    alive = observations(page)["at"]
    painted = page.evaluate("performance.getEntriesByName('first-contentful-paint')[0].startTime")
    return bool(painted < alive)


@pytest.mark.parametrize("path", ["kabsch.html", "race.html"])
def test_a_page_is_painted_before_its_figures_come_alive(reader: Callable[..., Reader], path: str) -> None:
    """On a busy machine a frame may be presented late; figures that do not wait for it come alive first every time."""
    page = watch(reader(), path)
    facts = observations(page)
    assert (facts["before"], facts["atOnce"], facts["atFrame"]) == (0, 0, 0)
    assert facts["alive"] == page.locator("figure.figure:has(> script.figure-record)").count() > 0
    assert facts["without"] > 20
    assert facts["left"] == 0
    loads = 1
    while not painted_first(page):
        assert loads < 3
        page.reload()
        loads += 1


@pytest.mark.parametrize("path", ["kabsch.html", "race.html"])
def test_nothing_moves_as_blocks_are_laid_out_and_figures_come_alive(reader: Callable[..., Reader], path: str) -> None:
    """On a busy machine the first frame may precede a typeface, and text moves when that arrives. Later visits have it
    in the cache, whereas a page that moves its own blocks does so every time."""
    visitor = reader()
    moved: list[list[float]] = []
    while [] not in moved and len(moved) < 5:
        page = watch(visitor, path)
        observations(page)
        moved.append(page.evaluate(MOVED))
    assert [] in moved


def test_a_way_back_and_a_link_into_the_page_find_all_of_it_laid_out(reader: Callable[..., Reader]) -> None:
    """Their places are below blocks that would not have their heights yet. A reloaded page keeps its position."""
    visitor = reader()
    page = watch(visitor, "kabsch.html")
    observations(page)
    top = "document.querySelector('#fig-mirror').getBoundingClientRect().top"
    page.locator("#fig-mirror").scroll_into_view_if_needed()
    before = page.evaluate(top)
    page.reload()
    assert observations(page)["without"] == 0
    until(page, f"Math.abs({top} - {before}) <= 1")
    page.goto(f"{visitor.origin}/index.html")
    page.go_back()
    assert observations(page)["without"] == 0
    until(page, f"Math.abs({top} - {before}) <= 1")
    page.goto(f"{visitor.origin}/index.html")
    page.goto(f"{visitor.origin}/kabsch.html#fig-mirror")
    assert observations(page)["without"] == 0
    until(page, f"{top} >= 0 && {top} < innerHeight / 2")


@pytest.mark.parametrize("path", ["kabsch.html#fig-mirror", "slides-kabsch.html"])
def test_figures_that_are_asked_for_come_alive_at_once(reader: Callable[..., Reader], path: str) -> None:
    page = watch(reader(), path)
    facts = observations(page)
    assert facts["atOnce"] == facts["alive"] > 0
