"""The score map: how each control changes it, where climbs lead, and what each level of detail shows."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from solvers.methods.ndt.score import score_map
from widgets.drawing.picture import Points, Ring, Segments
from widgets.engine.contract import Action, preset
from widgets.engine.host import Host
from widgets.figures.ndt_score import BANDS, REACH, START, WIDGET, draw

CLIMB, TRUTH = ["press", "climb"], ["press", "truth"]
RANGES = {"rotation": (-45.0, 45.0), "noise": (0.0, 0.2), "strays": (0.0, 60.0), "size": (0.4, 2.0)}


def outcome(*log: Any, seed: int = 40, **controls: Any) -> tuple[dict[str, Any], dict[str, Any]]:
    """The readouts by name, as numbers where they are, and the frame."""
    plain = {**preset(WIDGET, "default", controls).plain(), "log": list(log), "seed": seed}
    frame = Host().render("f", plain)
    values = {r["name"]: r["value"].replace("−", "-") for r in frame["readouts"]}
    return {k: v if "·" in v else float(v) for k, v in values.items()}, frame


def test_it_opens_before_its_climb() -> None:
    """Nothing has been climbed and the scan lies where the climb will begin; after a climb, the button is disabled."""
    text, frame = outcome()
    assert text["steps"] == "0 · 0"
    assert text["score"] == text["begin"]
    assert "climb" not in frame["disabled"]
    assert "where the climb will begin" in frame["panels"][1]["caption"]
    assert "will begin" not in outcome(CLIMB)[1]["panels"][1]["caption"]
    assert outcome(CLIMB)[1]["disabled"] == ["climb"]


def test_its_first_climb_arrives() -> None:
    """The first climb takes steps, has one rejected, and ends beside the truth with a higher score than there."""
    text, frame = outcome(CLIMB)
    steps, rejections = (int(v) for v in text["steps"].split(" · "))
    assert steps > 3
    assert rejections > 0
    assert text["away"] < 0.05
    assert text["score"] > text["truth"] > 5 * text["begin"]
    svg = frame["panels"][0]["svg"]
    assert 'class="shape cross outlier"' in svg
    assert "outlier dashed" in svg


def test_a_climb_starts_where_the_reader_picks_and_never_goes_down() -> None:
    """From nine places, the score never ends below the start's; a climb from the truth begins at its score."""
    for x in (-1.2, 0.1, 0.9):
        for y in (-0.9, 0.2, 1.1):
            text, _ = outcome(["click", "map", x, y])
            assert text["score"] >= text["begin"]
    text, _ = outcome(TRUTH)
    assert text["begin"] == text["truth"]


@pytest.mark.parametrize(("x", "y"), [(1.5, 1.5), (-1.5, -1.5), (-1.5, 1.5), (1.5, -1.5)])
def test_a_climb_that_leaves_the_map_is_cut_at_its_border(x: float, y: float) -> None:
    """The colour scale is to the right of the map; if the climb ended off the map, the note says so."""
    state = WIDGET.act(WIDGET.start(preset(WIDGET).controls, 40), Action("click", "map", x, y))
    picture = draw(state)
    marks = [mark for mark in picture.panels[0].marks if getattr(mark, "role", "") in ("source", "outlier")]
    parts = [getattr(mark, name) for mark in marks for name in ("xy", "a", "b") if hasattr(mark, name)]
    places = [np.reshape(part, (-1, 2)) for part in parts]
    assert np.abs(np.concatenate(places)).max() <= REACH + 1e-9
    is_off = bool(np.abs(state.path.places[-1]).max() > REACH)
    assert ("off the map" in picture.note) == is_off


def test_some_climb_leaves_the_map() -> None:
    _, frame = outcome(["click", "map", 1.5, 1.5])
    assert "off the map" in frame["note"]


def test_a_rotation_lowers_the_whole_map() -> None:
    """At 15°, climbs leave the rotation readout at 15, the truth's score is unchanged and out of reach, and the map's
    summit has moved."""
    level, at_15 = outcome(CLIMB)[0], outcome(CLIMB, rotation=15.0)[0]
    assert at_15["turn"] == 15
    assert at_15["truth"] == level["truth"]
    assert at_15["score"] < 0.5 * at_15["truth"]
    assert at_15["best"] > 0.3
    assert outcome(TRUTH, rotation=15.0)[0]["turn"] == 15


def test_the_map_says_at_which_rotation_it_is() -> None:
    for rotation in (0.0, -15.0, 30.0):
        plain = preset(WIDGET, "default", {"rotation": rotation, "noise": 0.05}).plain()
        caption = Host().render("f", plain, 0)["panels"][0]["caption"]
        assert caption == f"Score at {rotation:.0f}°".replace("-", "−")


def test_the_scale_ends_at_a_round_number_above_the_map() -> None:
    """The bar's own numbers end at 0.4 at the true rotation and at 0.2 or less at 15°."""

    def top(frame: dict[str, Any]) -> float:
        bar = frame["panels"][0]["svg"].split("shift in y, u</text>")[1].split("score</text>")[0]
        return max(float(label) for label in re.findall(r">([\d.]+)</text>", bar))

    assert top(outcome()[1]) == pytest.approx(0.4)
    assert top(outcome(rotation=15.0)[1]) <= 0.2


