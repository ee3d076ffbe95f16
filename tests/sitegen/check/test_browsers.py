"""A WebKit driver works if it opens a session, whatever it answers to --version; shown with stand-in programs. Also:
when Chromium's headless shell is used."""

from __future__ import annotations

import shutil
import sys
from dataclasses import replace
from pathlib import Path

import pytest

from sitegen.check import browsers, webkit
from sitegen.check.browsers import BrowserMissing, found

# Like WebKitWebDriver 2.50: --version prints its usage and exits with code 1; a session is requested over HTTP.
DRIVER = """#!{python}
import json, os, sys, threading
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer

if "--version" in sys.argv:
    sys.exit("Usage: WebKitWebDriver options")
assert os.environ["DISPLAY"] == ":77"

class Driver(BaseHTTPRequestHandler):
    def answer(self, value, code=200):
        body = json.dumps({{"value": value}}).encode()
        self.send_response(code)
        self.send_header("Content-Type", "application/json")
        self.send_header("Content-Length", str(len(body)))
        self.end_headers()
        self.wfile.write(body)

    def do_POST(self):
        self.rfile.read(int(self.headers["Content-Length"]))
        with open({asked!r}, "a+") as asked:
            asked.seek(0)
            nth = asked.read().count("asked")
            asked.write("asked ")
        if nth < {silent}:
            threading.Event().wait()
        elif {refuses}:
            self.answer({{"error": "session not created", "message": "no browser here", "stacktrace": ""}}, 500)
        else:
            self.answer({{"sessionId": "one", "capabilities": {{}}}})

    def do_DELETE(self):
        open({asked!r}, "a").write("ended ")
        self.answer(None)

    def do_GET(self):
        self.answer({{"ready": True, "message": ""}})
        if self.path == "/shutdown":
            os._exit(0)

    def log_message(self, *_):
        pass

ThreadingHTTPServer(("127.0.0.1", int(sys.argv[sys.argv.index("-p") + 1])), Driver).serve_forever()
"""
DISPLAY = """#!{python}
import os, signal, sys
os.write(int(sys.argv[sys.argv.index("-displayfd") + 1]), b"77\\n")
signal.pause()
"""


def program(path: Path, text: str) -> Path:
    path.write_text(text, "utf-8")
    path.chmod(0o755)
    return path


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder on the PATH with a stand-in for the display server."""
    program(tmp_path / "Xvfb", DISPLAY.format(python=sys.executable))
    monkeypatch.setenv("PATH", str(tmp_path), prepend=":")
    return tmp_path


def driver(folder: Path, *, refuses: bool = False, silent: int = 0) -> Path:
    """A stand-in driver; `silent` is how many requests it leaves unanswered first."""
    text = DRIVER.format(python=sys.executable, refuses=refuses, silent=silent, asked=str(folder / "asked"))
    return program(folder / "WebKitWebDriver", text)


def test_a_driver_that_gives_a_session_is_taken(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """It is named by a variable; its session is closed again."""
    monkeypatch.setenv("WEBKIT_DRIVER", str(driver(folder)))
    assert found("webkit") == folder / "WebKitWebDriver"
    assert (folder / "asked").read_text("utf-8").startswith("asked ended")


def test_a_browser_that_does_not_come_up_is_started_once_more(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A driver whose browser has crashed waits for it for ever; a second one that hangs is a fault."""
    monkeypatch.setattr(webkit, "STARTS", 2)
    assert webkit.fault(driver(folder, silent=1)) == ""
    assert (folder / "asked").read_text("utf-8").startswith("asked asked ended")
    assert "Read timed out" in webkit.fault(driver(folder, silent=9))


def test_one_that_refuses_or_ends_is_told(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert "no browser here" in webkit.fault(driver(folder, refuses=True))
    ends = program(folder / "ends", f"#!{sys.executable}\nraise SystemExit(3)\n")
    monkeypatch.setenv("WEBKIT_DRIVER", str(ends))
    with pytest.raises(BrowserMissing, match=r"WEBKIT_DRIVER=.*ends: .*Status code was: 3"):
        found("webkit")
    assert "No such file" in webkit.fault(folder / "absent")


def test_without_a_display_that_is_what_is_told(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(shutil, "which", lambda name: None)
    assert webkit.fault(driver(folder)) == "WebKit needs a display: Xvfb is not on the PATH"


def test_the_shell_is_driven_where_it_starts_and_no_chromium_is_meant(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A shell that does not start is not used; if a Chromium is given or named, its user wants that one tested."""
    shell = program(folder / "chromium-headless-shell", "")
    for name in browsers.ENGINES["chromium"].named:
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr(browsers, "installers", lambda engine: iter(()))
    monkeypatch.setattr(browsers, "SHELL", replace(browsers.SHELL, fault=lambda path: "does not start"))
    assert browsers.shell() is None
    monkeypatch.setattr(browsers, "SHELL", replace(browsers.SHELL, fault=lambda path: ""))
    assert browsers.shell() == shell
    assert browsers.shell(browser_path=shell) is None
    monkeypatch.setenv("CHROMIUM", str(shell))
    assert browsers.shell() is None
