"""Detects code fences that are never closed, or are closed elsewhere than their author meant."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

from markdown_it.token import Token

FENCE = re.compile(r"\s*(?P<sign>`{3,}|~{3,})(?P<more>[^`]*)")
DIRECTIVE = re.compile(r" {0,3}::[a-z]+\[")
TEXT = re.compile(r" {0,3}(?:::+[a-z]+\b|#{2,6} |\$\$|\[\^)")  # unlikely in code


@dataclass(frozen=True)
class OpenFence:
    """A fence in line `first` (from 0). unclear: the last line that may be code or text; says: the message."""

    first: int
    unclear: int
    says: str

    def hides(self, n: int, line: str) -> bool:
        """Whether to blank a line when the rest is read as text: the fence, and comments, which would become titles."""
        return n == self.first or (self.first < n <= self.unclear and line.startswith("# "))


def open_fence(tokens: Sequence[Token], lines: Sequence[str]) -> OpenFence | None:
    """The first fence that swallows text that is not code; None if there is none."""
    fences = [token for token in tokens if token.type == "fence" and token.map]
    for i, token in enumerate(fences):
        inner = token.content.split("\n")
        index = next((n for n, line in enumerate(inner) if _is_opening(token, line)), None)
        if index is not None:
            return _fence(token, lines, index)
        if not _is_closed(token, lines):
            # Fences come in pairs: a block that contains figures has lost its end, and the last fence is left over.
            guilty = next((f for f in fences[:i] if any(map(DIRECTIVE.match, f.content.split("\n")))), token)
            return _fence(guilty, lines, None)
    return None


def _is_closed(token: Token, lines: Sequence[str]) -> bool:
    first, end = token.map or (0, 0)
    sign = re.escape(token.markup[0])
    return end - first > 1 and re.fullmatch(rf"[\s>]*{sign}{{{len(token.markup)},}}\s*", lines[end - 1]) is not None


def _is_opening(token: Token, line: str) -> bool:
    """Whether a line of code looks like a fence followed by words, which can only open a block."""
    match = FENCE.fullmatch(line)
    indented = len(line) - len(line.lstrip()) > 3
    return bool(match and not indented and match["sign"].startswith(token.markup) and match["more"].strip())


def _fence(token: Token, lines: Sequence[str], index: int | None) -> OpenFence:
    first, end = token.map or (0, 0)
    inner = token.content.split("\n")
    near_end = next((n for n, line in enumerate(inner) if FENCE.fullmatch(line)), None) if index is None else index
    message = f"unclosed code block {lines[first].strip(' >')!r}: end it with a line of {token.markup} alone"
    if near_end is not None:
        reason = "does not end it" if inner[near_end].strip() != token.markup else "is indented too far"
        message += f"; line {first + 2 + near_end}, {inner[near_end].strip()!r}, {reason}"
    text = next((n for n, line in enumerate(inner) if TEXT.match(line)), len(inner))
    unclear = first + 1 + (text - 1 if near_end is None else min(text - 1, near_end))
    return OpenFence(first, min(unclear, end - 1), message)
