"""The figure of redrawn scans: its draws are the study's, its ellipses surround the truth, its scale is stated."""

from __future__ import annotations

import re

import numpy as np
import pytest

from solvers.studies.coverage import coverage, regions, runs
from solvers.studies.redrawn import STANDS, walls_of
from tests.widgets.states import frame_after, readouts
from widgets.drawing.picture import Ellipses, Label, Path, Points, Segments
from widgets.engine.contract import SEED, Action, preset
from widgets.engine.controls import specs
from widgets.engine.host import Host
from widgets.figures.spread.figure import WIDGET, Controls, act, draw, start
from widgets.figures.spread.panels import CLOSE, NEEDLE, SEEN
from widgets.figures.spread.runs import DRAWS, PRESS, closed_forms, ends

MORE, ALL = Action("press", "more"), Action("press", "finish")


def texts(name: str = "default", *presses: str, **controls: float | str) -> dict[str, str]:
    log = [["press", press] for press in presses]
    return readouts(frame_after(WIDGET, *log, name=name, **controls))


def test_before_the_first_draw_there_is_only_what_is_expected() -> None:
    result = texts()
    assert result["hessian"] == result["censi"] == result["widest"] == "–"
    assert float(result["claimed"]) > 0.0
    assert result["drawn"] == "0"


