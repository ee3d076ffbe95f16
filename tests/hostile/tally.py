"""Counts the outcomes of hostile calls: fine, degenerate, or refused in our own words; anything else is an error."""

from __future__ import annotations

import json
import linecache
import traceback
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field

import pytest

OUTCOMES = ("ok", "degenerate", "refused", "error")


@dataclass
class Tally:
    """The calls of one kind. errors: what was tried, and the error that it raised."""

    what: str
    counts: Counter[str] = field(default_factory=Counter)
    errors: list[str] = field(default_factory=list)

    def tries(self, subject: object, call: Callable[[], str]) -> None:
        """Count one call. `call` returns its outcome; a ValueError that our code raises counts as a refusal."""
        try:
            outcome = call()
        except Exception as error:
            outcome = "refused" if isinstance(error, ValueError) and _ours(error) else "error"
            if outcome == "error":
                self.errors.append(f"{subject}:\n{''.join(traceback.format_exception(error, limit=-3))}")
        self.counts[outcome] += 1

    def closes(self) -> None:
        """Fail with the first errors, if there are any."""
        if self.errors:
            pytest.fail(f"{len(self.errors)} errors, such as\n\n" + "\n".join(self.errors[:5]), pytrace=False)


def _ours(error: ValueError) -> bool:
    """Whether an explicit `raise`, with a message written for it, made the error, rather than numpy or int() in
    passing. Errors in JSON are the exception: json's own messages are best."""
    last = traceback.extract_tb(error.__traceback__)[-1]
    line = linecache.getline(last.filename, last.lineno or 0)
    is_raised = isinstance(error, json.JSONDecodeError) or line.strip().startswith("raise ")
    return is_raised and 0 < len(str(error)) < 1000
