"""A browser window, whatever drives it: what a test can do with one, and input events in WebDriver's form."""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import Any, Protocol

PATIENCE = 180  # seconds until a wait counts as failed: a start of Python in the slowest engine on a busy machine

Place = tuple[int, int]  # CSS px in the viewport


class Window(Protocol):
    """One window with its own storage."""

    def size(self, width: int, height: int) -> None:
        """Make the viewport this many CSS px wide; the height may differ by the browser's own parts."""

    def open(self, url: str) -> None:
        """Go to an address; return once the page has loaded."""

    def evaluate(self, expression: str) -> str:
        """The text to which a JavaScript expression, or its promise, evaluates. Raises if it throws."""

    def pointer(self, path: Sequence[Place]) -> None:
        """Press the mouse at the first place, move it through the others, and release it at the last."""

    def press(self, key: str) -> None:
        """Press a key on the focused element: ArrowLeft, Shift+ArrowUp, Enter …"""

    def picture(self) -> bytes:
        """The viewport as PNG."""

    def complaints(self) -> list[str]:
        """The errors and warnings that the browser has reported since the window was made."""

    def close(self) -> None:
        """Close the window."""


class Browser(Protocol):
    """A running browser."""

    def window(self) -> Window:
        """A new window, as fresh as on a first visit."""

    def close(self) -> None:
        """Close the browser."""


def run(window: Window, function: str, *arguments: Any) -> Any:
    """The result of a JavaScript function (given as source) for JSON values, as JSON; a promise is awaited."""
    values = ", ".join(map(json.dumps, arguments))
    call = f"Promise.resolve(({function})({values})).then((value) => JSON.stringify(value ?? null))"
    return json.loads(window.evaluate(call))


def until(window: Window, function: str, *arguments: Any) -> None:
    """Wait in the page until the function returns a true value; raise AssertionError if it does not."""
    script = f"""async (...given) => {{
      const end = performance.now() + {PATIENCE} * 1000;
      for (;;) {{
        if (await ({function})(...given)) return true;
        if (performance.now() > end) return false;
        await new Promise((go) => setTimeout(go, 30));
      }}
    }}"""
    assert run(window, script, *arguments), f"not within {PATIENCE} s: {function} of {arguments}"


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
    """WebDriver's input actions for a mouse dragged along a path."""
    moves: Actions = [{"type": "pointerMove", "x": x, "y": y, "duration": 0} for x, y in path]
    down, up = ({"type": kind, "button": 0} for kind in ("pointerDown", "pointerUp"))
    actions = [moves[0], down, *moves[1:], up]
    return [{"type": "pointer", "id": "mouse", "parameters": {"pointerType": "mouse"}, "actions": actions}]


def key_actions(key: str) -> Actions:
    """WebDriver's input actions for one key with its modifiers."""
    keys = [KEYS.get(name, name) for name in key.split("+")]
    down: Actions = [{"type": "keyDown", "value": value} for value in keys]
    up: Actions = [{"type": "keyUp", "value": value} for value in reversed(keys)]
    return [{"type": "key", "id": "keyboard", "actions": down + up}]
