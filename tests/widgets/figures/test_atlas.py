"""The atlas figure: every tile is one of the package's own runs, and is classified by where that run ends."""

from __future__ import annotations

from functools import partial
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from solvers import Pose, register
from solvers.core.status import Status
from solvers.scenes.rooms import room, room_start
from tests.widgets.states import state_after
from widgets.drawing.picture import ROLES, Group, Path, Points, Ring, Segments, Tiles
from widgets.engine.contract import SEED, Action
from widgets.figures.atlas import basins
from widgets.figures.atlas.basins import COLUMNS, HALF, KINDS, LEVELS, NONE, OFFSETS, QUARTER, ROWS, SHIFTED, TURNS
from widgets.figures.atlas.figure import FINEST, FIRST, TRACED, WIDGET, State, act, draw, motion

STEP, FINISH = Action("press", "step"), Action("press", "finish")
METHODS = pytest.mark.parametrize("method", ["icp", "point-to-plane", "ndt"])
TRUTH = Pose.identity()


run = partial(state_after, WIDGET)


def pick(row: int, column: int, kind: Any = "click") -> Action:
    return Action(kind, "map", float(TURNS[column]), float(OFFSETS[row]))


def texts(state: State, level: int = 0) -> dict[str, str]:
    return {r.name: r.value for r in draw(state, level).readouts}


# The lattice


def test_levels_add_up_to_the_full_lattice() -> None:
    """Each level holds the one before and adds equally many starts; the last has all."""
    levels = [basins.run_at(level) for level in range(-1, LEVELS)]
    assert not levels[0].any()
    assert levels[-1].all()
    assert ROWS >= 48
    assert COLUMNS >= 64
    for before, after in pairwise(levels):
        assert (after | ~before).all()
        assert after.sum() - before.sum() == ROWS * COLUMNS // LEVELS


@pytest.mark.parametrize("level", range(LEVELS))
def test_what_a_level_shows_is_known_by_then(level: int) -> None:
    """A tile shows its own start's end or that of one at most two rows and columns away, and finally its own."""
    rows, columns = basins.seen(level)
    mask = basins.run_at(level)
    assert mask[rows, columns].all()
    np.testing.assert_array_equal(rows[mask], np.nonzero(mask)[0])
    np.testing.assert_array_equal(columns[mask], np.nonzero(mask)[1])
    assert np.abs(rows - np.arange(ROWS)[:, None]).max() <= 2
    assert np.abs(columns - np.arange(COLUMNS)).max() <= 2


@given(st.integers(0, ROWS - 1), st.integers(0, COLUMNS - 1))
def test_a_tile_is_found_at_its_own_start(row: int, column: int) -> None:
    assert basins.tile_at(float(TURNS[column]), float(OFFSETS[row])) == (row, column)


def test_a_place_beside_the_map_is_taken_for_the_nearest_tile() -> None:
    assert basins.tile_at(-1e6, -1e6) == (0, 0)
    assert basins.tile_at(1e6, 1e6) == (ROWS - 1, COLUMNS - 1)


# Ends


def test_the_coarse_map_is_the_full_maps_own() -> None:
    """Each tile of the coarse map shows the end that the full map has for the start that the tile stands for."""
    ask = basins.Ask("icp", 0.6, "clean", SEED, 0.02, 0.0)
    coarse, full = basins.Runs(ask).ends(0), basins.Runs(ask).ends(FINEST)
    rows, columns = basins.seen(0)
    np.testing.assert_array_equal(coarse.kind, full.kind[rows, columns])
    np.testing.assert_array_equal(coarse.pose.t, full.pose.t[rows, columns])


def test_how_fine_a_map_is_does_not_depend_on_what_another_has_drawn() -> None:
    ask = basins.Ask("icp", 0.6, "clean", SEED, 0.02, 0.0)
    first, second = basins.Atlas(ask), basins.Atlas(ask)
    second.ends(1)
    first.ends(0)
    assert (first.known, second.known) == (0, 1)


