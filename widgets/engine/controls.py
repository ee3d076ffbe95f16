"""A figure's controls: the fields of a frozen dataclass that carry label, range, step and unit.

The page's inputs are rendered from these fields, and every value, an author's or a reader's, is validated against them.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from difflib import get_close_matches
from reprlib import Repr
from typing import Any, Literal

Value = bool | float | str
Keeps = Literal["log", "presses", "pose", "nothing"]


@dataclass(frozen=True)
class Spec:
    """How one control is shown and what it accepts.

    keeps: which of the reader's actions survive a change of this control: the whole log (replayed with the new value),
    the presses alone (of a control that places what a drag would), the placing of the start (drags), or nothing.
    sets: for a choice, the values that each option gives to other controls, as a scene has its own noise. The page
    applies them when the reader picks the option, `validated` when an option is given and the other control is not.
    places: whether a choice says where a run starts, which no longer holds once a handle has been dragged.
    named: for a slider whose meaning depends on a choice, that choice and the label under each of its options.
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
    sets: Mapping[str, Mapping[str, Value]] = field(default_factory=dict)
    places: bool = False
    named: tuple[str, Mapping[str, str]] | None = None

    def called(self, controls: Mapping[str, Value]) -> str:
        """The label while the controls have these values."""
        by, labels = self.named or ("", {})
        return labels.get(str(controls.get(by)), self.label)

    @property
    def decimals(self) -> int:
        """The number of decimals in a slider's value."""
        return next(d for d in range(7) if abs(round(self.step, d) - self.step) < 1e-9)


def slider(
    default: float,
    label: str,
    low: float,
    high: float,
    step: float,
    unit: str = "",
    help: str = "",
    keeps: Keeps = "log",
    named: tuple[str, Mapping[str, str]] | None = None,
) -> Any:
    """A number in [low, high] in steps of `step`."""
    spec = Spec("slider", label, low, high, step, unit, {}, help, keeps, named=named)
    return field(default=float(default), metadata={"spec": spec})


def choice(
    default: str,
    label: str,
    options: Mapping[str, str],
    help: str = "",
    keeps: Keeps = "nothing",
    sets: Mapping[str, Mapping[str, Value]] | None = None,
    places: bool = False,
) -> Any:
    """One of `options` (value → what the reader sees), which may set other controls as well."""
    spec = Spec("choice", label, options=options, help=help, keeps=keeps, sets=sets or {}, places=places)
    return field(default=default, metadata={"spec": spec})


def toggle(default: bool, label: str, help: str = "", keeps: Keeps = "log") -> Any:
    """On or off."""
    return field(default=default, metadata={"spec": Spec("toggle", label, help=help, keeps=keeps)})


def specs(controls: type) -> dict[str, Spec]:
    """The control specs of a controls dataclass, in order."""
    return {f.name: f.metadata["spec"] for f in fields(controls)}


def values(controls: Any) -> dict[str, Value]:
    """The control values as plain data."""
    return {f.name: getattr(controls, f.name) for f in fields(controls)}


def nearest(name: Any, names: Any) -> str:
    """'; did you mean …?' with the closest of `names`, or a list of them all if none is close."""
    text = name if isinstance(name, str) else clip(name)
    close = get_close_matches(text[:60], [str(n) for n in names], n=1)
    return f"; did you mean {close[0]!r}?" if close else f"; there are {', '.join(map(str, names))}"


def clip(value: Any) -> str:
    """The repr of a value, short enough for a message; of nested values only the outer levels."""
    text = _SHORT.repr(value)
    return text if len(text) <= 60 else text[:59] + "…"


_SHORT = Repr()
_SHORT.maxstring = _SHORT.maxother = _SHORT.maxlong = 60
_SHORT.fillvalue = "…"


def validated(controls: type, arguments: Mapping[str, Any]) -> Any:
    """The controls with the values in `arguments`, then those that the chosen options set, then the defaults.

    Raises ValueError that names the control, says what is wrong with the value and what was expected.
    """
    by_name = specs(controls)
    for name in arguments:
        if name not in by_name:
            raise ValueError(f"no control {clip(name)}{nearest(name, by_name)}")
    settings = {name: _value(name, by_name[name], raw) for name, raw in arguments.items()}
    implied = {k: v for name, value in settings.items() for k, v in by_name[name].sets.get(str(value), {}).items()}
    return controls(**{**implied, **settings})


def finite(raw: Any, limit: float) -> bool:
    """Whether `raw` is a number, not a bool, of magnitude below `limit`; false for NaN and infinity."""
    return isinstance(raw, (int, float)) and not isinstance(raw, bool) and -limit < raw < limit


def _value(name: str, spec: Spec, raw: Any) -> Value:
    if spec.kind == "choice":
        if not isinstance(raw, str) or raw not in spec.options:
            raise ValueError(f"{name}: no option {clip(raw)}{nearest(raw, spec.options)}")
        return raw
    if spec.kind == "toggle":
        if not isinstance(raw, bool):
            raise ValueError(f"{name}: {clip(raw)} is neither true nor false")
        return raw
    if not finite(raw, 1e15):
        raise ValueError(f"{name}: {clip(raw)} is not a number")
    if not spec.low - 1e-9 <= raw <= spec.high + 1e-9:
        raise ValueError(f"{name}: {raw:g} lies outside {spec.low:g} … {spec.high:g}")
    return min(max(float(raw), spec.low), spec.high) + 0.0  # turns −0.0, which compares equal to 0.0, into 0.0
