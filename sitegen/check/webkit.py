"""WebKit: WebKitGTK's MiniBrowser on a virtual display, driven by its WebDriver and Selenium."""

from __future__ import annotations

import os
import shutil
import subprocess
import tempfile
from pathlib import Path

from selenium import webdriver
from selenium.common.exceptions import WebDriverException
from selenium.webdriver.remote.client_config import ClientConfig
from selenium.webdriver.webkitgtk.options import Options
from selenium.webdriver.webkitgtk.service import Service
from urllib3.exceptions import HTTPError, ReadTimeoutError

from sitegen.problems import first_line

SCREEN = "1600x1400x24"
# Without this, the browser's toolbar keeps its window wider than a phone.
NARROW = "headerbar *, box button, entry, button { min-width: 0; padding: 0; margin: 0; }"
STARTS = 60  # seconds until a start counts as failed


class Display:
    """A virtual X server and empty configuration, data and cache folders. `env`: the environment for a driver on it."""

    def __init__(self) -> None:
        self.server, number = start_display()
        self.home = tempfile.TemporaryDirectory(prefix="ladder-webkit-", ignore_cleanup_errors=True)
        homes = {f"XDG_{kind}_HOME": f"{self.home.name}/{kind.lower()}" for kind in ("CONFIG", "DATA", "CACHE")}
        self.env = {**os.environ, **homes, "DISPLAY": f":{number}", "GDK_BACKEND": "x11"}
        style = Path(homes["XDG_CONFIG_HOME"]) / "gtk-3.0" / "gtk.css"
        style.parent.mkdir(parents=True)
        style.write_text(NARROW, "utf-8")

    def close(self) -> None:
        """End the server, by force if it does not terminate."""
        self.server.terminate()
        try:
            self.server.wait(STARTS)
        except subprocess.TimeoutExpired:
            self.server.kill()
            self.server.wait()
        self.home.cleanup()


def start_display() -> tuple[subprocess.Popen[bytes], str]:
    """Start an X server on the first free display number; the server and that number. Raises RuntimeError if it
    fails."""
    xvfb = shutil.which("Xvfb")
    if not xvfb:
        raise RuntimeError("WebKit needs a display: Xvfb is not on the PATH")
    ours, theirs = os.pipe()
    command = [xvfb, "-displayfd", str(theirs), "-screen", "0", SCREEN, "-nolisten", "tcp"]
    running = subprocess.Popen(command, pass_fds=[theirs], stdin=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    os.close(theirs)
    with open(ours, encoding="ascii") as pipe:
        number = pipe.readline().strip()
    if not number:
        raise RuntimeError(f"Xvfb exited with code {running.wait(STARTS)}")
    return running, number


def session(driver: Path, display: Display, seconds: float) -> tuple[Service, webdriver.Remote]:
    """The driver's running service and a browser with one window; `seconds`: how long any answer may take.

    A browser that does not come up is started once more: WebKitGTK's sometimes ends before its driver has noticed it,
    and the driver then waits for ever.
    """
    try:
        return _start(driver, display, seconds)
    except ReadTimeoutError:
        return _start(driver, display, seconds)


def _start(driver: Path, display: Display, seconds: float) -> tuple[Service, webdriver.Remote]:
    service = Service(str(driver), env=display.env)
    service.start()
    config = ClientConfig(remote_server_addr=service.service_url, timeout=STARTS)
    try:
        browser = webdriver.Remote(service.service_url, options=Options(), client_config=config)
    except BaseException:
        service.stop()
        raise
    config.timeout = round(seconds)  # read again for each answer
    return service, browser


def fault(driver: Path) -> str:
    """Why this program cannot drive a browser; "" if it can. It is tested with a session: its output and exit code for
    --version differ between versions."""
    try:
        display = Display()
    except (RuntimeError, OSError) as error:
        return str(error)
    try:
        service, browser = session(driver, display, STARTS)
        try:
            browser.quit()
        finally:
            service.stop()
    except (WebDriverException, HTTPError, OSError) as error:
        return first_line(error)
    finally:
        display.close()
    return ""
