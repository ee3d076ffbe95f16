"""The walkthrough's four methods by name."""

from __future__ import annotations

import pytest

from solvers.walk_scenes import fish, fish_start
from solvers.walkthrough import FOUR, begin_walk, clutter


@pytest.mark.parametrize("name", ["cdp", "icp", "", None])
def test_an_unknown_name_is_refused_with_the_known_ones(name: str) -> None:
    with pytest.raises(ValueError, match=r"^name: .* is unknown.*; known: cpd, filterreg, flow, mmd$"):
        begin_walk(name, [fish("clean")], [fish_start()])


@pytest.mark.parametrize("name", sorted({"cdp", *FOUR} - {"cpd", "filterreg"}))
def test_only_a_mixture_has_clutter(name: str) -> None:
    with pytest.raises(ValueError, match=r"^name: .* is unknown.*; known: cpd, filterreg$"):
        clutter(name)
