"""What a problem adds about the nearest right name."""

from __future__ import annotations

from sitegen.problems import hint


def test_a_hint_names_the_nearest_or_a_few() -> None:
    assert hint("noize", ["noise", "scene"]) == "; did you mean 'noise'?"
    assert hint("xyz", ["noise", "scene"]) == "; known: noise, scene"
    assert hint("xyz", [f"name-{i}" for i in range(40)]) == ""
