"""Directives, our extension of Markdown: `:name[text]{attributes}` in a line, `::name[text]{attributes}` as a line.

Everything carries its offset in the text it was read from, so that a problem can point at the very word.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

NAME = re.compile(r"[a-z][a-z-]*")
ATTRIBUTE = re.compile(r'\s*(?:(?P<name>[A-Za-z_][\w-]*)=)?(?P<value>"(?:[^"\\]|\\.)*"|[^\s"]+)')
APART = re.compile(r"\s+=")
CLOSING = {"[": "]", "{": "}"}


class DirectiveError(ValueError):
    """A malformed directive; `offset` is the place of the error in the text."""

    def __init__(self, message: str, offset: int) -> None:
        super().__init__(message)
        self.offset = offset


@dataclass(frozen=True)
class Directive:
    """A directive as written. Offsets point at `:`, at the text's first character and at the attributes' first."""

    name: str
    text: str
    attributes: str
    start: int
    text_start: int
    attributes_start: int
    end: int


@dataclass(frozen=True)
class Attribute:
    """`value`, or `name=value`, without quotes. `start` is the offset of the attribute, `value_start` of the value."""

    name: str
    value: str
    start: int
    value_start: int
    quoted: bool = False

    @property
    def text_start(self) -> int:
        """The offset of the value's first character, after an opening quote."""
        return self.value_start + self.quoted

    @property
    def plain(self) -> bool | int | float | str:
        """The value as data: true, false, a number, or text."""
        if self.value in ("true", "false"):
            return self.value == "true"
        for kind in (int, float):
            try:
                return kind(self.value)
            except ValueError:
                continue
        return self.value


def read(source: str, start: int, stop: int, colons: str) -> Directive | None:
    """The directive that begins at `start` with `colons`; None if there is none. It has to end by `stop`.

    Raises DirectiveError for one that is never closed.
    """
    if not source.startswith(colons, start):
        return None
    match = NAME.match(source, start + len(colons), stop)
    if match is None or match.end() >= stop or source[match.end()] != "[":
        return None
    text_start = match.end() + 1
    text_end = _close(source, match.end(), stop)
    end, attributes, attributes_start = text_end + 1, "", text_end + 1
    if end < stop and source[end] == "{":
        attributes_start = end + 1
        end = _close(source, end, stop) + 1
        attributes = source[attributes_start : end - 1]
    text = source[text_start:text_end]
    return Directive(match.group(), text, attributes, start, text_start, attributes_start, end)


def _close(source: str, start: int, stop: int) -> int:
    """Where the bracket at `start` closes; skips code and formulas in a text, and quoted values in attributes."""
    opening = source[start]
    closing = CLOSING[opening]
    delimiters = "`$" if opening == "[" else '"'
    depth, i = 0, start
    while i < stop:
        char = source[i]
        if char == "\\":
            i += 1
        elif char in delimiters:
            delimiter_end = source.find(char, i + 1, stop)
            i = delimiter_end if delimiter_end >= 0 else i
        elif char == opening:
            depth += 1
        elif char == closing:
            depth -= 1
            if depth == 0:
                return i
        i += 1
    raise DirectiveError(f"unclosed {opening!r}: missing {closing!r}", start)


def attributes(directive: Directive) -> list[Attribute]:
    """The attributes in order. Raises DirectiveError if they are malformed."""
    result, i = [], 0
    source = directive.attributes
    while source[i:].strip():
        match = ATTRIBUTE.match(source, i)
        if match is None:
            offset = i + len(source[i:]) - len(source[i:].lstrip())
            raise DirectiveError("unclosed quote", directive.attributes_start + offset)
        value, quoted = match["value"], match["value"].startswith('"')
        if (not match["name"] and value.endswith("=")) or APART.match(source, match.end()):
            offset = directive.attributes_start + match.start("name" if match["name"] else "value")
            raise DirectiveError("expected name=value, without spaces around the =", offset)
        if quoted:
            value = re.sub(r"\\(.)", r"\1", value[1:-1])
        start = match.start("name") if match["name"] else match.start("value")
        base = directive.attributes_start
        result.append(Attribute(match["name"] or "", value, base + start, base + match.start("value"), quoted))
        i = match.end()
    return result
