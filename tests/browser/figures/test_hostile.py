"""Input from an address or from storage is data: it never becomes markup and never breaks the page."""

from __future__ import annotations

import json
import re
import threading
from collections.abc import Callable
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any, ClassVar

import pytest
from playwright.sync_api import Browser, Page, expect

from tests.browser.conftest import Reader
from tests.browser.figure import Figure, link_of
from tests.browser.server import SiteServer

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


def records() -> list[Any]:
    """Hostile records: each of their parts in turn has an invalid value."""
    sound = {"widget": "kabsch", "preset": "noisy", "controls": {}, "seed": 7, "log": []}
    result: list[Any] = [*MARKUP, *ODD, json.loads('{"widget": "kabsch", "__proto__": {"polluted": 1}}')]
    for bad in (*MARKUP[:3], *ODD):
        result += [{**sound, "preset": bad}, {**sound, "seed": bad}, {**sound, "log": bad}, {**sound, "controls": bad}]
        result += [{**sound, "controls": {"noise": bad}}, {**sound, "log": [["press", bad]]}]
        result.append({**sound, "log": [["drag", bad, bad, bad]]})
        if isinstance(bad, str):
            result.append({**sound, "controls": {bad: bad}})
    return result


def check_unharmed(page: Page) -> None:
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
        [f"fig-solve?s={link_of(record)}" for record in records()]
        + [f"fig-solve?s=x{i}{text}" for i, text in enumerate(MARKUP)]
        + [f"{i}{text}" for i, text in enumerate(MARKUP)]
        + [f"fig-{i}{text}?s={text}" for i, text in enumerate(MARKUP)],
    )
    solve.settled()
    check_unharmed(page)
    for text in MARKUP[:2]:
        page.goto(f"{page.url.split('#')[0]}?q={text}#fig-solve?s={text}")
        check_unharmed(page)
    solve = Figure(page, "fig-solve").live().settled()
    solve.button("reset").click()
    before = solve.readout("rms")
    solve.button("solve").click()
    solve.changes("rms", before)


def test_no_storage_becomes_markup(reader: Callable[..., Reader]) -> None:
    """Pins and themes written by others: an invalid pin is skipped, the rest is text, and the page is live."""
    page = reader(reduced_motion="reduce").open("kabsch.html")
    Figure(page, "fig-solve").seen().reached("[data-pin]").click()
    sound = page.evaluate(
        "JSON.parse(localStorage.getItem(Object.keys(localStorage).find(name => name.startsWith('ladder-pins:'))))[0]"
    )
    hostile: list[Any] = [
        {**sound, "readouts": [{**r, "value": text} for r in sound["readouts"]]} for text in MARKUP
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
    check_unharmed(page)
    for text in ('{"half', "{}"):
        page.evaluate(
            "kept => Object.keys(localStorage).forEach(name => localStorage.setItem(name, kept))",
            text,
        )
        page.reload()
        expect(page.locator("html")).to_have_attribute("data-runtime", re.compile("idle|loading|live"))
        expect(rows).to_have_count(0)


@pytest.mark.parametrize("fragment", ["%", "%E0%A4%A", "2?s=%", "fig-solve?s=%FF"])
def test_a_fragment_that_cannot_be_decoded_leaves_the_deck_alive(
    reader: Callable[..., Reader], fragment: str
) -> None:
    """The deck counts its slides and moves, and its figure answers."""
    page = reader(reduced_motion="reduce").open(f"slides-kabsch.html#{fragment}")
    expect(page.locator(".deck-at")).to_have_text(re.compile(r"^\d+ of \d+$"))
    page.keyboard.press("End")
    expect(page.locator(".deck-at")).to_have_text(re.compile(r"^(\d+) of \1$"))
    Figure(page, "fig-solve").live()
    page.evaluate("location.hash = '#%'")
    page.keyboard.press("Home")
    expect(page.locator(".deck-at")).to_have_text(re.compile("^1 of"))


@pytest.mark.parametrize("width", [1280, 390])
def test_words_from_outside_are_clipped_in_the_status(reader: Callable[..., Reader], width: int) -> None:
    """With a link of 143 kB that names thousands of settings, the status and its announcement stay short."""
    page = reader(width, reduced_motion="reduce").open("kabsch.html")
    record = {"widget": "kabsch", "controls": {f"{i} {'setting' * 5}": 1 for i in range(2300)}, "seed": 7, "log": []}
    link = link_of(record)
    assert 135_000 < len(link) < 190_000
    page.evaluate("link => { location.hash = `fig-solve?s=${link}`; }", link)
    solve = Figure(page, "fig-solve")
    expect(solve.root.locator(".status-words")).to_contain_text("Ignored in the state")
    box = solve.root.locator(".figure-status").bounding_box()
    assert box is not None
    assert box["height"] < 250
    assert len(solve.root.locator(".figure-voice").inner_text()) < 400


# Every way for a worker to use the network, each for an address of another origin; resolves to their outcomes.
REACHES = """async (other) => {
  const heard = (thing) => new Promise((done) => {
    thing.onload = thing.onopen = () => done("reached");
    thing.onerror = () => done("stopped");
  });
  const said = (promise) => promise.then(() => "reached", () => "stopped");
  const tries = {
    fetch: () => said(fetch(`${other}/fetch`, { mode: "no-cors" })),
    import: () => said(import(`${other}/import.mjs`)),
    evaluated: () => said(eval(`import("${other}/evaluated.mjs")`)),
    request: () => {
      const asked = new XMLHttpRequest();
      asked.open("GET", `${other}/request`);
      asked.send();
      return heard(asked);
    },
    socket: () => heard(new WebSocket(`${other.replace("http", "ws")}/socket`)),
    events: () => heard(new EventSource(`${other}/events`)),
  };
  const found = {};
  for (const [name, ask] of Object.entries(tries)) {
    try { found[name] = await ask(); } catch { found[name] = "stopped"; }
  }
  return found;
}"""


class Listener(BaseHTTPRequestHandler):
    """Another origin, which records its requests."""

    paths: ClassVar[list[str]] = []

    def do_GET(self) -> None:
        self.paths.append(self.path)
        self.send_response(200)
        self.send_header("Access-Control-Allow-Origin", "*")
        self.send_header("Content-Type", "text/javascript")
        self.end_headers()

    def log_message(self, format: str, *args: Any) -> None:
        """Log nothing."""


@pytest.mark.parametrize("bare", [False, True])
def test_the_worker_reaches_no_other_origin(browser: Browser, server: SiteServer, bare: bool) -> None:
    """By no means, even on a host that sends no headers: the page's policy applies to its worker as well."""
    stranger = ThreadingHTTPServer(("127.0.0.1", 0), Listener)
    threading.Thread(target=stranger.serve_forever, daemon=True).start()
    server.bare = bare
    Listener.paths.clear()
    with browser.new_context() as context:
        page = context.new_page()
        page.goto(f"{server.origin}/kabsch.html")
        Figure(page, "fig-solve").live()
        (worker,) = page.workers
        result = worker.evaluate(REACHES, f"http://127.0.0.1:{stranger.server_port}")
    stranger.shutdown()
    stranger.server_close()
    assert (set(result.values()), Listener.paths) == ({"stopped"}, [])
    assert set(result) == {"fetch", "import", "evaluated", "request", "socket", "events"}
