"""The dial: its ring is the method's own objective, its ball ends where `register` ends, its band counts arrivals."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from solvers import Pose, fit_rigid, register
from solvers.metrics import rre, rte
from solvers.studies.benchmark import CLOSE_DEGREES, CLOSE_DISTANCE, is_close
from tests.widgets.states import frame_after, state_after
from widgets.drawing.picture import Label, Path, Points, Segments, number
from widgets.engine.contract import Action, preset
from widgets.engine.controls import specs
from widgets.engine.host import Host
from widgets.figures import dial as figure
from widgets.figures import ladder_map
from widgets.parts import dial_marks as marks
from widgets.parts.dial import COARSE, RUNGS, SLICES, Dial, headings, made, starts, valleys
from widgets.parts.ring import place

LOCAL = ["nearest", "surface", "cells", "soft", "means"]


def of(name: str, length: float | None = None, seed: int = 40, noise: float = 0.02) -> Dial:
    return made(name, seed, noise, length or RUNGS[name].length or 1.0)


def fresh(name: str) -> Dial:
    """A dial for which nothing has been computed."""
    return of(name)


def run(dial: Dial, turn: float, **more: Any) -> Any:
    clouds, start = dial.clouds, Pose.from_angle(turn)
    options = dial.rung.options(dial.length)
    return register(
        clouds.source, clouds.target, dial.rung.method, start=start, seed=dial.seed, max_steps=70, **options, **more
    )


def texts(name: str, *presses: str, **changes: Any) -> dict[str, str]:
    plain = preset(figure.WIDGET, name, changes).plain()
    frame = Host().render("f", {**plain, "log": [["press", press] for press in presses]})
    return {readout["name"]: readout["value"] for readout in frame["readouts"]}


def test_the_ring_of_known_pairs_is_the_sum_of_squares() -> None:
    """The ring equals the sum written out, and the cosine that expanding the squares gives."""
    dial = of("pairs")
    p, q = dial.clouds.source, dial.clouds.target
    clouds = [Pose.from_angle(turn).apply(p) for turn in headings()]
    np.testing.assert_allclose(dial.ring, [((cloud - q) ** 2).sum() for cloud in clouds])
    cosine, sine = (p * q).sum(), (p[:, 0] * q[:, 1] - p[:, 1] * q[:, 0]).sum()
    expected = (p**2).sum() + (q**2).sum() - 2 * (cosine * np.cos(headings()) + sine * np.sin(headings()))
    np.testing.assert_allclose(dial.ring, expected)
    assert len(valleys(dial.ring)) == 1


def test_the_ring_of_nearest_points_is_the_sum_of_capped_squares() -> None:
    dial = of("nearest", 1.0)
    p, q = dial.clouds.source, dial.clouds.target
    for k in (0, 31, 90, 139):
        squares = ((Pose.from_angle(headings()[k]).apply(p)[:, None] - q) ** 2).sum(axis=2).min(axis=1)
        np.testing.assert_allclose(dial.ring[k], np.minimum(squares, 1.0).sum())


@pytest.mark.parametrize("name", [name for name in RUNGS if name != "flow"])
def test_a_ring_is_the_objective_with_which_the_method_begins(name: str) -> None:
    dial = fresh(name)
    np.testing.assert_array_equal(dial.coarse, dial.ring[::COARSE])
    for k in (7, 90, 133):
        assert run(dial, headings()[k]).history.objective[0] == pytest.approx(dial.ring[k], rel=1e-9, abs=1e-12)


def test_a_flow_has_no_objective() -> None:
    """Its steps minimise nothing: the residual that it reports rises as well as falls."""
    dial = of("flow")
    assert not dial.ring.any()
    steps = np.diff(run(dial, 1.0).history.objective[1:])
    assert steps.min() < 0.0 < steps.max()
    assert np.ptp(marks.heights(dial, True)) == 0.0
    assert texts("flow")["objective_start"] == "–"
    _, chart = figure.draw(state_after(figure.WIDGET, name="flow")).panels
    assert not [mark for mark in chart.marks if isinstance(mark, Path) and mark.role == "accent"]
    assert any("no objective" in mark.text for mark in chart.marks if isinstance(mark, Label))


@pytest.mark.parametrize(("name", "words"), [("flow", "It ended "), ("default", "It came to rest ")])
def test_a_flow_that_has_finished_is_not_said_to_rest(name: str, words: str) -> None:
    """The note also gives both errors that decide whether the end is the truth."""
    frame = Host().render("f", {**preset(figure.WIDGET, name, {}).plain(), "log": [["press", "roll"]]})
    result = texts(name, "roll")
    assert frame["note"].startswith(words)
    assert f"{result['rotation_error']}° and {result['translation_error']} u off: not the truth" in frame["note"]


@pytest.mark.parametrize(("name", "steps"), [("pairs", "1 step, "), ("default", "13 steps, ")])
def test_one_step_is_told_as_one(name: str, steps: str) -> None:
    assert f"after {steps}" in frame_after(figure.WIDGET, ["press", "roll"], name=name)["description"]


def test_a_slider_is_called_what_the_rung_calls_it() -> None:
    names = {name: specs(figure.Controls)["length"].called({"rung": name}) for name in RUNGS}
    assert (names["nearest"], names["cells"], names["means"]) == ("Cap τ", "Cell size h", "First ℓ")
    assert {name for name, text in names.items() if "unused" in text} == {"pairs", "surface", "flow"}


@pytest.mark.parametrize("name", RUNGS)
def test_a_tick_marks_each_valley_that_is_counted(name: str) -> None:
    """On the ring, at its surface, and in the chart; the coarse ring, whose valleys are not counted, has none."""
    state = figure.start(preset(figure.WIDGET, "default" if name == "nearest" else name).controls, 40)
    full, count = figure.draw(state), len(valleys(state.dial.ring))
    assert {r.name: r.value for r in full.readouts}["valleys"] == ("–" if name == "flow" else str(count))
    for panel in full.panels:
        ticks = [mark for mark in panel.marks if isinstance(mark, Segments) and mark.role == "ink"]
        assert [len(np.reshape(mark.a, (-1, 2))) for mark in ticks] == [count], panel.name
    coarse = [mark for panel in figure.draw(state, 0).panels for mark in panel.marks]
    assert not [mark for mark in coarse if isinstance(mark, Segments) and mark.role == "ink"]
    bottoms = marks.at(state.dial, True, headings()[valleys(state.dial.ring)])
    distances = np.linalg.norm(np.asarray(marks.valley_ticks(state.dial).a) - bottoms, axis=1)
    np.testing.assert_allclose(distances, marks.TICK[0])


@pytest.mark.parametrize("name", RUNGS)
@pytest.mark.parametrize("turn", [-2.5, 0.0, 1.2])
def test_the_ball_ends_where_the_method_does(name: str, turn: float) -> None:
    course, result = of(name).course(turn), run(of(name), turn)
    np.testing.assert_allclose(course.pose.matrix, result.pose.matrix, atol=1e-9)
    assert course.status == result.status
    assert len(course.headings) - 1 == result.steps
    assert course.headings[0] == pytest.approx(turn)
    assert course.rotation == pytest.approx(np.degrees(rre(result.pose, Pose.identity())), abs=1e-6)
    assert course.translation == pytest.approx(rte(result.pose, Pose.identity()), abs=1e-9)


@pytest.mark.parametrize("name", ["pairs", "corrupted"])
def test_what_knows_its_pairs_takes_no_account_of_the_start(name: str) -> None:
    dial = of(name)
    ends = np.stack([dial.course(turn).pose.matrix for turn in (-3.0, -1.0, 0.5, 2.0)])
    np.testing.assert_allclose(ends, np.broadcast_to(ends[0], ends.shape), atol=1e-9)
    right = ~dial.clouds.wrong
    fit = fit_rigid(dial.clouds.source[right], dial.clouds.target[right]).pose
    np.testing.assert_allclose(ends[0], fit.matrix, atol=1e-6)
    assert dial.arrivals().all()


def test_four_pairs_in_ten_are_wrong_on_rung_2() -> None:
    clean, corrupted = of("pairs").clouds, of("corrupted").clouds
    assert not clean.wrong.any()
    assert corrupted.wrong.sum() == round(0.4 * len(corrupted.source))
    np.testing.assert_array_equal((clean.target != corrupted.target).any(axis=1), corrupted.wrong)


@pytest.mark.parametrize("name", LOCAL)
def test_every_start_is_a_run_of_its_own(name: str) -> None:
    """The slices give the same ends as single runs, however many are requested and in whatever order."""
    dial, second = fresh(name), fresh(name)
    arrivals = dial.arrivals()
    assert len(arrivals) == len(starts())
    assert second.slices == 0
    np.testing.assert_array_equal(second.arrivals(2), arrivals[: 2 * len(starts()) // SLICES])
    assert second.slices == 2
    for k in (0, 14, 18, 25):
        course = dial.course(starts()[k])
        close = is_close(course.rotation, course.translation)
        assert course.arrived == close == arrivals[k]
    assert 0 < arrivals.sum() < len(arrivals)


def test_valleys_are_counted_round_the_circle() -> None:
    turn = np.linspace(0.0, 2.0 * np.pi, 180, endpoint=False)
    for count in (1, 3, 8):
        for shift in (0.0, 0.3):
            assert len(valleys(np.cos(count * turn + shift))) == count
    assert len(valleys(np.zeros(180))) == 0
    assert len(valleys(np.full(180, 7.0) + 1e-13 * np.cos(turn))) == 0
    assert len(valleys(np.repeat([1.0, 0.0, 2.0, 0.0], 45))) == 2, "a flat bottom is one valley"


@pytest.mark.parametrize("turn", [-179.0, -90.0, 0.0, 33.0, 180.0])
def test_the_robot_faces_where_it_is_dragged(turn: float) -> None:
    """The truth is at the top; a positive turn is anticlockwise, as on the scan; keys turn by their stated angle."""
    state = figure.start(figure.Controls(), 40)
    x, y = place(np.radians(turn), 5.0).tolist()
    result = figure.act(state, Action("drag", "turn", x, y))
    assert np.degrees(result.heading) == pytest.approx(turn) or abs(turn) == 180
    nose = Pose.from_angle(result.heading).apply(np.array([[0.0, 1.0]]))[0]
    np.testing.assert_allclose(nose * 5.0, [x, y], atol=1e-9)
    handle = figure.draw(result).handles[0]
    np.testing.assert_allclose(handle.xy, nose * marks.HAND, atol=1e-9)
    left = figure.act(result, Action("drag", "turn", *handle.keys["ArrowLeft"]))
    assert np.sin(left.heading - result.heading) == pytest.approx(np.sin(np.radians(1.0)))


def test_a_turn_of_the_robot_leaves_the_ring() -> None:
    """While the robot is dragged, only its own run is computed."""
    state = figure.start(figure.Controls(), 40)
    assert figure.act(state, Action("drag", "turn", 1.0, 2.0)).dial is state.dial


def test_dragging_after_the_first_run_runs_again() -> None:
    state = figure.act(figure.start(figure.Controls(), 40), Action("press", "roll"))
    at = place(0.1, 5.0).tolist()
    result = figure.act(state, Action("drag", "turn", *at))
    assert state.course
    assert result.course
    assert not state.course.arrived
    assert result.course.arrived


def test_the_band_grows_slice_by_slice_and_the_count_waits_for_all() -> None:
    state = figure.State(figure.Controls(rung="surface"), fresh("surface"), 1.0, every=True)
    counts = []
    for detail in range(figure.DETAILS):
        picture = figure.draw(state, detail)
        counts.append({r.name: r.value for r in picture.readouts}["arrive"])
        assert figure.known(state) == detail
    assert counts[:-1] == ["…"] * (figure.DETAILS - 1)
    assert counts[-1] == str(state.dial.arrivals().sum())


def test_known_pairs_have_one_valley_and_guessed_ones_several() -> None:
    """Over ten draws: what the first rung's dial shows does not depend on one lucky draw."""
    for seed in range(40, 50):
        first, second = made("pairs", seed, 0.02, 1.0), made("nearest", seed, 0.02, 6.0)
        assert len(valleys(first.ring)) == 1 < len(valleys(second.ring))
        assert first.arrivals().all()
        assert second.arrivals().sum() < len(starts()) / 2


