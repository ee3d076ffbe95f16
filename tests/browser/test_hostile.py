"""What comes from an address or from storage is data: never markup, never the end of the page."""

from __future__ import annotations

import base64
import json
import re
from collections.abc import Callable
from typing import Any

from playwright.sync_api import Page, expect

from tests.browser.conftest import Reader
from tests.browser.figures import Figure

MARKUP = (
    '<img src=x onerror="window.struck = 1">',
    '"><script>window.struck = 1</script>',
    "<svg onload=window.struck=1>",
    "javascript:window.struck=1",
    "</script><script>window.struck=1</script>",
    "<iframe srcdoc='<script>parent.struck=1</script>'>",
    "__proto__",
    "constructor",
    "\u202e\u0000\ufeff½" * 40,
)
ODD: tuple[Any, ...] = (None, True, -1, 1e308, 2**53, "", "NaN", [], {}, [[]], {"a": {"b": []}})

STRUCK = """() => [
  window.struck,
  document.querySelectorAll('iframe, embed, object, img[onerror], svg[onload], main script:not([type])').length,
  Object.prototype.polluted,
]"""


def state(record: Any) -> str:
    """A record as a link carries it."""
    return base64.urlsafe_b64encode(json.dumps(record).encode()).decode().rstrip("=")


def records() -> list[Any]:
    """Hostile records: each of their parts in turn is something that it may not be."""
    sound = {"widget": "kabsch", "preset": "noisy", "controls": {}, "seed": 7, "log": []}
    made: list[Any] = [*MARKUP, *ODD, json.loads('{"widget": "kabsch", "__proto__": {"polluted": 1}}')]
    for bad in (*MARKUP[:3], *ODD):
        made += [{**sound, "preset": bad}, {**sound, "seed": bad}, {**sound, "log": bad}, {**sound, "controls": bad}]
        made += [{**sound, "controls": {"noise": bad}}, {**sound, "log": [["press", bad]]}]
        made.append({**sound, "log": [["drag", bad, bad, bad]]})
        if isinstance(bad, str):
            made.append({**sound, "controls": {bad: bad}})
    return made


def unharmed(page: Page) -> None:
    struck, foreign, polluted = page.evaluate(STRUCK)
    assert (struck, foreign, polluted) == (None, 0, None)


def test_no_address_becomes_markup(reader: Callable[..., Reader]) -> None:
    """Hundreds of hostile fragments and states, one after the other, on a live page; then the figure still answers."""
    page = reader(reduced_motion="reduce").open("kabsch.html")
    solve = Figure(page, "fig-solve").live().settled()
    page.evaluate(
        """async fragments => {
          for (const fragment of fragments) {
            location.hash = fragment;
            await new Promise(done => addEventListener('hashchange', done, { once: true }));
          }
        }""",
        [f"fig-solve?s={state(record)}" for record in records()]
        + [f"fig-solve?s=x{i}{text}" for i, text in enumerate(MARKUP)]
        + [f"{i}{text}" for i, text in enumerate(MARKUP)]
        + [f"fig-{i}{text}?s={text}" for i, text in enumerate(MARKUP)],
    )
    solve.settled()
    unharmed(page)
    for text in MARKUP[:2]:
        page.goto(f"{page.url.split('#')[0]}?q={text}#fig-solve?s={text}")
        unharmed(page)
    solve = Figure(page, "fig-solve").live().settled()
    solve.button("reset").click()
    before = solve.readout("rms")
    solve.button("solve").click()
    solve.changes("rms", before)


def test_no_storage_becomes_markup(reader: Callable[..., Reader]) -> None:
    """Pins and themes that somebody else wrote: what is no pin is passed over, the rest is text, the page is alive."""
    page = reader(reduced_motion="reduce").open("kabsch.html")
    Figure(page, "fig-solve").seen().root.locator("[data-pin]").click()
    sound = page.evaluate(
        "JSON.parse(localStorage.getItem(Object.keys(localStorage).find(name => name.startsWith('ladder-pins:'))))[0]"
    )
    hostile: list[Any] = [
        {**sound, "readouts": [{**each, "value": text} for each in sound["readouts"]]} for text in MARKUP
    ]
    count = len(hostile)
    hostile += [{**sound, "readouts": bad} for bad in ODD if not isinstance(bad, list)]
    hostile += [{**sound, "record": bad} for bad in ODD]
    hostile += [{**sound, "record": {**sound["record"], "log": [bad]}} for bad in ODD]
    hostile += [*ODD, *MARKUP]
    page.evaluate(
        """pins => {
          const key = Object.keys(localStorage).find(name => name.startsWith('ladder-pins:'));
          localStorage.setItem(key, JSON.stringify(pins));
          localStorage.setItem('ladder-theme', '"><img src=x onerror=window.struck=1>');
        }""",
        hostile[-50 + count :] + hostile[:count],
    )
    page.reload()
    solve = Figure(page, "fig-solve").live()
    rows = solve.root.locator(".runs tbody tr")
    expect(rows).to_have_count(count)
    expect(rows.first).to_contain_text(MARKUP[0])
    assert page.locator("html").get_attribute("data-theme") == "auto"
    unharmed(page)
    for kept in ('{"half', "{}"):
        page.evaluate(
            "kept => Object.keys(localStorage).forEach(name => localStorage.setItem(name, kept))",
            kept,
        )
        page.reload()
        expect(page.locator("html")).to_have_attribute("data-runtime", re.compile("idle|loading|live"))
        expect(rows).to_have_count(0)
