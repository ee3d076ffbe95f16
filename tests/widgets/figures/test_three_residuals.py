"""The figure of three residuals: one start, one scene and equally many steps, whichever panel is dragged."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np
import pytest

from tests.widgets.states import frame_after, readouts, state_after
from widgets.engine.contract import SEED, Action, preset
from widgets.engine.host import Host
from widgets.figures import surfaces
from widgets.figures.three_residuals import NAMES, WIDGET, act

STEP, FINISH = Action("press", "step"), Action("press", "finish")


run = partial(state_after, WIDGET)


def texts(log: list[Any], **controls: Any) -> dict[str, str]:
    return readouts(frame_after(WIDGET, *log, **controls))


@pytest.mark.parametrize("name", list(NAMES))
def test_a_drag_in_any_panel_begins_all_three(name: str) -> None:
    """Whichever panel's cloud is dragged, all three start there, with the same error at step 0."""
    for handle in ("source", "turn"):
        state = run(STEP, STEP, Action("drag", f"{name}-{handle}", 1.5, -1.0))
        poses = [fit.pose.matrix for fit in state.runs.values()]
        assert state.steps == 0
        np.testing.assert_array_equal(poses[0], poses[1])
        np.testing.assert_array_equal(poses[0], poses[2])
        errors = {fit.course[0].point for fit in state.runs.values()}
        assert len(errors) == 1


def test_they_step_together_and_each_stops_by_itself() -> None:
    """After k presses each has taken k steps, or fewer if it has stopped; the buttons are disabled when all have."""
    state = run()
    for k in range(1, 45):
        before, state = state, act(state, STEP)
        for name, fit in state.runs.items():
            assert fit.steps == (before.runs[name].steps if before.runs[name].done else k)
        if state.done:
            break
    assert state.done
    assert len({fit.steps for fit in state.runs.values()}) > 1
    end = run(FINISH)
    for name in NAMES:
        np.testing.assert_array_equal(end.runs[name].pose.matrix, state.runs[name].pose.matrix)
    assert Host().render("f", {**preset(WIDGET).plain(), "log": [["press", "finish"]]})["disabled"] == [
        "finish",
        "step",
    ]


@pytest.mark.parametrize("name", list(NAMES))
def test_it_is_the_single_figures_run(name: str) -> None:
    """Each panel ends at the pose of the single-residual figure with the same controls."""
    controls = {"outliers": 20.0, "weight": "tukey", "start": "near"}
    single = surfaces.start(preset(surfaces.WIDGET, "default", {**controls, "residual": name}).controls, SEED)
    np.testing.assert_array_equal(
        surfaces.act(single, FINISH).run.pose.matrix, run(FINISH, **controls).runs[name].pose.matrix
    )


def test_every_control_changes_what_it_names() -> None:
    base = {"outliers": 10.0, "weight": "huber"}
    plain = texts([["press", "step"]], **base)
    changes: list[dict[str, Any]] = [
        {"scene": "wall"}, {"scene": "corridor"}, {"weight": "none"}, {"weight": "tukey"}, {"weight": "welsch"},
        {"start": "near"}, {"start": "far"}, {"turn": 60.0}, {"offset": 0.5}, {"noise": 0.1}, {"outliers": 30.0},
    ]  # fmt: skip
    for change in changes:
        assert texts([["press", "step"]], **{**base, **change}) != plain, change
