"""The figure of corrupted pairs: its steps are the solver's, and every control changes what it names."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from solvers import Pose, Status, fit_rigid
from solvers.core.method import Problem
from solvers.core.stepper import advance, begin
from solvers.methods.pairs.consensus import trials
from solvers.methods.pairs.ransac import RANSAC, RansacOptions
from tests.widgets.states import frame_after, readouts, state_after
from widgets.drawing.picture import Label, Path, Points, Segments
from widgets.engine.contract import SEED, Action
from widgets.figures.ransac.budget_chart import SHARES, TOP, budget_chart, curve
from widgets.figures.ransac.figure import MOST, SEPARATION, STEPS, WIDGET, Controls, State, act, draw
from widgets.figures.ransac.match_view import HIGH, LEFT, LOW, PULLED, RIGHT, VIEW

STEP, FINISH = Action("press", "step"), Action("press", "finish")


run = partial(state_after, WIDGET)


frame = partial(frame_after, WIDGET)


@pytest.mark.parametrize("seed", [SEED, SEED + 13, SEED + 26])
@pytest.mark.parametrize("scene", ["occluded", "repeated"])
def test_each_step_is_one_step_of_the_solver(scene: str, seed: int) -> None:
    """The figure computes its trials in one block; the solver, one trial per step, goes through the same states."""
    state = run(scene=scene, seed=seed)
    pairs = state.scene.source[None], state.target[None], np.ones((1, 40))
    options = RansacOptions(0.25, 0.99, MOST, 1, SEPARATION)
    batch = begin(RANSAC, Problem(*pairs, Pose.identity(2, (1,)), np.array([seed])), options, STEPS)
    while not batch.done:
        batch, state = advance(batch), act(state, STEP)
        expected, now = batch.state(), state.run.now
        for field in ("trials", "budget", "count", "inliers", "refits", "last_sample", "last_count", "status"):
            np.testing.assert_array_equal(getattr(now, field), getattr(expected, field))
        np.testing.assert_array_equal(now.pose.matrix, expected.pose.matrix)
        np.testing.assert_array_equal(now.last_pose.matrix, expected.last_pose.matrix)
    assert state.run.over
    end = run(FINISH, scene=scene, seed=seed).run.now
    np.testing.assert_array_equal(end.pose.matrix, batch.state().pose.matrix)


def test_steps_after_the_end_change_nothing() -> None:
    """Step and To the end are off once the consensus is stable; a record that presses them shows equal numbers."""
    end = frame(["press", "finish"])
    assert set(end["disabled"]) == {"step", "finish"}
    for log in ([["press", "finish"], ["press", "step"]], [["press", "step"]] * 40):
        assert readouts(frame(*log)) == readouts(end)
    assert frame()["disabled"] == []


def test_the_default_run_finds_the_truth_and_least_squares_does_not() -> None:
    """The point of the figure, over 25 draws: the consensus is near the truth, the fit of all pairs is not."""
    for seed in range(SEED, SEED + 25 * 13, 13):
        values = readouts(frame(["press", "finish"], seed=seed))
        assert float(values["rotation_error"]) < 3
        assert float(values["translation_error"]) < 0.15
        assert float(values["ghost_translation"]) > 0.8


def test_every_control_changes_what_it_names() -> None:
    """ε changes circles and consensus, confidence the budget and its curve, noise and wrong pairs the ghost."""
    before = frame(["press", "finish"])
    for change, names in (
        ({"epsilon": 0.05}, ("count", "share", "budget", "trials", "capped_sum", "lost")),
        ({"confidence": "0.999"}, ("budget", "trials")),
        ({"noise": 0.2}, ("capped_sum", "rotation_error", "ghost_rotation", "lost")),
        ({"outliers": 0.7}, ("count", "share", "budget", "ghost_translation")),
        ({"scene": "repeated"}, ("capped_sum", "ghost_rotation", "ghost_translation")),
    ):
        after = frame(["press", "finish"], **change)
        for name in names:
            assert readouts(after)[name] != readouts(before)[name], (change, name)
    assert frame(confidence="0.5")["panels"][1]["svg"] != frame()["panels"][1]["svg"]
    assert frame(epsilon=0.5)["panels"][0]["svg"] != frame()["panels"][0]["svg"]


def test_one_trial_is_told_as_one() -> None:
    """If all pairs are right the budget is one trial; its label in the chart is above the curve."""
    right = draw(run(FINISH, outliers=0.0, noise=0.0))
    assert "asks for 1 trial at" in right.description
    (panel,) = (panel for panel in right.panels if panel.name == "budget")
    (name,) = (mark for mark in panel.marks if isinstance(mark, Label) and mark.text == "N = 1")
    spots = panel.view.px(np.column_stack([SHARES, np.log10(curve(0.99, 2))]))
    x, y = panel.view.px([name.xy])[0] + (name.dx, name.dy)
    beside = spots[(spots[:, 0] > x - 7.0 * len(name.text)) & (spots[:, 0] <= x)]
    assert len(beside) > 3
    assert (beside[:, 1] > y + 3.0).all()


def test_a_step_lights_its_two_pairs_and_says_its_count() -> None:
    """Two accent lines and a dashed outline; the note gives the rows (from one) and the count of this trial."""
    state = run(STEP, STEP, STEP)
    now = state.run.now
    marks = draw(state).panels[0].marks
    lit = [m for m in marks if isinstance(m, Path) and m.role == "accent"]
    assert [m.dashed for m in lit] == [False, False, True]
    i, j = now.last_sample[0]
    for line, k in zip(lit, (i, j), strict=False):
        np.testing.assert_allclose(np.asarray(line.xy)[1] - RIGHT, state.target[k])
    np.testing.assert_allclose(np.asarray(lit[2].xy) - RIGHT, now.last_pose[0].apply(state.scene.outline[0]))
    assert f"pairs {i + 1} and {j + 1}, {now.last_count[0]} of 40 within ε" in draw(state).note
    assert not [m for m in draw(run(FINISH)).panels[0].marks if m.__dict__.get("role") == "accent"]


def test_the_points_of_each_view_have_its_role() -> None:
    """The dots at the left are all forty source points; the squares at the right are the target's."""
    (panel,) = [panel for panel in draw(run()).panels if panel.name == "main"]
    points = [mark for mark in panel.marks if isinstance(mark, Points) and len(mark.xy)]
    left = [mark for mark in points if (mark.xy[:, 0] < 0.0).all()]
    assert [(mark.role, len(mark.xy)) for mark in left] == [("source", 40)]
    assert {mark.role for mark in points if mark.shape == "square"} == {"target"}


