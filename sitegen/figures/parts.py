"""The parts of a slow plot: each can be run by itself, and the repository stores their results.

content/data/plots/NAME.json holds the results by the parts' names, with the hash of the code that ran and numpy's
version. A build reads them from there as long as both are unchanged, and otherwise runs the parts.
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
Arguments = tuple[Any, ...]
Results = Mapping[Arguments, Any]


@dataclass(frozen=True)
class Parts:
    """arguments: what `part` is called with, for each of them. whole: combines all results into the plot's result.
    code: returns the hash of the code that `part` runs. file: where the results are stored."""

    arguments: Sequence[Arguments]
    part: Callable[..., Any]
    whole: Callable[[Results], Any]
    code: Callable[[], str]
    file: Path

    def run(self, arguments: Arguments) -> Any:
        """Run one part; its result in the form in which it is stored."""
        return json.loads(json.dumps(self.part(*arguments), allow_nan=False))

    def stored(self) -> dict[Arguments, Any] | None:
        """The stored results; None if the file is missing, or from other code, another numpy or other parts, or not
        valid JSON, as after a merge."""
        names = {named(arguments): arguments for arguments in self.arguments}
        try:
            data = json.loads(self.file.read_text("utf-8"))
        except (FileNotFoundError, ValueError):
            return None
        if list(data["parts"]) != list(names) or data["numpy"] != np.__version__ or data["code"] != self.code():
            return None
        return {names[name]: result for name, result in data["parts"].items()}

    def store(self, results: Results) -> None:
        """Store the results of all parts, one per line, so that a diff shows which have changed."""
        head = json.dumps({"numpy": np.__version__, "code": self.code()})
        lines = ",\n".join(
            f"{json.dumps(named(arguments))}: {json.dumps(results[arguments])}" for arguments in self.arguments
        )
        write(self.file, f'{head[:-1]}, "parts": {{\n{lines}\n}}}}\n'.encode())

    def result(self) -> Any:
        """The plot's result, from the stored results or else by running the parts."""
        results = self.stored()
        if results is None:
            results = {arguments: self.run(arguments) for arguments in self.arguments}
        return self.whole(results)


def named(arguments: Arguments) -> str:
    """A part's name: "clutter cpd 45"."""
    return " ".join(map(str, arguments))
