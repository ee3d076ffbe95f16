"""The walkthrough: its stages are those of one solver step, all panels keep in step, and every control takes effect."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from solvers import Pose, register
from solvers.methods.soft import cpd
from solvers.metrics import rre, rte
from solvers.studies.walkthrough import AREA, EVERY, FOUR
from tests.widgets.states import state_after
from widgets.drawing.picture import Heat, Panel, Points, Segments
from widgets.engine.contract import SEED, Action
from widgets.figures.four import mmd
from widgets.figures.four.figure import PARTS, SHORT, WIDGET, State, act, draw
from widgets.figures.four.run import STAGES

NEXT, ITERATE, FINISH = (Action("press", name) for name in ("next", "iterate", "finish"))
SCENES = ("clean", "noisy", "clutter")


def stage(k: int) -> Action:
    return Action("press", f"stage-{k}")


run = partial(state_after, WIDGET)


def panels(state: State) -> dict[str, Panel]:
    return {panel.name: panel for panel in draw(state).panels}


def texts(state: State) -> dict[str, str]:
    return {readout.name: readout.value.replace("−", "-") for readout in draw(state).readouts}


def captions(state: State) -> list[str]:
    return [panel.caption for panel in draw(state).panels]


@pytest.mark.parametrize("scene", SCENES)
def test_a_jump_shows_what_walking_there_shows(scene: str) -> None:
    """Each stage reached directly, forwards or back, has the same captions and numbers as by pressing Next."""
    walks = [run(*[NEXT] * k, scene=scene) for k in range(2 * STAGES)]
    for k in range(1, STAGES + 1):
        for jump, walk in (
            (run(stage(k), scene=scene), walks[k - 1]),
            (run(ITERATE, stage(5), stage(2), stage(k), scene=scene), walks[STAGES + k - 1]),
        ):
            assert captions(jump) == captions(walk)
            assert texts(jump) == texts(walk)


def test_an_iteration_is_five_stages() -> None:
    """Next iteration keeps the stage and leads to the same state as five presses of Next."""
    for k in range(1, STAGES + 1):
        assert captions(run(stage(k), ITERATE)) == captions(run(*[NEXT] * (k - 1 + STAGES)))


def test_all_panels_stand_at_the_same_stage_and_three_hold_their_fourth() -> None:
    """Each panel names its own stage of that number; at the fifth, the others still show their fourth."""
    for k in range(1, STAGES + 1):
        for name, panel in panels(run(stage(k))).items():
            stages = PARTS[name].STAGES
            assert f"{min(k, len(stages))} of {len(stages)} · {stages[min(k, len(stages)) - 1]}" in panel.caption
    fourth, fifth = run(stage(4)), run(stage(5))
    for a, b in zip(fourth.walk.looks(), fifth.walk.looks(), strict=True):
        if a.track.name != "cpd":
            assert a.errors() == b.errors()
            counts = [
                len(PARTS[look.track.name].shown(look).marks) for look in (a, b)
            ]  # the same number of marks as at the fourth
            assert counts[0] == counts[1]
    assert texts(fourth) == texts(fifth)


@pytest.mark.parametrize("scene", SCENES)
def test_after_k_iterations_the_errors_are_the_front_doors(scene: str) -> None:
    """The readouts agree with `register`, given the same options and number of steps, from the cloud as it lies."""
    state = run(ITERATE, ITERATE, stage(4), scene=scene, turn=45.0)
    text, walk = texts(state), state.walk
    moved = walk.start.apply(walk.scene.source)
    calls: dict[str, dict[str, Any]] = {
        "cpd": {"method": "cpd-similarity", "clutter": 0.12, "volume": AREA},
        "filterreg": {"method": "filterreg", "filter": "grid", "clutter": 0.25, "volume": AREA},
        "mmd": {"method": "mmd", "lengths": (1.5, 0.8, 0.5), "count": 48},
        "flow": {"method": "flow"},
    }
    assert list(calls) == list(FOUR)
    for name, call in calls.items():
        thin = slice(None, None, EVERY if name == "flow" else 1)
        result = register(moved[thin], walk.scene.target[thin], seed=SEED, max_steps=3, **call)
        pose = result.pose.compose(walk.start)
        assert float(text[f"{name}_rotation"]) == pytest.approx(np.degrees(rre(pose, walk.scene.truth)), abs=0.051)
        assert float(text[f"{name}_translation"]) == pytest.approx(rte(pose, walk.scene.truth), abs=0.0051)


def test_cpds_stages_lead_to_its_next_pose() -> None:
    """The motion and scale named by the third and fourth stages, together, give the pose that the step reaches."""
    for actions in ((stage(4),), (ITERATE, stage(4)), (ITERATE, ITERATE, stage(4))):
        look = run(*actions, scene="clutter").walk.looks()[0]
        step = cpd.stages(look.before)
        pose = Pose(step.rotation, step.translation, step.scale)
        assert pose.apply(look.given) == pytest.approx(look.went.apply(look.walk.scene.source), abs=1e-9)
        assert step.sigma == pytest.approx(float(look.after.sigma[0]))


def test_beside_the_bars_stand_the_clouds_that_they_were_made_of() -> None:
    """The previous stage at reduced size: the same points, the same poses."""
    state = run(stage(2))
    look = next(look for look in state.walk.looks() if look.track.name == "mmd")
    for index in (2, 3):
        small = [m for m in panels(run(stage(index)))["mmd"].marks if isinstance(m, Points)]
        for mark, cloud in zip(small, (state.walk.scene.target, look.moved), strict=True):
            offsets = np.asarray(mark.xy) / mmd.SMALL - cloud
            np.testing.assert_allclose(offsets - offsets[0], 0.0, atol=1e-12)


def test_the_bars_are_the_96_means_and_their_difference() -> None:
    """Two rows of 96 bars, then one of 96 whose squared lengths, divided by 48, add up to the objective."""

    def bars(panel: Panel) -> list[Segments]:
        return [mark for mark in panel.marks if isinstance(mark, Segments)]

    state = run(stage(2), scene="noisy")
    above, below = bars(panels(state)["mmd"])
    assert len(np.asarray(above.a)) == len(np.asarray(below.a)) == 96
    (bar,) = bars(panels(run(stage(3), scene="noisy"))["mmd"])
    lengths = (np.asarray(bar.b) - np.asarray(bar.a))[:, 1] / mmd.TALL
    objective = float(state.walk.tracks[2].before.objective()[0])
    assert float((lengths**2).sum() / 48) == pytest.approx(objective, rel=1e-9)


def test_the_filter_spreads_and_keeps_the_mass() -> None:
    """The blurred density covers over 1.5 times as much as the unblurred one; no cell exceeds the scale's end."""
    areas = []
    for k in (1, 2):
        (heat,) = (mark for mark in panels(run(ITERATE, stage(k)))["filterreg"].marks if isinstance(mark, Heat))
        values = np.asarray(heat.values)
        assert np.nanmax(values) <= heat.high * (1 + 1e-12)
        x0, x1, y0, y1 = heat.window
        areas.append(np.isfinite(values).mean() * (x1 - x0) * (y1 - y0))
    assert areas[1] > 1.5 * areas[0]


