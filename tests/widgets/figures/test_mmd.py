"""The figure of compared distributions: waves, means and estimates are the solver's, and controls do what they say."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from solvers.numerics.fourier_features import exact_squared_mmd
from tests.widgets.states import readouts, state_after
from widgets.drawing.picture import Path, Segments
from widgets.engine.contract import Action
from widgets.figures.mmd import MOST, SCHEDULE, STEPS, WIDGET, State, act, draw, motion
from widgets.parts.feature_marks import CIRCLE, MAP, crests

STEP, FINISH, RESAMPLE = (Action("press", name) for name in ("step", "finish", "resample"))
FAR = st.floats(-1e6, 1e6)


run = partial(state_after, WIDGET)


def texts(state: State) -> dict[str, str]:
    return readouts(draw(state))


@settings(max_examples=40, deadline=None)
@given(st.floats(-9, 9), st.floats(-9, 9))
def test_crests_stand_at_phase_zero_inside_the_window(x: float, y: float) -> None:
    """Both ends of every line lie inside the window or on its border, where the phase is a whole number of turns."""
    if np.hypot(x, y) < 1e-3:
        return
    frequency = np.array([x, y])
    lines = crests(MAP, frequency)
    for ends in (np.asarray(lines.a), np.asarray(lines.b)):
        turns = ends @ frequency / (2 * np.pi)
        assert turns == pytest.approx(np.rint(turns), abs=1e-6)
        assert (ends >= [MAP.x0 - 1e-9, MAP.y0 - 1e-9]).all()
        assert (ends <= [MAP.x1 + 1e-9, MAP.y1 + 1e-9]).all()


def test_the_estimate_is_the_solvers_and_the_exact_value_the_packages() -> None:
    """The estimate made from the figure's waves is the stepper's ‖r‖², and the exact value is MMD² itself."""
    for state in (run(), run(STEP, STEP), run(FINISH, name="schedule"), run(RESAMPLE, FINISH, count=10)):
        text = texts(state)
        assert float(text["estimate"]) == pytest.approx(float(state.batch.objective()[0]), abs=6e-5)
        moved = state.pose.apply(state.scene.source)
        exact = exact_squared_mmd(moved, state.scene.target, state.length)
        assert float(text["exact"]) == pytest.approx(exact, abs=6e-5)


def test_the_arrows_are_the_means_of_the_phases() -> None:
    """Dots lie on their circles, and each arrow ends at their mean."""
    marks = next(panel for panel in draw(run()).panels if panel.name == "phases").marks
    dots = {mark.role: np.asarray(mark.xy) for mark in marks if type(mark).__name__ == "Points"}
    arrows = {mark.role: np.asarray(mark.b) for mark in marks if type(mark).__name__ == "Arrow"}
    assert np.hypot(*dots["source"].T) == pytest.approx(1.0)
    assert arrows["source"] == pytest.approx(dots["source"].mean(axis=0))
    assert arrows["target"] == pytest.approx(dots["target"].mean(axis=0) / np.hypot(*dots["target"][0]))
    assert CIRCLE.size[1] == pytest.approx(MAP.size[1], abs=1.0)


def test_other_waves_on_the_same_room() -> None:
    """Resampling changes the waves and the estimate, but neither the clouds nor the exact value."""
    before, after = run(STEP), run(STEP, RESAMPLE)
    assert (before.scene.source == after.scene.source).all()
    assert np.abs(before.unit - after.unit).max() > 0.1
    assert len(after.course) == 1
    assert texts(run())["exact"] == texts(after)["exact"]
    assert texts(run())["estimate"] != texts(after)["estimate"]
    assert "Draw 2" in draw(after).note


def test_a_schedule_runs_through_its_length_scales() -> None:
    """ℓ falls from stage to stage; without a schedule it is the slider's."""
    state, lengths = run(name="schedule"), []
    while not state.batch.done:
        lengths.append(state.length)
        state = act(state, STEP)
    assert sorted({*lengths, state.length}, reverse=True) == list(SCHEDULE)
    assert {run(length=0.7).length, run(FINISH, length=0.7).length} == {0.7}


@pytest.mark.parametrize(
    ("control", "value", "readout"),
    [
        ("length", 2.5, "exact"),
        ("count", 6.0, "estimate"),
        ("wave", 9.0, "wave"),
        ("turn", -60.0, "rotation_error"),
        ("offset", 2.0, "translation_error"),
        ("noise", 0.3, "exact_truth"),
        ("outliers", 40.0, "exact_truth"),
        ("overlap", 50.0, "exact_truth"),
        ("density", 2.0, "exact_truth"),
        ("scene", "gradient", "exact_truth"),
    ],
)
def test_every_control_changes_what_it_names(control: str, value: Any, readout: str) -> None:
    """Moving one control changes its number."""
    assert texts(run())[readout] != texts(run(**{control: value}))[readout]


