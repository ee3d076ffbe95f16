"""A random walk of real clicks on every page with a figure: nothing breaks, and the state is in the link.

--walk-steps=100 --walk-seed=7 takes a longer one; --walk-pages=icp.html,race.html limits it to these pages.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import Page

from sitegen.bench.pages import IDLE, until
from tests.browser.conftest import Reader, keep_python_up
from tests.browser.walk import SEEN, Walk
from widgets.engine.host import Host

pytestmark = pytest.mark.browser
STEPS, SEED = 6, 1  # per page


def test_whatever_a_reader_does_the_state_is_in_the_link(
    reader: Callable[..., Reader], site: Path, pages: list[str], pytestconfig: pytest.Config
) -> None:
    """After every few steps the browser has no complaints, no number is NaN, and the inputs, readouts, words, handles
    and picture are those of a single frame. At the end the record in each figure's link gives the same bytes: natively
    and, on the first page or on every page of a longer walk, in a separate browser window."""
    count, seed = pytestconfig.getoption("walk_steps"), pytestconfig.getoption("walk_seed") or SEED
    option = pytestconfig.getoption("walk_pages")
    names = option.split(",") if option else [p for p in pages if "data-widget=" in (site / p).read_text("utf-8")]
    assert names
    visitor, host = reader(permissions=["clipboard-read", "clipboard-write"]), Host()
    keep_python_up(visitor.context, visitor.origin)
    visitor.beside = visitor.context.pages
    for name in names:
        page = visitor.open(name)
        walk = Walk(visitor, page, f"{seed} {name}")
        try:
            walk.steps(count or STEPS)
            draw_natively(page, host)
            if count or name == names[0]:
                open_links(page)
        except AssertionError as error:
            options = f"--walk-pages={name} --walk-seed={seed} --walk-steps={count or STEPS}"
            raise AssertionError(f"{options}: {error}") from error
        page.close()


# A figure's link, the record that the page itself reads from it, and which parts of that record it would ignore.
LINK = """id => {
  const figure = Ladder.figures.get(id);
  const { record: records, sound } = Ladder;
  const url = figure.link();
  const data = url.split("?s=")[1].split("&more")[0];
  const { record, ignored } = sound(records.decode(data, figure.initial), figure.initial, figure.spec);
  return { url, record, ignored, key: records.key(record), same: records.key(figure.shown) === records.key(record) };
}"""
MARKUP = """svgs => {
  const template = document.createElement("template");
  return svgs.map((svg) => ((template.innerHTML = svg), template.innerHTML));
}"""


def links(page: Page) -> dict[str, Any]:
    """Each figure's link, checked to hold the figure's whole state."""
    results = {name: page.evaluate(LINK, name) for name in page.evaluate("[...Ladder.figures.keys()]")}
    for name, link in results.items():
        assert link["same"], f"{name}: its link {link['url']} is read as {link['record']}"
        assert link["ignored"] == [], f"{name}: of its link {link['url']}, {link['ignored']} is ignored"
    return results


def draw_natively(page: Page, host: Host) -> None:
    """The build's Python draws the page's bytes, except for a reader's own clouds, which it does not have."""
    until(page, "[...Ladder.figures.values()].every(f => !f.pending && !(f.running && f.visible))")  # playback goes on
    for name, link in links(page).items():
        if "given" not in link["record"]:
            frame, picture = host.render(name, link["record"]), page.evaluate(SEEN, name)
            markup = page.evaluate(MARKUP, [panel["svg"] for panel in frame["panels"]])
            assert picture["svg"] == markup, f"{name}: natively its link {link['url']} is drawn otherwise"
            assert picture["readouts"] == [readout["value"] for readout in frame["readouts"]], f"{name}: {link['url']}"


def open_links(page: Page) -> None:
    """Each figure's link, opened in another window, shows what the page shows. Figures of a reader's own clouds, which
    no link contains, are drawn again by a restarted worker instead."""
    fresh = page.context.new_page()
    brought = []
    for name, link in links(page).items():
        if "given" in link["record"]:
            brought.append(name)
            continue
        if fresh.url == "about:blank":
            fresh.goto(link["url"])
        else:
            fresh.evaluate("hash => { location.hash = hash; }", link["url"].split("#")[1])
        condition = f"Ladder.record.key(Ladder.figures.get({name!r}).shown) === {json.dumps(link['key'])}"
        until(fresh, f"{IDLE} && {condition}")
        assert fresh.evaluate(SEEN, name) == page.evaluate(SEEN, name), f"{name}: {link['url']} shows something else"
    fresh.close()
    if brought:
        page.evaluate("Ladder.runtime.restart()")
        page.locator("html[data-runtime=live]").wait_for()
    for name in brought:
        frame = page.evaluate("id => Ladder.runtime.frame({ figure: id, record: Ladder.figures.get(id).shown })", name)
        markup = page.evaluate(MARKUP, [panel["svg"] for panel in frame["panels"]])
        assert page.evaluate(SEEN, name)["svg"] == markup, f"{name}: a worker started anew draws otherwise"
