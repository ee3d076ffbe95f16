"""The start of the runtime, side by side with stock Pyodide and numpy in one browser: same server, same policy.

For cold starts, both run in a module worker of a fresh browser context with empty caches; ours ends when solvers and
widgets are imported too, the stock one at the end of `import numpy`. They take turns, because the load varies. Later
visits are measured for ours only, in a persistent browser profile.
"""

from __future__ import annotations

import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from playwright.sync_api import BrowserContext, Playwright, sync_playwright

from sitegen.assets.hosting import POLICY, immutable
from sitegen.cache.files import cache_dir
from sitegen.check.browsers import FLAGS
from sitegen.external.fetch import gather
from sitegen.runtime.assemble import RuntimeInfo
from sitegen.serve.static_files import serving

HERE = Path(__file__).parent
WORKER = HERE.parents[1] / "templates" / "assets" / "worker.mjs"
TIMEOUT = 120_000
TIMES = 5  # of cold starts in pairs, and of later visits
STAY = 2_000.0  # ms that Python stays up on later visits: browsers store compiled code with a delay

_RUN = """([worker, message, timeout, stay]) => new Promise((resolve, reject) => {
  const began = performance.now();
  const running = new Worker(worker, { type: "module" });
  const late = setTimeout(() => reject(new Error("no answer")), timeout);
  running.onerror = (event) => reject(new Error(event.message));
  running.onmessage = ({ data }) => {
    if (data.type === "failed") reject(new Error(data.message));
    if (data.type !== "ready") return;
    clearTimeout(late);
    const took = performance.now() - began;
    setTimeout(() => (running.terminate(), resolve(took)), stay);
  };
  running.postMessage(message);
})"""


@contextmanager
def _serve(info: RuntimeInfo) -> Iterator[tuple[Playwright, str, dict[str, Any], dict[str, Any]]]:
    """Playwright, the address of a folder with both runtimes, and the start messages of the stock worker and of
    ours."""
    with tempfile.TemporaryDirectory(prefix="ladder-bench-") as temporary, sync_playwright() as playwright:
        root = Path(temporary)
        info.write(root / "runtime")
        shutil.copyfile(WORKER, root / "worker.mjs")
        shutil.copyfile(HERE / "stock.mjs", root / "stock.mjs")
        (root / "stock").mkdir()
        for path in gather(["numpy", "pyodide"], cache=cache_dir()).values():
            shutil.copyfile(path, root / "stock" / path.name)
        (root / "index.html").write_text("<!doctype html><title>bench</title><link rel=icon href=data:,>", "utf-8")
        # These files are named by their content, so the browser caches them like those of the site.
        (root / "_headers").write_text(f"/*\n  Content-Security-Policy: {POLICY}\n{immutable('runtime/')}", "utf-8")
        with serving(root) as server:
            origin = server.origin + "/"
            stock = {"folder": origin + "stock/", "code": "import numpy"}
            ours = {"type": "start", "runtime": origin + "runtime/", "files": info.start_files()}
            yield playwright, origin, stock, ours


def measure_start(info: RuntimeInfo, chromium: Path) -> list[tuple[float, float]]:
    """Pairs of cold starts in milliseconds, (stock, ours), after a first pair that is discarded."""
    with _serve(info) as (playwright, origin, stock, ours):
        browser = playwright.chromium.launch(executable_path=chromium, args=FLAGS)

        def cold(worker: str, message: dict[str, Any]) -> float:
            context = browser.new_context()
            try:
                return _start(context, origin, worker, message)
            finally:
                context.close()

        pairs = [(cold("stock.mjs", stock), cold("worker.mjs", ours)) for _ in range(TIMES + 1)][1:]
        browser.close()
    return pairs


def measure_later(info: RuntimeInfo, chromium: Path) -> list[float]:
    """A returning reader's starts in milliseconds. Three visits are discarded: the first, and two on which the browser
    stores its compiled code."""
    with _serve(info) as (playwright, origin, _, ours), tempfile.TemporaryDirectory(prefix="ladder-bench-") as profile:
        context = playwright.chromium.launch_persistent_context(profile, executable_path=chromium, args=FLAGS)
        times = [_start(context, origin, "worker.mjs", {**ours, "known": k > 0}, STAY) for k in range(TIMES + 3)]
        context.close()
    return times[3:]


def _start(context: BrowserContext, origin: str, worker: str, message: dict[str, Any], stay: float = 0.0) -> float:
    page = context.new_page()
    page.goto(origin)
    milliseconds = float(page.evaluate(_RUN, [worker, message, TIMEOUT, stay]))
    page.close()
    return milliseconds