def test_shorter_waves_make_more_valleys() -> None:
    counts = [int(texts("means", length=length)["valleys"]) for length in (2.4, 1.2, 0.6)]
    assert counts == sorted(counts)
    assert counts[0] < counts[-1]


def test_the_map_is_eight_dials_of_one_heading() -> None:
    """The map's readouts equal those of the single dials."""
    state = ladder_map.act(ladder_map.start(ladder_map.Controls(60.0), 40), Action("press", "roll"))
    frame = ladder_map.draw(state)
    assert [panel.name for panel in frame.panels] == list(RUNGS)
    values = {readout.name: readout.value for readout in frame.readouts}
    own = {name: texts("default" if name == "nearest" else name, "roll", turn=60.0) for name in RUNGS}
    assert values["rotation_pairs"] == own["pairs"]["rotation_error"]
    assert values["rotation_nearest"] == own["nearest"]["rotation_error"]
    assert values["valleys_nearest"] == own["nearest"]["valleys"]
    assert values["arrive"] == str(sum(course.arrived for course in state.courses))


def test_a_rungs_title_in_a_sentence_keeps_its_names() -> None:
    assert [RUNGS[name].phrase for name in ("cells", "pairs")] == ["the Gaussian of a cell", "pairs, all right"]


def test_the_map_tells_ends_before_full_rings() -> None:
    state = ladder_map.act(ladder_map.start(ladder_map.Controls(-35.0), 47), Action("press", "roll"))
    for detail, (arrive, rings) in enumerate([(False, False), (True, False), (True, True)]):
        values = {readout.name: readout.value for readout in ladder_map.draw(state, detail).readouts}
        assert (values["arrive"] != "…", values["valleys_soft"] != "…") == (arrive, rings)
        assert ladder_map.known(state) == detail
    assert detail == ladder_map.WIDGET.details - 1


