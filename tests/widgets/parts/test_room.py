"""The room shared by figures: its settings, its problem, its pairs by kind."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from solvers import Pose
from solvers.scenes.rooms import ROOM_SETTINGS, room
from widgets.drawing.picture import Path, Segments
from widgets.drawing.svg import panel_svg
from widgets.parts.room import BRINGS, error_chart, pair_lines, problem, single, source, still


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
