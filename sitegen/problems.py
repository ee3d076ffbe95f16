"""Problems in the content: collected over the whole build, each with its place and the closest valid name."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass, field
from difflib import get_close_matches
from pathlib import Path


def first_line(error: BaseException) -> str:
    """The first line of an error's message; its type if the message is empty."""
    text = str(error).strip()
    return text.splitlines()[0] if text else type(error).__name__


@dataclass(frozen=True, order=True)
class Problem:
    """One thing to fix. Line and column count from 1; both are 0 if the file as a whole is meant."""

    path: str
    line: int
    column: int
    message: str

    def __str__(self) -> str:
        return f"{self.path}:{self.line}:{self.column}: {self.message}"


@dataclass
class Problems:
    """The problems of one build; warnings, which a strict build treats as problems; and notes, which are not faults."""

    found: list[Problem] = field(default_factory=list)
    warnings: list[Problem] = field(default_factory=list)
    notes: list[Problem] = field(default_factory=list)
    unread: set[str] = field(default_factory=set)
    """Files that could not be read at all: a reference to a name they would have defined is not reported."""
    unclear: set[tuple[str, int]] = field(default_factory=set)
    """Lines of files that may be code or text. That is reported; other problems in them wait until it is fixed."""

    def add(self, place: Place, message: str) -> None:
        """Record a problem at a place, once."""
        self._append(self.found, place, message)

    def lacks(self, file: str, place: Place, message: str, any_known: bool = True) -> None:
        """Record that a file lacks a name; or, if none of its names are known (`any_known` is false), that the file
        itself is missing. A file that could not be read is not blamed."""
        if file not in self.unread and any_known:
            self.add(place, message)
        elif file not in self.unread:
            self.add(Place(file), "required file is missing or empty")

    def warn(self, place: Place, message: str) -> None:
        """Record something that only a strict build rejects."""
        self._append(self.warnings, place, message)

    def note(self, place: Place, message: str) -> None:
        """Record something that an author may want to know."""
        self._append(self.notes, place, message)

    def take(self, source: Problems) -> None:
        """Add everything from `source`, each once."""
        self.found += [p for p in source.found if p not in self.found]
        self.warnings += [p for p in source.warnings if p not in self.warnings]
        self.notes += [p for p in source.notes if p not in self.notes]
        self.unread |= source.unread
        self.unclear |= source.unclear

    def _append(self, problems: list[Problem], place: Place, message: str) -> None:
        problem = Problem(place.path, place.line, place.column, message)
        if problem not in problems and (place.path, place.line) not in self.unclear:
            problems.append(problem)


@dataclass(frozen=True)
class Place:
    """A place in a source file. Line and column count from 1; 0 means the whole file."""

    path: str
    line: int = 0
    column: int = 0


class BuildFailed(Exception):
    """Raised when the build has problems; nothing was published."""

    def __init__(self, problems: Iterable[Problem]) -> None:
        self.problems = tuple(sorted(problems))
        super().__init__("\n".join(map(str, self.problems)))


def read_text(path: Path, name: str, problems: Problems) -> str:
    """Read an author's file as any editor may save it, with line ends normalised to LF. Text that is not UTF-8, control
    characters and unresolved merge conflicts go to `problems`; what can be read is returned, so that other problems are
    found too."""
    text = _decode(path.read_bytes(), name, problems).removeprefix("\ufeff")
    text = text.replace("\r\n", "\n").replace("\r", "\n")
    if controls := list(CONTROL.finditer(text)):
        first, count = controls[0].start(), len(controls) - 1
        place = Place(name, text.count("\n", 0, first) + 1, first - text.rfind("\n", 0, first))
        also = f"; {count} more below" if count else ""
        problems.add(place, f"invisible character U+{ord(text[first]):04X}: delete it{also}")
        text = CONTROL.sub("\ufffd", text)
    for match in CONFLICT.finditer(text):
        first, last = (text.count("\n", 0, offset) + 1 for offset in (match.start(), match.end()))
        problems.add(Place(name, first, 1), f"unresolved merge conflict, up to line {last}")
    return CONFLICT.sub(_ours, text)


def _decode(raw: bytes, name: str, problems: Problems) -> str:
    if raw.startswith((b"\xff\xfe", b"\xfe\xff")):
        problems.add(Place(name, 1, 1), "expected UTF-8, got UTF-16: save the file as UTF-8")
        return raw.decode("utf-16", "replace")
    try:
        return raw.decode("utf-8")
    except UnicodeDecodeError as error:
        head = raw[: error.start].decode("utf-8")
        place = Place(name, head.count("\n") + 1, len(head.rpartition("\n")[2].removeprefix("\ufeff")) + 1)
        problems.add(place, "invalid UTF-8 from here on: save the file as UTF-8")
        return raw.decode("utf-8", "replace")


# No page may hold these: what a PDF or a terminal leaves in copied text, a mark of bytes within joined files, and
# separators that YAML counts as ends of lines, unlike Markdown and editors.
CONTROL = re.compile("[\0-\x08\x0b\x0c\x0e-\x1f\x7f-\x9f\u2028\u2029\ufeff]")
CONFLICT = re.compile(r"^<{7}(?: .*)?\n((?:.*\n)*?)={7}\n((?:.*\n)*?)>{7}(?: .*)?$", re.MULTILINE)


def _ours(match: re.Match[str]) -> str:
    """Our side of a conflict, padded with blank lines to keep line numbers right."""
    ours = re.split(r"^\|{7}", match[1], maxsplit=1, flags=re.MULTILINE)[0]  # diff3 style adds the common ancestor
    return "\n" + ours + "\n" * (match[0].count("\n") - ours.count("\n") - 1)


def hint(name: str, names: Iterable[str]) -> str:
    """'; did you mean 'x'?' for the closest of `names`; a list of them all if none is close and there are few."""
    choices = sorted(set(names))
    close = get_close_matches(name, choices, n=1)
    if close:
        return f"; did you mean {close[0]!r}?"
    if not choices:
        return "; none are defined"
    return f"; known: {', '.join(choices)}" if len(choices) <= 12 else ""