def test_the_maps_description_tells_its_valleys_and_ends_once_they_are_known() -> None:
    start = ladder_map.start(ladder_map.Controls(60.0), 40)
    assert "ends are off" not in ladder_map.draw(start).description
    assert "ring of rung 1" not in ladder_map.draw(start, 0).description
    state = ladder_map.act(start, Action("press", "roll"))
    frame = ladder_map.draw(state)
    assert (ladder_map.draw(start).disabled, frame.disabled) == (set(), {"roll"})
    ends = [
        f"rung {rung.number} ({rung.phrase}) {number(course.rotation, 1)}°"
        for rung, course in zip(RUNGS.values(), state.courses, strict=True)
    ]
    one, three = (r.value for r in frame.readouts if r.name in ("valleys_pairs", "valleys_nearest"))
    rings = f"The ring of rung 1 has {one} valley, that of rung 3 has {three}."
    assert frame.description.endswith(f" {rings} {frame.note} The ends are off by: {', '.join(ends)}.")


def test_a_ball_is_the_truth_s_where_its_run_ended_there() -> None:
    """So there are as many such balls as the map counts: the flow's is at the top, but its robot is displaced."""
    state = ladder_map.act(ladder_map.start(ladder_map.Controls(60.0), 40), Action("press", "roll"))
    frame = ladder_map.draw(state)
    balls = [
        mark
        for panel in frame.panels
        for mark in panel.marks
        if isinstance(mark, Points) and mark.role == "truth" and mark.shape == "dot" and mark.radius == marks.BALL - 1
    ]
    assert len(balls) == sum(course.arrived for course in state.courses) == 3
    flow = state.courses[-1]
    assert flow.rotation < CLOSE_DEGREES
    assert flow.translation > CLOSE_DISTANCE
    assert frame.note == "3 of 8 end at the truth; 1 more faces the right way, in the wrong place."


