"""What pairs along exact normals leave free, in words: a point of the plane or a direction, known from the shape."""

from __future__ import annotations

import re

import numpy as np
import pytest

from solvers.numerics import gauss_newton


def told(points: np.ndarray, normals: np.ndarray) -> str:
    """What is said of points (m, d) on a surface, each held along its normal."""
    centre = points.mean(axis=0)
    radius = np.sqrt(np.square(points - centre).sum(axis=1).mean())
    precision = normals[:, :, None] * normals[:, None, :]
    system = gauss_newton.system(
        points[None], points[None], precision[None], np.ones((1, len(points))), centre[None], radius[None]
    )
    return gauss_newton.freedom(system, 0)


def arc(half: float, radius: float, centre: tuple[float, float]) -> tuple[np.ndarray, np.ndarray]:
    """41 points on an arc of ±`half` rad about straight ahead, and their normals."""
    angle = np.linspace(-half, half, 41)
    normals = np.column_stack([np.cos(angle), np.sin(angle)])
    return radius * normals + centre, normals


@pytest.mark.parametrize("half", [0.5, 1.5, 3.0])
@pytest.mark.parametrize("radius", [0.5, 4.0])
def test_an_arc_turns_about_its_centre_not_about_that_of_its_points(half: float, radius: float) -> None:
    words = told(*arc(half, radius, (3.0, -1.25)))
    point = re.fullmatch(r"the pairs leave the turn about \((.+), (.+)\) free", words)
    assert point
    assert [float(x) for x in point.groups()] == [3.0, -1.25]


@pytest.mark.parametrize(("radii", "words"), [(9.0, "turn about"), (11.0, "slide along")])
def test_about_a_point_ten_radii_away_a_turn_is_told_as_a_slide(radii: float, words: str) -> None:
    """The points of a short arc ±h have an RMS distance of h / √3 of its radius from their centre."""
    assert told(*arc(np.sqrt(3.0) / radii, 1.0, (0.0, 0.0))).startswith(f"the pairs leave the {words} ")


def test_a_slide_is_along_the_wall() -> None:
    along = np.array([0.8, 0.6])
    words = told(np.linspace(-2.0, 5.0, 20)[:, None] * along, np.tile([-0.6, 0.8], (20, 1)))
    direction = re.fullmatch(r"the pairs leave the slide along \((.+), (.+)\) free", words)
    assert direction
    assert abs(np.array(direction.groups(), dtype=float) @ along) == pytest.approx(1.0)


@pytest.mark.parametrize("half", [1.0, np.pi])
def test_a_solid_of_revolution_turns_about_its_axis(half: float) -> None:
    """All round an ellipsoid, and over a part of it, whose points lie to one side of the axis."""
    rng = np.random.default_rng(5)
    longitude, latitude = rng.uniform(-half, half, 200), rng.uniform(-1.2, 1.2, 200)
    outward = np.column_stack([np.cos(latitude) * np.cos(longitude), np.cos(latitude) * np.sin(longitude)])
    points = np.column_stack([outward, 2.0 * np.sin(latitude)])
    normals = np.column_stack([outward, 0.5 * np.sin(latitude)])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    turn = gauss_newton.rotation(np.array([0.0, np.arccos(0.8), 0.0]))  # takes the axis to (0.6, 0, 0.8)
    words = told(points @ turn.T + [1.0, 2.0, 3.0], normals @ turn.T)
    direction = re.fullmatch(r"the pairs leave a turn about the direction \((.+), (.+), (.+)\) free", words)
    assert direction
    assert abs(np.array(direction.groups(), dtype=float) @ [0.6, 0.0, 0.8]) == pytest.approx(1.0, abs=0.01)


def test_an_ellipse_leaves_nothing_free() -> None:
    angle = np.linspace(0.0, 6.0, 30)
    normals = np.column_stack([np.cos(angle), 2.0 * np.sin(angle)])
    points = np.column_stack([2.0 * np.cos(angle), np.sin(angle)])
    assert told(points, normals / np.linalg.norm(normals, axis=1, keepdims=True)) == ""
