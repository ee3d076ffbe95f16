"""The marks of a dial: the ring's heights, the ball's way, and what links the clouds, each against its definition."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from solvers import Pose
from solvers.numerics.fourier_features import unit_frequencies
from widgets.drawing.picture import Arrow, Ellipses, Path, Points, Segments, Ticks
from widgets.parts import dial_marks as marks
from widgets.parts.dial import RUNGS, Dial, headings, made, starts
from widgets.parts.ring import place

POSE = Pose.from_angle(0.6)


def of(name: str, length: float | None = None) -> Dial:
    return made(name, 40, 0.02, length or RUNGS[name].length or 1.0)


def segments(drawn: tuple[Any, ...], role: str) -> tuple[Any, np.ndarray, np.ndarray]:
    """The one mark of segments in this role, and its ends (n, 2)."""
    (mark,) = (mark for mark in drawn if isinstance(mark, Segments) and mark.role == role)
    return mark, np.reshape(mark.a, (-1, 2)), np.reshape(mark.b, (-1, 2))


@pytest.mark.parametrize("name", ["pairs", "nearest", "means"])
@pytest.mark.parametrize("full", [True, False])
def test_a_rings_height_is_the_objectives(name: str, full: bool) -> None:
    """The lowest value lies on the inner circle, the highest on the outer, and equal differences are equal heights."""
    dial = of(name)
    values, heights = dial.ring if full else dial.coarse, marks.heights(dial, full)
    assert (heights.min(), heights.max()) == (marks.INNER, marks.OUTER)
    assert heights[np.argmin(values)] == marks.INNER
    slope = (marks.OUTER - marks.INNER) / np.ptp(values)
    np.testing.assert_allclose(np.diff(heights), slope * np.diff(values), atol=1e-9)


def test_a_ring_is_filled_between_its_surface_and_the_inner_circle() -> None:
    dial = of("nearest")
    area, truth = marks.ring(dial, True)
    assert isinstance(area, Path)
    assert isinstance(truth, Segments)
    xy = np.reshape(area.xy, (-1, 2))
    outside = len(headings()) + 1
    np.testing.assert_allclose(
        np.sort(np.linalg.norm(xy[: outside - 1], axis=1)), np.sort(marks.heights(dial, True)), atol=1e-12
    )
    np.testing.assert_allclose(xy[0], xy[outside - 1], atol=1e-12)
    np.testing.assert_allclose(np.linalg.norm(xy[outside:], axis=1), marks.INNER)
    assert area.filled
    assert area.closed
    x, y = np.append(xy, xy[:1], axis=0).T
    enclosed = 0.5 * (x[:-1] * y[1:] - x[1:] * y[:-1]).sum()  # the circle runs the other way round: a hole
    x, y = xy[:outside].T
    assert enclosed == pytest.approx(0.5 * (x[:-1] * y[1:] - x[1:] * y[:-1]).sum() - np.pi * marks.INNER**2, rel=0.02)
    np.testing.assert_allclose(np.reshape([truth.a, truth.b], (2, 2))[:, 0], 0.0, atol=1e-12)


@pytest.mark.parametrize(("name", "turn"), [("nearest", 2.2), ("nearest", 0.05), ("surface", -2.9), ("corrupted", 2.0)])
def test_a_ball_rolls_along_the_ring_from_the_starts_heading_to_the_ends(name: str, turn: float) -> None:
    """A dotted line joins the two if the method searches; a hollow ball has not arrived."""
    dial = of(name)
    course = dial.course(turn)
    drawn = marks.ball(dial, True, turn, course)
    begin, end = (marks.at(dial, True, np.array([h]))[0] for h in (turn, course.headings[-1]))
    (way,) = (mark for mark in drawn if isinstance(mark, Path))
    xy = np.reshape(way.xy, (-1, 2))
    np.testing.assert_allclose(xy[[0, -1]], [begin, end], atol=1e-12)
    assert (way.role, way.dotted) == (("ghost", True) if dial.rung.searches else ("source", False))
    if not dial.rung.searches:
        angles = np.arctan2(-xy[:, 0], xy[:, 1])
        np.testing.assert_allclose(xy, marks.at(dial, True, angles), atol=1e-9)
        steps = np.abs((np.diff(angles) + np.pi) % (2 * np.pi) - np.pi)
        assert steps.max() <= 2 * np.pi / len(headings()) + 1e-9
        direct = np.abs((np.diff(course.headings) + np.pi) % (2 * np.pi) - np.pi).sum()
        assert steps.sum() == pytest.approx(direct)
    balls = [mark for mark in drawn if isinstance(mark, Points) and np.allclose(mark.xy, end) and mark.role != "ghost"]
    solid = [mark.role for mark in balls if mark.shape == "dot"]
    assert solid == (["truth"] if course.arrived else [])
    assert [mark.role for mark in balls if mark.shape == "ring"] == ["truth" if course.arrived else "source"]


def test_each_start_has_its_mark_in_the_band() -> None:
    arrived = np.arange(len(starts())) % 3 == 0
    cross, square = marks.arrivals(arrived)
    assert isinstance(cross, Points)
    assert isinstance(square, Points)
    assert (cross.shape, square.shape, square.role) == ("cross", "square", "truth")
    np.testing.assert_allclose(square.xy, place(starts()[arrived], marks.BAND))
    np.testing.assert_allclose(cross.xy, place(starts()[~arrived], marks.BAND))


def test_known_pairs_are_joined_and_wrong_ones_dashed() -> None:
    clouds = of("corrupted").clouds
    drawn = marks.links(of("corrupted"), POSE)
    for role, rows in (("pair", ~clouds.wrong), ("outlier", clouds.wrong)):
        mark, a, b = segments(drawn, role)
        assert mark.dashed == (role == "outlier")
        np.testing.assert_allclose(a, POSE.apply(clouds.source)[rows])
        np.testing.assert_allclose(b, clouds.target[rows])


def test_each_point_is_joined_to_its_nearest_and_dashed_beyond_the_cap() -> None:
    dial = of("nearest", 0.5)
    moved, target = POSE.apply(dial.clouds.source), dial.clouds.target
    distances = np.linalg.norm(moved[:, None] - target, axis=2)
    rows, least = distances.argmin(axis=1), distances.min(axis=1)
    drawn = marks.links(dial, POSE)
    for role, chosen in (("pair", least <= 0.5), ("outlier", least > 0.5)):
        mark, a, b = segments(drawn, role)
        assert chosen.any()
        assert mark.dashed == (role == "outlier")
        np.testing.assert_allclose(a, moved[chosen])
        np.testing.assert_allclose(b, target[rows[chosen]])


def test_a_link_to_the_surface_ends_on_the_tangent_at_the_nearest_point() -> None:
    dial = of("surface")
    moved, target = POSE.apply(dial.clouds.source), dial.clouds.target
    drawn = marks.links(dial, POSE)
    (normals,) = (mark for mark in drawn if isinstance(mark, Ticks))
    np.testing.assert_array_equal(normals.xy, target)
    rows = np.linalg.norm(moved[:, None] - target, axis=2).argmin(axis=1)
    n = np.asarray(normals.direction)[rows]
    _, a, b = segments(drawn, "pair")
    np.testing.assert_allclose(a, moved)
    np.testing.assert_allclose(((b - target[rows]) * n).sum(axis=1), 0.0, atol=1e-9)
    np.testing.assert_allclose((b - a)[:, 0] * n[:, 1] - (b - a)[:, 1] * n[:, 0], 0.0, atol=1e-9)


def test_an_ellipse_is_the_gaussian_of_a_cells_points() -> None:
    """One for each cell of at least three points, its mean and covariance theirs."""
    dial = of("cells")
    target, h = dial.clouds.target, dial.length
    (ellipses,) = (mark for mark in marks.links(dial, POSE) if isinstance(mark, Ellipses))
    assert (ellipses.sigmas, ellipses.filled) == (2.0, True)
    numbers, counts = np.unique(np.floor(target / h), axis=0, return_counts=True)
    centres, covariances = np.asarray(ellipses.centre), np.asarray(ellipses.covariance)
    cells = np.floor(centres / h)
    assert sorted(map(tuple, cells)) == sorted(map(tuple, numbers[counts >= 3]))
    for cell, centre, covariance in zip(cells, centres, covariances, strict=True):
        points = target[(np.floor(target / h) == cell).all(axis=1)]
        np.testing.assert_allclose(centre, points.mean(axis=0), atol=1e-12)
        np.testing.assert_allclose(covariance, np.cov(points.T, bias=True), atol=1e-12)


def test_a_thread_is_the_stronger_the_larger_its_share() -> None:
    """Opacity squared is proportional to the share of each of the threaded points; the strongest has the largest."""
    dial = of("soft")
    source, target = POSE.apply(dial.clouds.source)[:: marks.THREADED], dial.clouds.target
    mark, a, b = segments(marks.links(dial, POSE), "pair")
    squares = ((source[:, None] - target) ** 2).sum(axis=2)
    kernel = np.exp(-(squares - squares.min(axis=1, keepdims=True)) / (2.0 * dial.length**2))
    shares = kernel / kernel.sum(axis=1, keepdims=True)
    i = np.linalg.norm(a[:, None] - source, axis=2).argmin(axis=1)
    j = np.linalg.norm(b[:, None] - target, axis=2).argmin(axis=1)
    np.testing.assert_allclose(a, source[i])
    np.testing.assert_allclose(b, target[j])
    weight = np.asarray(mark.weight)
    np.testing.assert_allclose(weight**2 / shares[i, j], (weight**2).max() / shares.max(), rtol=1e-6)
    drawn = np.zeros(shares.shape, dtype=bool)
    drawn[i, j] = True
    assert shares[~drawn].max() < shares[drawn].min()
    assert shares[drawn].sum() > 0.9 * len(source)


def test_crests_are_where_the_wave_has_a_whole_phase() -> None:
    """Every crest inside the ring, each a chord across it, a whole number of periods from the centre."""
    dial = of("means")
    frequency = unit_frequencies(np.array([dial.seed]), 1, 2)[0, 0] / dial.length
    _, a, b = segments(marks.links(dial, POSE), "guide")
    phase = a @ frequency / (2.0 * np.pi)
    np.testing.assert_allclose(b @ frequency / (2.0 * np.pi), phase, atol=1e-9)
    reach = np.linalg.norm(a, axis=1)
    np.testing.assert_allclose(np.linalg.norm(b, axis=1), reach)
    np.testing.assert_allclose(reach, reach[0])
    assert 0.9 * marks.INNER < reach[0] < marks.INNER
    most = int(reach[0] * np.linalg.norm(frequency) / (2.0 * np.pi))
    np.testing.assert_allclose(np.sort(phase), np.arange(-most, most + 1), atol=1e-9)
    assert (np.linalg.norm(b - a, axis=1) > 0.0).all()


def test_a_flows_arrows_lead_from_the_start_to_the_end() -> None:
    dial = of("flow")
    course = dial.course(1.2)
    assert marks.links(dial, POSE) == ()
    arrows = marks.links(dial, course.pose, course)
    source = dial.clouds.source[:: marks.THREADED]
    assert all(isinstance(arrow, Arrow) for arrow in arrows)
    np.testing.assert_allclose([arrow.a for arrow in arrows], Pose.from_angle(1.2).apply(source), atol=1e-9)
    np.testing.assert_allclose([arrow.b for arrow in arrows], course.pose.apply(source), atol=1e-9)


def test_the_robot_is_symmetric_about_its_heading() -> None:
    """Its nose is the point that lies straight ahead."""
    group = marks.scan(of("nearest"), Pose.identity())
    (body,) = (mark for mark in group.marks if isinstance(mark, Path) and mark.filled)
    xy = np.asarray(body.xy)
    np.testing.assert_allclose(sorted(map(tuple, xy * [-1.0, 1.0])), sorted(map(tuple, xy)))
    np.testing.assert_allclose(xy[np.argmax(xy[:, 1])], [0.0, marks.NOSE])