def test_only_cpd_finds_the_smaller_clouds_size() -> None:
    """With the scale switch, CPD ends within 2 % of 1/0.85; the other three stay 15 % off."""
    text = texts(run(FINISH, smaller=True))
    assert abs(float(text["cpd_scale"])) < 2.0
    assert [text[f"{name}_scale"] for name in ("filterreg", "mmd", "flow")] == ["-15.0"] * 3


def test_the_projection_switch_changes_the_flow_alone() -> None:
    """After two iterations the flow's numbers differ; the others' do not."""
    on, off = (texts(run(ITERATE, ITERATE, stage(4), turn=100.0, project=flag)) for flag in (True, False))
    names = {name for name in on if on[name] != off[name]}
    assert names
    assert all(name.startswith("flow_") for name in names)


def test_the_end_certifies_nothing() -> None:
    """From half a turn all four stop, and the note counts fewer than four as right."""
    state = run(FINISH, turn=180.0)
    picture = draw(state)
    assert "Stopping certifies nothing" in picture.note
    assert "4 of 4" not in picture.note
    assert {"next", "iterate", "finish", "stage-5"} <= picture.disabled
    assert captions(act(state, NEXT)) == captions(state)


def test_words_name_in_full_what_a_caption_shortens() -> None:
    """A caption has the readouts' name for a method; pictures' labels and the description say what it is."""
    picture = draw(run())
    for name, panel in panels(run()).items():
        assert panel.caption.startswith(f"{SHORT[name]}: 1 of ")
        assert panel.label.startswith(f"{PARTS[name].NAME}, ")
        assert f"{PARTS[name].NAME}: 1 of " in picture.description


