"""A browser window, whatever drives it: what a test may ask of one, and the input events as WebDriver writes them."""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import Any, Protocol

PATIENCE = 180  # seconds until a wait counts as failed: a start of Python in the slowest engine on a busy machine

Place = tuple[int, int]  # CSS px in the viewport


class Window(Protocol):
    """One window with storage of its own."""

    def size(self, width: int, height: int) -> None:
        """Makes the viewport so many CSS px wide; the height may differ by what the browser keeps for itself."""

    def open(self, url: str) -> None:
        """Goes to an address; returns once the page has loaded."""

    def evaluate(self, expression: str) -> str:
        """The text that a JavaScript expression, or the promise that it is, comes to. Raises where it throws."""

    def pointer(self, path: Sequence[Place]) -> None:
        """Presses the mouse at the first place, goes through the others, lets go at the last."""

    def press(self, key: str) -> None:
        """Presses a key on what has the focus: ArrowLeft, Shift+ArrowUp, Enter …"""

    def picture(self) -> bytes:
        """The viewport as PNG."""

    def complaints(self) -> list[str]:
        """What the browser has found wrong since the window was made: errors and warnings."""

    def close(self) -> None:
        """Ends the window."""


class Browser(Protocol):
    """A running browser."""

    def window(self) -> Window:
        """A new window, as fresh as a first visit."""

    def close(self) -> None:
        """Ends the browser."""


def run(window: Window, function: str, *given: Any) -> Any:
    """What a JavaScript function (its source) gives for JSON values, as JSON; a promise is waited for."""
    values = ", ".join(map(json.dumps, given))
    call = f"Promise.resolve(({function})({values})).then((value) => JSON.stringify(value ?? null))"
    return json.loads(window.evaluate(call))


def until(window: Window, function: str, *given: Any) -> None:
    """Waits in the page until the function gives something true; raises AssertionError when it does not."""
    looked = f"""async (...given) => {{
      const end = performance.now() + {PATIENCE} * 1000;
      for (;;) {{
        if (await ({function})(...given)) return true;
        if (performance.now() > end) return false;
        await new Promise((go) => setTimeout(go, 30));
      }}
    }}"""
    assert run(window, looked, *given), f"not within {PATIENCE} s: {function} of {given}"


KEYS = {
    "Tab": "\ue004",
    "Enter": "\ue007",
    "Shift": "\ue008",
    "Escape": "\ue00c",
    "ArrowLeft": "\ue012",
    "ArrowUp": "\ue013",
    "ArrowRight": "\ue014",
    "ArrowDown": "\ue015",
}

Actions = list[dict[str, Any]]


def pointer_actions(path: Sequence[Place]) -> Actions:
    """WebDriver's input actions of a mouse that is dragged along a path."""
    moves: Actions = [{"type": "pointerMove", "x": x, "y": y, "duration": 0} for x, y in path]
    down, up = ({"type": kind, "button": 0} for kind in ("pointerDown", "pointerUp"))
    taken = [moves[0], down, *moves[1:], up]
    return [{"type": "pointer", "id": "mouse", "parameters": {"pointerType": "mouse"}, "actions": taken}]


def key_actions(key: str) -> Actions:
    """WebDriver's input actions of one key with its modifiers."""
    held = [KEYS.get(name, name) for name in key.split("+")]
    down: Actions = [{"type": "keyDown", "value": value} for value in held]
    up: Actions = [{"type": "keyUp", "value": value} for value in reversed(held)]
    return [{"type": "key", "id": "keyboard", "actions": down + up}]
