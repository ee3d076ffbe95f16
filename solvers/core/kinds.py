"""Type checks of arguments, which raise a ValueError that names the argument."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, TypeVar

import numpy as np

_Kind = TypeVar("_Kind")
_Function = TypeVar("_Function")
_WAYS = {
    "Pose": "; Pose.from_matrix makes one of a matrix, and result.pose is a result's",
    "Covariance": "; solvers.uncertainty.from_matrix makes one of a matrix and a pose",
    "Runs": "; solvers.uncertainty_study.runs makes them",
    "Scans": "; solvers.odometry.prepare makes them of a drive",
}
_PARTS = {
    ("Covariance", "Result"): "solvers.uncertainty.covariance(result)",
    ("Covariance", "Spread"): "spread.whole",
    ("Pose", "Chain"): "chain.poses",
    ("Pose", "Drive"): "drive.motion",
    ("Pose", "GraphResult"): "result.poses",
    ("Pose", "Result"): "result.pose",
}
"""The part that was probably meant when the whole was passed, by (expected, given) class."""
_LONGEST = 60


def of_kind(value: object, kind: type[_Kind], name: str) -> _Kind:
    """Return `value` if it is of this class, else raise ValueError."""
    if not isinstance(value, kind):
        expected, actual = kind.__name__, type(value).__name__
        part = _PARTS.get((expected, actual))
        hint = f"; pass {part}" if part else _WAYS.get(expected, "")
        if expected == "Pose" and isinstance(value, list | tuple) and value and all(isinstance(v, kind) for v in value):
            hint = " of poses; solvers.posegraph.stacked makes one of them"
        raise ValueError(f"{name}: expected {'' if expected.endswith('s') else 'a '}{expected}, got {actual}{hint}")
    return value


def or_usual(value: object, kind: type[_Kind], name: str) -> _Kind:
    """As `of_kind`, except that None gives an instance with the class's defaults."""
    return kind() if value is None else of_kind(value, kind, name)


def several(values: object, name: str, what: str) -> tuple[Any, ...]:
    """`values` as a tuple; raises ValueError for text, a single number or anything else that cannot be iterated."""
    try:
        if isinstance(values, Iterable) and not isinstance(values, str | bytes):
            return tuple(values)
    except TypeError:  # a numpy array without axes passes for an iterable until it is iterated
        pass
    raise ValueError(f"{name}: expected a sequence of {what}, got {shown(values)}")


def function(value: _Function, name: str) -> _Function:
    """Return `value` if it is callable or None, else raise ValueError."""
    if value is not None and not callable(value):
        raise ValueError(f"{name}: expected a function, got {shown(value)}")
    return value


def shown(value: object) -> str:
    """A value as shown in a message: shortened, and for a long array its shape."""
    text = " ".join(repr(value).split())
    if len(text) <= _LONGEST:
        return text
    return f"an array of shape {value.shape}" if isinstance(value, np.ndarray) else f"{text[: _LONGEST - 1]}…"
