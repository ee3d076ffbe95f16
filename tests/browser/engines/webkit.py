"""WebKit: WebKitGTK's own small browser on a display of its own, through its WebDriver and Selenium."""

from __future__ import annotations

import base64
import os
import shutil
import subprocess
import tempfile
from collections.abc import Sequence
from pathlib import Path

from selenium import webdriver
from selenium.webdriver.remote.client_config import ClientConfig
from selenium.webdriver.webkitgtk.options import Options
from selenium.webdriver.webkitgtk.service import Service

from tests.browser.engines.window import PATIENCE, Place, key_actions, pointer_actions

SCREEN = "1600x1400x24"
# Without this the browser's own toolbar keeps its window wider than a phone.
NARROW = "headerbar *, box button, entry, button { min-width: 0; padding: 0; margin: 0; }"


class Webkit:
    """A display, and a home folder with nothing in it, for one browser a window."""

    def __init__(self, driver: Path) -> None:
        self.driver = driver
        self.home = tempfile.TemporaryDirectory(prefix="ladder-webkit-", ignore_cleanup_errors=True)
        self.display, number = start_display()
        homes = {f"XDG_{kind}_HOME": f"{self.home.name}/{kind.lower()}" for kind in ("CONFIG", "DATA", "CACHE")}
        self.env = {**os.environ, **homes, "DISPLAY": f":{number}", "GDK_BACKEND": "x11"}
        style = Path(homes["XDG_CONFIG_HOME"]) / "gtk-3.0" / "gtk.css"
        style.parent.mkdir(parents=True)
        style.write_text(NARROW, "utf-8")

    def window(self) -> WebkitWindow:
        return WebkitWindow(Service(str(self.driver), env=self.env))

    def close(self) -> None:
        self.display.terminate()
        self.display.wait(PATIENCE)
        self.home.cleanup()


def start_display() -> tuple[subprocess.Popen[bytes], str]:
    """An X server that draws nowhere, and its number: it takes the first that is free, and tells."""
    xvfb = shutil.which("Xvfb")
    if not xvfb:
        raise RuntimeError("WebKit needs Xvfb, which is not on the PATH")
    ours, theirs = os.pipe()
    command = [xvfb, "-displayfd", str(theirs), "-screen", "0", SCREEN, "-nolisten", "tcp"]
    running = subprocess.Popen(command, pass_fds=[theirs], stdin=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    os.close(theirs)
    with open(ours, encoding="ascii") as told:
        number = told.readline().strip()
    if not number:
        raise RuntimeError(f"Xvfb ended with code {running.wait(PATIENCE)}")
    return running, number


class WebkitWindow:
    """A browser with one window."""

    def __init__(self, service: Service) -> None:
        self.service = service
        self.wrong: list[str] = []
        service.start()
        where = service.service_url
        config = ClientConfig(remote_server_addr=where, timeout=3 * PATIENCE)
        try:
            self.driver = webdriver.Remote(where, options=Options(), client_config=config)
        except BaseException:
            service.stop()
            raise
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
        """Its driver tells of none: the server's listener has gathered the page's, and they go with the page."""
        self.wrong += self.driver.execute_script("return (globalThis.complaints ?? []).splice(0)")
        return self.wrong

    def close(self) -> None:
        try:
            self.driver.quit()
        finally:
            self.service.stop()
