"""The repr of a record of arrays: one line, however many points it holds."""

from __future__ import annotations

from dataclasses import fields, is_dataclass
from typing import Any

import numpy as np

_FEW = 9  # a 3 × 3 matrix is still read at a glance
_LONG = 120  # a pose or a method's few options


def brief(record: Any) -> str:
    """`Name(field=value, …)` of a dataclass: small arrays in full, others by dtype and shape."""
    values = ", ".join(f"{f.name}={_text(getattr(record, f.name))}" for f in fields(record))
    return f"{type(record).__name__}({values})"


def _text(value: Any) -> str:
    if isinstance(value, tuple | list) and value and all(isinstance(part, np.ndarray) for part in value):
        return f"{len(value)} arrays" if len(value) > 1 else f"({_text(value[0])},)"
    if isinstance(value, tuple) and value and all(is_dataclass(part) for part in value):
        return f"{len(value)} records" if len(value) > 1 else f"({_text(value[0])},)"
    if is_dataclass(value):
        text = repr(value)
        return text if len(text) <= _LONG else f"{type(value).__name__}(…)"
    if not isinstance(value, np.ndarray | np.generic):
        return repr(value)
    if value.size > _FEW or (value.dtype == object and any(is_dataclass(part) for part in value.flat)):
        return f"{value.dtype} array of shape {value.shape}"
    return " ".join(np.array2string(np.asarray(value), precision=6, separator=", ").split())
