"""The figure of three residuals: one start, one scene and equally many steps, whichever panel is dragged."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np
import pytest

from tests.widgets.states import frame_after, readouts, state_after
from widgets.drawing.picture import Label, Path, Segments
from widgets.engine.contract import SEED, Action, preset
from widgets.engine.host import Host
from widgets.figures import surfaces
from widgets.figures.three_residuals import NAMES, ROLES, WIDGET, act, draw

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


@pytest.mark.parametrize("actions", [(STEP, STEP, STEP), (FINISH,)])
def test_the_chart_has_a_line_and_a_name_for_each(actions: tuple[Action, ...]) -> None:
    """The RMS distance of the points from their true positions after each step, by powers of ten; the names in its key
    have the lines' colours and strokes; the mark is at the steps of the one that took most."""
    state = run(*actions)
    panel = draw(state).panels[-1]
    paths = {m.role: m for m in panel.marks if isinstance(m, Path) and m.thick}
    names = {m.text: m for m in panel.marks if isinstance(m, Label)}
    strokes = {float(np.ravel(m.a)[1]): m for m in panel.marks if isinstance(m, Segments) and m.role in paths}
    for name, fit in state.runs.items():
        path, truth = paths[ROLES[name]], fit.scene.truth.apply(fit.scene.source)
        xy = np.asarray(path.xy)
        np.testing.assert_array_equal(xy[:, 0], np.arange(fit.steps + 1))
        assert 10.0 ** xy[-1, 1] == pytest.approx(np.sqrt(((fit.moved - truth) ** 2).sum(axis=1).mean()))
        label = names[NAMES[name]]
        stroke = strokes[float(np.ravel(label.xy)[1])]
        assert label.role == stroke.role == ROLES[name]
        assert path.dashed == stroke.dashed
        assert panel.view.y0 < np.ravel(label.xy)[1] < panel.view.y1
    (now,) = (m for m in panel.marks if isinstance(m, Segments) and m.dashed and m.role == "guide")
    assert np.ravel(now.a)[0] == max(fit.steps for fit in state.runs.values())


def test_the_note_names_those_that_have_arrived() -> None:
    """Within 0.1 u of the truth, while at least one still runs; then only where each stopped."""
    state, told = run(), set[str]()
    while not state.done:
        state = act(state, STEP)
        off = {name: fit.moved - fit.scene.truth.apply(fit.scene.source) for name, fit in state.runs.items()}
        near = [NAMES[name] for name, d in off.items() if np.sqrt((d**2).sum(axis=1).mean()) < 0.1]
        if not state.done:
            expected = f"Step {state.steps}. Within 0.1 u of the truth: {', '.join(near) or 'none'}."
            assert draw(state).note == expected
            told.add(expected.partition("truth: ")[2])
    point, plane, gicp = (fit.steps for fit in state.runs.values())
    assert draw(state).note.startswith(f"Stopped at steps {point} (point), {plane} (plane) and {gicp} (GICP).")
    assert len(told) > 1
