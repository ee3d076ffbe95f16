"""The project's .venv: created on first use from requirements.lock, entered by restarting with its Python.

Standard library only, since it runs before anything is installed. The stamp in .venv is written last and holds the
lock's hash: without a stamp a set-up was interrupted, with another hash the lock has changed since.
"""

from __future__ import annotations

import hashlib
import importlib.util
import os
import subprocess
import sys
import time
from collections import deque
from pathlib import Path

LOCK = "requirements.lock"
STAMP = "made-from.sha256"


class SetupError(RuntimeError):
    """.venv could not be created; the message says what to do."""


def folder(root: Path) -> Path:
    """The folder of the environment of the checkout at `root`."""
    return root / ".venv"


def python(root: Path) -> Path:
    """The environment's interpreter."""
    return folder(root) / ("Scripts/python.exe" if os.name == "nt" else "bin/python")


def lock_hash(root: Path) -> str:
    """The hash of the lock, which the stamp must hold."""
    return hashlib.sha256((root / LOCK).read_bytes()).hexdigest()


def is_ready(root: Path) -> bool:
    """Whether .venv is complete and made from the current lock."""
    stamp = folder(root) / STAMP
    return python(root).is_file() and stamp.is_file() and stamp.read_text("utf-8").strip() == lock_hash(root)


def is_inside(root: Path) -> bool:
    """Whether this process runs in the environment."""
    return Path(sys.prefix).resolve() == folder(root).resolve()


def enter(root: Path, script: Path, words: list[str]) -> None:
    """Set up the environment if needed and restart in it; returns only inside it. Raises SetupError."""
    if not is_ready(root):
        set_up(root)
    if is_inside(root):
        return
    command = [str(python(root)), str(script), *words]
    sys.stdout.flush()
    sys.stderr.flush()
    if os.name == "nt":  # exec would return control to the console before the command ends
        raise SystemExit(subprocess.call(command))
    os.execv(command[0], command)


def set_up(root: Path) -> None:
    """Create the environment, or update a complete one to the lock. Raises SetupError."""
    began = time.monotonic()
    stamp = folder(root) / STAMP
    complete = stamp.is_file() and python(root).is_file()
    stamp.unlink(missing_ok=True)
    if not complete and not is_inside(root):
        _create(root)
    _install(root)
    stamp.write_text(lock_hash(root) + "\n", "utf-8")
    _say(f"set up .venv in {time.monotonic() - began:.0f} s")


def _create(root: Path) -> None:
    for module in ("venv", "ensurepip"):
        if importlib.util.find_spec(module) is None:
            version = f"{sys.version_info.major}.{sys.version_info.minor}"
            raise SetupError(
                f"this Python ({sys.executable}) lacks {module}, which is needed to create .venv.\n"
                f"On Debian or Ubuntu: apt-get install python3-venv   (or python{version}-venv). Then run this again."
            )
    _say("setting up .venv (only once): creating it")
    result = subprocess.run(
        [sys.executable, "-P", "-m", "venv", "--clear", str(folder(root))],
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        errors="replace",
        check=False,
    )
    if result.returncode != 0:
        raise SetupError(f".venv could not be created:\n{(result.stdout + result.stderr).strip()}")


def _install(root: Path) -> None:
    command = [str(python(root)), "-P", "-m", "pip", "install", "--require-hashes", "--no-input"]
    command += ["--disable-pip-version-check", "--progress-bar", "off"]
    # Most modules are never imported; Python compiles those that are.
    command += ["--no-compile", "-r", str(root / LOCK)]
    lines = (root / LOCK).read_text("utf-8").splitlines()
    total = sum("==" in line and not line.startswith((" ", "#")) for line in lines)
    show = _Line()
    last: deque[str] = deque(maxlen=20)
    count = 0
    with subprocess.Popen(
        command,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        errors="replace",
    ) as process:
        assert process.stdout is not None
        try:
            for line in process.stdout:
                last.append(line.rstrip())
                words = line.split()
                if words[:1] in (["Collecting"], ["Requirement"]):  # "Requirement already satisfied: …"
                    count += 1
                    name = words[1] if words[0] == "Collecting" else words[3]
                    show(f"setting up .venv: {count} of at most {total}: {name}")
                elif words[:1] == ["Downloading"]:
                    show(f"setting up .venv: {count} of at most {total}: {Path(words[1]).name} {' '.join(words[2:])}")
                elif words[:2] == ["Installing", "collected"]:
                    show(f"setting up .venv: installing {len(words) - 3} packages")
        except BaseException:
            process.kill()
            raise
        finally:
            show.end()
    if process.returncode != 0:
        raise SetupError("pip could not install the locked packages:\n  " + "\n  ".join(last))


class _Line:
    """A progress line, overwritten on a terminal; elsewhere a new line at most every ten seconds, to keep logs
    short."""

    def __init__(self) -> None:
        self._over = sys.stderr.isatty()
        self._last_time = 0.0

    def __call__(self, text: str) -> None:
        if self._over:
            print(f"\r\x1b[K{text[:100]}", end="", file=sys.stderr, flush=True)
        elif time.monotonic() - self._last_time > 10:
            self._last_time = time.monotonic()
            _say(text)

    def end(self) -> None:
        if self._over:
            print("\r\x1b[K", end="", file=sys.stderr, flush=True)


def _say(text: str) -> None:
    print(text, file=sys.stderr, flush=True)
