"""The figure of nearest points: which quantities fall and which may rise, both halves of a step, and controls that do
what they say."""

from __future__ import annotations

from functools import partial
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.widgets.states import readouts, state_after
from widgets.drawing.picture import Label, Path, Points
from widgets.engine.contract import Action, preset
from widgets.engine.host import Host
from widgets.figures.icp.figure import OPEN, STEPS, WIDGET, State, act, draw, motion
from widgets.figures.icp.run import begun

STEP, FINISH = Action("press", "step"), Action("press", "finish")
SCENES = ["clean", "noise", "gradient", "striped", "outliers", "combo"]


run = partial(state_after, WIDGET)


def texts(state: State) -> dict[str, str]:
    return readouts(draw(state))


def test_the_chart_goes_as_far_as_its_words_say() -> None:
    """Eight steps at first, then more; the dot of the last step agrees with the tick labels."""
    for actions, span in (((), 8), ((STEP,) * 8, 8), ((STEP,) * 9, 16), ((FINISH,), 40)):
        state = run(*actions, start="far", turn=-110.0, offset=1.43)
        panel = next(panel for panel in draw(state).panels if panel.name == "rms")
        labels = [mark for mark in panel.marks if isinstance(mark, Label) and mark.anchor == "middle"]
        words = [float(label.text) for label in labels if label.text.isdigit()]
        assert words == [span * part / 4 for part in range(5)]
        dots = np.concatenate([np.reshape(m.xy, (-1, 2)) for m in panel.marks if isinstance(m, Points)])
        assert dots[:, 0].max() * span == pytest.approx(state.run.steps)


@pytest.mark.parametrize(
    ("actions", "controls"),
    [
        ((), {}),
        ((Action("drag", "source", 6.4, 4.6),), {}),
        ((FINISH,), {"overlap": 30.0, "offset": 0.0}),
        ((FINISH,), {"objective": "capped", "gate": 3.0, "overlap": 30.0}),
    ],
)
def test_the_chart_of_the_rms_holds_all_of_it(actions: tuple[Action, ...], controls: dict[str, Any]) -> None:
    """The last RMS and that at the truth agree with the tick labels beside the axis, however large they are."""
    state = run(*actions, **controls)
    (panel,) = (panel for panel in draw(state).panels if panel.name == "rms")
    words = [mark for mark in panel.marks if isinstance(mark, Label) and mark.anchor == "end" and mark.dx == -6]
    top = max(float(label.text) for label in words)
    dots = np.concatenate([np.reshape(mark.xy, (-1, 2)) for mark in panel.marks if isinstance(mark, Points)])
    last = dots[np.argmax(dots[:, 0])]
    assert last[1] * top == pytest.approx(state.run.course[-1].rms)
    (truth,) = (mark for mark in panel.marks if isinstance(mark, Path) and mark.role == "truth")
    assert np.asarray(truth.xy)[0, 1] * top == pytest.approx(float(state.run.truth.rms[0]))
    assert np.asarray(truth.xy).max() <= 1.0


@pytest.mark.parametrize("name", WIDGET.presets)
def test_a_drag_changes_the_start_and_not_the_pairs_at_the_truth(name: str) -> None:
    """They equal those of a run begun at the new start, and the next step leads to the same pose."""
    result = run(Action("drag", "source", 0.8, -0.6), name=name).run
    anew = begun(result.rule, result.scene, result.began, STEPS)
    assert np.abs(result.began.t - run(name=name).run.began.t).max() > 0.01
    for part in ("rows", "used", "rms", "objective"):
        assert np.array_equal(getattr(result.truth, part), getattr(anew.truth, part)), part
    assert np.array_equal(result.step().pose.matrix, anew.step().pose.matrix)


@settings(max_examples=30, deadline=None)
@given(
    st.sampled_from(SCENES),
    st.floats(-180, 180),
    st.floats(0, 3),
    st.sampled_from(["plain", "count", "capped"]),
    st.floats(0.1, 3),
    st.floats(0, 60),
    st.integers(0, 999),
)
def test_what_is_said_never_to_rise_never_rises(
    scene: str, turn: float, offset: float, objective: str, gate: float, trim: float, seed: int
) -> None:
    """With any controls, where the figure promises that the objective or the RMS never rises, no step raises it."""
    state = run(FINISH, seed=seed, scene=scene, turn=turn, offset=offset, objective=objective, gate=gate, trim=trim)
    course = state.run.course
    if state.run.rule.objective_falls:
        assert all(b.mean <= a.mean * (1 + 1e-9) for a, b in pairwise(course))
    if state.run.rule.rms_falls:
        assert not state.run.rises
        assert len({entry.used for entry in course}) == 1
    assert state.run.steps <= STEPS
    assert state.run.done


