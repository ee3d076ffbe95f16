"""The Python that a figure hands to its reader: its first lines, and how values and calls are written in it."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

import numpy as np

from solvers import __version__

WHEEL = f"registration_ladder-{__version__}-py3-none-any.whl"
"""The file on the site that pip installs, and that every script needs."""
WIDTH = 88


def headed(text: str, title: str) -> str:
    """A script under the line that installs what it imports, and its figure's title; no script stays none."""
    return f"# pip install {WHEEL}\n# The Registration Ladder: {title}\n\n{text}" if text else ""


def literal(value: Any) -> str:
    """A value of an option as Python writes it, in a script that has imported numpy as np."""
    if isinstance(value, str):
        return json.dumps(value)
    return "np.inf" if isinstance(value, float) and value == np.inf else repr(value)


def named(options: Mapping[str, Any]) -> list[str]:
    """Options as the arguments of a call: ["gate=2.6", …]."""
    return [f"{name}={literal(value)}" for name, value in options.items()]


def called(before: str, *arguments: str, after: str = "") -> list[str]:
    """The lines of a call, `before` up to its bracket: one where it fits, else the arguments on lines of their own."""
    line = f"{before}({', '.join(arguments)}){after}"
    if len(line) <= WIDTH:
        return [line]
    lead = before[: len(before) - len(before.lstrip())]
    lines = [""]
    for one in arguments:
        longer = f"{lines[-1]} {one}," if lines[-1] else f"{lead}    {one},"
        lines = [*lines[:-1], longer] if len(longer) <= WIDTH else [*lines, f"{lead}    {one},"]
    return [f"{before}(", *lines, f"{lead}){after}"]
