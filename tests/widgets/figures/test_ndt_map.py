"""The grid of Gaussians: cells chosen by hover and by button, discarded cells with reasons, consistent numbers."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from solvers.methods.ndt.floor import FLOOR
from tests.widgets.states import readouts, state_after
from widgets.drawing.picture import Ellipses, Heat, Path, Points, Segments
from widgets.engine.contract import Action, preset
from widgets.engine.host import Host
from widgets.figures.ndt_map import ROOM, STUCK, WIDGET

NEXT = ["press", "next"]
RANGES = {"noise": (0.0, 0.2), "size": (0.3, 2.5), "nudge_x": (-0.75, 0.75), "nudge_y": (-0.75, 0.75)}


def outcome(*log: Any, host: Host | None = None, **controls: Any) -> tuple[dict[str, str], dict[str, Any]]:
    """The readouts by name, and the frame, from a fresh host unless one is given."""
    plain = {**preset(WIDGET, "default", controls).plain(), "log": list(log)}
    frame = (host or Host()).render("f", plain)
    return {r["name"]: r["value"] for r in frame["readouts"]}, frame


def test_it_opens_on_a_corner_that_one_gaussian_blurs() -> None:
    """The first cell holds both arms of a corner: its small eigenvalue exceeds ten times the noise variance."""
    text, _ = outcome()
    assert text["cell"] == "kept"
    assert float(text["low"]) > 10 * 0.03**2
    assert 30 < abs(float(text["angle"].replace("−", "-"))) < 60


def test_pointing_chooses_the_cell_that_is_there() -> None:
    """Two places in one cell give one picture, a place in another cell another; only the last hover counts."""
    _, first = outcome(["hover", "main", -4.6, 1.2])
    _, twin = outcome(["hover", "main", -4.9, 1.9])
    _, second = outcome(["hover", "main", 0.5, 1.4])
    _, last = outcome(["hover", "main", -4.6, 1.2], ["hover", "main", 0.5, 1.4])
    assert first["panels"] == twin["panels"]
    assert first["panels"] != second["panels"]
    assert last["panels"] == second["panels"]


@pytest.mark.parametrize("controls", [{}, {"size": 0.4}, {"size": 2.0}, {"noise": 0.0}, {"nudge_x": 0.35}])
def test_next_goes_through_every_cell_that_holds_a_point(controls: dict[str, float]) -> None:
    """As many presses as there are such cells lead back to the first; together they hold every point once."""
    first, _ = outcome(**controls)
    cells = int(first["kept"]) + int(first["discarded"])
    host = Host()
    messages = [outcome(*[NEXT] * k, host=host, **controls)[0] for k in range(cells + 1)]
    assert messages[cells] == messages[0]
    assert len({m["mean"] for m in messages[:cells]}) > 0.9 * cells
    total = int(first["covered"].split(" of ")[1])
    assert sum(int(m["count"]) for m in messages[:cells]) == total
    full = [m for m in messages[:cells] if m["cell"].startswith("kept")]
    assert len(full) == int(first["kept"])
    assert sum(int(m["count"]) for m in full) == int(first["covered"].split(" of ")[0])


def test_discarded_cells_say_why() -> None:
    """The stuck beam's cell has enough points but no spread; another has too few; an empty one has none."""
    text, frame = outcome(["hover", "main", -2.5, 0.4])
    assert text["cell"] == "discarded"
    assert text["count"] == str(STUCK)
    assert "all points at one place" in frame["note"]
    notes = [outcome(*[NEXT] * k)[1]["note"] for k in range(34)]
    assert any("fewer than 3 points" in note for note in notes)
    text, frame = outcome(["hover", "main", 0.5, -0.5])
    assert (text["cell"], text["count"], text["angle"]) == ("empty", "0", "–")
    assert "This cell is empty" in frame["note"]


def test_the_stuck_beam_adds_its_returns_and_nothing_that_is_kept() -> None:
    """Switched off, its five points and one discarded cell disappear; the kept cells stay."""
    on, off = outcome()[0], outcome(stuck=False)[0]
    assert on["kept"] == off["kept"]
    assert int(on["discarded"]) == int(off["discarded"]) + 1
    assert int(on["covered"].split(" of ")[1]) == int(off["covered"].split(" of ")[1]) + STUCK


def test_without_noise_walls_are_floored_and_say_so() -> None:
    """The cell after the corner holds one exact wall."""
    text, frame = outcome(NEXT, noise=0.0)
    assert text["cell"] == "kept, floored"
    assert "raised" in frame["note"]


