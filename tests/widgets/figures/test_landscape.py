"""The figure of the landscape: terrain and descents of the solvers' own objectives."""

from __future__ import annotations

from functools import partial

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.widgets.states import state_after
from widgets.drawing.picture import Group, Heat, Label, Path, Points, Segments
from widgets.engine.contract import Action, preset
from widgets.engine.host import Host
from widgets.figures.landscape.figure import BANDS, FEW, MOST, NEAR, REACH, SIDE, WIDGET, State, act, draw

SOW, CLEAR, RESAMPLE = (Action("press", name) for name in ("sow", "clear", "resample"))
OBJECTIVES = pytest.mark.parametrize("objective", ["mmd", "capped"])


run = partial(state_after, WIDGET)


def click(x: float, y: float) -> Action:
    return Action("click", "map", x, y)


def texts(state: State, detail: int = BANDS) -> dict[str, str]:
    return {r.name: r.value for r in draw(state, detail).readouts}


@pytest.mark.parametrize("length", [0.2, 0.5, 1.5, 3.0])
@OBJECTIVES
def test_the_colours_span_the_map(objective: str, length: float) -> None:
    """At every length, the highest value on the coarse map lies above a third of the scale and not above its end; no
    two numbers beside the scale are equal."""
    state = run(objective=objective, length=length)
    terrain = state.terrain
    assert terrain.top / 3 < terrain.field.values(0).max() <= terrain.top
    labels = [mark for mark in draw(state, 0).panels[0].marks if isinstance(mark, Label) and mark.dx == 7]
    words = [label.text for label in labels]
    assert len(set(words)) == len(words) >= 2


@pytest.mark.parametrize(("length", "words"), [(2.4, "which end in 1 place,"), (1.0, " places,")])
def test_ends_are_counted_in_words(length: float, words: str) -> None:
    assert words in draw(run(SOW, objective="mmd", length=length), BANDS).description


def test_descents_that_have_begun_are_on_their_way() -> None:
    """The coarsest picture, which comes first, does not know where they end."""
    captions = [draw(run(*log), 0).panels[1].caption for log in ((), (SOW,))]
    assert captions == ["No descent yet: the source at the truth", "On their way: the source at the truth"]


@OBJECTIVES
def test_descents_descend_on_the_terrain_that_is_drawn(objective: str) -> None:
    """The objective along every run is the field's value at its places, and never rises."""
    state = run(SOW, objective=objective)
    (descent,) = state.runs
    assert len(descent.starts) == SIDE**2
    assert (np.diff(descent.path.objective, axis=0) <= 1e-12).all()
    for i in (0, 24, 48):
        way = descent.way(i)
        np.testing.assert_allclose(way[0], descent.starts[i])
        np.testing.assert_allclose(way[-1], descent.ends[i])
        np.testing.assert_allclose(state.terrain.chosen.values(way), descent.path.objective[: len(way), i], atol=1e-12)


@OBJECTIVES
def test_deep_is_low_on_the_map_and_on_its_scale(objective: str) -> None:
    """The lowest tile has the strongest colour, and the strongest end of the scale is at its lowest number."""
    picture = draw(run(objective=objective))
    field, bar = (mark for mark in picture.panels[0].marks if isinstance(mark, Heat))
    values = run(objective=objective).terrain.field.values(BANDS)
    assert np.argmax(np.asarray(field.values)) == np.argmin(values)
    scale = np.asarray(bar.values)[:, 0]
    assert (np.diff(scale) < 0.0).all()  # row 0 is at the lower end, where the number is 0


def test_counts_are_of_what_is_drawn() -> None:
    """Rings mark the starts that reach the truth, crosses the others."""
    state = run(SOW)
    reached, of = texts(state)["reached"].split(" of ")
    ends = state.runs[0].ends
    assert (int(reached), int(of)) == ((np.hypot(*ends.T) < NEAR).sum(), SIDE**2)
    svg = Host().render("f", {**preset(WIDGET).plain(), "log": [["press", "sow"]]})["panels"][0]["svg"]
    (rings,) = (d for d in svg.split("<path") if "shape ring truth" in d)
    (crosses,) = (d for d in svg.split("<path") if "shape cross source" in d)
    assert (rings.count("M"), crosses.count("M")) == (int(reached), SIDE**2 - int(reached))


