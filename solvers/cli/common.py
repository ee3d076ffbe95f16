"""What the commands share: exit codes, how help is wrapped, whole numbers, a progress bar, files to write, and JSON."""

from __future__ import annotations

import argparse
import importlib.util
import json
import os
import sys
import textwrap
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

UNTRUSTED = 3
"""The exit code of an answer that should not be trusted; each command's help says when."""
DRAWN = (".svg", ".png")


def program(command: str = "") -> str:
    """What a usage line and an error call the program: the name that it was started by."""
    script = Path(sys.argv[0]).stem == "registration-ladder"
    return f"{'registration-ladder' if script else 'python -m solvers'} {command}".rstrip()


def able_to_write(path: Path, kinds: Sequence[str]) -> None:
    """Raises ValueError where `path`, given as --out, ends in none of `kinds`, names a folder or lies in none, may not
    be written, or is a picture and matplotlib, an extra, is missing: asked before anything is computed.
    """
    kind = path.suffix.lower()
    if kind not in kinds:
        raise ValueError(f"--out: {path}: expected a name that ends in {', '.join(kinds)}")
    if not os.path.isdir(path.parent):
        raise ValueError(f"--out: {path}: there is no folder {path.parent}")
    if os.path.isdir(path):
        raise ValueError(f"--out: {path}: is a folder; expected a file's name")
    if not os.access(path if os.path.exists(path) else path.parent, os.W_OK):
        raise ValueError(f"--out: {path}: no permission to write there")
    if kind in DRAWN and importlib.util.find_spec("matplotlib") is None:
        raise ValueError("--out: drawing needs matplotlib: pip install matplotlib")


class Bar:
    """A bar on stderr where that is a terminal, cleared at the end; nothing in a log."""

    def __init__(self, what: str) -> None:
        self.what, self.live = what, sys.stderr.isatty()

    def __enter__(self) -> Callable[[int, int], None]:
        return self._show

    def _show(self, done: int, total: int) -> None:
        if self.live:
            bar = "#" * (30 * done // max(total, 1))
            print(f"\r{self.what} [{bar:30}] {done}/{total}", end="", file=sys.stderr, flush=True)

    def __exit__(self, *_: object) -> None:
        if self.live:
            print("\r\033[K", end="", file=sys.stderr, flush=True)


class Help(argparse.HelpFormatter):
    """argparse's own, which would break a method's name at its hyphens."""

    def _fill_text(self, text: str, width: int, indent: str) -> str:
        return textwrap.fill(text, width, initial_indent=indent, subsequent_indent=indent, break_on_hyphens=False)

    def _split_lines(self, text: str, width: int) -> list[str]:
        return textwrap.wrap(" ".join(text.split()), width, break_on_hyphens=False)


def whole(text: str) -> int:
    """A whole number that 64 bits hold."""
    number = int(text)
    if not -(2**63) <= number < 2**63:
        raise argparse.ArgumentTypeError(f"a number of {len(text)} digits; expected 18 at most")
    return number


def printed(told: Any) -> None:
    """One JSON document on stdout; numbers that are not finite become null, as JSON has no word for them."""
    print(json.dumps(_plain(told), indent=2, allow_nan=False))


def _plain(value: Any) -> Any:
    if isinstance(value, dict):
        return {name: _plain(each) for name, each in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(each) for each in value]
    if isinstance(value, np.generic | np.ndarray):
        return _plain(value.tolist())
    if isinstance(value, float) and not np.isfinite(value):
        return None
    return value