def test_smaller_cells_keep_less_of_the_scan() -> None:
    """Points in kept cells: all but a few at 1 u, fewer at 0.4 u, far fewer at 0.3 u."""
    counts = [int(outcome(size=h)[0]["covered"].split(" of ")[0]) for h in (1.0, 0.4, 0.3)]
    assert counts[0] > counts[1] > 1.5 * counts[2]


@settings(max_examples=25, deadline=None)
@given(
    st.fixed_dictionaries({name: st.floats(*span) for name, span in RANGES.items()}),
    st.lists(
        st.one_of(
            st.just(NEXT),
            st.tuples(st.just("hover"), st.just("main"), st.floats(-9e5, 9e5), st.floats(-9e5, 9e5)).map(list),
        ),
        max_size=4,
    ),
    st.integers(0, 2**31 - 1),
)
def test_whatever_a_reader_does_the_numbers_add_up(controls: dict[str, float], log: list[Any], seed: int) -> None:
    """For any grid, cell and draw, counts of cells and points are consistent, and nothing drawn is NaN."""
    plain = {**preset(WIDGET, "default", controls).plain(), "log": log, "seed": seed}
    frame = Host().render("f", plain)
    readouts = {r["name"]: r["value"] for r in frame["readouts"]}
    inside, total = (int(v) for v in readouts["covered"].split(" of "))
    assert 0 <= inside <= total
    assert 0 <= int(readouts["count"]) <= total
    assert "nan" not in frame["panels"][0]["svg"] + frame["panels"][1]["svg"]
    assert np.isfinite(int(readouts["kept"]) + int(readouts["discarded"]))


def test_one_point_is_a_point() -> None:
    """A cell with a single point says so in the singular."""
    text = Host().render("cells", {"widget": "ndt-map", "controls": {"nudge_x": 0.5, "nudge_y": 0.5}})["description"]
    assert "holds 1 point and is discarded" in text


NUDGED = {"size": 0.9, "nudge_x": 0.35, "nudge_y": -0.25}
CORNER = (4.5, 2.5)


def cells_of(points: np.ndarray, h: float, nudge: np.ndarray) -> np.ndarray:
    return np.floor((points - nudge) / h)


@pytest.mark.parametrize("point", [CORNER, (-4.6, 1.2), (-2.5, 0.4), (0.5, -0.5)])
def test_the_rim_is_the_cell_that_is_pointed_at(point: tuple[float, float]) -> None:
    """A square of side h whose corners are the nudge plus whole cells."""
    state = state_after(WIDGET, Action("hover", "main", *point), **NUDGED)
    (rim,) = (m for m in WIDGET.draw(state).panels[0].marks if isinstance(m, Path) and m.role == "accent")
    xy, h, nudge = np.asarray(rim.xy), 0.9, np.array([0.35, -0.25])
    np.testing.assert_allclose(np.ptp(xy, axis=0), h)
    corner = xy.min(axis=0)
    assert (corner <= point).all()
    assert (point < corner + h).all()
    np.testing.assert_allclose((corner - nudge) / h, np.round((corner - nudge) / h), atol=1e-9)


def test_the_close_up_is_the_cell_in_units_of_its_side() -> None:
    """Its points, their Gaussian and, within the cell, the score that this Gaussian gives a single point."""
    state = state_after(WIDGET, Action("hover", "main", *CORNER), **NUDGED)
    h, nudge = 0.9, np.array([0.35, -0.25])
    number = cells_of(np.array(CORNER), h, nudge)
    corner = nudge + h * number
    own = state.points[(cells_of(state.points, h, nudge) == number).all(axis=1)]
    assert readouts(WIDGET.draw(state))["count"] == str(len(own))
    marks = state.close.marks
    mean, spread = (own.mean(axis=0) - corner) / h, np.cov(own.T, bias=True) / h**2
    ellipses = [mark for mark in marks if isinstance(mark, Ellipses)]
    assert [mark.sigmas for mark in ellipses] == [1.0, 2.0]
    for mark in ellipses:
        np.testing.assert_allclose(np.reshape(mark.centre, 2), mean, atol=1e-12)
        np.testing.assert_allclose(np.reshape(mark.covariance, (2, 2)), spread, atol=1e-12)
    dots = {mark.role: np.reshape(mark.xy, (-1, 2)) for mark in marks if isinstance(mark, Points)}
    np.testing.assert_allclose(dots["normal"][0], mean, atol=1e-12)
    np.testing.assert_allclose(dots["target"], (own - corner) / h, atol=1e-12)
    around = (state.points - corner) / h
    shown = (np.abs(around - 0.5) < 0.75).all(axis=1)
    assert len(dots["ghost"]) == shown.sum() - len(own) > 0
    heat = next(mark for mark in marks if isinstance(mark, Heat))
    assert heat.window == (-0.25, 1.25, -0.25, 1.25)
    values = np.asarray(heat.values)
    at = -0.25 + 1.5 * (np.arange(len(values)) + 0.5) / len(values)
    x, y = np.meshgrid(at, at)
    offset = np.stack([x, y], axis=-1) - mean
    score = np.exp(-0.5 * np.einsum("...i,ij,...j", offset, np.linalg.inv(spread), offset))
    inside = (x > 0.0) & (x < 1.0) & (y > 0.0) & (y < 1.0)
    np.testing.assert_allclose(values[inside], score[inside], atol=1e-9)


