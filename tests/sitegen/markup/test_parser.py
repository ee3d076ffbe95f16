"""Where a line of text may not break."""

from __future__ import annotations

import pytest

from sitegen.markup.parser import unbroken


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("80 % of 0.6 u, 0.2 rad.", "80\u00a0% of 0.6\u00a0u, 0.2\u00a0rad."),
        (" u off", "\u00a0u off"),
        ("7 m in 2 ms of ε = 0.04 u", "7\u00a0m in 2\u00a0ms of ε\u00a0=\u00a00.04\u00a0u"),
        ("12 main streets, a = b", "12 main streets, a = b"),
        ("in 25 unlike draws", "in 25 unlike draws"),
        ("an u, a %", "an u, a %"),
    ],
)
def test_a_unit_stays_with_its_number(text: str, expected: str) -> None:
    """No line begins with the unit of a number, typed or computed; words stay as they are."""
    assert unbroken(text) == expected
