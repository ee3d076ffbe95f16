"""Writing the Python script that a figure offers its reader: the header, values, arguments and calls."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

import numpy as np

from solvers import __version__

WHEEL = f"registration_ladder-{__version__}-py3-none-any.whl"
"""The wheel on the site that pip installs; every script needs it."""
WIDTH = 88


def headed(text: str, title: str) -> str:
    """The script below a header that says how to install its imports and names its figure; "" stays ""."""
    return f"# pip install {WHEEL}\n# The Registration Ladder: {title}\n\n{text}" if text else ""


def literal(value: Any) -> str:
    """The Python literal of an option's value, in a script that has imported numpy as np."""
    if isinstance(value, str):
        return json.dumps(value)
    return "np.inf" if isinstance(value, float) and value == np.inf else repr(value)


def named(options: Mapping[str, Any]) -> list[str]:
    """Options as keyword arguments: ["gate=2.6", …]."""
    return [f"{name}={literal(value)}" for name, value in options.items()]


def called(before: str, *arguments: str, after: str = "") -> list[str]:
    """The lines of a call, `before` being what precedes its bracket: one line if it fits, else arguments below it."""
    line = f"{before}({', '.join(arguments)}){after}"
    if len(line) <= WIDTH:
        return [line]
    lead = before[: len(before) - len(before.lstrip())]
    lines: list[str] = []
    for argument in arguments:
        if lines and len(longer := f"{lines[-1]} {argument},") <= WIDTH:
            lines[-1] = longer
        else:
            lines.append(f"{lead}    {argument},")
    return [f"{before}(", *lines, f"{lead}){after}"]
