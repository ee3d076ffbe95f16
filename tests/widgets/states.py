"""A figure's states, reached action by action as a reader would, and the frames and readouts there."""

from __future__ import annotations

from typing import Any

from widgets.drawing.picture import Picture
from widgets.engine.contract import SEED, Action, Widget, preset
from widgets.engine.host import Host


def state_after(widget: Widget, *actions: Action, seed: int = SEED, name: str = "default", **controls: Any) -> Any:
    """The figure's state after these actions, from a preset with these control values."""
    state = widget.start(preset(widget, name, controls).controls, seed)
    for action in actions:
        state = widget.act(state, action)
    return state


def frame_after(
    widget: Widget, *log: list[Any], seed: int = SEED, name: str = "default", host: Host | None = None, **controls: Any
) -> dict[str, Any]:
    """The frame after these log entries, from a fresh host unless one is given."""
    plain = preset(widget, name, controls).plain()
    return (host or Host()).render("f", {**plain, "seed": seed, "log": [*log]})


def readouts(picture: Picture | dict[str, Any]) -> dict[str, str]:
    """The readouts of a picture or a frame, by name."""
    if isinstance(picture, Picture):
        return {readout.name: readout.value for readout in picture.readouts}
    return {readout["name"]: readout["value"] for readout in picture["readouts"]}
