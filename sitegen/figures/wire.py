"""The data of a figure that a page holds, as plain data and as JSON."""

from __future__ import annotations

import json
from typing import Any

from markupsafe import Markup

from widgets.engine.contract import Widget
from widgets.engine.controls import Spec, specs

Plain = dict[str, Any]


def dumps(data: Any) -> str:
    """Compact JSON that is safe inside a script element."""
    text = json.dumps(data, ensure_ascii=False, separators=(",", ":"), allow_nan=False)
    return text.replace("<", "\\u003c").replace("\u2028", "\\u2028").replace("\u2029", "\\u2029")


def attribute(data: Any) -> Markup:
    """Compact JSON as an attribute's value, its quotes included: single ones, since JSON itself has many double ones,
    which would be escaped."""
    return Markup("'{}'").format(Markup(dumps(data).replace("&", "&amp;").replace("'", "&#39;")))


def spec(widget: Widget) -> Plain:
    """What the page's script needs to know about a widget."""
    return {
        "buttons": [
            {"name": b.name, "label": b.label, "does": b.does, "repeats": b.repeats}
            for b in widget.buttons
        ],
        "controls": {name: _control(control) for name, control in specs(widget.controls).items()},
        "handles": list(widget.handles),
        "clicks": list(widget.clicks),
        "hovers": list(widget.hovers),
        "takes": list(widget.takes),
        "details": widget.details,
    }


def _control(control: Spec) -> Plain:
    common: Plain = {"kind": control.kind, "label": control.label, "keeps": control.keeps}
    if control.kind == "slider":
        numbers = {"low": control.low, "high": control.high, "step": control.step}
        naming = {"named": control.named} if control.named else {}
        return {**common, **numbers, "unit": control.unit, "decimals": control.decimals, **naming}
    if control.kind == "choice":
        sets = {option: dict(effects) for option, effects in control.sets.items()}
        flags = {"places": True} if control.places else {}
        return {**common, "options": dict(control.options), "sets": sets, **flags}
    return common


def without_drawings(shown: Plain) -> Plain:
    """A frame or a job's result without its drawings, which are already in the page."""
    return {**shown, "panels": [{k: v for k, v in panel.items() if k != "svg"} for panel in shown["panels"]]}
