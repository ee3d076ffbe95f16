"""What a claim of kind *why* rests on: a test that changes one factor, and the outcome with and without the change.

A test hands them to the fixture `why`. They go with pytest's report, from there into the file of results, and onto the
page of checks: no outcome that is shown there was typed.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

FIXTURE = "why"  # what such a test takes as an argument, and the name of the property in its report


@dataclass(frozen=True)
class Change:
    """One factor, and for each of its settings what came out; the first setting is the one the sentence is about."""

    factor: str
    outcomes: tuple[tuple[str, str], ...]

    def plain(self) -> list[Any]:
        """As lists and texts, which a report and a file can hold."""
        return [self.factor, [list(pair) for pair in self.outcomes]]


def change(factor: str, outcomes: Mapping[str, str]) -> Change:
    """The change with its words checked. Raises ValueError where it shows no cause."""
    if len(outcomes) < 2:
        raise ValueError(f"{factor}: an outcome as it is and one with the factor changed are expected")
    if len(set(outcomes.values())) < 2:
        raise ValueError(f"{factor}: with every setting {next(iter(outcomes.values()))!r}, so it is not the cause")
    texts = [factor, *outcomes, *outcomes.values()]
    if not all(isinstance(text, str) and text.strip() for text in texts):
        raise ValueError(f"{factor}: settings and outcomes are texts")
    return Change(factor, tuple(outcomes.items()))


def read(plain: Any) -> Change:
    """The change that `plain` wrote."""
    factor, outcomes = plain
    return Change(factor, tuple((setting, outcome) for setting, outcome in outcomes))


def recorded(properties: Iterable[tuple[str, Any]]) -> Change | None:
    """The change that a test's report tells of, if any."""
    return next((read(value) for name, value in properties if name == FIXTURE), None)
