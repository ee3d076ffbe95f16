"""After the first visit: the server may be gone, a new build may come, the browser may store nothing."""

from __future__ import annotations

import gzip
import hashlib
import shutil
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import Browser, Error, Page, expect

from sitegen.cache.files import short_hash
from sitegen.check import offline
from sitegen.pipeline.build import build
from sitegen.pipeline.context import STANDARD
from sitegen.runtime import assemble as runtime
from tests.browser.conftest import ROOT, Reader
from tests.browser.figure import Figure
from tests.browser.server import SiteServer

GONE = ("ERR_CONNECTION_REFUSED", "Failed to fetch", "fetching the script", "Failed to find a valid digest")
KEPT = ".site-kept:not(:empty)"
# Resolves when a new version is stored and waits for the old version's pages to close.
WAITING = """navigator.serviceWorker.getRegistration().then(registration => new Promise(done => {
  const look = () => registration.waiting && done();
  const watch = () => { registration.installing?.addEventListener('statechange', look); look(); };
  registration.addEventListener('updatefound', watch);
  watch();
}))"""


def until_cached(page: Page) -> None:
    """Wait until the page says that the site is stored."""
    page.wait_for_selector(KEPT, state="attached", timeout=120_000)


@contextmanager
def until_switched(blank: Page) -> Iterator[None]:
    """Afterwards, wait until the version that waits now has taken over; the blank page is no client of either.

    Chromium never answers a navigation that begins while it stops the old version's worker.
    """
    session = blank.context.new_cdp_session(blank)
    states: dict[str, str] = {}

    def note(event: dict[str, Any]) -> None:
        states.update((version["versionId"], version["status"]) for version in event["versions"])
        blank.evaluate("states => { globalThis.states = states; }", states)

    session.on("ServiceWorker.workerVersionUpdated", note)
    session.send("ServiceWorker.enable")
    (waiting,) = blank.wait_for_function(
        "() => { const all = Object.entries(globalThis.states ?? {}).filter(([, state]) => state === 'installed');"
        " return all.length && all.map(([id]) => id); }"
    ).json_value()
    yield
    blank.wait_for_function("id => states[id] === 'activated'", arg=waiting)


def built_by(page: Page) -> str:
    """The build that the page's text is from, checked against the script and style that it runs with."""
    assert page.evaluate("version") == page.evaluate(
        "getComputedStyle(document.documentElement).getPropertyValue('--version').trim()"
    )
    text: str = page.locator(".version").inner_text()
    assert text == page.evaluate("version")
    return text


def answers(page: Page) -> None:
    """Check that Python draws the first figure of an open page."""
    name = page.locator("figure.figure").first.get_attribute("id") or ""
    Figure(page, name).live()
    offline.ask(page, name)


def other_python(**options: Any) -> runtime.RuntimeInfo:
    """The runtime with our wheel compressed differently: equivalent, under another name."""
    info = runtime.assemble(**options)
    (old,) = [file for file in info.files if file.name.endswith("/ladder.pack")]
    data = gzip.compress(gzip.decompress(info.contents[old.name]), 5, mtime=0)
    name = f"{short_hash(data)}/ladder.pack"
    new = replace(old, name=name, size=len(data), sha256=hashlib.sha256(data).hexdigest(), gzipped=len(data))
    contents = {**{path: content for path, content in info.contents.items() if path != old.name}, name: data}
    return replace(info, files=tuple(new if file is old else file for file in info.files), contents=contents)


