"""The parts of a plot that takes long: each can be run by itself, and the repository keeps what they found.

content/data/plots/NAME.json holds the parts by their names, with the hash of the code that ran and numpy's version. A
build takes them from there as long as both are still the same, and else runs them.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from sitegen.cache.files import write

FOLDER = "content/data/plots"
Asked = tuple[Any, ...]
Found = Mapping[Asked, Any]


@dataclass(frozen=True)
class Parts:
    """asked: what `part` is called with for each. whole: makes the plot's result of what all of them found. code: gives
    the hash of what `part` runs. file: where they are kept."""

    asked: Sequence[Asked]
    part: Callable[..., Any]
    whole: Callable[[Found], Any]
    code: Callable[[], str]
    file: Path

    def run(self, arguments: Asked) -> Any:
        """What one part finds, as it is kept."""
        return json.loads(json.dumps(self.part(*arguments), allow_nan=False))

    def kept(self) -> dict[Asked, Any] | None:
        """What the parts found; None where the file is not of this code, this numpy and these parts, or is damaged, as
        a merge may leave it."""
        names = {named(arguments): arguments for arguments in self.asked}
        try:
            data = json.loads(self.file.read_text("utf-8"))
        except (FileNotFoundError, ValueError):
            return None
        if list(data["parts"]) != list(names) or data["numpy"] != np.__version__ or data["code"] != self.code():
            return None
        return {names[name]: result for name, result in data["parts"].items()}

    def keep(self, results: Found) -> None:
        """Write what all parts found, a line for each, so that a change shows where it is."""
        head = json.dumps({"numpy": np.__version__, "code": self.code()})
        lines = ",\n".join(
            f"{json.dumps(named(arguments))}: {json.dumps(results[arguments])}" for arguments in self.asked
        )
        write(self.file, f'{head[:-1]}, "parts": {{\n{lines}\n}}}}\n'.encode())

    def result(self) -> Any:
        """The plot's result: of what is kept, or of parts that are run now."""
        results = self.kept()
        return self.whole({arguments: self.run(arguments) for arguments in self.asked} if results is None else results)


def named(arguments: Asked) -> str:
    """A part's name: "clutter cpd 45"."""
    return " ".join(map(str, arguments))
