"""What is wrong with the content: collected over the whole build, each with its place and the nearest right name."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from difflib import get_close_matches
from pathlib import Path


@dataclass(frozen=True, order=True)
class Problem:
    """One thing to mend; line and column count from 1, 0 where a file as a whole is meant."""

    path: str
    line: int
    column: int
    message: str

    def __str__(self) -> str:
        return f"{self.path}:{self.line}:{self.column}: {self.message}"


@dataclass
class Problems:
    """The problems of one build; its warnings, which are problems in a strict one; notes, which are no fault."""

    found: list[Problem] = field(default_factory=list)
    warnings: list[Problem] = field(default_factory=list)
    notes: list[Problem] = field(default_factory=list)

    def add(self, place: Place, message: str) -> None:
        """Note a problem at a place, once."""
        _append(self.found, place, message)

    def warn(self, place: Place, message: str) -> None:
        """Note what only a strict build minds."""
        _append(self.warnings, place, message)

    def note(self, place: Place, message: str) -> None:
        """Note what an author may want to know."""
        _append(self.notes, place, message)


def _append(problems: list[Problem], place: Place, message: str) -> None:
    problem = Problem(place.path, place.line, place.column, message)
    if problem not in problems:
        problems.append(problem)


@dataclass(frozen=True)
class Place:
    """A place in a source file."""

    path: str
    line: int = 0
    column: int = 0


class BuildFailed(Exception):
    """The build has problems; nothing was published."""

    def __init__(self, problems: Iterable[Problem]) -> None:
        self.problems = tuple(sorted(problems))
        super().__init__("\n".join(map(str, self.problems)))


def read_text(path: Path, name: str, problems: Problems) -> str:
    """An author's file as any editor saves it, with plain line ends; what is not UTF-8 goes to `problems`."""
    raw = path.read_bytes()
    try:
        text = raw.decode("utf-8")
    except UnicodeDecodeError as error:
        problems.add(Place(name, raw[: error.start].count(b"\n") + 1, 1), "not UTF-8")
        text = raw.decode("utf-8", "replace")
    return text.removeprefix("\ufeff").replace("\r\n", "\n").replace("\0", "\ufffd")


def hint(name: str, names: Iterable[str]) -> str:
    """'; did you mean 'x'?' for the closest of `names`; a list of them where none is close and they are few."""
    known = sorted(set(names))
    close = get_close_matches(name, known, n=1)
    if close:
        return f"; did you mean {close[0]!r}?"
    if not known:
        return "; there are none"
    return f"; there are {', '.join(known)}" if len(known) <= 12 else ""
