"""The repr of a graph's runs and results."""

from __future__ import annotations

from typing import Any


def summary(run: Any) -> str:
    """One line for a run or a result, however large the graph."""
    outcome = f"{run.status}{f' ({run.reason})' if run.reason else ''}, steps={run.steps}"
    size = f"nodes={run.poses.batch[0]}, edges={len(run.chi2)}"
    value = f"total={run.total:.6g}" if hasattr(run, "total") else f"objective={run.objective:.6g}"
    return f"{type(run).__name__}({outcome}, {size}, {value})"
