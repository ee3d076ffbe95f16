"""What the commands share: exit codes, how help is wrapped, whole numbers, a progress bar, files and JSON."""

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

from solvers.io.text import check_size, told

UNTRUSTED = 3
"""The exit code of an answer that should not be trusted; each command's help says when."""
DRAWN = (".svg", ".png")


def program(command: str = "") -> str:
    """The program's name in usage lines and errors: the one that it was started by."""
    script = Path(sys.argv[0]).stem == "registration-ladder"
    return f"{'registration-ladder' if script else 'python -m solvers'} {command}".rstrip()


def able_to_write(path: Path, kinds: Sequence[str]) -> None:
    """Raise ValueError if `path`, given as --out, ends in none of `kinds`, names a folder or lies in none, may not be
    written, or is a picture and matplotlib, an extra, is missing. Called before anything is computed.
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


def bytes_of(path: Path, most: int) -> bytes:
    """The bytes of a file, or for `-` of standard input. Raises ValueError, without reading to its end, if there are
    more than `most`, and OSError if it cannot be read.
    """
    if str(path) == "-":
        if sys.stdin is None:  # closed by the caller, as by `<&-`
            raise OSError("standard input is closed")
        data = sys.stdin.buffer.read(most + 1)
    else:
        check_size(path.stat().st_size, most)
        with path.open("rb") as file:
            data = file.read(most + 1)
    if len(data) > most:  # a device or a pipe, which does not say its size
        raise ValueError(f"it has more than the limit of {most / 1e6:.0f} MB")
    return data


class Bar:
    """A progress bar on stderr, cleared at the end; shown only on a terminal, never in a log."""

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
    """argparse's formatter, except that it does not break a method's name at its hyphens."""

    def _fill_text(self, text: str, width: int, indent: str) -> str:
        return textwrap.fill(text, width, initial_indent=indent, subsequent_indent=indent, break_on_hyphens=False)

    def _split_lines(self, text: str, width: int) -> list[str]:
        return textwrap.wrap(" ".join(text.split()), width, break_on_hyphens=False)


def whole(text: str) -> int:
    """Parse a whole number that fits into 64 bits."""
    try:
        number = int(text)
    except ValueError:  # argparse would show this function's name
        raise argparse.ArgumentTypeError(f"{told(text)} is not a whole number") from None
    if not -(2**63) <= number < 2**63:
        raise argparse.ArgumentTypeError(f"a number of {len(text)} digits; expected 18 at most")
    return number


def printed(document: Any) -> None:
    """Print one JSON document; numbers that are not finite become null, since JSON cannot express them."""
    print(json.dumps(_plain(document), indent=2, allow_nan=False))


def _plain(value: Any) -> Any:
    if isinstance(value, dict):
        return {name: _plain(item) for name, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(item) for item in value]
    if isinstance(value, np.generic | np.ndarray):
        return _plain(value.tolist())
    if isinstance(value, float) and not np.isfinite(value):
        return None
    return value
