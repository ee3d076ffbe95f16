"""Counts with their nouns."""

from __future__ import annotations

import pytest

from solvers.core.amounts import amount


@pytest.mark.parametrize(
    ("count", "words", "text"),
    [
        (0, ("step",), "0 steps"),
        (1, ("step",), "1 step"),
        (12_345, ("step",), "12,345 steps"),
        (1, ("try", "tries"), "1 try"),
        (2, ("try", "tries"), "2 tries"),
    ],
)
def test_a_count_has_its_noun_in_the_number_it_takes(count: int, words: tuple[str, ...], text: str) -> None:
    assert amount(count, *words) == text