def test_no_ball_or_ring_of_the_map_is_cut() -> None:
    """Half a turn off, where the rings are widest and reach the panel's edge."""
    state = ladder_map.act(ladder_map.start(ladder_map.Controls(180.0), 40), Action("press", "roll"))
    for panel in ladder_map.draw(state).panels:
        for mark in panel.marks:
            if isinstance(mark, Points) and mark.radius >= marks.BALL - 1:
                spots, edge = panel.view.px(mark.xy), mark.radius
                assert (spots >= edge).all(), panel.name
                assert (spots <= np.array(panel.view.size) - edge).all(), panel.name


def test_an_objective_of_thousands_has_a_comma() -> None:
    assert texts("pairs", turn=100.0)["objective_start"] == "1,680.558"


@pytest.mark.parametrize("turn", [-180.0, 180.0])
def test_half_a_turn_stands_clear_of_the_words_at_the_axis(turn: float) -> None:
    """With either sign, the ball is at the right end of the unrolled ring: at the left it would cover "high"."""
    _, chart = figure.draw(state_after(figure.WIDGET, turn=turn)).panels
    (ball,) = (mark for mark in chart.marks if isinstance(mark, Points))
    assert np.reshape(ball.xy, -1)[0] == pytest.approx(180.0)


def test_the_first_heading_and_the_lowest_place_are_written_apart() -> None:
    """Both labels are at the chart's lower left corner."""
    state = figure.start(preset(figure.WIDGET, "pairs").controls, 40)
    panel = next(panel for panel in figure.draw(state).panels if panel.name == "unrolled")
    heights = {
        mark.text: float(panel.view.px(mark.xy)[0, 1]) + mark.dy for mark in panel.marks if isinstance(mark, Label)
    }
    assert heights["−180"] - heights["low"] > 16.0