def test_the_long_axis_is_the_larger_eigenvector() -> None:
    """Its angle, and both eigenvalues, in every kept cell of a nudged grid."""
    state = state_after(WIDGET, **NUDGED)
    seen = 0
    for _ in range(25):
        state = WIDGET.act(state, Action("press", "next"))
        text = readouts(WIDGET.draw(state))
        if not text["cell"].startswith("kept"):
            continue
        own = state.points[(state.cell == state.chosen).all(axis=1)]
        values, vectors = np.linalg.eigh(np.cov(own.T, bias=True))
        turn = np.degrees(np.arctan2(vectors[1, 1], vectors[0, 1]))
        off = (float(text["angle"].replace("−", "-")) - turn + 90.0) % 180.0 - 90.0
        assert abs(off) <= 0.5 + 1e-6
        assert float(text["high"]) == pytest.approx(values[1], abs=0.01)
        assert (text["cell"] == "kept, floored") == (values[0] < FLOOR * values[1])
        seen += 1
    assert seen > 10


def test_every_cell_that_holds_a_point_is_marked_once() -> None:
    """A Gaussian in each kept cell; a dashed rim in each other, with a cross where points are too few, and a diamond
    where all lie at one place; the points of both kinds have their colours."""
    h, nudge = 0.9, np.array([0.35, -0.25])
    state = state_after(WIDGET, **NUDGED)
    panel = WIDGET.draw(state).panels[0]
    numbers, which, counts = np.unique(
        cells_of(state.points, h, nudge), axis=0, return_inverse=True, return_counts=True
    )
    spread = np.array([np.ptp(state.points[which.reshape(-1) == k], axis=0).max() for k in range(len(numbers))])
    kept = (counts >= 3) & (spread > 0.0)
    dots = {(m.role, m.shape): np.reshape(m.xy, (-1, 2)) for m in panel.marks if isinstance(m, Points)}

    def places(mask: np.ndarray) -> list[Any]:
        return sorted(map(tuple, np.round(nudge + h * (numbers[mask] + 0.5), 9)))

    assert sorted(map(tuple, np.round(dots["outlier", "cross"], 9))) == places(counts < 3)
    assert sorted(map(tuple, np.round(dots["outlier", "diamond"], 9))) == places((counts >= 3) & (spread == 0.0))
    rims = [np.mean(np.asarray(m.xy), axis=0) for m in panel.marks if isinstance(m, Path) and m.dashed]
    assert sorted(map(tuple, np.round(rims, 9))) == places(~kept)
    (ellipses,) = (m for m in panel.marks if isinstance(m, Ellipses))
    middles = nudge + h * (cells_of(np.asarray(ellipses.centre), h, nudge) + 0.5)
    assert sorted(map(tuple, np.round(middles, 9))) == places(kept)
    assert len(dots["target", "square"]) == counts[kept].sum()
    assert len(dots["outlier", "square"]) == counts[~kept].sum()
    lines = next(m for m in panel.marks if isinstance(m, Segments))
    a, b = np.asarray(lines.a), np.asarray(lines.b)
    across, up = a[a[:, 0] == b[:, 0]], a[a[:, 1] == b[:, 1]]
    for at, first, low, high in (
        (across[:, 0], nudge[0], ROOM.x0, ROOM.x1),
        (up[:, 1], nudge[1], ROOM.y0, ROOM.y1),
    ):
        k = np.arange(np.ceil((low - first) / h), np.floor((high - first) / h) + 1)
        np.testing.assert_allclose(np.sort(at), first + h * k)
