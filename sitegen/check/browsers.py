"""Browsers to drive: a named one, one on the machine, or one that is installed on demand."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

from playwright.sync_api import Error, sync_playwright

from sitegen.check import webkit
from sitegen.problems import first_line

# Headless in a container, without the browser's own requests; in the headless shell, letters as wide as in a window.
FLAGS = (
    "--no-sandbox",
    "--disable-gpu",
    "--font-render-hinting=none",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
)
INSTALL_SECONDS = 900.0


class BrowserMissing(RuntimeError):
    """No browser could be found or installed; the message says what was tried."""


def run_fault(command: list[str]) -> str:
    """Run an installer, or a program to see if it starts; what went wrong, or ""."""
    env = {**os.environ, "DEBIAN_FRONTEND": "noninteractive"}
    try:
        result = subprocess.run(
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
    output = (result.stdout + result.stderr).strip().splitlines()
    return "" if result.returncode == 0 else f"exited with code {result.returncode}: {' | '.join(output[-3:])}"


def chromium_fault(path: Path) -> str:
    """Why this Chromium does not start; "" if it does."""
    try:
        with sync_playwright() as playwright:
            browser = playwright.chromium.launch(executable_path=path, args=FLAGS)
            browser.new_page().goto("about:blank")
            browser.close()
    except Error as error:
        return first_line(error)
    return ""


def firefox_fault(path: Path) -> str:
    """Why this Firefox does not start; "" if it does."""
    return run_fault([str(path), "--version"])


@dataclass(frozen=True)
class Engine:
    """How to find or install one of the engines.

    named: variables that may hold its path. programs: its names on the PATH. places: other paths, with variables in
    braces. packages: Debian's. fault: returns why a program does not start.
    """

    title: str
    named: tuple[str, ...]
    programs: tuple[str, ...]
    places: tuple[str, ...]
    packages: tuple[str, ...]
    fault: Callable[[Path], str]


ENGINES = {
    "chromium": Engine(
        "Chromium",
        ("CHROMIUM", "LADDER_CHROMIUM"),
        ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "microsoft-edge", "msedge"),
        (
            "/Applications/Google Chrome.app/Contents/MacOS/Google Chrome",
            "/Applications/Chromium.app/Contents/MacOS/Chromium",
            "/Applications/Microsoft Edge.app/Contents/MacOS/Microsoft Edge",
            "{ProgramFiles}/Google/Chrome/Application/chrome.exe",
            "{ProgramFiles(x86)}/Google/Chrome/Application/chrome.exe",
            "{LOCALAPPDATA}/Google/Chrome/Application/chrome.exe",
            "{ProgramFiles(x86)}/Microsoft/Edge/Application/msedge.exe",
        ),
        ("chromium",),
        chromium_fault,
    ),
    "firefox": Engine(
        "Firefox",
        ("FIREFOX", "LADDER_FIREFOX"),
        ("firefox-esr", "firefox"),
        ("/Applications/Firefox.app/Contents/MacOS/firefox", "{ProgramFiles}/Mozilla Firefox/firefox.exe"),
        ("firefox-esr",),
        firefox_fault,
    ),
    "webkit": Engine(
        "WebKitGTK driver",
        ("WEBKIT_DRIVER", "LADDER_WEBKIT"),
        ("WebKitWebDriver",),
        (),
        ("webkit2gtk-driver", "xvfb"),
        webkit.fault,
    ),
}

SHELL = Engine(
    "Chromium's headless shell",
    (),
    ("chromium-headless-shell", "chrome-headless-shell"),
    (),
    ("chromium-headless-shell",),
    chromium_fault,
)


def chromium(browser_path: Path | None = None) -> Path:
    """A Chromium that starts; see `found`."""
    return found("chromium", browser_path)


def shell(browser_path: Path | None = None) -> Path | None:
    """Chromium's headless shell, installed if possible: the same engine without a window, which loads a page with a
    third of the work. None if there is none, or if a Chromium is given or named, which then takes precedence."""
    if browser_path or any(os.environ.get(variable) for variable in ENGINES["chromium"].named):
        return None
    return next((path for _, path in found_or_installed(SHELL, []) if not SHELL.fault(path)), None)


def found(name: str, browser_path: Path | None = None) -> Path:
    """The program of an engine: the one given or named by a variable, which must start, else the first other that does.

    Raises BrowserMissing with everything that was tried.
    """
    engine = ENGINES[name]
    by_variable = [
        (f"{variable}={os.environ[variable]}", Path(os.environ[variable]))
        for variable in engine.named
        if os.environ.get(variable)
    ]
    mandatory = [(f"--browser-path {browser_path}", browser_path)] if browser_path else by_variable[:1]
    attempts: list[str] = []
    for source, path in mandatory or found_or_installed(engine, attempts):
        fault = engine.fault(path)
        if not fault:
            return path
        attempts.append(f"{source}: {fault}")
    raise BrowserMissing(
        f"no {engine.title} to test with. Tried:\n"
        + "".join(f"  {line}\n" for line in attempts)
        + f"Specify one with {'--browser-path or ' if name == 'chromium' else ''}the variable {engine.named[0]}."
    )


def found_or_installed(engine: Engine, attempts: list[str]) -> Iterator[tuple[str, Path]]:
    """Candidates and how they were found; installs only if more are requested. Failures go to `attempts`."""
    programs = [path for name in engine.programs if (path := shutil.which(name))]
    places = [path for pattern in engine.places if (path := _fill(pattern)) and Path(path).is_file()]
    if not programs and not places:
        attempts.append(f"the PATH: none of {', '.join(engine.programs)}")
    yield from ((path, Path(path)) for path in [*programs, *places])
    if engine is ENGINES["chromium"] and (chromium := playwrights_own()).is_file():
        yield "Playwright's own", chromium
    for description, command in installers(engine):
        print(f"no {engine.title} yet: {description}", file=sys.stderr, flush=True)
        fault = run_fault(command)
        if fault:
            attempts.append(f"{description}: {fault}")
            continue
        program = shutil.which(engine.programs[0]) if command[0] == "apt-get" else str(playwrights_own())
        if program:
            yield description, Path(program)


def _fill(pattern: str) -> str:
    try:
        return pattern.format_map(os.environ)
    except KeyError:
        return ""


def playwrights_own() -> Path:
    """The path at which Playwright installs its Chromium, whether or not it is there."""
    with sync_playwright() as playwright:
        return Path(playwright.chromium.executable_path)


def installers(engine: Engine) -> Iterator[tuple[str, list[str]]]:
    """Commands that may install an engine, in the order to try."""
    if engine is ENGINES["chromium"]:
        yield "playwright install chromium", [sys.executable, "-P", "-m", "playwright", "install", "chromium"]
    if hasattr(os, "geteuid") and os.geteuid() == 0 and shutil.which("apt-get"):
        yield "apt-get update", ["apt-get", "update"]
        packages = engine.packages
        yield (
            f"apt-get install {' '.join(packages)}",
            ["apt-get", "install", "--yes", "--no-install-recommends", *packages],
        )
