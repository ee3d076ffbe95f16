"""The cold start of the runtime, side by side with stock Pyodide and numpy in one browser: same server, same policy.

Both run in a module worker of a fresh browser context, so that nothing is in any cache; ours ends when solvers and
widgets are imported as well, the stock one at the end of `import numpy`. They take turns, since load comes and goes.
"""

from __future__ import annotations

import json
import shutil
import statistics
import tempfile
from pathlib import Path
from typing import Any

from playwright.sync_api import Browser, sync_playwright

from sitegen.browser import FLAGS
from sitegen.outside import cache_dir, gather
from sitegen.runtime import HERE, RuntimeInfo
from sitegen.static import serving

WORKER = HERE.parent / "templates" / "assets" / "worker.mjs"
POLICY = "default-src 'none'; script-src 'self' 'wasm-unsafe-eval'; connect-src 'self'; worker-src 'self'"
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


def measure_start(
    info: RuntimeInfo, chromium: Path, *, rounds: int = 5, worker: Path = WORKER, cache: Path | None = None
) -> dict[str, Any]:
    """Cold starts in milliseconds and their ratio, with the sizes that a reader loads.

    The ratio is the median over `rounds` of ours by the stock one beside it; `best_ratio` is of the fastest of each,
    which a busy machine disturbs less. A first round of both is thrown away.
    """
    with tempfile.TemporaryDirectory(prefix="ladder-bench-") as temporary, sync_playwright() as playwright:
        root = Path(temporary)
        shutil.copytree(info.folder, root / "runtime")
        shutil.copyfile(worker, root / "worker.mjs")
        shutil.copyfile(HERE / "bench_stock.mjs", root / "stock.mjs")
        (root / "stock").mkdir()
        for path in gather(["numpy", "pyodide"], cache=cache or cache_dir()).values():
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
    return {
        "stock_ms": round(statistics.median(a for a, _ in pairs)),
        "ours_ms": round(statistics.median(b for _, b in pairs)),
        "ratio": round(statistics.median(b / a for a, b in pairs), 3),
        "best_ratio": round(min(b for _, b in pairs) / min(a for a, _ in pairs), 3),
        "rounds": [[round(a), round(b)] for a, b in pairs],
        "gzip_bytes": info.gzipped,
        "raw_bytes": info.size,
        "files": {file.name.rpartition("/")[2]: file.gzipped for file in info.files},
    }


def _start(browser: Browser, here: str, worker: str, message: dict[str, Any]) -> float:
    context = browser.new_context()
    try:
        page = context.new_page()
        page.goto(here)
        return float(page.evaluate(_RUN, [worker, message, TIMEOUT]))
    finally:
        context.close()


def main() -> int:
    """Assemble the runtime and print what was measured, as JSON."""
    from sitegen.browser import chromium
    from sitegen.runtime import assemble

    with tempfile.TemporaryDirectory(prefix="ladder-runtime-") as temporary:
        print(json.dumps(measure_start(assemble(Path(temporary)), chromium()), indent=1))
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
