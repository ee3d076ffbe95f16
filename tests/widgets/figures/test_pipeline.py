"""The figure of the stages: each does what it says, each can be left out, and the verdict follows from the signs."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from solvers import Pose
from solvers.metrics import point_error
from solvers.studies.seeds import seeds
from tests.widgets.states import readouts, state_after
from widgets.drawing.picture import Label, Path, Points, Segments
from widgets.engine.contract import Action, preset
from widgets.engine.host import Host
from widgets.figures.pipeline.door import door
from widgets.figures.pipeline.figure import WIDGET, State, act, draw, motion
from widgets.figures.pipeline.run import REACH, right

NEXT, FINISH = Action("press", "next"), Action("press", "finish")


run = partial(state_after, WIDGET)


def texts(state: State) -> dict[str, str]:
    return readouts(draw(state))


def stages(state: State) -> list[str]:
    return [stage.name for stage in state.stages]


def test_the_stages_follow_one_another() -> None:
    """Each press runs one stage; the last moves nothing and decides, and then the buttons are disabled."""
    steps = [run(*[NEXT] * k) for k in range(5)]
    assert [stages(state)[-1] for state in steps] == ["start", "propose", "refine", "refine", "refine"]
    assert [state.verdict for state in steps] == [False, False, False, True, True]
    np.testing.assert_array_equal(steps[2].pose.matrix, steps[3].pose.matrix)
    assert draw(steps[3]).disabled == {"next", "finish"}
    assert not draw(steps[2]).disabled


def test_all_stages_at_once_are_the_stages_one_by_one() -> None:
    assert texts(run(FINISH)) == texts(run(NEXT, NEXT, NEXT))


@pytest.mark.parametrize(
    ("controls", "names"),
    [
        ({"draws": 0.0}, ["start", "refine"]),
        ({"refine": "none"}, ["start", "propose"]),
        ({"draws": 0.0, "refine": "none"}, ["start"]),
    ],
)
def test_what_is_left_out_does_not_run(controls: dict[str, Any], names: list[str]) -> None:
    state = run(FINISH, **controls)
    assert stages(state) == names
    assert state.verdict


def test_the_proposal_does_not_know_the_prediction() -> None:
    """Two predictions give the same proposal."""
    first, second = run(NEXT, turn=20.0), run(NEXT, turn=-170.0, offset=3.0)
    np.testing.assert_array_equal(first.pose.matrix, second.pose.matrix)


def test_where_nothing_is_explained_there_is_no_residual() -> None:
    """A source dragged out of the picture has no target point near it: no RMS or conditioning is shown, and the
    conditioning does not count as met."""
    state = run(Action("drag", "source", -6.4, -4.6))
    report = texts(state)
    assert (report["share"], report["rms"], report["conditioning"]) == ("0", "–", "–")
    by_name = {sign.name: sign for sign in state.judgement.signs}
    assert (by_name["residual"].said, by_name["residual"].at) == ("–", None)
    assert (by_name["conditioning"].said, by_name["conditioning"].met) == ("–", False)


def test_a_sign_without_a_value_is_not_met_once_it_is_required() -> None:
    """Far from everything no half finds a pose; and where no stage runs, the halves are not tried."""
    clean = {"scene": "clean", "noise": 0.02, "outliers": 0.0, "gate": 0.1, "draws": 0.0, "least": 0.0}
    away = run(Action("drag", "source", -6.4, -4.6), FINISH, **clean)
    untried = run(FINISH, draws=0.0, refine="none", turn=0.0, offset=0.0)
    for state in (away, untried):
        assert texts(state)["halves"] == "–"
        assert "two halves" in state.judgement.failed
        assert "two halves not known" in draw(state).description
        assert not state.accepted
    assert run(FINISH, trust=180.0).accepted, "what is not required does not refuse"


def test_a_conditioning_near_zero_keeps_a_digit() -> None:
    """In a corridor the cross is not at the end of the scale, and the number beside it is not 0.000."""
    (sign,) = (sign for sign in run(FINISH, scene="corridor").judgement.signs if sign.name == "conditioning")
    assert sign.at is not None
    assert sign.at > 0.0
    assert 0.0 < float(sign.said) < 0.001


@pytest.mark.parametrize(
    ("name", "controls", "sign", "said", "readout"),
    [
        ("hall", {"trust": 160.0}, "prediction", ("160.1°", "≤ 160°"), ("prediction", "160.1")),
        ("default", {"outliers": 60.0, "least": 0.0}, "residual", ("0.1801 u", "≤ 0.18 u"), ("rms", "0.1801")),
    ],
)
def test_a_limit_that_is_missed_does_not_read_as_met(
    name: str, controls: dict[str, Any], sign: str, said: tuple[str, str], readout: tuple[str, str]
) -> None:
    """Rounded as usual, both would be the limit itself. The readout has the sign's digits."""
    state = run(FINISH, name=name, **controls)
    (found,) = (s for s in state.judgement.signs if s.name == sign)
    assert (found.said, found.asked, found.met) == (*said, False)
    assert texts(state)[readout[0]] == readout[1]


