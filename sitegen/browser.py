"""A Chromium to drive: the one that is named, one that the machine has, or one that is installed for it."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

from playwright.sync_api import Error, sync_playwright

NAMED = ("CHROMIUM", "LADDER_CHROMIUM")
PROGRAMS = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "microsoft-edge", "msedge")
PLACES = (
    "/Applications/Google Chrome.app/Contents/MacOS/Google Chrome",
    "/Applications/Chromium.app/Contents/MacOS/Chromium",
    "/Applications/Microsoft Edge.app/Contents/MacOS/Microsoft Edge",
    "{ProgramFiles}/Google/Chrome/Application/chrome.exe",
    "{ProgramFiles(x86)}/Google/Chrome/Application/chrome.exe",
    "{LOCALAPPDATA}/Google/Chrome/Application/chrome.exe",
    "{ProgramFiles(x86)}/Microsoft/Edge/Application/msedge.exe",
)

# Headless in a container, and no requests of the browser's own.
FLAGS = (
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
)
INSTALL_SECONDS = 900.0


class BrowserMissing(RuntimeError):
    """No browser could be found or installed; the message says what was tried."""


def chromium(given: Path | None = None) -> Path:
    """A Chromium that starts. What is given, or named by a variable, must do; else the first of the others that does.

    Raises BrowserMissing with everything that was tried.
    """
    named = [(f"{name}={os.environ[name]}", Path(os.environ[name])) for name in NAMED if os.environ.get(name)]
    insisted = [(f"--browser-path {given}", given)] if given else named[:1]
    tried: list[str] = []
    for how, path in insisted or found_or_installed(tried):
        fault = start_fault(path)
        if not fault:
            return path
        tried.append(f"{how}: {fault}")
    raise BrowserMissing(
        "no Chromium to test with. Tried:\n"
        + "".join(f"  {line}\n" for line in tried)
        + "Name one with --browser-path or the variable CHROMIUM."
    )


def found_or_installed(tried: list[str]) -> Iterator[tuple[str, Path]]:
    """Candidates and how they were come by; installs only when asked for more. What led to none is added to `tried`."""
    programs = [path for name in PROGRAMS if (path := shutil.which(name))]
    places = [path for place in PLACES if (path := _filled(place)) and Path(path).is_file()]
    if not programs and not places:
        tried.append(f"the PATH: none of {', '.join(PROGRAMS)}")
    yield from ((path, Path(path)) for path in [*programs, *places])
    own = playwrights_own()
    if own.is_file():
        yield "Playwright's own", own
    for how, command in installers():
        print(f"no browser yet: {how}", file=sys.stderr, flush=True)
        fault = run_fault(command)
        if fault:
            tried.append(f"{how}: {fault}")
            continue
        program = shutil.which("chromium") if command[0] == "apt-get" else str(playwrights_own())
        if program:
            yield how, Path(program)


def _filled(place: str) -> str:
    try:
        return place.format_map(os.environ)
    except KeyError:
        return ""


def playwrights_own() -> Path:
    """Where Playwright keeps the Chromium that it installs, whether it is there or not."""
    with sync_playwright() as playwright:
        return Path(playwright.chromium.executable_path)


def installers() -> Iterator[tuple[str, list[str]]]:
    """What may bring a browser, in the order to try."""
    yield "playwright install chromium", [sys.executable, "-P", "-m", "playwright", "install", "chromium"]
    if hasattr(os, "geteuid") and os.geteuid() == 0 and shutil.which("apt-get"):
        yield "apt-get update", ["apt-get", "update"]
        yield "apt-get install chromium", ["apt-get", "install", "--yes", "--no-install-recommends", "chromium"]


def run_fault(command: list[str]) -> str:
    """Run an installer; what went wrong, or nothing."""
    env = {**os.environ, "DEBIAN_FRONTEND": "noninteractive"}
    try:
        done = subprocess.run(
            command,
            env=env,
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            errors="replace",
            timeout=INSTALL_SECONDS,
            check=False,
        )
    except (OSError, subprocess.TimeoutExpired) as error:
        return str(error)
    said = (done.stdout + done.stderr).strip().splitlines()
    return "" if done.returncode == 0 else f"ended with code {done.returncode}: {' | '.join(said[-3:])}"


def start_fault(path: Path) -> str:
    """Why this browser does not start; nothing when it does."""
    try:
        with sync_playwright() as playwright:
            browser = playwright.chromium.launch(executable_path=path, args=FLAGS)
            browser.new_page().goto("about:blank")
            browser.close()
    except Error as error:
        return str(error).strip().splitlines()[0]
    return ""


def other_engine_fault(name: str) -> str:
    """Why Firefox or WebKit cannot be tested in here, after an attempt to install it; nothing when it can."""
    if name not in ("firefox", "webkit"):
        return f"no engine {name!r}; there are chromium, firefox, webkit"
    install = run_fault([sys.executable, "-P", "-m", "playwright", "install", name])
    try:
        with sync_playwright() as playwright:
            getattr(playwright, name).launch().close()
    except Error as error:
        return f"{name}: {install or str(error).strip().splitlines()[0]}"
    return ""