def test_lines_split_by_the_best_pose() -> None:
    """Before a consensus all forty look alike; after it, its inliers are solid and the others dashed."""
    (pairs,) = [m for m in draw(run()).panels[0].marks if isinstance(m, Segments) and m.role == "pair"]
    assert len(np.asarray(pairs.a)) == 40
    state = run(FINISH)
    lines = {m.role: m for m in draw(state).panels[0].marks if isinstance(m, Segments) and m.role != "source"}
    assert set(lines) == {"inlier", "outlier"}
    assert not lines["inlier"].dashed
    assert lines["outlier"].dashed
    inliers = state.run.now.inliers[0]
    np.testing.assert_allclose(np.asarray(lines["inlier"].b) - RIGHT, state.target[inliers])
    np.testing.assert_allclose(np.asarray(lines["outlier"].b) - RIGHT, state.target[~inliers])


def test_what_the_threshold_gets_wrong_is_ringed() -> None:
    """A ring marks each wrong pair that is counted and each right one that is not, as many as the readouts say;
    partners outside ε are hollow."""
    for controls in ({"scene": "repeated", "outliers": 0.6}, {"epsilon": 1.6, "outliers": 0.8}, {"epsilon": 0.04}, {}):
        state = run(FINISH, **controls)
        rings = [m for m in draw(state).panels[0].marks if isinstance(m, Points) and m.shape == "ring"]
        counts = {m.role: len(np.asarray(m.xy)) for m in rings}
        assert counts.pop("ghost") == 40
        values = readouts(frame(["press", "finish"], **controls))
        assert counts.pop("target") == 40 - int(values["count"])
        assert counts == {"outlier": int(values["admitted"]), "truth": int(values["lost"])}
    assert int(readouts(frame(["press", "finish"], scene="repeated", outliers=0.6))["admitted"]) >= 20
    assert int(readouts(frame(["press", "finish"], epsilon=0.04))["lost"]) >= 11


def test_a_trial_is_seen_without_the_errors_of_the_pose() -> None:
    """While a trial's two lines are lit, no ring tells right from wrong; the best pose's rings come at the end."""
    marks = draw(run(STEP)).panels[0].marks
    rings = {m.role for m in marks if isinstance(m, Points) and m.shape == "ring"}
    assert rings == {"ghost", "target", "accent"}