@pytest.mark.parametrize(("name", "controls"), [("default", {}), ("gated", {}), ("default", {"objective": "capped"})])
def test_both_halves_of_a_step(name: str, controls: dict[str, Any]) -> None:
    """The move never lengthens the pairs that it fits; the matching never lengthens a point's distance."""
    state = run(name=name, **controls)
    for _ in range(6):
        before, state = state, act(state, STEP)
        last = state.run.course[-1]
        assert last.moved <= before.run.course[-1].rms * (1 + 1e-9)
        old = before.run.now.pairing
        distances = np.linalg.norm(state.run.now.pairing.moved[0] - state.run.now.index.points[0, old.rows[0]], axis=1)
        assert (state.run.now.pairing.distances[0] <= distances + 1e-12).all()
        assert last.changed == (old.rows != state.run.now.pairing.rows).sum()


def test_the_gated_preset_rises() -> None:
    """The preset for a rising RMS does show it: in the readout, in the note of such a step, and as diamonds."""
    state = run(FINISH, name="gated")
    assert len(state.run.rises) >= 5
    first = state.run.rises[0]
    at = run(*[STEP] * first, name="gated")
    picture = draw(at)
    assert picture.note.endswith("a rise.")
    assert texts(at)["rises"] == f"1 of {first}"
    assert texts(at)["falls"] == "neither"
    frame = Host().render("f", {**preset(WIDGET, "gated").plain(), "log": [["press", "finish"]]})
    (chart,) = (p["svg"] for p in frame["panels"] if p["name"] == "rms")
    assert "shape diamond outlier" in chart


def test_a_gate_and_a_cap_take_the_same_steps_and_promise_different_things() -> None:
    """Gated and capped runs pass through the same poses; only the cap's objective is guaranteed not to rise."""
    gated = run(*[STEP] * 12, turn=45.0, offset=1.43, gate=0.6)
    capped = run(*[STEP] * 12, turn=45.0, offset=1.43, objective="capped", gate=0.6)
    np.testing.assert_allclose(gated.run.pose.matrix, capped.run.pose.matrix, atol=1e-12)
    assert gated.run.rises == capped.run.rises != ()
    assert (texts(gated)["falls"], texts(capped)["falls"]) == ("neither", "the objective")
    means = [entry.mean for entry in capped.run.course]
    assert means == sorted(means, reverse=True)


def test_trimming_alone_is_the_fixed_count() -> None:
    """With the gate open, a trimmed fraction is a fixed number of pairs: the same steps, the same promise."""
    plain, count = (run(*[STEP] * 8, objective=o, gate=OPEN, trim=20.0) for o in ("plain", "count"))
    np.testing.assert_array_equal(plain.run.pose.matrix, count.run.pose.matrix)
    assert texts(plain)["falls"] == texts(count)["falls"] == "RMS and objective"
    assert texts(run(gate=0.6, trim=20.0))["falls"] == "neither"


def test_the_wrong_fits_are_convincing() -> None:
    """The presets of wrong fits converge far from the truth, at an RMS near or below that at the truth."""
    wall = run(FINISH, name="overlap").run
    assert wall.status.label == "converged"
    assert wall.course[-1].rms < float(wall.truth.rms[0])
    assert wall.course[-1].translation > 0.5
    stripes = run(FINISH, name="striped").run
    assert stripes.status.label == "converged"
    assert stripes.course[-1].rms < 0.08
    assert stripes.course[-1].translation > 0.2
    result = run(FINISH, name="far").run
    assert result.status.label == "converged"
    assert result.course[-1].rotation > 90.0