def test_some_draws_and_then_the_rest_are_all_draws_at_once() -> None:
    state = start(Controls(), SEED)
    for _ in range(DRAWS // PRESS):
        state = act(state, MORE)
    assert state.drawn == DRAWS
    assert draw(state).readouts == draw(act(start(Controls(), SEED), ALL)).readouts
    assert act(state, MORE).drawn == DRAWS
    assert {"more", "finish"} <= draw(state).disabled


def test_the_counts_are_the_studys() -> None:
    lines = coverage("room", "point-to-plane", ("hessian", "censi"), count=DRAWS)
    result = texts("default", "finish")
    assert [result["hessian"], result["censi"]] == [str(line.covered) for line in lines]


def test_the_hall_has_clusters_and_the_room_has_one() -> None:
    assert texts("default", "finish")["modes"] == "1"
    assert texts("hall", "finish")["modes"] == "2", "a single stray end is no cluster of its own"
    assert texts("hall", "finish", heading=3.0)["modes"] == "1"
    frame = frame_after(WIDGET, ["press", "finish"], name="hall")
    one, two = map(int, re.search(r"; clusters: (\d+) ends \(σ [^)]* u\) \+ (\d+)\.$", frame["note"]).groups())
    assert f"In the largest: {one}, in none: {DRAWS - one - two}." in frame["description"]


def test_a_size_without_bound_is_told_as_such() -> None:
    """A run that found a direction free states no σ: what is drawn, 5 u, is the least that it may be."""
    for seed, unit in ((40, "u"), (53, "u or more")):
        frame = frame_after(WIDGET, seed=seed, name="corridor", heading=90.0)
        claimed = next(each for each in frame["readouts"] if each["name"] == "claimed")
        assert claimed["unit"] == unit
        assert f"a largest σ of the position of {claimed['value']} {unit}, Censi" in frame["description"]


@pytest.mark.parametrize("heading", [3.0, 90.0])
def test_regions_without_a_bound_are_told(heading: float) -> None:
    """They contain almost everything: a run in a corridor that ends across it leaves the slide along it free."""
    made = runs("corridor", "point-to-plane", DRAWS, seed=40, heading=heading, shift=0.15, noise=0.04)
    free = np.any([regions(made, form).free.any(axis=-1) for form in ("hessian", "censi")], axis=0)
    frame = frame_after(WIDGET, ["press", "finish"], name="corridor", heading=heading)
    assert f"Draws with an unbounded region: {free.sum()}." in frame["description"]
    assert (f", {free.sum()} with unbounded regions" in frame["note"]) == (heading > 3.0) == free.any()


def test_ends_outside_all_clusters_are_counted() -> None:
    frame = frame_after(WIDGET, ["press", "finish"], seed=53, name="corridor", heading=90.0)
    found = re.search(r"over 5 % of ends: 2\. In the largest: (\d+), in none: (\d+)\.", frame["description"])
    assert found
    largest, outside = map(int, found.groups())
    assert DRAWS - 2 * largest <= outside < DRAWS - largest


@pytest.mark.parametrize(("wall", "is_told"), [(4.5, False), (6.0, True)])
def test_a_cluster_that_is_not_all_ends_says_how_many_it_holds(wall: float, is_told: bool) -> None:
    """Far end walls scatter the ends: the widths are those of a part of them."""
    frame = frame_after(WIDGET, ["press", "finish"], name="hall", wall=wall, heading=3.0)
    held = re.search(r"; clusters: (\d+) ends ", frame["note"])
    assert bool(held) == is_told
    assert held is None or int(held[1]) < 0.95 * DRAWS


@pytest.mark.parametrize("name", ["default", "corridor", "hall"])
def test_the_end_wall_is_pulled_by_a_handle_that_sets_the_slider(name: str) -> None:
    """The handle is on the right end wall, whatever was drawn. An arrow key moves the slider by one step, never beyond
    its ends, and all draws are kept."""
    slider, host = specs(Controls)["wall"], Host()
    low, high = slider.low, slider.high
    for wall in (low, 3.0, high):
        plain = {**preset(WIDGET, name, {"wall": wall}).plain(), "log": [["press", "more"]]}
        frame = host.render("f", plain)
        (handle,) = frame["handles"]
        assert (handle["sets"], handle["world"]) == ("wall", [wall, 0.0])
        assert handle["slider"] == [low, high, wall]
        (walls,) = walls_of(frame["controls"]["scene"], wall)
        assert walls[:, 0].max() == wall
        keys = {key: point[0] for key, point in handle["keys"].items()}
        assert keys["ArrowRight"] == keys["ArrowUp"] == pytest.approx(min(wall + slider.step, high))
        assert keys["ArrowLeft"] == keys["ArrowDown"] == pytest.approx(max(wall - slider.step, low))
        picture = host.render("f", {**plain, "controls": {**plain["controls"], "wall": keys["ArrowRight"]}})
        assert picture["handles"][0]["world"] == [keys["ArrowRight"], 0.0]
        assert {r["name"]: r["value"] for r in picture["readouts"]}["drawn"] == str(PRESS)


def test_what_is_expected_lies_about_the_true_position() -> None:
    ask = start(Controls(), SEED).ask
    for region in closed_forms(ask):
        middle = STANDS["room"][1].apply(region.ellipse(reach=1.0)[:-1]).mean(axis=0)
        np.testing.assert_allclose(middle, STANDS["room"][0].t, atol=1e-4)


@pytest.mark.parametrize("wall", [2.6, 6.0])
def test_the_close_view_is_to_the_scale_that_its_bar_tells(wall: float) -> None:
    """The bars lie along the panel's axes and are as long as their labels say; every dot of the true cluster is in the
    window, and the ellipses take most of its height where both scales are equal."""
    state = act(start(Controls(wall=wall), SEED), ALL)
    picture = draw(state)
    (close,) = (panel for panel in picture.panels if panel.name == "close")
    labels = {mark.text for mark in close.marks if isinstance(mark, Label)}
    assert labels == ({"0.5 u", "0.05 u"} if wall > SEEN else {"0.02 u"})
    bars = next(mark for mark in close.marks if isinstance(mark, Segments))
    across, up = np.abs(np.asarray(bars.b) - np.asarray(bars.a)).max(axis=1)
    assert across == pytest.approx(0.5 / NEEDLE[0] if wall > SEEN else 0.02 / 0.06)
    assert up == pytest.approx(0.05 / NEEDLE[1] if wall > SEEN else 0.02 / 0.06)
    dots = next(mark for mark in close.marks if isinstance(mark, Points) and mark.role == "source")
    assert (np.abs(dots.xy) < [CLOSE.x1, CLOSE.y1]).all()
    spread, _ = ends(state.ask, DRAWS)
    assert len(np.asarray(dots.xy)) == (spread.mode == 0).sum()
    ellipses = [np.ptp(np.asarray(mark.xy), axis=0) for mark in close.marks if isinstance(mark, Path)]
    assert max(size[0] for size in ellipses) > 0.3
    assert wall > SEEN or max(size[1] for size in ellipses) > 0.7 * (CLOSE.y1 - CLOSE.y0)


@pytest.mark.parametrize(
    ("controls", "is_told"),
    [
        ({}, False),
        ({"wall": 6.0, "heading": 90.0, "noise": 0.1}, False),
        ({"wall": 6.0, "heading": 90.0, "noise": 0.1, "shift": 0.3}, True),
    ],
)
def test_regions_beyond_the_picture_are_told(controls: dict[str, float], is_told: bool) -> None:
    """If the closed forms' ellipses lie outside the panel, the caption says so; their σ is then in whole units."""
    picture = draw(start(Controls(**controls), SEED))  # type: ignore[arg-type]
    (panel,) = (panel for panel in picture.panels if panel.name == "close")
    paths = [mark for mark in panel.marks if isinstance(mark, Path)]
    ellipses = [np.asarray(path.xy) for path in paths if path.role in ("accent", "inlier")]
    assert len(ellipses) == 2
    assert all((np.abs(xy) > 1.0).any(axis=1).all() for xy in ellipses) == is_told
    assert panel.caption.endswith("the expected regions lie outside") == is_told
    for name in ("claimed", "carried"):
        value = readouts(picture)[name]
        assert value.isdigit() if is_told else len(value.split(".")[1]) == 3


def test_the_scale_about_the_true_position_is_told() -> None:
    """The same in both directions if the end wall is seen; smaller along the corridor if it is not."""
    for wall, text in ((2.6, "enlarged 107 times"), (6.0, "enlarged 46 times up and 3 across")):
        frame = draw(start(Controls(wall=wall), SEED))
        (caption,) = (panel.caption for panel in frame.panels if panel.name == "close")
        assert caption == f"About the truth, {text}"


@pytest.mark.parametrize("name", ["default", "hall"])
def test_every_end_is_drawn_from_above_with_its_heading(name: str) -> None:
    """In the colour of ends elsewhere if it is not of the true cluster; one dashed ellipse for all, where there are
    several clusters: their mean and 95 % of their spread in two dimensions."""
    state = act(start(preset(WIDGET, name).controls, SEED), MORE)
    spread, _ = ends(state.ask, PRESS)
    first, stand = STANDS[state.ask.place]
    places = stand.apply(spread.poses.t)
    true = np.linalg.norm(places - first.t, axis=1) < 0.5
    true &= (stand.compose(spread.poses).R[..., 0] @ first.R[:, 0]) > 0.5
    assert true.any()
    assert (~true).any() == (name == "hall")
    marks = draw(state).panels[0].marks
    for role, mask in (("source", true), ("outlier", ~true)):
        dots = [m for m in marks if isinstance(m, Points) and m.role == role]
        noses = [m for m in marks if isinstance(m, Segments) and m.role == role]
        assert len(dots) == len(noses) == mask.any()
        for dot, nose in zip(dots, noses, strict=True):
            np.testing.assert_allclose(dot.xy, places[mask], atol=1e-12)
            np.testing.assert_allclose(nose.a, places[mask], atol=1e-12)
            ahead = np.asarray(nose.b) - np.asarray(nose.a)
            ahead /= np.linalg.norm(ahead, axis=1, keepdims=True)
            np.testing.assert_allclose(ahead, stand.compose(spread.poses).R[mask][..., 0], atol=1e-9)
    ellipses = [m for m in marks if isinstance(m, Ellipses)]
    assert len(ellipses) == (name == "hall")
    for ellipse in ellipses:
        np.testing.assert_allclose(ellipse.centre, places.mean(axis=0))
        np.testing.assert_allclose(ellipse.covariance, np.cov(places.T))
        assert ellipse.sigmas**2 == pytest.approx(-2.0 * np.log(0.05))
    cross = [m for m in marks if isinstance(m, Points) and m.shape == "cross"]
    np.testing.assert_allclose(np.reshape(cross[-1].xy, 2), first.t)


def test_the_target_scan_lies_on_the_walls() -> None:
    """Seen from the second robot's place, within the noise; a beam without an echo is not drawn."""
    state = start(Controls(), SEED)
    marks = draw(state).panels[0].marks
    (scan,) = (np.asarray(m.xy) for m in marks if isinstance(m, Points) and m.shape == "square")
    walls = [np.asarray(m.xy) for m in marks if isinstance(m, Path) and m.role == "ink"]
    a = np.concatenate([wall[:-1] for wall in walls])
    b = np.concatenate([wall[1:] for wall in walls])
    along = np.clip(((scan[:, None] - a) * (b - a)).sum(axis=2) / ((b - a) ** 2).sum(axis=1), 0.0, 1.0)
    off = np.linalg.norm(scan[:, None] - a - along[..., None] * (b - a), axis=2).min(axis=1)
    assert off.max() < 5.0 * state.ask.noise
    assert len(scan) > 60