@pytest.fixture(scope="module")
def builds(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """Two builds whose pages, scripts, styles and Python all differ, and that name themselves."""
    home = tmp_path_factory.mktemp("builds")
    sites = {}
    for name, assemble in (("A", runtime.assemble), ("B", other_python)):
        root = home / name
        for part in ("content", "templates", "tests", "solvers", "widgets"):
            shutil.copytree(ROOT / part, root / part, ignore=shutil.ignore_patterns("__pycache__"))
        assets = root / "templates" / "assets"
        style = f":root {{ --version: {name}; }}\n"
        for file, more in (("js/main.js", f'globalThis.version = "{name}";\n'), ("css/print.css", style)):
            (assets / file).write_text((assets / file).read_text("utf-8") + more, "utf-8")
        base = root / "templates" / "base.html"
        base.write_text(
            base.read_text("utf-8").replace("</footer>", f'<p class="version">{name}</p></footer>'), "utf-8"
        )
        sites[name] = root / "site"
        build(root, sites[name], pack=False, parts=replace(STANDARD, assemble=assemble))
    return sites


def test_a_figure_of_a_page_never_visited_answers_without_the_server(browser: Browser, site: Path) -> None:
    """It uses only what the service worker stores (`serve --offline-check` tests this on every page)."""
    ((name, count, fault),) = offline.visits(site, browser, {"race.html"})
    assert (name, count, fault) == ("race.html", 1, "")


def test_what_is_not_kept_is_told(browser: Browser, site: Path, tmp_path: Path) -> None:
    """The check can fail: a Python file that the worker does not know is reported missing on the page that needs it."""
    copy = shutil.copytree(site, tmp_path / "site", ignore=shutil.ignore_patterns("*.gz", "*.br"))
    worker = copy / "sw.js"
    lines = worker.read_text("utf-8").splitlines(keepends=True)
    worker.write_text("".join(line for line in lines if "/numpy.pack" not in line), "utf-8")
    ((name, count, fault),) = offline.visits(copy, browser, {"kabsch.html"})
    assert (name, count) == ("kabsch.html", 0)
    assert "numpy.pack could not be loaded" in fault


def test_every_page_of_the_site_is_kept(reader: Callable[..., Reader], server: SiteServer, pages: list[str]) -> None:
    """After one visit of the first page, each page opens without the server, with its style and script."""
    visitor = reader(reduced_motion="reduce", service_workers="allow")
    page = visitor.open("index.html")
    until_cached(page)
    expect(page.locator(".site-kept")).to_contain_text("Works offline: stored on this device (")
    server.stop()
    visitor.expect(*GONE)
    for name in pages:
        if name in offline.NOT_KEPT:
            continue
        page.goto(f"{server.origin}/{name}")
        expect(page.locator("h1")).to_be_visible()
        assert page.evaluate("document.styleSheets[0].cssRules.length > 100 && typeof Ladder.offline") == "object"
    page.goto(f"{server.origin}/kabsch.html?from=mail#fig-solve")
    until_cached(page)
    page.goto(f"{server.origin}/")
    expect(page.locator("h1")).to_be_visible()


def test_an_update_never_mixes_two_builds(
    reader: Callable[..., Reader], server: SiteServer, builds: dict[str, Path]
) -> None:
    """A tab open during the update stays with its build, a new one has the new build; also without the server."""
    server.root = builds["A"]
    visitor = reader(reduced_motion="reduce", service_workers="allow")
    old = visitor.open("references.html")
    until_cached(old)

    offline.forget(visitor.context)
    server.asked.clear()
    server.root = builds["B"]
    new = visitor.open("kabsch.html")
    assert built_by(new) == "B"
    Figure(new, "fig-solve").live()
    new.evaluate(WAITING)
    assert not [path for path in server.asked if path.endswith("/numpy.pack")], "what stays the same is kept"

    # The old tab goes on with files that it has not loaded yet: a page of its build, its tape, its Python.
    assert built_by(old) == "A"
    server.stop()
    visitor.expect(*GONE)
    offline.forget(visitor.context)
    old.goto(f"{server.origin}/icp.html")
    assert built_by(old) == "A"
    answers(old)

    # All tabs closed: from now on the new build is used, just as whole.
    with until_switched(visitor.page()):
        old.close()
        new.close()
    page = visitor.open("icp.html")
    assert built_by(page) == "B"
    answers(page)
    until_cached(page)
    names = page.evaluate("caches.keys()")
    assert len(names) == 2, f"the old build's are gone: {names}"


def spoil(page: Page, part: str) -> str:
    """Flip a bit of a stored file; return its address."""
    address: str = page.evaluate(
        """async part => {
          for (const name of await caches.keys()) {
            const cache = await caches.open(name);
            for (const { url } of await cache.keys()) {
              if (!new RegExp(part).test(url)) continue;
              const kept = await cache.match(url);
              const bytes = new Uint8Array(await kept.arrayBuffer());
              bytes[bytes.length >> 1] ^= 1;
              await cache.put(url, new Response(bytes, { headers: kept.headers }));
              return url;
            }
          }
        }""",
        part,
    )
    return address


def test_what_is_lost_is_kept_again(reader: Callable[..., Reader], server: SiteServer) -> None:
    """If the browser drops stored files while the worker stays, the next visit stores them again."""
    visitor = reader(reduced_motion="reduce", service_workers="allow")
    page = visitor.open("references.html")
    until_cached(page)
    names = page.evaluate("caches.keys()")
    count = "caches.open(name).then(cache => cache.keys()).then(keys => keys.length)"
    sizes = [page.evaluate(f"name => {count}", name) for name in names]
    for name in names:
        page.evaluate("name => caches.delete(name)", name)
        page.reload()
        until_cached(page)
        assert [page.evaluate(f"name => {count}", name) for name in names] == sizes
    page.evaluate("name => caches.open(name).then(cache => cache.delete('kabsch.html'))", names[0])
    page.evaluate("name => caches.open(name).then(cache => cache.delete('kabsch.html'))", names[1])
    page.reload()
    until_cached(page)
    server.stop()
    visitor.expect(*GONE)
    page.goto(f"{server.origin}/kabsch.html")
    answers(page)


DAMAGED = (r"/assets/site\.\w+\.js$", "/numpy.pack$", "/pyodide.asm.mjs$", "/pyodide.asm.wasm$", "/icp.html$")


DIGEST = """async url => {
  const bytes = await (await caches.match(url)).arrayBuffer();
  const hash = new Uint8Array(await crypto.subtle.digest('SHA-256', bytes));
  return Array.from(hash, byte => byte.toString(16).padStart(2, '0')).join('');
}"""


def test_a_damaged_file_is_dropped_and_asked_for_anew(reader: Callable[..., Reader], server: SiteServer) -> None:
    """With a damaged file in the cache, the page and its Python still start, and the file is stored again."""
    visitor = reader(reduced_motion="reduce", service_workers="allow")
    page = visitor.open("references.html")
    visitor.expect("Failed to find a valid digest", "wasm", "CompileError")
    for part in DAMAGED:
        page.goto(f"{server.origin}/references.html")
        until_cached(page)
        offline.forget(visitor.context)
        url = spoil(page, part)
        file = server.root / url.removeprefix(f"{server.origin}/")
        right = hashlib.sha256(file.read_bytes()).hexdigest()
        assert page.evaluate(DIGEST, url) != right, part
        page.goto(f"{server.origin}/icp.html")
        Figure(page, page.locator("figure.figure").first.get_attribute("id") or "").seen()
        retry = page.locator("[data-way=Retry]").first
        live = page.locator("html[data-runtime=live]")
        expect(retry.or_(live)).to_be_visible(timeout=60_000)
        if retry.is_visible():
            retry.click()
        answers(page)
        page.reload()
        until_cached(page)
        assert page.evaluate(DIGEST, url) == right, part


def test_a_damaged_file_is_dropped_without_the_rest(reader: Callable[..., Reader], server: SiteServer) -> None:
    """Without a server, the damaged file is missing and everything else is still there."""
    visitor = reader(reduced_motion="reduce", service_workers="allow")
    page = visitor.open("references.html")
    until_cached(page)
    server.stop()
    visitor.expect(*GONE)
    offline.forget(visitor.context)
    spoil(page, "/icp.html")
    tab = visitor.page()
    with pytest.raises(Error, match="ERR_FAILED"):
        tab.goto(f"{server.origin}/icp.html")
    tab.close()
    page.goto(f"{server.origin}/kabsch.html")
    answers(page)


def test_a_host_in_trouble_is_replaced_by_what_is_stored(reader: Callable[..., Reader], server: SiteServer) -> None:
    """Here one that leaves .html out of its addresses. A page comes though its answer does not, or is an error, and
    the page that was open all along goes on without the host."""
    server.extensionless = True
    visitor = reader(reduced_motion="reduce", service_workers="allow")
    visitor.expect(*GONE, "500")
    first = visitor.open("surfaces")
    until_cached(first)
    offline.forget(visitor.context)
    page = visitor.page()
    server.hold("/kabsch")
    page.goto(f"{server.origin}/kabsch")
    expect(page.locator("h1")).to_be_visible()
    server.release()
    server.spoilt = {"icp.html": "broken"}
    answer = page.goto(f"{server.origin}/icp")
    assert answer is not None
    assert answer.status == 200
    server.stop()
    for name in ("ransac", "ransac.html"):
        page.goto(f"{server.origin}/{name}")
        expect(page.locator("h1")).to_be_visible()
    Figure(first, "fig-three").live()
    offline.ask(first, "fig-three")


def test_what_is_forgotten_while_it_is_being_stored_is_not_promised(
    reader: Callable[..., Reader], server: SiteServer
) -> None:
    """Neither here nor to another tab that asks for it at that moment."""
    server.hold("/numpy.pack")
    visitor = reader(reduced_motion="reduce", service_workers="allow")
    page = visitor.open("about.html")
    page.evaluate("navigator.serviceWorker.ready")
    page.wait_for_function("async () => (await caches.keys()).some(name => name.includes(':runtime:'))")
    page.evaluate("""() => {
      const { port1, port2 } = new MessageChannel();
      window.told = new Promise(done => { port1.onmessage = ({ data }) => done(data); });
      navigator.serviceWorker.controller.postMessage({ keep: true }, [port2]);
    }""")
    page.get_by_role("button", name="Forget all of it").click()
    expect(page.locator(".stored")).to_contain_text("Forgotten")
    server.release()
    assert page.evaluate("told") == {"kept": False}
    assert page.evaluate("caches.keys()") == []
    expect(page.locator(".site-kept")).to_be_empty()


REFUSED = """for (const [home, kind] of [[Navigator.prototype, 'serviceWorker'],
  ...['localStorage', 'sessionStorage', 'caches', 'indexedDB'].map(kind => [window, kind])]) {
  Object.defineProperty(home, kind, { get() { HOW } });
}"""
HOWS = {"absent": "return undefined", "forbidden": "throw new DOMException('The operation is insecure.')"}


@pytest.mark.parametrize("way", HOWS)
def test_a_browser_that_keeps_nothing_shows_the_site(reader: Callable[..., Reader], way: str) -> None:
    """Figures answer, pins and the theme last as long as the page, and nothing is said about offline use."""
    visitor = reader(alone=True, reduced_motion="reduce")
    visitor.context.add_init_script(REFUSED.replace("HOW", HOWS[way]))
    page = visitor.open("kabsch.html")
    answers(page)
    solve = Figure(page, "fig-solve")
    solve.reached("[data-pin]").click()
    expect(solve.root.locator(".runs tbody tr")).to_have_count(1)
    page.locator("button.theme").click()
    assert page.locator("html").get_attribute("data-theme") != "auto"
    expect(page.locator(".site-kept")).to_be_empty()


def test_no_room_leaves_nothing_behind_and_the_site_works(reader: Callable[..., Reader], server: SiteServer) -> None:
    """If storage fills up half-way, nothing is stored or promised, and figures answer; with room, all is stored."""
    visitor = reader(reduced_motion="reduce", service_workers="allow")
    visitor.expect("QuotaExceeded")
    page = visitor.page()
    quota = visitor.context.new_cdp_session(page)
    quota.send("Storage.overrideQuotaForOrigin", {"origin": server.origin, "quotaSize": 4_000_000})
    page.goto(f"{server.origin}/kabsch.html")
    answers(page)
    page.evaluate(INSTALL_ENDS)
    assert page.evaluate("caches.keys()") == []
    expect(page.locator(".site-kept")).to_be_empty()
    quota.send("Storage.overrideQuotaForOrigin", {"origin": server.origin})
    page.reload()
    until_cached(page)


# Tries to install the worker once more, and resolves to the outcome.
INSTALL_ENDS = """navigator.serviceWorker.register('sw.js').then(({ installing }) => new Promise(done => {
  if (!installing) done('no attempt');
  installing?.addEventListener('statechange', () => done(installing.state));
}), error => error.message)"""
