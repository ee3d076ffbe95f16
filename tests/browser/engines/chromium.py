"""Chromium, through Playwright."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from playwright.sync_api import BrowserContext, ConsoleMessage, Playwright

from sitegen.check.browsers import FLAGS
from tests.browser.engines.window import Place


class Chromium:
    """A running Chromium."""

    def __init__(self, program: Path, playwright: Playwright) -> None:
        self.browser = playwright.chromium.launch(executable_path=program, args=FLAGS)

    def window(self) -> ChromiumWindow:
        return ChromiumWindow(self.browser.new_context())

    def close(self) -> None:
        self.browser.close()


class ChromiumWindow:
    """A page in its own context."""

    def __init__(self, context: BrowserContext) -> None:
        self.context = context
        self.wrong: list[str] = []
        context.on("console", self._on_console)
        context.on("weberror", lambda error: self.wrong.append(str(error.error)))
        self.page = context.new_page()

    def _on_console(self, message: ConsoleMessage) -> None:
        if message.type in ("error", "warning"):
            self.wrong.append(f"{message.text} ({message.location['url']})")

    def size(self, width: int, height: int) -> None:
        self.page.set_viewport_size({"width": width, "height": height})

    def open(self, url: str) -> None:
        self.page.goto(url)

    def evaluate(self, expression: str) -> str:
        return str(self.page.evaluate(expression))

    def pointer(self, path: Sequence[Place]) -> None:
        self.page.mouse.move(*path[0])
        self.page.mouse.down()
        for point in path[1:]:
            self.page.mouse.move(*point)
        self.page.mouse.up()

    def press(self, key: str) -> None:
        self.page.keyboard.press(key)

    def picture(self) -> bytes:
        return bytes(self.page.screenshot())

    def complaints(self) -> list[str]:
        return self.wrong

    def close(self) -> None:
        self.context.close()