def test_with_missing_overlap_a_run_leaves_the_truth_for_a_smaller_exact_discrepancy() -> None:
    """Started at the truth with 60 % of the room in the target, the run ends elsewhere, at a lower exact MMD²."""
    first, last = texts(run(name="overlap")), texts(run(FINISH, name="overlap"))
    assert float(first["rotation_error"]) == 0.0
    assert float(last["rotation_error"]) > 5.0
    assert float(last["exact"]) < float(last["exact_truth"]) == float(first["exact"])
    assert float(texts(run(FINISH, name="overlap", length=0.6))["rotation_error"]) < 2.0


def test_the_chart_of_the_estimate_holds_the_exact_value_here_and_at_the_truth() -> None:
    """Its dashed lines are at the two readouts, in their colours, and the solid one passes through the estimate."""
    state = run(STEP)
    panel, text = next(panel for panel in draw(state).panels if panel.name == "estimate"), texts(state)
    lines = {mark.role: np.asarray(mark.xy) for mark in panel.marks if isinstance(mark, Path) and mark.thick}
    for role, readout in (("source", "exact"), ("truth", "exact_truth")):
        assert 10 ** lines[role][:, 1] == pytest.approx(float(text[readout]), abs=6e-5)
    at = np.argmin(np.abs(lines["ink"][:, 0] - np.log2(32)))
    assert 10 ** lines["ink"][at, 1] == pytest.approx(float(text["estimate"]), abs=6e-5)


def test_a_wave_beyond_those_used_is_the_last_of_them() -> None:
    """The slider may exceed D; the figure then says which wave it shows instead."""
    state = run(count=4, wave=30)
    assert texts(state)["wave"] == texts(run(count=4, wave=4))["wave"]
    assert "Only 4 waves" in draw(state).note


def test_a_step_moves_the_source_and_a_drag_begins_anew() -> None:
    """The motion leads from the old pose to the new; a drag empties the course."""
    before = run()
    after = act(before, STEP)
    result = motion(before, after)
    assert result is not None
    angle = float(after.pose.angle - before.pose.angle)
    assert np.cos(result.turn) == pytest.approx(np.cos(angle))
    assert len(act(after, Action("drag", "source", 1.0, 1.0)).course) == 1


@settings(max_examples=25, deadline=None)
@given(
    st.lists(
        st.one_of(
            st.sampled_from([STEP, FINISH, RESAMPLE]),
            st.builds(Action, st.just("drag"), st.sampled_from(["source", "turn"]), FAR, FAR),
        ),
        max_size=5,
    ),
    st.sampled_from(["clean", "striped", "combo"]),
    st.floats(0.2, 4),
    st.integers(1, MOST // 2),
    st.integers(0, 999),
)
def test_any_actions_in_any_order(actions: list[Action], scene: str, length: float, half: int, seed: int) -> None:
    """No exception, no NaN, never more steps than allowed."""
    state = run(*actions, seed=seed, scene=scene, length=length, count=2.0 * half)
    picture = draw(state)
    assert len(state.course) <= STEPS + 1
    assert not any("nan" in readout.value for readout in picture.readouts)


@pytest.mark.parametrize("log", [(), (STEP,), (STEP, STEP)])
def test_the_crests_in_the_picture_are_those_of_the_wave_shown(log: tuple[Action, ...]) -> None:
    """As far apart as the description says, at the ℓ in use; the start's outline is drawn once a step has been made."""
    state = run(*log, name="schedule", wave=3)
    picture = draw(state)
    main = picture.panels[0].marks
    (lines,) = (mark for mark in main if isinstance(mark, Segments) and mark.role == "accent")
    frequency = state.unit[2] / state.length
    turns = np.asarray(lines.a) @ frequency / (2 * np.pi)
    assert turns == pytest.approx(np.rint(turns), abs=1e-9)
    assert np.diff(np.unique(np.rint(turns))) == pytest.approx(1.0)
    gap = 2 * np.pi / np.hypot(*frequency)
    assert f"crests of wave 3 of {state.controls.count:.0f}, {gap:.2f} u apart" in picture.description
    assert f"After {len(log)} step" in picture.description
    assert any(isinstance(mark, Path) and mark.role == "ghost" for mark in main) == bool(log)
