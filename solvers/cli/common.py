"""What the commands share: how help is set, whole numbers, and JSON."""

from __future__ import annotations

import argparse
import json
import sys
import textwrap
from pathlib import Path
from typing import Any

import numpy as np

UNTRUSTED = 3
"""The exit code of an answer that the method itself does not stand by."""


def program(command: str) -> str:
    """What a usage line calls the program: the name that it was started by."""
    script = Path(sys.argv[0]).stem == "registration-ladder"
    return f"{'registration-ladder' if script else 'python -m solvers'} {command}"


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
    """One JSON document on stdout; what is not finite is null, as JSON has no word for it."""
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
