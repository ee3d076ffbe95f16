"""`serve --offline-check`: after one visit the server stops; then every page must open and every figure answer live."""

from __future__ import annotations

import sys
from collections.abc import Collection, Iterator
from pathlib import Path

from playwright.sync_api import Browser, BrowserContext, Error, Page, sync_playwright

from sitegen.check.browsers import FLAGS, BrowserMissing, chromium
from sitegen.pipeline.attempt import attempt, tell
from sitegen.problems import first_line
from sitegen.progress import reporting
from sitegen.serve.static_files import serving

KEPT_MS = 180_000  # to store the whole site, from loopback, on a busy machine
PATIENCE_MS = 60_000
NOT_KEPT = ("404.html",)  # the host's answer for addresses that do not exist


def offline_check(root: Path, browser_path: Path | None) -> int:
    """Build site/ and check it without its server, printing one line per page. The exit code is 1 if one fails."""
    with reporting() as progress:
        outcome = attempt(root, root / "site", progress=progress)
    tell(outcome, root / "site")
    if not outcome.good:
        return 1
    try:
        browser = chromium(browser_path)
    except BrowserMissing as error:
        print(error, file=sys.stderr)
        return 1
    faults = 0
    with sync_playwright() as playwright:
        running = playwright.chromium.launch(executable_path=browser, args=FLAGS)
        for name, figures, fault in visits(root / "site", running):
            print(f"{name}: {fault or f'opens, {figures} figures answer'}", flush=True)
            faults += bool(fault)
        running.close()
    print(f"{faults} pages fail without the server" if faults else "everything works without the server", flush=True)
    return 1 if faults else 0


def visits(site: Path, browser: Browser, only: Collection[str] = ()) -> Iterator[tuple[str, int, str]]:
    """Visit the first page, stop the server, open every page: its name, how many figures answered, what is wrong.

    only: the pages to open; all if empty.
    """
    context = browser.new_context(reduced_motion="reduce")
    try:
        with serving(site) as server:
            if fault := kept_fault(context, f"{server.origin}/index.html"):
                yield "index.html", 0, fault
                return
        forget(context)
        for path in sorted(site.rglob("*.html")):
            name = path.relative_to(site).as_posix()
            if name not in NOT_KEPT and (not only or name in only):
                yield (name, *answers(context, f"{server.origin}/{name}"))
    finally:
        context.close()


def kept_fault(context: BrowserContext, address: str) -> str:
    """Open a page and wait until it says that the site is stored; why it does not, or ""."""
    page = context.new_page()
    try:
        page.goto(address)
        page.wait_for_selector(".site-kept:not(:empty)", timeout=KEPT_MS, state="attached")
    except Error as error:
        return f"the site is not stored: {first_line(error)}"
    finally:
        page.close()
    return ""


def forget(context: BrowserContext) -> None:
    """Empty the browser's own cache, which would hide what the service worker has not stored."""
    page = context.new_page()
    context.new_cdp_session(page).send("Network.clearBrowserCache")
    page.close()


def answers(context: BrowserContext, address: str) -> tuple[int, str]:
    """Open a page and reset each figure to its first state: how many answered live, and what is wrong."""
    page, live = context.new_page(), 0
    page.set_default_timeout(PATIENCE_MS)
    try:
        page.goto(address)
        page.wait_for_selector("h1")
        for figure in page.locator("figure.figure").all():
            figure.scroll_into_view_if_needed()
            page.wait_for_selector(":is([data-runtime=live], [data-runtime=failed])")
            if fault := page.evaluate("Ladder.runtime.message"):
                return live, fault
            ask(page, figure.get_attribute("id") or "")
            live += 1
    except Error as error:
        return live, first_line(error)
    finally:
        page.close()
    return live, ""


def ask(page: Page, name: str) -> None:
    """Reset a figure to its first state and wait until Python has drawn it."""
    frame = page.evaluate(
        "name => { const figure = Ladder.figures.get(name), { frame = '' } = figure.root.dataset;"
        " figure.reset(); return frame; }",
        name,
    )
    page.wait_for_selector(f'#{name}[data-state=live][data-frame]:not([data-frame="{frame}"])')