def test_a_small_budget_makes_a_worse_proposal() -> None:
    """Over six draws, one step of hypotheses leaves the source over three times as far off as seventy do."""

    def error(steps: float) -> float:
        results = [run(NEXT, draws=steps, seed=seed) for seed in seeds(6)]
        return sum(float(point_error(s.pose, s.scene.truth, s.scene.source)) for s in results)

    assert error(1.0) > 3 * error(70.0)


@pytest.mark.parametrize(
    ("controls", "sign"),
    [
        ({"least": 100.0}, "overlap"),
        ({"scene": "corridor"}, "conditioning"),
        ({"trust": 30.0}, "prediction"),
    ],
)
def test_each_sign_can_refuse(controls: dict[str, Any], sign: str) -> None:
    """A sign whose demand is too strict fails, and the note names it."""
    state = run(FINISH, **controls)
    assert sign in state.judgement.failed
    assert not state.accepted
    assert sign in draw(state).note


@pytest.mark.parametrize("sign", ["two halves", "residual"])
def test_a_wrong_fit_can_fail_by_other_signs_too(sign: str) -> None:
    """From far away, without a proposal: over six draws, each of these signs refuses some wrong pose."""
    results = [run(FINISH, name="local", seed=seed) for seed in seeds(6)]
    assert any(sign in state.judgement.failed and not right(state.scene, state.pose) for state in results)


def test_a_stop_flag_accepts_what_the_signs_refuse() -> None:
    """Without a proposal ICP converges on a wrong pose: its stop flag accepts it, the signs do not."""
    flag, signs = (run(FINISH, name="local", accept=by) for by in ("flag", "signs"))
    assert not right(flag.scene, flag.pose)
    assert flag.accepted
    assert not signs.accepted
    assert "false acceptance" in draw(flag).note


def test_the_signs_accept_a_wrong_hall_unless_the_prediction_is_asked() -> None:
    """Half a turn off in the hall, all other signs are met; only the prediction refuses the pose."""
    blind, strict = run(FINISH, name="hall"), run(FINISH, name="hall", trust=60.0)
    assert not right(blind.scene, blind.pose)
    assert blind.accepted
    assert strict.judgement.failed == ("prediction",)


def test_a_door_tells_the_ends_of_the_hall_apart() -> None:
    """Half a turn off, the source's door is at the other end; at the truth, on the true one. Rooms have none."""
    scene = run(name="hall").scene
    wrong = run(FINISH, name="hall")

    def middle(pose: Pose) -> Any:
        (line,) = door(scene, pose, "source")
        return np.mean(line.xy, axis=0)

    true = middle(scene.truth)
    np.testing.assert_allclose(middle(wrong.pose), -true, atol=0.1)
    np.testing.assert_allclose(middle(run(FINISH, name="hall", draws=0.0, gate=2.6).pose), true, atol=0.1)
    assert "at the other end of the hall from the true one" in draw(wrong).description
    assert door(run().scene, Pose.identity(), "source") == ()


def test_a_drag_starts_anew_from_there() -> None:
    """A drag after the verdict makes a new prediction and discards the stages."""
    state = run(FINISH, Action("drag", "source", 1.0, -0.5))
    assert stages(state) == ["start"]
    assert not state.verdict
    np.testing.assert_allclose(state.pose.t, (1.0, -0.5))