def test_coarse_levels_have_fewer_tiles() -> None:
    """The coarsest picture is the lightest; all levels have equal readouts, except the highest tile's place."""
    plain, host = preset(WIDGET).plain(), Host()
    frames = [host.render("f", plain, level) for level in range(WIDGET.details)]
    sizes = [len(frame["panels"][0]["svg"]) for frame in frames]
    assert sizes[0] == min(sizes)
    for frame in frames:
        rest = [r for r in frame["readouts"] if r["name"] != "best"]
        assert rest == [r for r in frames[-1]["readouts"] if r["name"] != "best"]


@settings(max_examples=20, deadline=None)
@given(
    st.fixed_dictionaries({name: st.floats(*span) for name, span in RANGES.items()}),
    st.sampled_from(["one", "four"]),
    st.lists(
        st.one_of(
            st.just(TRUTH),
            st.just(CLIMB),
            st.tuples(st.just("click"), st.just("map"), st.floats(-9e5, 9e5), st.floats(-9e5, 9e5)).map(list),
        ),
        max_size=3,
    ),
    st.integers(0, 2**31 - 1),
)
def test_whatever_a_reader_does_scores_stay_scores(
    controls: dict[str, float], grids: str, log: list[Any], seed: int
) -> None:
    """For any setting, start and draw: scores between 0 and 1, never below the start's, and a picture without NaN."""
    text, frame = outcome(*log, seed=seed, grids=grids, **controls)
    assert 0 <= text["begin"] <= text["score"] <= 1
    assert 0 <= text["truth"] <= 1
    assert "nan" not in frame["panels"][0]["svg"]


@pytest.mark.parametrize("rotation", [0.0, 15.0])
def test_the_map_shows_each_step_and_each_rejected_try(rotation: float) -> None:
    """Dots on a line through the accepted places; a dashed line to a cross from the last accepted place before it."""
    state = WIDGET.act(WIDGET.start(preset(WIDGET, "default", {"rotation": rotation}).controls, 40), Action(*CLIMB))
    path, marks = state.path, draw(state).panels[0].marks
    place, tries, steps = path.tried[0], [], []
    for to, accepted in zip(path.tried[1:], path.accepted[1:], strict=True):
        if accepted:
            place = to
            steps.append(to)
        else:
            tries.append((place, to))
    assert steps
    assert tries
    (dashed,) = (mark for mark in marks if isinstance(mark, Segments) and mark.role == "outlier")
    np.testing.assert_allclose(dashed.a, [a for a, _ in tries])
    np.testing.assert_allclose(dashed.b, [b for _, b in tries])
    (crosses,) = (mark for mark in marks if isinstance(mark, Points) and mark.shape == "cross")
    np.testing.assert_allclose(crosses.xy, [b for _, b in tries])
    dots, end = (np.reshape(mark.xy, (-1, 2)) for mark in marks if isinstance(mark, Points) and mark.role == "source")
    np.testing.assert_allclose(dots, steps)
    np.testing.assert_allclose(end, steps[-1:])
    begin = [np.reshape(mark.xy, 2) for mark in marks if isinstance(mark, Ring) and mark.role == "source"]
    np.testing.assert_allclose(begin, [START])
    (truth,) = (mark for mark in marks if isinstance(mark, Ring) and mark.role == "truth")
    np.testing.assert_array_equal(np.reshape(truth.xy, 2), 0.0)


@pytest.mark.parametrize("grids", ["one", "four"])
def test_a_score_is_the_mean_over_points_and_grids(grids: str) -> None:
    """The map's highest tile, the start's score and the truth's, against a sum over the points of each grid."""
    state = WIDGET.start(preset(WIDGET, "default", {"grids": grids, "rotation": 4.0}).controls, 40)
    count = 4 if grids == "four" else 1

    def mean(points: np.ndarray) -> float:
        total = sum(float(score_map(state.cells, point[None], np.zeros(1), np.zeros(1))[0, 0]) for point in points)
        return total / (len(points) * count)

    text = {r.name: r.value for r in draw(state).readouts}
    assert float(text["begin"]) == pytest.approx(mean(state.scan + START), abs=6e-4)
    assert float(text["truth"]) == pytest.approx(mean(state.scene.source), abs=6e-4)
    best, value = state.field.highest(BANDS)
    assert value == pytest.approx(mean(state.scan + best))
    assert float(text["best"]) == pytest.approx(np.hypot(*best), abs=6e-3)
    assert f"from {grids} grid{'s' * (count > 1)} of cells" in draw(state).description


def test_the_scan_is_drawn_where_the_climb_began_and_where_it_ended() -> None:
    state = WIDGET.act(WIDGET.start(preset(WIDGET).controls, 40), Action(*TRUTH))
    clouds = {mark.role: mark.xy for mark in draw(state).panels[1].marks if isinstance(mark, Points)}
    np.testing.assert_allclose(clouds["ghost"], state.scan + state.path.places[0])
    np.testing.assert_allclose(clouds["source"], state.scan + state.path.places[-1])
