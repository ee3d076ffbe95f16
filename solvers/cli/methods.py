"""`methods`: list the methods, with their papers and options."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import fields
from math import inf
from typing import Any

from solvers import METHODS
from solvers.cli.common import Help, printed, program
from solvers.core.registry import method_of


def parser() -> argparse.ArgumentParser:
    """The command's arguments."""
    cli = argparse.ArgumentParser(
        prog=program("methods"),
        description="List the methods and the dimensions they work in. With a name: show its paper, and its options"
        " with their defaults.",
        formatter_class=Help,
    )
    cli.add_argument("names", nargs="*", metavar="METHOD", help="the method to describe")
    cli.add_argument("--json", action="store_true", help="print one JSON document instead of text")
    return cli


def methods(arguments: Sequence[str]) -> int:
    """Run the command and return its exit code. Raises ValueError for an unknown name."""
    args = parser().parse_args(arguments)
    names = [method_of(name, "METHOD").name for name in args.names] or list(METHODS)
    if args.json:
        described = [told(name) for name in names]
        for about in described:  # JSON has no infinity, and null stands for None
            about["options"] = {option: "inf" if x == inf else x for option, x in about["options"].items()}
        printed(described)
        return 0
    for name in names:
        about = told(name)
        dims = "any" if about["dims"] is None else " or ".join(f"{d}-D" for d in about["dims"])
        print(f"{name:24}{dims:12}{about['summary']}")
        if args.names:
            takes = [word for word in ("paired", "weighted") if about[word]]
            print(f"{'':24}{about['source']}{''.join(f'; {word}' for word in takes)}")
            for option, default in about["options"].items():
                print(f"{'':24}{option}={default}")
    return 0


def told(name: str) -> dict[str, Any]:
    """The facts of a method, by name, as plain values."""
    method = METHODS[name]
    usual = method.options()
    return {
        "name": name,
        "summary": method.summary,
        "source": method.source,
        "paired": method.paired,
        "weighted": method.weighted,
        "dims": method.dims,
        "max_steps": method.max_steps,
        "options": {f.name: getattr(usual, f.name) for f in fields(usual)},
    }
