"""`check`, whose steps are part of `test` too: build strictly, check the site, rerun a sample of the stored results."""

from __future__ import annotations

import sys
import tempfile
import time
from pathlib import Path

from sitegen.cache.files import cache_dir
from sitegen.chapters import claims
from sitegen.check.html import Page, read_pages
from sitegen.check.rules import check_pages
from sitegen.check.sizes import heaviest, page_weight, runtime_weight
from sitegen.check.spelling import spelling
from sitegen.pipeline.attempt import attempt, tell
from sitegen.progress import reporting


def summary(pages: dict[str, Page]) -> str:
    """The number of pages and the sizes, as a sentence."""
    page, runtime = (heaviest(map(weight, pages.values())) for weight in (page_weight, runtime_weight))
    return (
        f"{len(pages)} pages; the heaviest, {page.page}, has {page.total / 1000:.0f} kB compressed, "
        f"the runtime {runtime.total / 1e6:.2f} MB"
    )


def publish_and_check(root: Path, dest: Path) -> int:
    """Build strictly into `dest`, then run every check on it. The exit code is 1 if there are problems."""
    with reporting() as progress:
        outcome = attempt(root, dest, strict=True, progress=progress)
    tell(outcome, root / "site")
    if not outcome.good:
        return 1
    pages = read_pages(dest)
    problems = check_pages(dest, pages, cache_dir())
    for problem in problems:
        print(problem, file=sys.stderr)
    print(f"{len(problems)} problems" if problems else f"no problems; {summary(pages)}", flush=True)
    return 1 if problems else 0


def prove_kept(root: Path, *, anew: bool = False) -> int:
    """Report stale results in the repository (the sweep's, long plots', the claims' tests) and rerun a sample of the
    first two; with `anew` even one that has been verified before. The exit code is 1 if a result is wrong."""
    from sitegen.experiments import sweep_verify
    from sitegen.pipeline import plot_parts

    cache = None if anew else cache_dir()
    sweep, plots = sweep_verify.standing(root, cache=cache), plot_parts.standing(cache=cache)
    for problem in (*sweep.stale, *plots.stale):
        print(f"{problem} (note)", file=sys.stderr)
    for problem in (*sweep.wrong, *plots.wrong):
        print(problem, file=sys.stderr)
    occasion = "repeated now" if sweep.ran else "repeated earlier on this machine with the same code"
    print(f"sweep: {sweep.proved} runs {occasion} match its files", flush=True)
    print(f"long plots: one part of each of {plots.proved} matches its file", flush=True)
    if behind := claims.behind(root):
        message = f"{len(behind)} claims are shown as not yet run on this code"
        print(f"{claims.RESULTS}: {message}; a full test run updates it (note)", file=sys.stderr)
    return 1 if sweep.wrong or plots.wrong else 0


def check_command(root: Path) -> int:
    """Build strictly into a temporary folder and check the site there; site/ stays as it is. Then check the spelling of
    the sources and verify the stored results of long runs."""
    began = time.monotonic()
    with tempfile.TemporaryDirectory(prefix="ladder-check-") as folder:
        code = publish_and_check(root, Path(folder) / "site")
    code = max(code, spelling(root), prove_kept(root))
    print(f"checked in {time.monotonic() - began:.1f} s", flush=True)
    return code
