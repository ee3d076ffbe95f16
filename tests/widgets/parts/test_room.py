"""The room shared by figures: its settings, its problem, its pairs by kind."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from solvers import Pose
from solvers.scenes.rooms import ROOM_SETTINGS, room
from widgets.drawing.picture import Path, Points, Segments
from widgets.drawing.svg import panel_svg
from widgets.parts.room import (
    BRINGS,
    STARTS,
    error_chart,
    pair_lines,
    problem,
    single,
    source,
    start_choice,
    start_offset,
    start_turn,
    still,
)


@pytest.mark.parametrize("setting", ROOM_SETTINGS)
def test_a_setting_brings_what_the_scene_has_by_itself(setting: str) -> None:
    """The slider values that a setting brings are those of the scene when none are given."""
    noise, outliers = (float(BRINGS[setting][name]) for name in ("noise", "outliers"))
    own, explicit = room(setting), room(setting, noise=noise, outliers=outliers / 100.0)
    np.testing.assert_array_equal(own.source, explicit.source)
    np.testing.assert_array_equal(own.target, explicit.target)


def test_a_problem_is_a_batch_of_one() -> None:
    """The clouds, start and seed of the scene have one leading axis; `single` removes it again."""
    scene = room("combo", seed=53)
    start = Pose.from_angle(0.3, (1.0, -2.0))
    batch = problem(scene, start)
    assert batch.source.shape == (1, *scene.source.shape)
    assert batch.target.shape == (1, *scene.target.shape)
    assert batch.seed.tolist() == [53]
    np.testing.assert_array_equal(single(batch.start).matrix, start.matrix)


@given(st.lists(st.sampled_from(["used", "gated", "trimmed"]), min_size=1, max_size=20))
def test_every_pair_is_drawn_once_by_its_kind(kinds: list[str]) -> None:
    """Used, gated and trimmed pairs are three layers that together hold every pair; only the used ones are strong."""
    ends = np.arange(2.0 * len(kinds)).reshape(-1, 2)
    used, gated = (np.array([kind == name for kind in kinds]) for name in ("used", "gated"))
    lines = pair_lines(ends, ends + 1.0, used, gated)
    counts = {mark.role: len(np.asarray(mark.a)) for mark in lines if isinstance(mark, Segments)}
    assert counts == {"pair": kinds.count("used"), "outlier": kinds.count("gated"), "weak": kinds.count("trimmed")}
    for mark in lines:
        assert isinstance(mark, Segments)
        assert (mark.weight is None) is (mark.role == "pair")
        assert mark.weight is None or (np.asarray(mark.weight) < 0.5).all()


def test_the_marks_make_a_panel() -> None:
    """The static marks, the moving group and the error chart are drawn, even for a course of one step."""
    scene = room("striped")
    assert len(still(scene, scene.start)) == len(still(scene)) + 1
    assert source(scene, scene.start).name == "source"
    for course in ([12.0], [12.0, 3.0, 0.0]):
        assert "<path" in panel_svg(error_chart(course, course, 40), "f")


def test_the_two_errors_are_told_apart_without_colour() -> None:
    """Of their lines one is dashed."""
    marks = error_chart([12.0, 3.0, 1.0], [2.0, 1.0, 0.5], 40).marks
    lines = {mark.role: mark.dashed for mark in marks if isinstance(mark, Path) and mark.role in ("ink", "accent")}
    assert lines == {"ink": False, "accent": True}


def test_points_that_are_not_used_are_faint() -> None:
    """With all used, as if nothing was said of them."""
    scene, pose = room("striped"), Pose.from_angle(0.3, (1.0, -2.0))
    used = np.arange(len(scene.source)) % 3 > 0
    for given_used, faint in ((used, ~used), (np.ones_like(used), None), (None, None)):
        (points,) = (mark for mark in source(scene, pose, given_used).marks if isinstance(mark, Points))
        np.testing.assert_array_equal(points.xy, pose.apply(scene.source))
        assert (points.weight is None) is (faint is None)
        if faint is not None:
            np.testing.assert_array_equal(np.asarray(points.weight) < 1.0, faint)


@pytest.mark.parametrize("name", STARTS)
def test_a_start_sets_the_turn_and_the_offset_and_is_left_by_a_drag(name: str) -> None:
    """A figure that opens at a start has its two numbers, which its sliders accept as those of every other start."""
    start, turn, offset = start_choice(name), start_turn(name), start_offset(name)
    spec = start.metadata["spec"]
    assert (start.default, set(spec.options), spec.places) == (name, set(STARTS), True)
    assert spec.sets[name] == {"turn": turn.default, "offset": offset.default}
    for brought in spec.sets.values():
        for control, value in (("turn", turn), ("offset", offset)):
            slider = value.metadata["spec"]
            assert slider.low <= brought[control] <= slider.high
    assert (turn.metadata["spec"].low, turn.metadata["spec"].high) == (-180.0, 180.0)