def test_a_stage_moves_the_source_and_a_verdict_does_not() -> None:
    before = run(NEXT, NEXT)
    assert motion(run(NEXT), before) is not None
    assert motion(before, act(before, NEXT)) is None


@settings(max_examples=12, deadline=None)
@given(
    st.sampled_from(["clean", "striped", "combo", "hall", "corridor"]),
    st.floats(-180, 180),
    st.integers(0, 70),
    st.sampled_from(["none", "point", "plane", "gicp"]),
    st.floats(0.1, 3),
    st.floats(0, 100),
    st.floats(0, 60),
    st.integers(0, 999),
)
def test_whatever_is_set_there_is_a_verdict(
    scene: str, turn: float, draws: int, refine: str, gate: float, least: float, outliers: float, seed: int
) -> None:
    """Every setting ends in a verdict that follows from the signs, with finite readouts."""
    controls = {
        "scene": scene, "turn": turn, "draws": float(draws), "refine": refine, "gate": gate, "least": least,
        "outliers": outliers,
    }  # fmt: skip
    plain = preset(WIDGET, "default", controls).plain()
    frame = Host().render("f", {**plain, "seed": seed, "log": [["press", "finish"]]})
    readouts = {r["name"]: r["value"] for r in frame["readouts"]}
    assert readouts["verdict"] in ("accepted", "refused")
    assert not any("nan" in value or "inf" in value for value in readouts.values())
    assert set(frame["disabled"]) == {"finish", "next"}


@pytest.mark.parametrize("name", ["default", "local", "hall", "corridor"])
def test_a_sign_is_drawn_within_its_good_part_exactly_if_it_is_met(name: str) -> None:
    """A dot on the thick part of its scale, or a cross beside it; the threshold is where the two parts meet."""
    state = run(FINISH, name=name, trust=60.0)
    marks = draw(state).panels[1].marks
    good = [np.asarray(m.xy) for m in marks if isinstance(m, Path) and m.role == "inlier"]
    limits = [np.reshape(m.a, 2)[0] for m in marks if isinstance(m, Segments) and m.role == "ink"]
    values = {np.reshape(m.xy, 2)[1]: m for m in marks if isinstance(m, Points)}
    assert len(good) == len(limits) == 5
    for sign, part, limit in zip(state.judgement.signs, good, limits, strict=True):
        low, high = np.sort(part[:, 0])
        assert limit in (low, high)
        assert {low, high} - {limit} <= {0.0, 1.0}
        value = values.get(part[0, 1])
        assert (value is None) == (sign.at is None)
        if value is not None:
            x = float(np.reshape(value.xy, 2)[0])
            assert (low <= x <= high) == sign.met
            assert (value.shape, value.role) == (("dot", "inlier") if sign.met else ("cross", "outlier"))


def test_what_is_not_explained_is_crossed_out() -> None:
    """Each source point without a target point within reach; the rest is the share of the first sign."""
    state = run(NEXT)
    moved, target = state.pose.apply(state.scene.source), state.scene.target
    far = np.linalg.norm(moved[:, None] - target, axis=2).min(axis=1) > REACH
    (crosses,) = (m for m in draw(state).panels[0].marks if isinstance(m, Points) and m.shape == "cross")
    np.testing.assert_allclose(crosses.xy, moved[far])
    assert far.any()
    assert float(texts(state)["share"]) == pytest.approx(100 * (~far).mean(), abs=0.5)


@pytest.mark.parametrize(
    ("name", "role", "ending"), [("default", "inlier", ", accepted"), ("local", "outlier", ", refused")]
)
def test_the_picture_s_title_has_the_verdict(name: str, role: str, ending: str) -> None:
    """And the note tells the four cases apart."""
    (before,) = (m for m in draw(run(name=name)).panels[0].marks if isinstance(m, Label))
    assert before.role == "ink"
    state = run(FINISH, name=name)
    (title,) = (m for m in draw(state).panels[0].marks if isinstance(m, Label))
    assert title.text.endswith(ending)
    assert title.role == role
    fits = right(state.scene, state.pose)
    assert ("The pose is right" in draw(state).note) == fits
    assert ("false" in draw(state).note) == (state.accepted != fits)
