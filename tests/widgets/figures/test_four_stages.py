"""The walkthrough's pictures stage by stage: what is drawn follows from the method's state by its definition."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np
import pytest

from solvers.studies.walkthrough import EVERY
from tests.widgets.states import state_after
from widgets.drawing.picture import Arrow, Heat, Path, Points, Ring, Segments
from widgets.engine.contract import Action
from widgets.figures.four import cpd, filterreg
from widgets.figures.four.figure import WIDGET, draw
from widgets.figures.four.run import Look

ITERATE = Action("press", "iterate")
PLACES = {"cpd": 0, "filterreg": 1, "mmd": 2, "flow": 3}

run = partial(state_after, WIDGET)


def shown(method: str, stage: int, iterations: int = 1, **controls: Any) -> tuple[Look, tuple[Any, ...], str]:
    """The method's look at a stage, the marks of its panel, and the words of its caption."""
    state = run(*[ITERATE] * iterations, Action("press", f"stage-{stage}"), **controls)
    panel = draw(state).panels[PLACES[method]]
    return state.walk.looks()[PLACES[method]], panel.marks, panel.caption.split("\n")[1]


def of(marks: tuple[Any, ...], kind: type, role: str) -> list[Any]:
    return [mark for mark in marks if isinstance(mark, kind) and mark.role == role]


def rigid(before: np.ndarray, after: np.ndarray) -> bool:
    """Whether the points have all their distances kept."""
    a, b = (np.linalg.norm(x[:, None] - x, axis=2) for x in (before, after))
    return bool(np.allclose(a, b, atol=1e-6))


def test_cpds_first_stage_draws_the_shares_of_six_fixed_points() -> None:
    """By the definition, from the moved cloud at the state's σ; a cross is as strong as what clutter takes."""
    look, marks, words = shown("cpd", 1, scene="clutter")
    target, sigma, w = look.walk.scene.target, float(look.before.sigma[0]), look.before.options.clutter
    K = np.exp(-np.square(look.moved[:, None] - target).sum(axis=2) / (2.0 * sigma**2))
    (crosses,) = [m for m in of(marks, Points, "outlier") if m.shape == "cross"]
    np.testing.assert_allclose(crosses.xy, target)
    clutter = np.asarray(crosses.weight)
    constant = clutter / (1.0 - clutter) * K.sum(axis=0)  # one number, whatever the point
    np.testing.assert_allclose(constant, np.median(constant), rtol=1e-6)
    assert (w > 0.0) == (clutter.sum() > 0.0)
    assert f"clutter takes {clutter.sum():.1f} fixed points." in words
    (lines,) = of(marks, Segments, "pair")
    assert len(np.unique(np.asarray(lines.b), axis=0)) == 6
    for a, b, weight in zip(np.asarray(lines.a), np.asarray(lines.b), np.asarray(lines.weight), strict=True):
        j = int(np.linalg.norm(target - b, axis=1).argmin())
        i = int(np.linalg.norm(look.moved - a, axis=1).argmin())
        assert weight == pytest.approx(K[i, j] / K[:, j].max())
        assert weight > cpd.FAINTEST


def test_cpds_middle_stages_centre_turn_and_shift() -> None:
    """The weighted means are at the cross; the arc ends at the new heading; the arrow leads to the new place."""
    look, marks, _ = shown("cpd", 2)
    fixed, moving = (of(marks, Points, role)[0] for role in ("target", "source"))
    for points, weights in ((fixed, look.before.row[0]), (moving, look.before.column[0])):
        np.testing.assert_allclose(np.asarray(points.weight), weights / weights.max() if points is moving else weights)
        np.testing.assert_allclose(weights @ np.asarray(points.xy), 0.0, atol=1e-8)
    (cross,) = of(marks, Points, "ink")
    np.testing.assert_array_equal(np.reshape(cross.xy, 2), 0.0)
    look, marks, words = shown("cpd", 3)
    before, after = (np.asarray(of(marks, Points, role)[0].xy) for role in ("ghost", "source"))
    assert rigid(before, after)
    cosine, sine = (before * after).sum(), (before[:, 0] * after[:, 1] - before[:, 1] * after[:, 0]).sum()
    turn = float(np.degrees(np.arctan2(sine, cosine)))
    assert f"by {turn:.1f}°".replace("-", "−") in words
    (arc,), (tip,) = of(marks, Path, "accent"), of(marks, Arrow, "accent")
    ends = np.asarray(arc.xy)[[0, -1]]
    swept = np.degrees(np.arctan2(ends[0, 0] * ends[1, 1] - ends[0, 1] * ends[1, 0], (ends[0] * ends[1]).sum()))
    assert swept == pytest.approx(turn, abs=1e-6)
    np.testing.assert_allclose(tip.b, ends[1])
    look, marks, _ = shown("cpd", 4)
    (arrow,) = of(marks, Arrow, "accent")
    np.testing.assert_allclose([arrow.a, arrow.b], [look.came.t, look.went.t])


