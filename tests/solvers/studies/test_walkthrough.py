"""The walkthrough's four methods by name."""

from __future__ import annotations

import pytest

from solvers import Pose
from solvers.bird_scene import bird
from solvers.scenes import Scene
from solvers.walk_scenes import fish, fish_start
from solvers.walkthrough import FOUR, begin_walk, clutter


@pytest.mark.parametrize("name", ["cdp", "icp", "", None])
def test_an_unknown_name_is_refused_with_the_known_ones(name: str) -> None:
    with pytest.raises(ValueError, match=r"^name: .* is unknown.*; known: cpd, filterreg, flow, mmd$"):
        begin_walk(name, [fish("clean")], [fish_start()])


@pytest.mark.parametrize(
    ("scenes", "starts", "message"),
    [
        ([fish(), fish()], [fish_start()], "^starts: expected one for each scene, and a scene, got 1 for 2"),
        ([], [], "^starts: expected one for each scene, and a scene, got 0 for 0"),
        ([fish(), bird()], [fish_start()] * 2, "^scenes: expected equally many points in each"),
    ],
)
def test_scenes_that_are_no_batch_are_refused_by_name(scenes: list[Scene], starts: list[Pose], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        begin_walk("cpd", scenes, starts)


@pytest.mark.parametrize("name", sorted({"cdp", *FOUR} - {"cpd", "filterreg"}))
def test_only_a_mixture_has_clutter(name: str) -> None:
    with pytest.raises(ValueError, match=r"^name: .* is unknown.*; known: cpd, filterreg$"):
        clutter(name)
