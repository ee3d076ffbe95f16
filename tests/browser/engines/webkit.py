"""A reader's window in WebKit; see sitegen.check.webkit for how it is started."""

from __future__ import annotations

import base64
from collections.abc import Sequence
from pathlib import Path

from sitegen.check.webkit import Display, session
from tests.browser.engines.window import PATIENCE, Place, key_actions, pointer_actions


class Webkit:
    """A display that starts one browser per window."""

    def __init__(self, driver: Path) -> None:
        self.driver = driver
        self.display = Display()

    def window(self) -> WebkitWindow:
        return WebkitWindow(self.driver, self.display)

    def close(self) -> None:
        self.display.close()


class WebkitWindow:
    """A browser with one window."""

    def __init__(self, driver: Path, display: Display) -> None:
        self.wrong: list[str] = []
        self.service, self.driver = session(driver, display, 3 * PATIENCE)
        self.driver.set_script_timeout(2 * PATIENCE)

    def size(self, width: int, height: int) -> None:
        self.driver.set_window_rect(width=width, height=height)

    def open(self, url: str) -> None:
        self.complaints()
        self.driver.get(url)

    def evaluate(self, expression: str) -> str:
        text = f"""const [done] = arguments;
          Promise.resolve({expression}).then((value) => done([value]), (error) => done([null, String(error)]))"""
        value, *error = self.driver.execute_async_script(text)
        if error:
            raise RuntimeError(error[0])
        return str(value)

    def pointer(self, path: Sequence[Place]) -> None:
        self.driver.execute("actions", {"actions": pointer_actions(path)})

    def press(self, key: str) -> None:
        self.driver.execute("actions", {"actions": key_actions(key)})

    def picture(self) -> bytes:
        return base64.b64decode(self.driver.get_screenshot_as_base64())

    def complaints(self) -> list[str]:
        """The driver reports none: the server's listener collects them in the page, and they are lost with the page."""
        self.wrong += self.driver.execute_script("return (globalThis.complaints ?? []).splice(0)")
        return self.wrong

    def close(self) -> None:
        try:
            self.driver.quit()
        finally:
            self.service.stop()