@pytest.mark.parametrize(
    ("control", "value", "base"),
    [
        ("noise", 0.2, {}),
        ("outliers", 30.0, {}),
        ("overlap", 60.0, {}),
        ("gate", 0.3, {}),
        ("gate", 0.3, {"objective": "capped"}),
        ("trim", 40.0, {}),
        ("trim", 40.0, {"objective": "count"}),
        ("turn", -60.0, {}),
        ("offset", 2.0, {}),
        ("scene", "striped", {}),
        ("start", "far", {}),
        ("objective", "count", {}),
    ],
)
def test_a_control_changes_the_picture_and_the_numbers(control: str, value: Any, base: dict[str, Any]) -> None:
    """Even before any step, the map and at least one readout change."""
    plain, variant = (preset(WIDGET, "default", {**base, **more}).plain() for more in ({}, {control: value}))
    first, second = (Host().render("f", record) for record in (plain, variant))
    assert first["panels"][0]["svg"] != second["panels"][0]["svg"]
    assert first["readouts"] != second["readouts"]
    assert first["python"] != second["python"]


def test_a_knob_that_plays_no_part_is_named() -> None:
    """The gate under a fixed count, and trimming under a cap, change only the note that says so."""
    assert "has no effect" in draw(run(objective="count", gate=0.5)).note
    assert "has no effect" in draw(run(objective="capped", trim=30.0)).note
    assert draw(run(objective="count")).note == draw(run()).note == ""


def test_every_pair_is_one_of_three_kinds() -> None:
    """Lines for used, out-of-gate and trimmed pairs add up to one per source point, and the texts count them."""
    state = run(gate=0.5, trim=30.0, turn=30.0, offset=1.0)
    n = len(state.run.scene.source)
    layers = {m.role: len(np.asarray(m.a)) for m in draw(state).panels[0].marks if hasattr(m, "a")}
    assert set(layers) == {"pair", "outlier", "weak"}
    assert sum(layers.values()) == n
    assert all(layers.values())
    assert texts(state)["used"] == f"{layers['pair']} of {n}"
    assert f"{layers['outlier']} pairs lie farther apart than 0.50 u" in draw(state).description
    assert f"{layers['weak']} pairs are trimmed" in draw(state).description


def test_the_motion_is_the_move() -> None:
    """Turned about the old origin, then shifted, the old points become the new points; jumps are not animated."""
    before, after = run(STEP), run(STEP, STEP)
    moved = motion(before, after)
    assert moved is not None
    c, s = np.cos(moved.turn), np.sin(moved.turn)
    old = before.run.now.pairing.moved[0] - moved.about
    new = old @ np.array([[c, -s], [s, c]]).T + moved.about + moved.shift
    np.testing.assert_allclose(new, after.run.now.pairing.moved[0], atol=1e-12)
    assert motion(before, act(before, FINISH)) is None
    assert motion(before, act(before, Action("drag", "source", 0.0, 0.0))) is None


@settings(max_examples=50, deadline=None)
@given(
    st.lists(
        st.one_of(
            st.sampled_from([STEP, FINISH]),
            st.builds(
                Action, st.just("drag"), st.sampled_from(["source", "turn"]), st.floats(-99, 99), st.floats(-99, 99)
            ),
        ),
        max_size=6,
    ),
    st.floats(0.1, 1.0),
    st.floats(30, 100),
    st.floats(0, 50),
)
def test_any_actions_leave_handles_in_view(actions: list[Action], gate: float, overlap: float, outliers: float) -> None:
    """Steps and drags in any order, even to where no pair is left: a picture, finite numbers, handles in view."""
    state = run(*actions, gate=gate, overlap=overlap, outliers=outliers)
    picture = draw(state)
    for handle in picture.handles:
        assert abs(handle.xy[0]) < 6.4
        assert abs(handle.xy[1]) < 4.6
    assert state.run.steps <= STEPS
    assert (picture.disabled == {"step", "finish"}) == state.run.done
    log = [action.plain() for action in actions]
    controls = {"gate": gate, "overlap": overlap, "outliers": outliers}
    frame = Host().render("f", {**preset(WIDGET, "default", controls).plain(), "log": log})
    assert not {"nan", "inf"} & set(frame["description"].lower().replace(".", " ").split())


