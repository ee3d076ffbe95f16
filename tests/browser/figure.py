"""A reader's actions on a figure, by name."""

from __future__ import annotations

import json
from base64 import urlsafe_b64encode
from collections.abc import Sequence
from typing import Any

from playwright.sync_api import FloatRect, Locator, Page, expect

from sitegen.bench.pages import until

LIVE = 60_000  # ms: a start of Python on a busy machine
TAPS, TAPPED = 5, 2_000  # how often a finger tries, and for how many ms it waits each time


def await_attribute(page: Page, selector: str, name: str, value: str) -> None:
    """Wait until an element has an attribute of this value. For its message, `expect` describes what it looks at, or
    the page if that is hidden, at each look that fails: of a whole page, for a tenth of a second or more."""
    page.wait_for_selector(f'{selector}[{name}="{value}"]', state="attached", timeout=LIVE)


class Figure:
    """One figure on an open page."""

    def __init__(self, page: Page, name: str) -> None:
        self.page, self.name = page, name
        self.root = page.locator(f"#{name}")

    def seen(self) -> Figure:
        self.root.scroll_into_view_if_needed()
        return self

    def becomes(self, state: str) -> Figure:
        """Wait for the figure's state: static, tape, waiting, live or failed."""
        await_attribute(self.page, f"#{self.name}", "data-state", state)
        return self

    def live(self) -> Figure:
        self.seen()
        await_attribute(self.page, "html", "data-runtime", "live")
        return self

    def warm(self) -> Figure:
        """Wait until Python's warm-up for this figure is over."""
        await_attribute(self.live().page, f"#{self.name}", "data-warm", "")
        return self

    def boxes(self, selector: str) -> list[FloatRect]:
        """The boxes of the figure's matching elements in the window, px; elements that are not drawn are left out."""
        places = [node.bounding_box() for node in self.root.locator(selector).all()]
        return [box for box in places if box is not None]

    def button(self, name: str) -> Locator:
        return self.reached(f'[data-button="{name}"]')

    def reached(self, selector: str) -> Locator:
        """An element of the figure; if it is behind More, that is opened first, as a reader would."""
        more = self.root.locator("details.figure-rest:not([open])")
        if more.locator(selector).count():
            more.locator("summary").click()
        return self.root.locator(selector)

    def handle(self, name: str) -> Locator:
        return self.root.locator(f'[data-handle="{name}"]')

    def control(self, name: str) -> Locator:
        return self.reached(f'[name="{name}"]')

    def readout(self, name: str) -> str:
        return self.root.locator(f'[data-readout="{name}"] .value').text_content() or ""

    def shows(self, name: str, value: str) -> Figure:
        until(self.page, f"{self._value(name)} === {json.dumps(value)}")
        return self

    def changes(self, name: str, before: str) -> str:
        """Wait until the readout is no longer `before` and no request is pending: after a drag, its last frame."""
        until(self.page, f"![undefined, {json.dumps(before)}].includes({self._value(name)})")
        return self.settled().readout(name)

    def _value(self, name: str) -> str:
        """The script of a readout's text; undefined while there is none."""
        return f"document.querySelector({json.dumps(f'#{self.name} [data-readout={name}] .value')})?.textContent"

    def frames(self) -> int:
        return int(self.root.get_attribute("data-frame") or 0)

    def record(self) -> dict[str, Any]:
        return self._ask("record")  # type: ignore[no-any-return]

    def frame(self) -> dict[str, Any]:
        return self._ask("frame")  # type: ignore[no-any-return]

    def _ask(self, name: str) -> Any:
        """A property of the figure's controller, once it is set up (the page is painted first)."""
        message = "([name, what]) => Ladder.alive.then(() => Ladder.figures.get(name)[what])"
        return self.page.evaluate(message, [self.name, name])

    def settled(self) -> Figure:
        """Wait until no request is pending and nothing moves."""
        until(self.page, f"Ladder.figures.get({self.name!r})?.busy === false")
        return self

    def set(self, name: str, value: str | bool) -> None:
        """Set a control to the value that a reader's keyboard or pointer would leave."""
        control = self.control(name)
        kind = control.first.get_attribute("type")
        if control.first.evaluate("e => e.localName") == "select":
            control.select_option(str(value))
        elif kind == "radio":
            self.root.locator(f'[name="{name}"][value="{value}"]').check(force=True)
        elif kind == "checkbox":
            control.set_checked(bool(value), force=True)
        else:
            control.fill(str(value))

    def drag(self, name: str, dx: float, dy: float, steps: int = 8) -> None:
        """Drag a handle by this many px with the mouse."""
        self.handle(name).scroll_into_view_if_needed()
        box = self.handle(name).bounding_box()
        assert box is not None
        x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
        self.page.mouse.move(x, y)
        self.page.mouse.down()
        self.page.mouse.move(x + dx, y + dy, steps=steps)
        self.page.mouse.up()


def experiments(page: Page, name: str) -> Locator:
    """The buttons to try with a figure, all of them unfolded."""
    folds = page.locator("details.try-this:not([open])")
    while folds.count():
        folds.first.locator("summary").click()
    return page.locator(f'button.try[data-figure="{name}"]')


def figures(page: Page) -> list[Figure]:
    return [Figure(page, node.get_attribute("id") or "") for node in page.locator("figure.figure").all()]


def finger(page: Page, path: Sequence[tuple[float, float]]) -> None:
    """Put a finger down at the first place, draw it through the others and lift it at the last, as touch input."""
    touch = page.context.new_cdp_session(page)
    for kind, places in (("touchStart", path[:1]), ("touchMove", path[1:]), ("touchEnd", [()])):
        for point in places:
            points = [dict(zip("xy", point, strict=True))] if point else []
            touch.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})


def tap_after_drag(target: Locator) -> None:
    """Tap right after a finger was lifted. Chromium ignores a tap while it still handles the drag, which can take any
    time on a busy machine; then tap again, as a reader would."""
    target.evaluate("e => e.addEventListener('click', () => { e.dataset.tapped = ''; }, { once: true })")
    for _ in range(TAPS):
        target.tap()
        try:
            expect(target).to_have_attribute("data-tapped", "", timeout=TAPPED)
        except AssertionError:
            continue
        target.evaluate("e => e.removeAttribute('data-tapped')")
        return
    raise AssertionError(f"{TAPS} taps were taken for none")


def first_record(figure: Figure) -> dict[str, Any]:
    """The record that the build wrote into the page."""
    return json.loads(figure.root.locator("script.figure-record").text_content() or "")["record"]  # type: ignore[no-any-return]


def link_of(record: Any) -> str:
    """A record as a link carries it."""
    return urlsafe_b64encode(json.dumps(record).encode()).decode().rstrip("=")
