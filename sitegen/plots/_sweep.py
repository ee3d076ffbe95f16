"""The sweep's results, for plots: content/data/sweep/*.json, written by `python3 build.py sweep`."""

from __future__ import annotations

import json
from typing import Any

from sitegen.plots.registry import ROOT
from solvers.studies.race import CONTESTANTS

LABELS = {contestant.method: contestant.label for contestant in CONTESTANTS}


def read(name: str) -> dict[str, Any]:
    """Read one file of the sweep. Raises ValueError if it or a contestant is missing."""
    path = ROOT / "content" / "data" / "sweep" / f"{name}.json"
    if not path.is_file():
        raise ValueError(f"missing {path.relative_to(ROOT)}: run `python3 build.py sweep --only {name}`")
    data: dict[str, Any] = json.loads(path.read_text("utf-8"))
    missing = [label for method, label in LABELS.items() if method not in data["contestants"]]
    if missing:
        raise ValueError(f"{path.relative_to(ROOT)} lacks {', '.join(missing)}: run `python3 build.py sweep`")
    return data


def hits(bits: str) -> int:
    """How many flags of a hexadecimal string are set."""
    return sum(int(digit, 16).bit_count() for digit in bits)
