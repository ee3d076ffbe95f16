"""The evidence for claims of kind *why*: a test that changes one factor, and the outcomes with and without the change.

A test hands them to the fixture `why`. They travel in pytest's report, from there into the file of results, and onto
the page of checks: none of the outcomes shown there was typed by hand.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

FIXTURE = "why"  # the argument of such a test, and the name of the property in its report


@dataclass(frozen=True)
class Change:
    """One factor, and the outcome for each of its settings; the first setting is the one that the sentence is about."""

    factor: str
    outcomes: tuple[tuple[str, str], ...]

    def plain(self) -> list[Any]:
        """As lists and strings, for reports and files."""
        return [self.factor, [list(pair) for pair in self.outcomes]]


def change(factor: str, outcomes: Mapping[str, str]) -> Change:
    """Make a change and check it. Raises ValueError if it does not show a cause."""
    if len(outcomes) < 2:
        raise ValueError(f"{factor}: expected an outcome as it is and one with the factor changed")
    if len(set(outcomes.values())) < 2:
        raise ValueError(f"{factor}: every setting gives {next(iter(outcomes.values()))!r}, so it is not the cause")
    texts = [factor, *outcomes, *outcomes.values()]
    if not all(isinstance(text, str) and text.strip() for text in texts):
        raise ValueError(f"{factor}: settings and outcomes must be text")
    return Change(factor, tuple(outcomes.items()))


def read(plain: Any) -> Change:
    """Restore a change from the output of `plain`."""
    factor, outcomes = plain
    return Change(factor, tuple((setting, outcome) for setting, outcome in outcomes))


def recorded(properties: Iterable[tuple[str, Any]]) -> Change | None:
    """The change in the properties of a test's report, if any."""
    return next((read(value) for name, value in properties if name == FIXTURE), None)
