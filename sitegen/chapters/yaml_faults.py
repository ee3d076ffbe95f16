"""Explains YAML errors to authors: what is wrong in plain words, and where, often lines before the parser fails."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Any

import yaml

Loader = getattr(yaml, "CSafeLoader", yaml.SafeLoader)

TAB = "tab character: indent with spaces"
UNALIGNED = "inconsistent indentation: align with the neighbouring lines"
LINE = "expected 'name: value'"
UNCLOSED = "unclosed quote"
# Text in YAML's message, whether to report the start of the construct, and the message for authors.
COMMON = (
    ("mapping values are not allowed", False,
     "unexpected ': ': quote text that contains it, and align names with their neighbours"),
    ("cannot start any token", False, "text cannot start with this character: quote it"),
    ("a tab character", False, TAB),
    ("unknown escape character", False, "unknown escape: use single quotes for text with a \\"),
    ("while scanning a quoted scalar", True, UNCLOSED),
    ("while scanning a simple key", True, LINE),
    ("while parsing a flow sequence", True, "unclosed list: missing ]"),
    ("while parsing a flow mapping", True, "unclosed mapping: missing }"),
    ("while parsing a block mapping", False, UNALIGNED),
)  # fmt: skip
NAMED = re.compile(r"\n\s*(?:- +)?\{?[\w\\'\"-]+:(?: |\n|$)|\n\s*- ")  # a line that begins a new entry


def cause(source: str, error: yaml.MarkedYAMLError) -> tuple[int, int, str]:
    """Line and column, from 0, where a fault begins, and its message: a tab, an earlier quote, or what YAML says."""
    begins, message = _in_words(f"{error.context}: {error.problem}")
    spot = error.problem_mark or error.context_mark
    if spot is None:
        return 0, 0, message
    text = [*source.split("\n"), ""][spot.line]
    head = text[: spot.column]
    blank = re.match(r"[\s-]*", text)
    if blank and "\t" in blank[0] and spot.column <= blank.end():
        return spot.line, text.index("\t"), TAB
    for start, end, style in _quotes(source):
        if (start.line, start.column) > (spot.line, spot.column):
            break
        if NAMED.search(source.split("\n", start.line)[-1][start.column : start.column + end.index - start.index]):
            return start.line, start.column, UNCLOSED
        if end.line == spot.line and not head[end.column :].strip() and spot.column < len(text):
            quotes = {"'": "double", '"': "single"}[style]
            return end.line, end.column - 1, f"the quoted text ends here: use {quotes} quotes for text with a {style}"
    if "mapping values are not allowed" in str(error.problem) and re.fullmatch(r"\s*[\w-]+", head):
        # The line is correct, but was read as part of the one above, which lacks a colon or a blank after it.
        line = next((n for n in range(spot.line - 1, -1, -1) if source.split("\n")[n].strip()), spot.line)
        previous = source.split("\n")[line]
        if line < spot.line and not NAMED.match(f"\n{previous}"):
            return line, len(previous) - len(previous.lstrip()), LINE
    if message == UNALIGNED and head.strip():
        message = "unexpected text after the value"
    mark = (error.context_mark if begins else None) or spot
    return mark.line, mark.column, message


def _in_words(context: str) -> tuple[bool, str]:
    """Whether a fault is best placed at the start of its context, and the message for authors."""
    for phrase, begins, message in COMMON:
        if phrase in context:
            return begins, message
    return False, context.rpartition(": ")[2]


def _quotes(source: str) -> Iterator[tuple[Any, Any, str]]:
    """Yield the quoted texts, up to the first error."""
    try:
        for token in yaml.scan(source, Loader=Loader):
            if isinstance(token, yaml.ScalarToken) and token.style in ("'", '"'):
                yield token.start_mark, token.end_mark, token.style
    except yaml.YAMLError:
        return