def test_no_pair_left_is_said() -> None:
    """If the gate rejects every pair, no RMS is shown, and the run stops at once with the reason."""
    state = run(name="overlap", turn=0.0, offset=1.2, scene="clean", overlap=30.0)
    assert texts(state)["used"] == "0 of 132"
    picture = draw(state)
    assert next((r.value, r.unit) for r in picture.readouts if r.name == "rms") == ("–", "")
    (chart,) = (panel for panel in picture.panels if panel.name == "rms")
    assert not any(len(mark.xy) for mark in chart.marks if isinstance(mark, Points))
    assert "no pair with weight lies within the gate" in picture.note


def test_a_drag_begins_anew() -> None:
    """A dragged source has taken no step, and the outline of its start is at the new place."""
    state = run(STEP, STEP, Action("drag", "source", 1.0, -0.5))
    assert state.run.steps == 0
    np.testing.assert_allclose(state.run.began.t, (1.0, -0.5))
    assert not any(getattr(mark, "role", "") == "ghost" for mark in draw(state).panels[0].marks)
    assert any(getattr(mark, "role", "") == "ghost" for mark in draw(act(state, STEP)).panels[0].marks)


@pytest.mark.parametrize("controls", [{"gate": 0.6}, {"objective": "capped", "gate": 0.6}, {"objective": "count"}])
def test_the_charts_show_every_step_of_the_run(controls: dict[str, Any]) -> None:
    """A step is a line for its move and one for its matching; a dot for each number of pairs. The objective has a line
    only where it never rises and the RMS may."""
    state = run(*[STEP] * 12, turn=45.0, offset=1.43, **controls)
    course, charts = state.run.course, {panel.name: panel for panel in draw(state).panels}
    paths = [mark for mark in charts["rms"].marks if isinstance(mark, Path)]
    (truth,) = (np.asarray(path.xy) for path in paths if path.role == "truth")
    top = float(state.run.truth.rms[0]) / truth[0, 1]
    lines = {role: [np.asarray(path.xy) for path in paths if path.role == role] for role in ("source", "target")}
    for k, (a, b) in enumerate(pairwise(course)):
        np.testing.assert_allclose(lines["source"][k], [[k / 16, a.rms / top], [(k + 0.5) / 16, b.moved / top]])
        np.testing.assert_allclose(lines["target"][k], [[(k + 0.5) / 16, b.moved / top], [(k + 1) / 16, b.rms / top]])
    assert len(lines["source"]) == len(lines["target"]) == 12
    means = [np.asarray(path.xy) for path in paths if path.role == "accent"]
    assert len(means) == (controls.get("objective") == "capped")
    for mean in means:
        np.testing.assert_allclose(mean, [[k / 16, entry.mean / top] for k, entry in enumerate(course)])
    (dots,) = (np.asarray(mark.xy) for mark in charts["used"].marks if isinstance(mark, Points))
    np.testing.assert_allclose(dots, [[k / 16, entry.used] for k, entry in enumerate(course)])


def test_the_description_promises_what_the_rule_can_keep() -> None:
    for controls, words in (
        ({"objective": "count"}, "neither the sum of squares nor the RMS can rise"),
        ({"objective": "capped"}, "The capped sum of squares cannot rise; the RMS over the pairs used can"),
        ({"gate": 0.6}, "both the sum of squares and the RMS can rise"),
    ):
        assert words in draw(run(**controls)).description


def test_a_used_pair_joins_a_point_to_its_nearest() -> None:
    """By brute force; those beyond the gate are told apart by their length."""
    state = run(gate=0.5, turn=30.0, offset=1.0)
    moved, target = state.run.pose.apply(state.run.scene.source), state.run.scene.target
    distances = np.linalg.norm(moved[:, None] - target, axis=2)
    for mark in draw(state).panels[0].marks:
        if not hasattr(mark, "a") or not len(np.asarray(mark.a)):
            continue
        a, b = np.asarray(mark.a), np.asarray(mark.b)
        rows = np.linalg.norm(a[:, None] - moved, axis=2).argmin(axis=1)
        np.testing.assert_allclose(a, moved[rows], atol=1e-12)
        np.testing.assert_allclose(b, target[distances[rows].argmin(axis=1)], atol=1e-12)
        assert ((distances[rows].min(axis=1) <= 0.5) == (mark.role == "pair")).all()
