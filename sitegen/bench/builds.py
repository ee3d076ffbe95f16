"""Speed for authors, and sizes: clean builds, the time from an edit to the page that shows it, bytes."""

from __future__ import annotations

import shutil
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path
from statistics import median

from sitegen.bench.model import Bench, Row
from sitegen.bench.pages import browser_of, live, visit
from sitegen.bench.starts import measure_later, measure_start
from sitegen.cache.files import cache_dir
from sitegen.check.html import read_pages
from sitegen.check.sizes import PAGE_LIMIT, heaviest, page_weight, runtime_weight
from sitegen.runtime.assemble import assemble
from sitegen.serve.live import WATCHED, LiveSite

EDITS = 7
RUNTIME_MB = 6.0  # target for the files that a start loads
SHOWS = "text => document.body.textContent.includes(text)"
RUNTIME_CACHES = ("outside", "compiled", "wheel", "runtime")  # what a first build fetches and compiles for browsers


def sizes(bench: Bench) -> list[Row]:
    """The heaviest page with everything that it loads, and the runtime, by gzip -9."""
    pages = read_pages(bench.site).values()
    page, runtime = (heaviest(map(weight, pages)) for weight in (page_weight, runtime_weight))
    return [
        Row("heaviest page, compressed, without tapes", page.total / 1e3, "kB", PAGE_LIMIT / 1e3, page.page),
        Row("runtime, compressed", runtime.total / 1e6, "MB", RUNTIME_MB, f"{len(runtime.parts)} files"),
    ]


def start(bench: Bench) -> list[Row]:
    """The time until Python is up and our packages are imported, against stock Pyodide and numpy in the same
    browser."""
    info = assemble()
    pairs, later = measure_start(info, bench.chromium), measure_later(info, bench.chromium)
    rounds = f"median of {len(pairs)} pairs of cold starts"
    stock_ms = median(stock for stock, _ in pairs)
    stock = f"that of stock Pyodide with numpy {stock_ms:.0f} ms"
    note = f"{median(later):.0f} ms, median of {len(later)}"
    return [
        Row("runtime start against stock Pyodide with numpy", median(b / a for a, b in pairs), "", 0.25, rounds),
        Row("runtime start, cold", median(ours for _, ours in pairs), "ms", None, stock),
        Row("runtime start, on a later visit, against the same", median(later) / stock_ms, "", 0.15, note),
    ]


def build_times(bench: Bench) -> list[Row]:
    """Times of a clean build with the runtime cached, of the same again, and from saving a chapter to the page with
    it."""
    with tempfile.TemporaryDirectory(prefix="ladder-bench-") as folder:
        directory = Path(folder)
        cache, copy = directory / "cache", directory / "checkout"
        for name in RUNTIME_CACHES:
            if (cache_dir() / name).is_dir():
                shutil.copytree(cache_dir() / name, cache / name)
        _copy_sources(bench.root, copy)
        times = [_build_once(copy, cache) for _ in range(2)]
        reloads = _edits(bench, copy)
    return [
        Row("clean build, runtime cached", times[0], "s", 40),
        Row("build again, nothing changed", times[1], "s"),
        Row("a chapter saved to its page", median(reloads), "s", 0.5, f"worst of {EDITS}: {max(reloads):.2f} s"),
    ]


def _copy_sources(root: Path, copy: Path) -> None:
    """Copy everything that a build reads, so that the bench does not edit the checkout's own chapters."""
    copy.mkdir()
    for name in (*WATCHED, "pyproject.toml", "README.md", "LICENSE"):
        if (root / name).is_dir():
            shutil.copytree(root / name, copy / name, ignore=shutil.ignore_patterns("__pycache__"))
        elif (root / name).is_file():
            shutil.copy(root / name, copy)


def _build_once(copy: Path, cache: Path) -> float:
    """Seconds of one build in its own process, from start to end."""
    asks = (
        "from pathlib import Path; from sitegen.pipeline.build import build; import sys; "
        "build(Path(sys.argv[1]), Path(sys.argv[1]) / 'site', cache=Path(sys.argv[2]))"
    )
    began = time.perf_counter()
    subprocess.run([sys.executable, "-c", asks, str(copy), str(cache)], cwd=copy, check=True)
    return time.perf_counter() - began


def _edits(bench: Bench, copy: Path) -> list[float]:
    """Seconds from saving an edit until the open page shows it, for several edits in a row."""
    chapter = sorted((copy / "content").glob("*.md"))[0]
    text = chapter.read_text("utf-8")
    site = LiveSite(copy, copy / "site")
    watcher = threading.Thread(target=site.watch)
    seconds = []
    try:
        site.rebuild()
        watcher.start()
        with browser_of(bench) as browser, visit(browser, f"{site.server.origin}/index.html") as page:
            for i in range(EDITS):
                live(page)  # edits are measured on a page at rest
                site.idle.wait()
                began = time.perf_counter()
                chapter.write_text(f"{text}\n\nAn edit, number {i}.\n", "utf-8")
                # Polled every 10 ms; a locator would retry only every half second.
                page.wait_for_function(SHOWS, arg=f"An edit, number {i}.", polling=10)
                seconds.append(time.perf_counter() - began)
    finally:
        site.stop()
        if watcher.ident:
            watcher.join()
        site.close()
    return seconds