@METHODS
def test_a_tile_ends_as_a_single_run_from_its_start_does(method: str) -> None:
    """This also holds where a gate refuses every pair."""
    state = run(method=method, gate=0.3)
    ends, scene = state.atlas.ends(0), state.atlas.scene
    options = {} if method == "ndt" else {"gate": 0.3}
    rng = np.random.default_rng(1)
    for row, column in zip(
        rng.integers(0, ROWS // 4, 8) * 4 + 1, rng.integers(0, COLUMNS // 4, 8) * 4 + 1, strict=True
    ):
        begin = room_start(float(TURNS[column]), float(OFFSETS[row]))
        alone = register(scene.source[::2], scene.target, method, start=begin, **options)
        np.testing.assert_allclose(ends.pose.t[row, column], alone.pose.t, atol=1e-9)
        np.testing.assert_allclose(ends.pose.R[row, column], alone.pose.R, atol=1e-9)
        assert ends.kind[row, column] == basins.kinds(alone.pose, scene.truth, alone.status)
        assert state.atlas.track(row, column).kind == ends.kind[row, column]


@pytest.mark.parametrize(
    ("turn", "shift", "status", "kind"),
    [
        (0.0, 0.0, Status.CONVERGED, basins.TRUTH),
        (-4.9, 0.19, Status.STALLED, basins.TRUTH),
        (-4.9, 0.19, Status.CAPPED, basins.TRUTH),  # a correct end counts, however the run stopped
        (5.1, 0.0, Status.CONVERGED, SHIFTED),
        (0.0, 0.21, Status.CONVERGED, SHIFTED),
        (-16.0, 0.0, Status.CONVERGED, basins.TURNED),
        (74.0, 3.0, Status.STALLED, basins.TURNED),
        (-90.0, 0.0, Status.CONVERGED, QUARTER),
        (180.0, 0.0, Status.CONVERGED, HALF),
        (180.0, 0.0, Status.CAPPED, NONE),
        (16.0, 0.0, Status.DEGENERATE, NONE),
    ],
)
def test_ends_are_called_by_their_errors_and_by_how_the_run_stopped(
    turn: float, shift: float, status: Status, kind: int
) -> None:
    pose = Pose.from_angle(np.radians(turn), (0.0, shift))
    assert basins.kinds(pose, TRUTH, status) == kind
    world = Pose.from_angle(1.0, (3.0, -2.0))  # errors are relative: the truth may lie anywhere
    end = Pose(pose.R @ world.R, world.t + pose.t)
    assert basins.kinds(end, world, status) == kind


@METHODS
def test_the_starts_beside_the_truth_reach_it(method: str) -> None:
    ends = run(method=method).atlas.ends(0)
    middle = COLUMNS // 2
    assert (ends.kind[1, [middle - 3, middle + 1]] == basins.TRUTH).all()


def test_a_gate_below_every_distance_leaves_no_fit() -> None:
    """From far starts no pair lies within 0.001 u: the run stops where it began."""
    ask = basins.Ask("icp", 1e-3, "clean", SEED, 0.02, 0.0)
    atlas = basins.Runs(ask)
    ends = atlas.ends(0)
    assert (ends.kind == NONE).mean() > 0.9
    row, column = np.argwhere(ends.kind == NONE)[0].tolist()
    row, column = row // 4 * 4 + 1, column // 4 * 4 + 1
    track = atlas.track(row, column)
    assert track.status == Status.DEGENERATE
    assert track.steps == 0


def test_a_gate_deforms_the_map_and_ndt_has_none() -> None:
    free, gated = (run(gate=gate).atlas.ends(0) for gate in (3.0, 0.6))
    lost = (free.kind == basins.TRUTH) & (gated.kind != basins.TRUTH)
    assert lost.any()
    assert run(method="ndt", gate=0.6).atlas.ask == run(method="ndt").atlas.ask


# Readouts


@pytest.mark.parametrize("level", [0, 1])
def test_the_shares_are_the_maps_own(level: int) -> None:
    """They count each start run so far once."""
    state = run(gate=0.4)
    text, ends = texts(state, level), state.atlas.ends(level)
    kinds = ends.kind[basins.run_at(level)]
    for name, kind in (("reached", basins.TRUTH), ("shifted", SHIFTED), ("quarter", QUARTER), ("unfit", NONE)):
        assert float(text[name]) == pytest.approx(100.0 * (kinds == kind).mean(), abs=0.051)


def test_the_map_is_in_the_colours_of_the_ends() -> None:
    state = run()
    tiles = next(mark for mark in draw(state, 0).panels[0].marks if isinstance(mark, Tiles))
    np.testing.assert_array_equal(tiles.kinds, state.atlas.ends(0).kind)
    assert tiles.roles == KINDS
    assert set(KINDS) <= set(ROLES)
    assert len(basins.NAMES) == len(KINDS) == len(set(basins.NAMES))


def test_it_opens_before_its_run_and_the_end_is_told_when_it_is_there() -> None:
    """At the first start nothing has happened; single steps lead to the same end that pressing "finish" shows."""
    state = run()
    assert state.tile == FIRST
    assert texts(state)["end"] == "–"
    for _ in range(state.track.steps):
        assert "step" not in draw(state, 0).disabled
        before, state = state, act(state, STEP)
        moved = motion(before, state)
        assert moved is not None
        assert moved.panel == "room"
    assert "step" in draw(state, 0).disabled
    assert texts(state) == texts(run(FINISH))
    assert texts(state)["end"] in basins.NAMES


@pytest.mark.parametrize("kind", ["click", "hover"])
def test_a_place_that_is_picked_or_pointed_at_shows_its_whole_run(kind: str) -> None:
    """Its end is the one shown by its tile, and a step begins the run anew."""
    state = run(pick(1, 33, kind))
    assert texts(state)["end"] == "the truth"
    assert state.pose.t == pytest.approx(state.atlas.ends(0).pose.t[1, 33], abs=1e-9)
    result = act(state, STEP)
    assert result.steps == 1
    assert motion(state, result) is None  # the jump from the end back to the start is not animated
    assert act(result, FINISH).steps == state.steps


def test_the_gate_of_the_first_start_saves_it_and_a_narrow_one_does_not() -> None:
    ends = [texts(run(FINISH, gate=gate))["end"] for gate in (3.0, 1.0, 0.5)]
    assert [end == "the truth" for end in ends] == [False, True, False]


# Borders


def test_borders_lie_between_what_differs() -> None:
    """A lone tile has four sides, in the map's own units; a row of three is one rectangle."""
    inside = np.zeros((ROWS, COLUMNS), dtype=np.bool_)
    assert len(basins.around(inside)[0]) == 0
    inside[2, 3:6] = True
    a, b = basins.around(inside)
    assert len(a) == 4
    low, high = np.minimum(a, b).min(axis=0), np.maximum(a, b).max(axis=0)
    np.testing.assert_allclose(low, [TURNS[3] - 180.0 / COLUMNS, OFFSETS[2] - 1.5 / ROWS])
    np.testing.assert_allclose(high, [TURNS[5] + 180.0 / COLUMNS, OFFSETS[2] + 1.5 / ROWS])


def test_the_orange_line_surrounds_the_starts_that_end_together() -> None:
    state = run(pick(1, 33))
    ends = state.atlas.ends(0)
    region = basins.alike(ends.pose, state.track.poses[-1])
    assert region[1, 33]
    assert (ends.kind[region] == basins.TRUTH).mean() > 0.9
    lines = [m for m in draw(state, 0).panels[0].marks if isinstance(m, Segments) and m.role == "source"]
    np.testing.assert_array_equal(np.asarray(lines[0].a), basins.around(region)[0])
    assert not [m for m in draw(run(), 0).panels[0].marks if isinstance(m, Segments) and m.role == "source"]


def test_rms_is_that_of_the_nearest_points() -> None:
    state = run(FINISH)
    scene = room("clean", seed=SEED)
    moved = state.pose.apply(scene.source[::2])
    gaps = np.linalg.norm(moved[:, None] - scene.target, axis=2).min(axis=1)
    assert float(texts(state)["rms"]) == pytest.approx(float(np.sqrt(np.mean(gaps**2))), abs=5e-4)


@pytest.mark.parametrize("steps", [0, 3])
def test_the_room_shows_the_run_so_far(steps: int) -> None:
    """Its scan, the paths of three corners of the room, and the numbers of the same pose in words."""
    state = run(*[STEP] * steps)
    scene, picture = state.atlas.scene, draw(state, 0)
    marks = picture.panels[1].marks
    (group,) = (mark for mark in marks if isinstance(mark, Group))
    (scan,) = (mark for mark in group.marks if isinstance(mark, Points))
    np.testing.assert_allclose(scan.xy, state.pose.apply(scene.source[::2]))
    paths = [np.asarray(m.xy) for m in marks if isinstance(m, Path) and m.role == "source"]
    assert len(paths) == (3 if steps else 0)
    for corner, path in zip(TRACED, paths, strict=False):
        np.testing.assert_allclose(path, [state.track.poses[k].apply(corner[None])[0] for k in range(steps + 1)])
    corners = np.concatenate(scene.outline)
    assert np.linalg.norm(TRACED[:, None] - corners, axis=2).min(axis=1).max() < 1e-9
    turn, away = np.degrees(abs(state.pose.angle)), np.linalg.norm(state.pose.t)
    outlines = [np.asarray(m.xy) for m in marks if isinstance(m, Path) and m.role == "ghost"]
    assert len(outlines) == (len(scene.outline) if steps else 0)
    for outline, line in zip(outlines, scene.outline, strict=False):
        np.testing.assert_allclose(outline, state.track.poses[0].apply(line))
    assert picture.note == ""
    words = f"After {steps} steps its run is {turn:.1f}° and {away:.2f} u from the truth."
    assert words in picture.description
    ring = next(m for m in picture.panels[0].marks if isinstance(m, Ring) and m.role == "source")
    np.testing.assert_allclose(np.reshape(ring.xy, 2), [TURNS[state.tile[1]], OFFSETS[state.tile[0]]])
