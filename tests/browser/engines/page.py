"""What a reader does with a page and its figures, in any engine."""

from __future__ import annotations

from typing import Any

from tests.browser.engines.window import Window, run, until


class Reading:
    """A reader with one window on the site."""

    def __init__(self, window: Window, origin: str) -> None:
        self.window, self.origin = window, origin
        self.expected: tuple[str, ...] = ()
        window.size(1280, 1000)

    def open(self, page: str, origin: str = "") -> None:
        """Go to a page; its figures are then set up, after its first paint. `origin` replaces the server's."""
        self.window.open(f"{origin or self.origin}/{page}")
        self.run("() => globalThis.Ladder?.alive")

    def expect(self, *parts: str) -> None:
        """Complaints that contain one of these parts are expected by the test."""
        self.expected = parts

    def run(self, function: str, *arguments: Any) -> Any:
        return run(self.window, function, *arguments)

    def until(self, function: str, *arguments: Any) -> None:
        until(self.window, function, *arguments)

    def figure(self, name: str) -> Figure:
        """A figure, scrolled to the middle of the window."""
        self.run("(name) => document.getElementById(name).scrollIntoView({block: 'center', behavior: 'instant'})", name)
        return Figure(self, name)

    def names(self) -> list[str]:
        """The names of the open page's figures."""
        return list(self.run("() => [...document.querySelectorAll('figure.figure')].map(({ id }) => id)"))


class Figure:
    """One figure on the open page. Parts are named by selectors within it."""

    def __init__(self, reading: Reading, name: str) -> None:
        self.reading, self.name = reading, name

    def of(self, function: str, *arguments: Any) -> Any:
        """The result of a function of the figure's controller."""
        call = f"(name, ...given) => ({function})(Ladder.figures.get(name), ...given)"
        return self.reading.run(call, self.name, *arguments)

    def becomes(self, state: str) -> Figure:
        """Wait for the figure's state: static, tape, waiting, live or failed."""
        self.reading.until("(name, state) => document.getElementById(name).dataset.state === state", self.name, state)
        return self

    def live(self) -> Figure:
        """Wait until Python is up, even if the page calls the start slow."""
        self.reading.until(
            "() => { const { state, message } = Ladder.runtime;"
            " if (state === 'failed' && !message.includes('any further')) throw new Error(message);"
            " return state === 'live'; }"
        )
        return self

    def settled(self) -> Figure:
        """Wait until no request is pending and nothing moves."""
        self.reading.until("(name) => !Ladder.figures.get(name).busy", self.name)
        return self

    def readout(self, name: str) -> str:
        part = f'[data-readout="{name}"] .value'
        return str(self.of("({ root }, part) => root.querySelector(part).textContent", part))

    def changes(self, name: str, before: str) -> str:
        """Wait until a readout is no longer `before`; return its new value."""
        part = f'[data-readout="{name}"] .value'
        differs = "(figure, part, before) => document.getElementById(figure).querySelector(part).textContent !== before"
        self.reading.until(differs, self.name, part, before)
        return self.settled().readout(name)

    def box(self, part: str) -> tuple[float, float, float, float]:
        """Left, top, width and height of a part, in px in the viewport."""
        of = "({ root }, part) => { const b = root.querySelector(part).getBoundingClientRect();"
        return tuple(self.of(of + " return [b.left, b.top, b.width, b.height]; }", part))

    def middle(self, part: str) -> tuple[int, int]:
        left, top, width, height = self.box(part)
        return round(left + width / 2), round(top + height / 2)

    def click(self, part: str) -> None:
        """Scroll a part to the middle of the window and click it with the mouse."""
        show = "({ root }, part) => root.querySelector(part).scrollIntoView({block: 'center', behavior: 'instant'})"
        self.of(show, part)
        self.reading.window.pointer([self.middle(part)])

    def focus(self, part: str) -> None:
        self.of("({ root }, part) => root.querySelector(part).focus()", part)

    def drag(self, part: str, dx: int, dy: int, steps: int = 6) -> None:
        """Drag a part by this many px with the mouse."""
        x, y = self.middle(part)
        path = [(round(x + dx * i / steps), round(y + dy * i / steps)) for i in range(steps + 1)]
        self.reading.window.pointer(path)

    def frame(self) -> Any:
        """The current frame."""
        return self.of("({ frame }) => frame")