def test_the_source_beside_the_map_is_seen_whole() -> None:
    """At any shift on the map. The panel's caption differs before and after a descent."""
    state = run()
    (room,) = (panel for panel in draw(state).panels if panel.name == "room")
    assert room.caption.startswith("No descent yet")
    reach = np.abs(state.terrain.turned).max(axis=0) + REACH
    assert (reach < [room.view.x1, room.view.y1]).all()
    (room,) = (panel for panel in draw(act(state, SOW)).panels if panel.name == "room")
    assert room.caption == "Where the last descent ended"


def test_starts_stay_until_cleared_and_frequencies_until_redrawn() -> None:
    """Clicked starts accumulate; *Clear* removes only them; *Resample* changes the terrain and keeps the starts."""
    state = run(click(1.0, 1.0), SOW, click(-1.0, 0.5))
    assert state.count == SIDE**2 + 2
    assert act(state, CLEAR).count == 0
    assert act(state, CLEAR).terrain is state.terrain
    anew = act(state, RESAMPLE)
    assert anew.count == state.count
    assert np.abs(anew.terrain.mmd.frequencies - state.terrain.mmd.frequencies).max() > 0.1
    assert texts(anew)["truth"] != texts(state)["truth"]
    assert act(anew, CLEAR).terrain is anew.terrain
    assert draw(run()).disabled == {"clear"}


def test_more_frequencies_extend_the_draw() -> None:
    """The first of many frequencies are the few."""
    few, many = run(count=8.0).terrain.mmd.frequencies, run(count=64.0).terrain.mmd.frequencies
    np.testing.assert_array_equal(many[:8], few)


@OBJECTIVES
@pytest.mark.parametrize(
    ("name", "value"),
    [("length", 1.6), ("count", 8.0), ("cap", 0.4), ("setting", "striped"), ("noise", 0.2), ("outliers", 30.0)],
)
def test_every_control_changes_the_figure(objective: str, name: str, value: float | str) -> None:
    """A control that does not affect the chosen objective moves the other one's line in the cut."""
    before, after = (
        Host().render("f", preset(WIDGET, "default", {"objective": objective, **change}).plain())
        for change in ({}, {name: value})
    )
    assert before["panels"][2]["svg"] != after["panels"][2]["svg"]
    own = {"mmd": ("length", "count"), "capped": ("cap",)}[objective]
    if name in (*own, "setting", "noise", "outliers"):
        assert before["panels"][0]["svg"] != after["panels"][0]["svg"]


@OBJECTIVES
def test_the_coarse_answer_waits_for_nothing(objective: str) -> None:
    """With many starts, the coarse map shows them without their runs; a few run at once."""
    many = run(SOW, objective=objective)
    assert texts(many, 0)["reached"] == "…"
    assert "path" not in many.runs[0].__dict__
    assert texts(many, 1)["reached"].endswith(f" of {SIDE**2}")
    few = run(*[click(0.3 * k, 0.2) for k in range(FEW)], objective=objective)
    assert texts(few, 0)["reached"].endswith(f" of {FEW}")
    assert texts(few, 0)["minima"] == "…"


def test_there_is_an_end_to_sowing() -> None:
    """No more starts than can be drawn: the button is disabled, and a click beyond the last changes nothing."""
    state = run(*[click(0.01 * k, 0.02) for k in range(MOST + 5)])
    assert state.count == MOST
    assert "sow" in draw(state, 0).disabled
    assert act(state, SOW) is state


@OBJECTIVES
def test_no_start_is_counted_twice(objective: str) -> None:
    """Launched again, the lattice adds nothing, nor does a click on one of its places; after Clear it does."""
    state = run(SOW, objective=objective)
    assert act(state, SOW) is state
    assert act(state, click(0.0, 0.0)) is state
    assert "sow" in draw(state, 0).disabled
    assert run(click(0.0, 0.0), click(0.1, 0.2), SOW, objective=objective).count == SIDE**2 + 1
    assert run(SOW, CLEAR, SOW, objective=objective).count == SIDE**2


@OBJECTIVES
@settings(deadline=None, max_examples=15)
@given(st.lists(st.tuples(st.floats(-99, 99), st.floats(-99, 99)), min_size=1, max_size=4), st.floats(0.2, 3.0))
def test_nothing_a_reader_picks_breaks_it(objective: str, picks: list[tuple[float, float]], scale: float) -> None:
    """A place outside the window is moved to its border; no number is NaN."""
    plain = preset(WIDGET, "default", {"objective": objective, "length": scale, "cap": scale}).plain()
    frame = Host().render("f", {**plain, "log": [["click", "map", x, y] for x, y in picks]}, 0)
    assert "nan" not in "".join(p["svg"] for p in frame["panels"]) + frame["description"]
    state = run(*[click(x, y) for x, y in picks], objective=objective)
    assert (np.abs(np.concatenate([r.starts for r in state.runs])) <= REACH).all()


