"""A figure's controls: the fields of a frozen dataclass that carry label, range, step and unit.

The page's inputs are rendered from these fields and every value, an author's or a reader's, is validated by them.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from difflib import get_close_matches
from math import isfinite
from typing import Any, Literal

Value = bool | float | str
Keeps = Literal["log", "pose", "nothing"]


@dataclass(frozen=True)
class Spec:
    """How one control is shown and what it accepts.

    keeps: what of the reader's actions survives a change of this control: the whole log (replayed with the new value),
    the placing of the start (drags), or nothing.
    """

    kind: Literal["slider", "choice", "toggle"]
    label: str
    low: float = 0.0
    high: float = 1.0
    step: float = 0.01
    unit: str = ""
    options: Mapping[str, str] = field(default_factory=dict)
    help: str = ""
    keeps: Keeps = "log"

    @property
    def decimals(self) -> int:
        """How many decimals a slider's value is written with."""
        return next(d for d in range(7) if abs(round(self.step, d) - self.step) < 1e-9)


def slider(
    default: float, label: str, low: float, high: float, step: float, unit: str = "", help: str = "", keeps: Keeps = "log"
) -> Any:
    """A number in [low, high] by steps of `step`."""
    return field(default=float(default), metadata={"spec": Spec("slider", label, low, high, step, unit, {}, help, keeps)})


def choice(default: str, label: str, options: Mapping[str, str], help: str = "", keeps: Keeps = "nothing") -> Any:
    """One of `options` (value → what the reader sees)."""
    return field(default=default, metadata={"spec": Spec("choice", label, options=options, help=help, keeps=keeps)})


def toggle(default: bool, label: str, help: str = "", keeps: Keeps = "log") -> Any:
    """On or off."""
    return field(default=default, metadata={"spec": Spec("toggle", label, help=help, keeps=keeps)})


def specs(controls: type) -> dict[str, Spec]:
    """The control specs of a controls dataclass, in order."""
    return {f.name: f.metadata["spec"] for f in fields(controls)}


def values(controls: Any) -> dict[str, Value]:
    """The control values as plain data."""
    return {f.name: getattr(controls, f.name) for f in fields(controls)}


def nearest(name: str, names: Any) -> str:
    """'; did you mean …?' for the closest of `names`, or a list of them all where none is close."""
    close = get_close_matches(str(name), [str(n) for n in names], n=1)
    return f"; did you mean {close[0]!r}?" if close else f"; there are {', '.join(map(str, names))}"


def validated(controls: type, given: Mapping[str, Any]) -> Any:
    """The controls with `given` in place of defaults.

    Raises ValueError that names the control, says what is wrong with the value and what was expected.
    """
    known = specs(controls)
    for name in given:
        if name not in known:
            raise ValueError(f"no control {name!r}{nearest(name, known)}")
    return controls(**{name: _value(name, known[name], raw) for name, raw in given.items()})


def _value(name: str, spec: Spec, raw: Any) -> Value:
    if spec.kind == "choice":
        if raw not in spec.options:
            raise ValueError(f"{name}: no option {raw!r}{nearest(raw, spec.options)}")
        return str(raw)
    if spec.kind == "toggle":
        if not isinstance(raw, bool):
            raise ValueError(f"{name}: {raw!r} is neither true nor false")
        return raw
    if isinstance(raw, bool) or not isinstance(raw, (int, float)) or not isfinite(raw):
        raise ValueError(f"{name}: {raw!r} is not a number")
    if not spec.low - 1e-9 <= raw <= spec.high + 1e-9:
        raise ValueError(f"{name}: {raw:g} lies outside {spec.low:g} … {spec.high:g}")
    return float(raw)
