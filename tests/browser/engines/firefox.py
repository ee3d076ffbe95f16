"""Firefox, through WebDriver BiDi on its own remote debugging port, without a driver program."""

from __future__ import annotations

import base64
import json
import subprocess
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import websocket

from tests.browser.engines.window import PATIENCE, Place, key_actions, pointer_actions

# A fresh profile asks no questions and makes no requests.
PREFERENCES = {
    "app.update.enabled": False,
    "browser.aboutwelcome.enabled": False,
    "browser.shell.checkDefaultBrowser": False,
    "datareporting.policy.dataSubmissionEnabled": False,
    "network.captive-portal-service.enabled": False,
    "network.connectivity-service.enabled": False,
    "toolkit.telemetry.enabled": False,
}
# Logged for a formula that is laid out before all of it has arrived; a test checks that it is whole in the end.
HALF_READ = "Invalid markup: Incorrect number of children for <m"
HEARD = ("log.entryAdded", "network.beforeRequestSent")


class Firefox:
    """A running Firefox with its own profile."""

    def __init__(self, program: Path) -> None:
        self.profile = tempfile.TemporaryDirectory(prefix="ladder-firefox-", ignore_cleanup_errors=True)
        home = Path(self.profile.name)
        lines = [f"user_pref({json.dumps(name)}, {json.dumps(value)});\n" for name, value in PREFERENCES.items()]
        (home / "user.js").write_text("".join(lines), "utf-8")
        command = [str(program), "--headless", "--no-remote", "--profile", str(home), "--remote-debugging-port", "0"]
        quiet = subprocess.DEVNULL
        self.process = subprocess.Popen([*command, "about:blank"], stdin=quiet, stdout=quiet, stderr=quiet)
        try:
            self.session = Session(self.address(home / "WebDriverBiDiServer.json"))
        except BaseException:
            self.process.kill()
            raise

    def address(self, file: Path) -> str:
        """The address that Firefox listens on, which it writes into its profile."""
        end = time.monotonic() + PATIENCE
        while time.monotonic() < end:
            if self.process.poll() is not None:
                raise RuntimeError(f"Firefox ended with code {self.process.returncode} before it could be driven")
            try:
                address = json.loads(file.read_text("utf-8"))
                return f"ws://{address['ws_host']}:{address['ws_port']}/session"
            except (OSError, ValueError):  # missing or incomplete
                time.sleep(0.05)
        raise RuntimeError(f"Firefox has not opened its debugging port within {PATIENCE} s")

    def window(self) -> FirefoxWindow:
        return FirefoxWindow(self.session)

    def close(self) -> None:
        self.session.call("browser.close")
        self.process.wait(PATIENCE)
        self.profile.cleanup()


class Session:
    """A BiDi session: one command at a time; events that arrive in between are kept."""

    def __init__(self, url: str) -> None:
        self.socket = websocket.create_connection(url, timeout=2 * PATIENCE, suppress_origin=True)
        self.number = 0
        self.events: list[dict[str, Any]] = []
        self.call("session.new", capabilities={})
        self.call("session.subscribe", events=HEARD)

    def call(self, method: str, **params: Any) -> dict[str, Any]:
        """A command's result. Raises RuntimeError with the browser's error."""
        self.number += 1
        self.socket.send(json.dumps({"id": self.number, "method": method, "params": params}))
        while (message := json.loads(self.socket.recv())).get("id") != self.number:
            self.events.append(message)
        if message["type"] == "error":
            raise RuntimeError(f"{method}: {message['error']}: {message['message']}")
        return dict(message["result"])


class FirefoxWindow:
    """A tab in a user context, which is Firefox's separate storage."""

    def __init__(self, session: Session) -> None:
        self.session = session
        self.user = session.call("browser.createUserContext")["userContext"]
        self.tab = session.call("browsingContext.create", type="tab", userContext=self.user)["context"]

    def call(self, method: str, **params: Any) -> dict[str, Any]:
        return self.session.call(method, context=self.tab, **params)

    def size(self, width: int, height: int) -> None:
        self.call("browsingContext.setViewport", viewport={"width": width, "height": height}, devicePixelRatio=1.0)

    def open(self, url: str) -> None:
        self.call("browsingContext.navigate", url=url, wait="complete")

    def evaluate(self, expression: str) -> str:
        target = {"context": self.tab}
        text = self.session.call("script.evaluate", expression=expression, target=target, awaitPromise=True)
        if text["type"] == "exception":
            raise RuntimeError(text["exceptionDetails"]["text"])
        return str(text["result"]["value"])

    def pointer(self, path: Sequence[Place]) -> None:
        self.call("input.performActions", actions=pointer_actions(path))

    def press(self, key: str) -> None:
        self.call("input.performActions", actions=key_actions(key))

    def picture(self) -> bytes:
        return base64.b64decode(self.call("browsingContext.captureScreenshot")["data"])

    def complaints(self) -> list[str]:
        self.session.call("session.status")  # brings pending events
        entries = [event["params"] for event in self.session.events if event["method"] == "log.entryAdded"]
        mine = [entry for entry in entries if entry["source"].get("context", self.tab) == self.tab]
        messages = [str(entry["text"]) for entry in mine if entry["level"] in ("error", "warn")]
        return [text for text in messages if not text.startswith(HALF_READ)]

    def close(self) -> None:
        self.session.call("browser.removeUserContext", userContext=self.user)
