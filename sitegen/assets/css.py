"""Parsed style sheets: their rules and the addresses that they name."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import tinycss2

SHEETS = 64  # remembered sheets: `serve` reads the same ones at every build


@dataclass(frozen=True)
class Rule:
    """A rule for every screen: its selectors, and the names and values of its declarations, without comments."""

    selectors: tuple[str, ...]
    declarations: tuple[tuple[str, str], ...]


@dataclass(frozen=True)
class Url:
    """An address in a style sheet, with the line and column where it begins, from 1."""

    address: str
    line: int
    column: int


@lru_cache(maxsize=SHEETS)
def rules(text: str) -> tuple[Rule, ...]:
    """The top-level rules of a sheet, in order, without those inside @media, @container and the like."""
    parts = tinycss2.parse_stylesheet(text, skip_comments=True, skip_whitespace=True)
    plain = [part for part in parts if part.type == "qualified-rule"]
    return tuple(Rule(_selectors(part.prelude), _declarations(part.content)) for part in plain)


@lru_cache(maxsize=SHEETS)
def urls(text: str) -> tuple[Url, ...]:
    """All addresses in a sheet, at any level."""
    return tuple(_urls(tinycss2.parse_component_value_list(text)))


def imports(text: str) -> Iterator[Url]:
    """The sheets that a sheet imports by `@import "…"`; those by `url(…)` are found by `urls`."""
    for rule in tinycss2.parse_stylesheet(text, skip_comments=True, skip_whitespace=True):
        if rule.type == "at-rule" and rule.lower_at_keyword == "import":
            for part in rule.prelude:
                if part.type == "string":
                    yield Url(part.value, part.source_line, part.source_column + 1)


def functions(text: str, name: str) -> Iterator[list[str]]:
    """The arguments of each `name(…)` in a value."""
    for token in tinycss2.parse_component_value_list(text):
        if token.type == "function" and token.lower_name == name:
            yield [_plain(part) for part in _split(token.arguments)]


def _declarations(content: Iterable[Any]) -> tuple[tuple[str, str], ...]:
    parts = tinycss2.parse_blocks_contents(content, skip_comments=True, skip_whitespace=True)
    return tuple((part.name, _value(part)) for part in parts if part.type == "declaration")


def _value(declaration: Any) -> str:
    return f"{_plain(declaration.value)} !important" if declaration.important else _plain(declaration.value)


def _selectors(prelude: Iterable[Any]) -> tuple[str, ...]:
    return tuple(_plain(part) for part in _split(prelude))


def _split(tokens: Iterable[Any]) -> list[list[Any]]:
    """Split at the top-level commas, not at those inside brackets and functions."""
    parts: list[list[Any]] = [[]]
    for token in tokens:
        if token == ",":
            parts.append([])
        else:
            parts[-1].append(token)
    return parts


def _plain(tokens: Iterable[Any]) -> str:
    """The text of a value or a selector on one line."""
    text: str = tinycss2.serialize([token for token in tokens if token.type != "comment"])
    return " ".join(text.split())


def _urls(tokens: Iterable[Any]) -> Iterator[Url]:
    for token in tokens:
        if token.type == "url":
            yield Url(token.value, token.source_line, token.source_column + len("url("))
        elif token.type == "function" and token.lower_name == "url":
            for part in token.arguments:
                if part.type == "string":
                    yield Url(part.value, part.source_line, part.source_column + 1)
        else:
            yield from _urls(getattr(token, "arguments", None) or getattr(token, "content", None) or ())
