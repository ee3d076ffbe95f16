"""Any record that a figure accepts: every preset, any values of its controls, any seed, any actions in any order."""

from __future__ import annotations

from typing import Any

from hypothesis import strategies as st

from widgets.engine.contract import Widget, preset
from widgets.engine.controls import Spec, specs

FAR = 999_999.9  # the log accepts coordinates below a million units
PLACES = st.floats(-6, 6) | st.sampled_from([0.0, -0.0, 1e-300, -1e-9, 0.5, FAR, -FAR, 1e3]) | st.floats(-FAR, FAR)
SEEDS = st.integers(0, 99).map(lambda k: 40 + 13 * k) | st.integers(0, 2**31 - 1)


def values(spec: Spec) -> st.SearchStrategy[bool | float | str]:
    """Any value of a control: its ends, a slider's steps and values between them."""
    if spec.kind == "toggle":
        return st.booleans()
    if spec.kind == "choice":
        return st.sampled_from(list(spec.options))
    steps = round((spec.high - spec.low) / spec.step)
    on_step = st.integers(0, steps).map(lambda k: min(round(spec.low + k * spec.step, spec.decimals), spec.high))
    return st.sampled_from([spec.low, spec.high]) | on_step | st.floats(spec.low, spec.high)


def actions(widget: Widget) -> st.SearchStrategy[list[Any]]:
    """One log entry: a press of a button, or a drag, click or hover at any place."""
    presses = [["press", b.name] for b in widget.buttons if b.does == "press"]
    aims = [
        *(["drag", h] for h in widget.handles),
        *(["click", c] for c in widget.clicks),
        *(["hover", c] for c in widget.hovers),
    ]
    spots = st.tuples(st.sampled_from(aims), PLACES, PLACES).map(lambda a: [*a[0], a[1], a[2]]) if aims else None
    buttons = st.sampled_from(presses) if presses else None
    kinds = [kind for kind in (buttons, spots) if kind is not None]
    return st.one_of(kinds) if kinds else st.nothing()


@st.composite
def records(draw: st.DrawFn, widget: Widget, longest: int = 6) -> dict[str, Any]:
    """A plain record with a log of at most `longest` actions."""
    by_name = specs(widget.controls)
    names = draw(st.sets(st.sampled_from(sorted(by_name))))
    changes = {name: draw(values(by_name[name])) for name in sorted(names)}
    plain = preset(widget, draw(st.sampled_from(sorted(widget.presets))), changes).plain()
    possible = actions(widget)
    log = [] if possible.is_empty else draw(st.lists(possible, max_size=longest))
    return {**plain, "seed": draw(SEEDS), "log": log}