def test_cpds_last_stage_draws_both_widths() -> None:
    look, marks, words = shown("cpd", 5)
    dashed, solid = of(marks, Ring, "ghost"), of(marks, Ring, "accent")
    np.testing.assert_allclose([ring.reach for ring in dashed], float(look.before.sigma[0]))
    np.testing.assert_allclose([ring.reach for ring in solid], float(look.after.sigma[0]))
    assert all(ring.dashed for ring in dashed)
    moved = look.went.apply(look.walk.scene.source)[cpd.SOME]
    for rings in (dashed, solid):
        np.testing.assert_allclose([np.reshape(ring.xy, 2) for ring in rings], moved)
    assert f"{float(look.before.sigma[0]):.3f} → {float(look.after.sigma[0]):.3f} u" in words


@pytest.mark.parametrize(("stage", "column"), [(1, "splat"), (2, "values")])
def test_filterregs_heat_is_its_lattice(stage: int, column: str) -> None:
    """A cell is coloured if a vertex lies in it that holds a fiftieth of the largest value, with the largest there."""
    look, marks, _ = shown("filterreg", stage)
    grid = look.before.filters[0]
    places = grid.places(grid.splat_codes if stage == 1 else grid.codes)
    mass = getattr(grid, column)[:, 0]
    (heat,) = (mark for mark in marks if isinstance(mark, Heat))
    x0, x1, y0, y1 = heat.window
    values = np.asarray(heat.values)
    side = (x1 - x0) / values.shape[1]
    assert side == pytest.approx((y1 - y0) / values.shape[0])
    assert side >= min(filterreg.CELL, grid.side)
    expected = np.full(values.shape, np.nan)
    for (x, y), value in zip(places, mass, strict=True):
        i, j = int(np.floor((y - y0) / side + 1e-6)), int(np.floor((x - x0) / side + 1e-6))
        if 0 <= i < len(values) and 0 <= j < values.shape[1] and value >= 0.02 * mass.max():
            expected[i, j] = np.fmax(expected[i, j], value)
    np.testing.assert_allclose(values, expected)
    assert heat.high == mass.max()


def test_filterregs_queries_pull_and_its_twist_moves() -> None:
    """A line from each drawn point to its soft target, with the point's confidence; crosses have the rest of it."""
    look, marks, words = shown("filterreg", 3)
    weight, to = look.before.weights[0], look.before.targets[0]
    (lines,), (diamonds,) = of(marks, Segments, "accent"), of(marks, Points, "accent")
    np.testing.assert_allclose(lines.a, look.moved[::3])
    for ends, weights in ((lines.b, lines.weight), (diamonds.xy, diamonds.weight)):
        np.testing.assert_allclose(ends, to[::3])
        np.testing.assert_allclose(np.asarray(weights), weight[::3])
    (crosses,) = of(marks, Points, "outlier")
    np.testing.assert_allclose(np.asarray(crosses.weight), 1.0 - weight)
    pull = np.sqrt((weight @ np.square(to - look.moved).sum(axis=1)) / weight.sum())
    assert f"Mean confidence {weight.mean():.2f}; targets pull over {pull:.2f} u" in words
    look, marks, _ = shown("filterreg", 4)
    (moves,) = of(marks, Segments, "accent")
    source = look.walk.scene.source
    np.testing.assert_allclose(moves.a, look.came.apply(source)[::6])
    np.testing.assert_allclose(moves.b, look.went.apply(source)[::6])


@pytest.mark.parametrize("project", [True, False])
def test_the_flows_projection_draws_rigid_copies(project: bool) -> None:
    """Of the moving and of the fixed points that the network got; each end is joined to its place in them, and their
    distance apart is told."""
    look, marks, words = shown("flow", 3, project=project)
    moving, target = look.given[::EVERY], look.walk.scene.target[::EVERY]
    clouds = [np.asarray(of(marks, Points, role)[-1].xy) for role in ("source", "target")]
    for given, copy in zip((moving, target), clouds, strict=True):
        assert rigid(given, copy)
        a, b = given - given.mean(axis=0), copy - copy.mean(axis=0)
        assert np.linalg.det(a.T @ b) > 0.0
    (lines,) = of(marks, Segments, "accent")
    np.testing.assert_allclose(lines.b, np.concatenate(clouds))
    off = np.sqrt(np.square(np.asarray(lines.b) - np.asarray(lines.a)).sum(axis=1).mean())
    assert words.startswith(f"{off:.3f} u RMS off rigid copies")
    assert words.endswith("made rigid." if project else "only measured.")
    curves = [np.asarray(of(marks, Path, role)[0].xy) for role in ("source", "target")]
    outline = look.walk.scene.outline[0]
    starts = (look.walk.start.apply(outline), look.walk.scene.truth.apply(outline))
    assert all(rigid(start, curve) for start, curve in zip(starts, curves, strict=True))


def test_the_flows_endpoints_are_joined_to_where_the_sample_is() -> None:
    _, marks, words = shown("flow", 2)
    ends = [np.asarray(of(marks, Points, role)[-1].xy) for role in ("source", "target")]
    lines = [of(marks, Segments, role)[0] for role in ("source", "target")]
    for line, end in zip(lines, ends, strict=True):
        np.testing.assert_allclose(line.b, end)
    both = np.concatenate([np.asarray(line.b) - np.asarray(line.a) for line in lines])
    assert f"{np.sqrt(np.square(both).sum(axis=1).mean()):.2f} u away, RMS" in words
    _, before, _ = shown("flow", 1)
    for line in lines:
        (rings,) = (mark for mark in of(before, Points, line.role) if mark.shape == "ring")
        np.testing.assert_allclose(line.a, rings.xy)