@pytest.mark.parametrize("name", RUNGS)
def test_the_legend_says_which_rungs_link_the_clouds(name: str) -> None:
    pairs = [mark for mark in marks.links(of(name), Pose.from_angle(0.3)) if getattr(mark, "role", None) == "pair"]
    assert bool(pairs) == (name in marks.LINKED)


@pytest.mark.parametrize("name", ["pairs", "default", "means"])
@pytest.mark.parametrize("detail", [0, figure.DETAILS - 1])
def test_the_unrolled_ring_is_the_objective_over_the_heading(name: str, detail: int) -> None:
    """From its lowest to its highest value; the ball lies on it at its heading; after the run a ring stays there."""
    before = state_after(figure.WIDGET, name=name, turn=100.0)
    after = state_after(figure.WIDGET, Action("press", "roll"), name=name, turn=100.0)
    for state in (before, after):
        panel = figure.draw(state, detail).panels[1]
        (line,) = (np.asarray(m.xy) for m in panel.marks if isinstance(m, Path) and m.role == "accent")
        ring = state.dial.ring if detail else state.dial.coarse
        turns = np.degrees(headings()) if detail else np.degrees(headings())[::COARSE]
        np.testing.assert_allclose(line[:-1], np.stack([turns, (ring - ring.min()) / np.ptp(ring)], axis=1))
        np.testing.assert_allclose(line[-1], [180.0, line[0, 1]])
        dots = {(m.role, m.shape): np.reshape(m.xy, 2) for m in panel.marks if isinstance(m, Points)}
        end = 100.0 if state is before else float(np.degrees(state.course.headings[-1]))
        expected = {("source", "dot"): end} | ({("ghost", "ring"): 100.0} if state is after else {})
        assert dots.keys() == expected.keys()
        for kind, turn in expected.items():
            np.testing.assert_allclose(dots[kind], [turn, np.interp(turn, *line.T)], atol=1e-9)


def test_an_error_to_the_right_is_as_large_as_to_the_left() -> None:
    assert texts("default", turn=-40.0)["rotation_start"] == texts("default", turn=40.0)["rotation_start"] == "40.0"


def test_the_motion_turns_the_scan_from_its_start_to_the_end_once() -> None:
    """About the robot, then by the end's shift; a second press and a drag are not animated."""
    before = state_after(figure.WIDGET, turn=60.0)
    after = figure.act(before, Action("press", "roll"))
    moved = figure.motion(before, after)
    assert moved is not None
    turned = Pose.from_angle(moved.turn, moved.shift).apply(before.pose.apply(before.dial.clouds.source))
    np.testing.assert_allclose(turned, after.pose.apply(before.dial.clouds.source), atol=1e-9)
    assert moved.about == (0.0, 0.0)
    assert figure.motion(after, after) is None
    dragged = figure.act(after, Action("drag", "turn", 0.0, 8.0))
    assert figure.motion(after, dragged) is None
    assert figure.motion(before, figure.act(before, Action("press", "every"))) is None