@OBJECTIVES
def test_contour_lines_lie_at_eighths_of_the_colour_scale(objective: str) -> None:
    """Every end of a piece is between two neighbouring tiles' centres, where their values enclose one of the levels."""
    terrain = run(objective=objective).terrain
    values, x, y = terrain.field.values(BANDS), terrain.field.x, terrain.field.y
    levels = terrain.top * np.arange(1, 8) / 8
    lines = terrain.lines
    places = np.concatenate([np.asarray(lines.a), np.asarray(lines.b)])
    j = np.clip(np.searchsorted(x, places[:, 0]) - 1, 0, len(x) - 2)
    i = np.clip(np.searchsorted(y, places[:, 1]) - 1, 0, len(y) - 2)
    u, v = (places[:, 0] - x[j]) / (x[1] - x[0]), (places[:, 1] - y[i]) / (y[1] - y[0])
    corners = values[i, j], values[i, j + 1], values[i + 1, j], values[i + 1, j + 1]
    at = (1 - v) * ((1 - u) * corners[0] + u * corners[1]) + v * ((1 - u) * corners[2] + u * corners[3])
    off = np.abs(at[:, None] - levels)
    assert off.min(axis=1).max() < 1e-6 * terrain.top
    crossed = {k for k in range(7) if values.min() < levels[k] < values.max()}
    assert set(off.argmin(axis=1)) == crossed


@OBJECTIVES
def test_the_panels_beside_the_map_are_of_the_last_end(objective: str) -> None:
    """The source lies there; both objectives are cut along x through it, each over its own largest value there."""
    state = run(click(1.0, 1.0), click(0.4, -0.3), objective=objective)
    end = state.runs[-1].ends[-1]
    picture = draw(state)
    (source,) = (m for m in picture.panels[1].marks if isinstance(m, Points) and m.role == "source")
    np.testing.assert_allclose(source.xy, state.terrain.turned + end)
    lines = {m.role: m for m in picture.panels[2].marks if isinstance(m, Path) and m.thick}
    x = np.linspace(-REACH, REACH, 121)
    along = np.stack([x, np.full(121, end[1])], axis=1)
    for role, of in (("accent", state.terrain.mmd), ("ink", state.terrain.capped)):
        values = of.values(along)
        np.testing.assert_allclose(lines[role].xy, np.stack([x, values / values.max()], axis=1))
        assert lines[role].dashed == (role == "ink")
    (now,) = (m for m in picture.panels[2].marks if isinstance(m, Segments) and m.dashed)
    assert np.ravel(now.a)[0] == end[0]
    chosen = state.terrain.chosen.values(end)
    assert float(texts(state)["value"]) == pytest.approx(float(chosen), abs=6e-5)
    assert float(texts(state)["away"]) == pytest.approx(float(np.hypot(*end)), abs=6e-4)
    assert len(texts(state)["value"].partition(".")[2]) == 4


@OBJECTIVES
def test_minima_and_places_are_counted_as_defined(objective: str) -> None:
    """Tiles lower than all eight around them, and ends at least 0.1 u apart; a click is a ring or a cross."""
    state = run(SOW, click(0.1, 0.1), objective=objective)
    values, text = state.terrain.field.values(BANDS), texts(state)
    lower = sum(
        values[i, j] < np.delete(values[i - 1 : i + 2, j - 1 : j + 2].ravel(), 4).min()
        for i in range(1, len(values) - 1)
        for j in range(1, len(values) - 1)
    )
    assert text["minima"] == str(lower)
    kept: list[np.ndarray] = []
    for end in np.concatenate([each.ends for each in state.runs]):
        kept += [end] if all(np.hypot(*(end - other)) >= 0.1 for other in kept) else []
    assert text["places"] == str(len(kept))
    row, column = np.unravel_index(np.argmin(values), values.shape)
    deepest = np.hypot(state.terrain.field.x[column], state.terrain.field.y[row])
    assert float(text["lowest"]) == pytest.approx(float(deepest), abs=6e-3)
    (last,) = (mark for mark in draw(state).panels[0].marks if isinstance(mark, Group))
    ends = [np.reshape(m.xy, (-1, 2)) for m in last.marks if isinstance(m, Points) and m.shape == "dot"]
    np.testing.assert_allclose(ends[-1], state.runs[-1].ends[-1:])
