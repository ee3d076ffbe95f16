"""The cold start of the runtime, side by side with stock Pyodide and numpy in one browser: same server, same policy.

Both run in a module worker of a fresh browser context, so that nothing is in any cache; ours ends when solvers and
widgets are imported as well, the stock one at the end of `import numpy`. They take turns, since load comes and goes.
"""

from __future__ import annotations

import shutil
import tempfile
from pathlib import Path
from typing import Any

from playwright.sync_api import Browser, sync_playwright

from sitegen.assets import POLICY
from sitegen.browser import FLAGS
from sitegen.outside import cache_dir, gather
from sitegen.runtime import HERE, RuntimeInfo
from sitegen.static import serving

WORKER = HERE.parent / "templates" / "assets" / "worker.mjs"
TIMEOUT = 120_000

_RUN = """([worker, message, timeout]) => new Promise((resolve, reject) => {
  const began = performance.now();
  const running = new Worker(worker, { type: "module" });
  const late = setTimeout(() => reject(new Error("no answer")), timeout);
  running.onerror = (event) => reject(new Error(event.message));
  running.onmessage = ({ data }) => {
    if (data.type === "failed") reject(new Error(data.message));
    if (data.type !== "ready") return;
    clearTimeout(late);
    running.terminate();
    resolve(performance.now() - began);
  };
  running.postMessage(message);
})"""


def measure_start(info: RuntimeInfo, chromium: Path, rounds: int = 5) -> list[tuple[float, float]]:
    """Cold starts in milliseconds, (stock, ours) side by side, `rounds` of them; a first pair is thrown away."""
    with tempfile.TemporaryDirectory(prefix="ladder-bench-") as temporary, sync_playwright() as playwright:
        root = Path(temporary)
        shutil.copytree(info.folder, root / "runtime")
        shutil.copyfile(WORKER, root / "worker.mjs")
        shutil.copyfile(HERE / "bench_stock.mjs", root / "stock.mjs")
        (root / "stock").mkdir()
        for path in gather(["numpy", "pyodide"], cache=cache_dir()).values():
            shutil.copyfile(path, root / "stock" / path.name)
        (root / "index.html").write_text("<!doctype html><title>bench</title><link rel=icon href=data:,>", "utf-8")
        (root / "_headers").write_text(f"/*\n  Content-Security-Policy: {POLICY}\n", "utf-8")
        browser = playwright.chromium.launch(executable_path=chromium, args=FLAGS)
        with serving(root) as server:
            here = server.origin + "/"
            stock = {"folder": here + "stock/"}
            ours = {"type": "start", "runtime": here + "runtime/", "files": info.start_files()}
            pairs = [
                (_start(browser, here, "stock.mjs", stock), _start(browser, here, "worker.mjs", ours))
                for _ in range(rounds + 1)
            ][1:]
        browser.close()
    return pairs


def _start(browser: Browser, here: str, worker: str, message: dict[str, Any]) -> float:
    context = browser.new_context()
    try:
        page = context.new_page()
        page.goto(here)
        return float(page.evaluate(_RUN, [worker, message, TIMEOUT]))
    finally:
        context.close()
