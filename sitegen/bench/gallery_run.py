"""Runs one snippet of the gallery in its own process: `python -m sitegen.bench.gallery_run SNIPPET CLOUDS.npz`.

Prints JSON: its answer, the times of its calls and of its imports; or which module is absent. Needs numpy and whatever
the snippet imports.
"""

from __future__ import annotations

import json
import runpy
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

FEWEST, MOST, ENOUGH = 9, 500, 1.0
"""Timed calls: the least and most, and the seconds after which no more are begun."""
FINE = 1e-6


def run(snippet: Path, clouds: Sequence[Any]) -> dict[str, Any]:
    """Run the snippet's `register` on the clouds: `matrix`, `seconds` of each call after the first, `importing`
    seconds.

    If the snippet's module is not installed, only `absent`: the error's message.
    """
    began = time.perf_counter()
    try:
        register = runpy.run_path(str(snippet))["register"]
    except ModuleNotFoundError as error:
        return {"absent": str(error)}
    importing = time.perf_counter() - began
    matrix = np.asarray(register(*clouds), dtype=float)  # the first call warms up
    # CPU time: other work on the machine would lengthen long calls more than short ones. If that clock is too coarse,
    # wall time.
    clock = time.process_time if time.get_clock_info("process_time").resolution <= FINE else time.perf_counter
    seconds: list[float] = []
    while len(seconds) < FEWEST or (len(seconds) < MOST and sum(seconds) < ENOUGH):
        began = clock()
        register(*clouds)
        seconds.append(clock() - began)
    return {"matrix": matrix.tolist(), "seconds": seconds, "importing": importing}


if __name__ == "__main__":
    with np.load(sys.argv[2]) as arrays:
        print(json.dumps(run(Path(sys.argv[1]), [arrays[name] for name in arrays.files])))