@settings(max_examples=25, deadline=None)
@given(st.floats(-8, 8), st.floats(-4, 4))
def test_pulling_one_partner_moves_the_ghost_by_its_fortieth(x: float, y: float) -> None:
    """The ghost's centroid moves by δ/40, wherever the partner is put; the partner stays inside the panel."""
    before, after = run(FINISH), run(FINISH, Action("drag", "partner", x, y))
    delta = after.target[PULLED] - before.target[PULLED]
    assert np.all((after.target[PULLED] + RIGHT >= LOW) & (after.target[PULLED] + RIGHT <= HIGH))

    def centroid(state: State) -> np.ndarray[Any, Any]:
        return np.asarray(state.run.now.ghost[0].apply(state.scene.source).mean(axis=0))

    np.testing.assert_allclose(centroid(after) - centroid(before), delta / 40, atol=1e-12)
    assert after.wrong[PULLED]


def test_a_partner_put_back_is_right_again() -> None:
    """Dragged to where it was measured, in the four decimals of a handle, it is one that was never touched."""
    x, y = np.round(run().target[PULLED] + RIGHT, 4).tolist()
    log = [["drag", "partner", x + 0.1, y], ["drag", "partner", x, y], ["press", "finish"]]
    assert frame(*log)["panels"] == frame(["press", "finish"])["panels"]
    assert frame(*log)["description"] == frame(["press", "finish"])["description"]


def test_a_partner_pulled_by_hand_is_told_apart_from_wrong_ones() -> None:
    pulled = frame(["drag", "partner", 6.9, -2.8], scene="repeated", outliers=0.0)["description"]
    assert "no partner is wrong" in pulled
    assert "One partner has been pulled away by hand." in pulled
    assert "partners are wrong, all one window to the side" in frame(scene="repeated")["description"]


def test_a_far_partner_does_not_move_the_consensus() -> None:
    """Pulled beyond ε in any direction it is left out, and the consensus pose is the same to the last digit shown."""
    places = [(-4.0, 0.0), (2.0, -2.5), (6.9, -2.8)]
    ends = [readouts(frame(["drag", "partner", *spot], ["press", "finish"])) for spot in places]
    assert len({(e["rotation_error"], e["translation_error"], e["count"]) for e in ends}) == 1
    assert len({e["ghost_translation"] for e in ends}) == 3
    result = run(FINISH)
    assert not result.wrong[PULLED]
    assert int(ends[0]["count"]) == int(result.run.now.count[0]) - 1


def test_the_note_says_when_a_refit_loses_inliers() -> None:
    """Some draw shows it; the capped sum never rises even so."""
    fell = 0
    for seed in range(SEED, SEED + 13 * 25, 13):
        state = run(FINISH, epsilon=0.1, seed=seed)
        now, searched = state.run.now, state.run.searched
        assert searched is not None
        assert now.objective[0] <= searched.objective[0]
        lost = now.count[0] < searched.count[0]
        assert ("the count may fall" in draw(state).note) == lost
        fell += int(lost)
    assert fell


def test_the_cap_is_said() -> None:
    """If the formula calls for more trials than the cap, the note and the description say that the run was capped."""
    picture = frame(["press", "finish"], epsilon=0.02, noise=0.3)
    state = run(FINISH, epsilon=0.02, noise=0.3)
    assert state.run.now.status[0] == Status.CAPPED
    assert readouts(picture)["trials"] == str(MOST)
    assert "Capped short of N" in picture["note"]
    assert f"of at most {MOST}" in picture["description"]


def test_the_curve_is_the_formula() -> None:
    """Rounded up to whole trials, the drawn curve is `trials`; the mark is at the run's estimate and budget."""
    for p in (0.5, 0.9, 0.99, 0.999):
        np.testing.assert_array_equal(np.ceil(curve(p, 2) * (1 - 1e-12)), trials(SHARES, p, 2))
    for share in (0.05, 0.4, 0.9, 1.0):
        (mark,) = [m for m in budget_chart(0.99, 2, MOST, share).marks if isinstance(m, Points)]
        x, y = np.asarray(mark.xy)
        assert x == share
        assert 10**y == pytest.approx(min(trials(share, 0.99, 2), TOP))
    assert not [m for m in budget_chart(0.99, 2, MOST, None).marks if isinstance(m, Points)]


