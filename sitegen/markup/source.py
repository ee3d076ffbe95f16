"""A Markdown file to parse, and the places of its offsets."""

from __future__ import annotations

from bisect import bisect_right
from dataclasses import dataclass, field

from sitegen.problems import Place, Problems


@dataclass
class Source:
    """A Markdown file to parse: its path as problems cite it, and its text with the front matter blanked out.

    shift: number of columns before each line of the text in its file.
    """

    path: str
    text: str
    problems: Problems
    shift: int = 0
    lines: list[str] = field(init=False)
    starts: list[int] = field(init=False)

    def __post_init__(self) -> None:
        self.lines = self.text.split("\n")
        self.starts = [0]
        for line in self.lines[:-1]:
            self.starts.append(self.starts[-1] + len(line) + 1)

    def at(self, offset: int) -> Place:
        """The place of an offset in the text."""
        line = bisect_right(self.starts, offset) - 1
        return Place(self.path, line + 1, self.shift + offset - self.starts[line] + 1)
