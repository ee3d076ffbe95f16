"""Makes kept_modules.txt: `python -m sitegen.runtime.trace_modules`, to be run again when pages need more of Python or
numpy.

The exercise runs on the complete runtime under Node; the modules that it imports are shipped, and the few named here.
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

from sitegen.cache.files import cache_dir
from sitegen.external.fetch import gather
from sitegen.external.node import run_node
from sitegen.runtime.assemble import HERE, KEPT_MODULES, RUNNER, compiled, kept_modules, library_and_numpy, mounted
from sitegen.runtime.patches import LEFT_OUT, SITE_PACKAGES, STDLIB
from sitegen.runtime.wheel import build_wheel

# Modules that solvers and figures may use at any time.
ALSO = [
    *("base64", "bisect", "copy", "dataclasses", "difflib", "fractions", "functools", "graphlib", "heapq", "html"),
    *("json", "numbers", "random", "statistics", "string", "textwrap", "traceback"),
    *("encodings.ascii", "encodings.latin_1"),
]


def traced(cache: Path) -> list[str]:
    """The dotted names to ship, sorted: what the exercise imported, and ALSO with what that imports."""
    originals = gather(["numpy", "pyodide"], cache=cache)
    library, numpy = library_and_numpy(originals, cache)
    ladder = compiled(build_wheel(cache), SITE_PACKAGES, originals, cache, ours=True)
    with tempfile.TemporaryDirectory(prefix="ladder-trace-") as temporary:
        request = {
            "folder": str(originals["pyodide/pyodide.mjs"].parent),
            **mounted(library, [numpy, ladder], Path(temporary)),
            "python": (HERE / "exercise.py").read_text("utf-8"),
            "input": ALSO,
        }
        origins = run_node(RUNNER, request, timeout=900)["origins"]
    prefixes = (STDLIB, SITE_PACKAGES + "numpy/")
    return sorted(name for name, origin in origins.items() if origin.startswith(prefixes) and name not in LEFT_OUT)


def main() -> int:
    """Rewrite kept_modules.txt and print how it changed."""
    old = kept_modules() if KEPT_MODULES.is_file() else frozenset()
    names = traced(cache_dir())
    command = "`python -m sitegen.runtime.trace_modules`"
    head = f"# The modules of the standard library and of numpy that are shipped; made by {command}.\n"
    KEPT_MODULES.write_text(head + "\n".join(names) + "\n", "utf-8")
    new, removals = sorted(set(names) - old), sorted(old - set(names))
    print(f"{len(names)} modules; new: {', '.join(new) or 'none'}; gone: {', '.join(removals) or 'none'}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