def test_the_ghost_is_the_fit_of_all_pairs() -> None:
    """In every state, before or after trials, the grey outline is `fit_rigid` of all forty pairs."""
    for state in (run(), run(STEP), run(FINISH), run(FINISH, Action("drag", "partner", 0, 0))):
        fit = fit_rigid(state.scene.source, state.target).pose
        np.testing.assert_allclose(state.run.now.ghost[0].matrix, fit.matrix, atol=1e-12)
        ghosts = [m for m in draw(state).panels[0].marks if isinstance(m, Path) and m.role == "ghost"]
        np.testing.assert_allclose(np.asarray(ghosts[0].xy) - RIGHT, fit.apply(state.scene.outline[0]), atol=1e-12)


def test_a_state_is_computed_once() -> None:
    """The frame, description and script of one state share one run."""
    state = run(FINISH)
    assert state.run is state.run
    assert replace(state, steps=1).run is not state.run
    assert Controls() == state.controls


@settings(max_examples=40, deadline=None)
@given(
    st.fixed_dictionaries(
        {
            "scene": st.sampled_from(["occluded", "repeated"]),
            "outliers": st.floats(0, 0.8),
            "noise": st.floats(0, 0.3),
            "epsilon": st.floats(0.02, 1.6),
            "confidence": st.sampled_from(["0.5", "0.9", "0.99", "0.999"]),
        }
    ),
    st.lists(
        st.one_of(
            st.just(["press", "step"]),
            st.just(["press", "finish"]),
            st.tuples(st.floats(-1e5, 1e5), st.floats(-1e5, 1e5)).map(lambda xy: ["drag", "partner", *xy]),
        ),
        max_size=6,
    ),
    st.integers(0, 2**31 - 1),
)
def test_whatever_a_reader_does_the_numbers_are_numbers(
    controls: dict[str, Any], log: list[list[Any]], seed: int
) -> None:
    """Any controls, presses, pulls and seed: finite readouts, counts from 2 to 40, trials within the cap."""
    picture = frame(*log, seed=seed, **controls)
    result = readouts(picture)
    assert not any(word in " ".join(result.values()) + picture["description"] for word in ("nan", "inf"))
    assert int(result["trials"]) <= MOST
    if result["count"] != "–":
        assert 2 <= int(result["count"]) <= 40
        assert 0 <= int(result["admitted"]) <= int(result["count"])


def test_the_best_pose_lies_in_the_target_s_view() -> None:
    """The façade and its points there by the pose, the façade by the truth, and a circle of ε round each partner; at
    the left both as they were measured."""
    state = run(FINISH, epsilon=0.4)
    scene, pose = state.scene, state.run.now.pose[0]
    front, marks = scene.outline[0], draw(state).panels[0].marks
    for role, expected in (
        ("truth", [scene.truth.apply(front) + RIGHT]),
        ("source", [front + LEFT, pose.apply(front) + RIGHT]),
    ):
        fronts = [np.asarray(mark.xy) for mark in marks if isinstance(mark, Path) and mark.role == role]
        np.testing.assert_allclose(fronts, expected)
    dots = [np.asarray(m.xy) for m in marks if isinstance(m, Points) and m.role == "source"]
    np.testing.assert_allclose(dots, [scene.source + LEFT, pose.apply(scene.source) + RIGHT])
    (circles,) = (m for m in marks if isinstance(m, Points) and m.role == "ghost" and m.shape == "ring")
    np.testing.assert_allclose(circles.xy, state.target + RIGHT)
    assert circles.radius == pytest.approx(0.4 * VIEW.scale)


def test_the_last_trial_is_told_as_the_last() -> None:
    """Then come the refits: of the notes of trials only its one says so."""
    state, notes = run(STEP), list[str]()
    while state.run.before is None:
        notes.append(draw(state).note)
        state = act(state, STEP)
    assert [note.endswith("The last one: refits follow.") for note in notes] == [False] * (len(notes) - 1) + [True]
    assert all(note.startswith(f"Trial {k}: ") for k, note in enumerate(notes, start=1))
    assert draw(state).note.startswith("Refit 1: ")


def test_the_cap_is_a_line_across_the_chart() -> None:
    (line,) = (m for m in budget_chart(0.99, 2, MOST, 0.5).marks if isinstance(m, Path) and m.dashed)
    np.testing.assert_allclose(line.xy, [[0.0, np.log10(MOST)], [1.0, np.log10(MOST)]])