def test_each_panel_says_why_it_stopped() -> None:
    """From 120° the filter runs into its cap of steps in the walk's last iteration."""
    words = captions(run(FINISH, turn=120.0))
    assert all(": ended" in text and "Stopped after" in text for text in words)
    assert "Stopped after 120 steps: the cap of 120 steps was reached." in words[1]


def test_the_fifth_stage_is_spoken_of_while_cpd_has_one() -> None:
    """From half a turn CPD stops after 52 steps, the others later."""
    notes = [draw(run(*[ITERATE] * count, stage(5), turn=180.0)).note for count in (1, 60)]
    assert notes[0] == "Only CPD has a fifth stage; the others hold their fourth."
    assert notes[1] == "Iteration 61, stage 5 of 5."


def test_captions_keep_to_one_line_on_a_wide_page() -> None:
    """No line of a caption exceeds 84 characters, in any stage of the first three iterations or at the end."""
    for scene in SCENES:
        state = run(scene=scene, smaller=True)
        for _ in range(3 * STAGES):
            state = act(state, NEXT)
            assert max(len(line) for caption in captions(state) for line in caption.split("\n")) <= 84
        for line in (line for caption in captions(act(state, FINISH)) for line in caption.split("\n")):
            assert len(line) <= 84


PRESSES = st.sampled_from(["next", "iterate", *(f"stage-{k}" for k in range(1, STAGES + 1))])
PLACES = st.floats(-1e6, 1e6)
ACTIONS = st.one_of(
    st.builds(lambda name: Action("press", name), PRESSES),
    st.builds(lambda name, x, y: Action("drag", name, x, y), st.sampled_from(["source", "turn"]), PLACES, PLACES),
)


@settings(max_examples=15, deadline=None)
@given(st.lists(ACTIONS, max_size=6), st.sampled_from(SCENES), st.booleans())
def test_whatever_a_reader_does_there_is_a_picture(actions: list[Action], scene: str, smaller: bool) -> None:
    """Any presses and drags: four panels, finite errors, a stage from 1 to 5, handles only before anything moves."""
    state = run(*actions, scene=scene, smaller=smaller)
    picture = draw(state)
    assert len(picture.panels) == 4
    assert 1 <= state.walk.stage <= STAGES
    assert all(np.isfinite(look.errors()).all() for look in state.walk.looks())
    assert bool(picture.handles) == (state.walk.iteration == state.walk.stage == 1)


def test_the_readouts_of_a_method_stand_together() -> None:
    """However a page arranges them, the readouts of each method follow one another."""
    names = [readout.name.split("_") for readout in draw(run()).readouts]
    assert [method for method, _ in names[::4]] == list(PARTS)
    assert all(method == names[k - k % 4][0] for k, (method, _) in enumerate(names))


def test_the_start_is_dragged_before_anything_else_has_happened() -> None:
    """Only the first stage of the first iteration has handles, and no note; later the note counts both."""
    for actions, iteration, at in (((), 1, 1), ((stage(3),), 1, 3), ((ITERATE,), 2, 1), ((ITERATE, stage(2)), 2, 2)):
        picture = draw(run(*actions))
        is_first = not actions
        assert bool(picture.handles) == is_first
        assert picture.note == ("" if is_first else f"Iteration {iteration}, stage {at} of {STAGES}.")
        assert f"stage-{at}" in picture.disabled
