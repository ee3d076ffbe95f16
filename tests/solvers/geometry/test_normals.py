"""Eigenvectors with fixed signs; normals of surfaces where they are known, and flags where there are none."""

import numpy as np
import pytest

from solvers import register
from solvers.geometry import nearest
from solvers.geometry.normals import normals
from solvers.geometry.spectral import symmetric_eigen
from solvers.scenes.rooms import room

pytestmark = pytest.mark.filterwarnings("error::RuntimeWarning")


@pytest.mark.parametrize("d", [2, 3])
def test_eigenvectors_solve_their_equation_and_have_a_fixed_sign(rng, d):
    """A = V Λ Vᵀ with ascending values, orthonormal V, and the largest component of each vector positive."""
    root = rng.standard_normal((200, d, d)) * 10.0 ** rng.uniform(-4, 4, (200, 1, 1))
    A = root + root.swapaxes(1, 2)
    values, vectors = symmetric_eigen(A)
    assert (np.diff(values, axis=1) >= 0.0).all()
    rebuilt = (vectors * values[:, None]) @ vectors.swapaxes(1, 2)
    assert (np.abs(rebuilt - A).max(axis=(1, 2)) <= 1e-14 * np.abs(A).max(axis=(1, 2)) * d).all()
    np.testing.assert_allclose(vectors.swapaxes(1, 2) @ vectors, np.broadcast_to(np.eye(d), A.shape), atol=1e-14)
    assert (np.take_along_axis(vectors, np.abs(vectors).argmax(axis=1)[:, None], axis=1) > 0.0).all()


def test_the_planar_closed_form_agrees_with_lapack(rng):
    root = rng.standard_normal((100, 4, 2)) * [1.0, 0.01]
    A = root.swapaxes(1, 2) @ root
    np.testing.assert_allclose(symmetric_eigen(A)[0], np.linalg.eigvalsh(A), rtol=1e-13, atol=1e-15 * A.max())


@pytest.mark.parametrize("d", [2, 3])
def test_normals_of_a_flat_surface_are_its_normal(rng, d, random_pose):
    """Points on a line in the plane or on a plane in space, at any position: every normal is the surface's."""
    pose = random_pose(rng, d)
    flat = rng.uniform(-2.0, 2.0, (1, 60, d))
    flat[..., -1] = 0.0
    result = normals(nearest.build(pose.apply(flat)))
    assert not result.flagged.any()
    np.testing.assert_allclose(np.abs(result.vectors @ pose.R[:, -1]), 1.0, atol=1e-12)
    assert (result.eigenvalues[..., 0] < 1e-14).all()


def test_normals_of_a_circle_point_to_its_centre():
    """On a regular polygon the neighbourhoods are symmetric, and the normals are the radii to rounding."""
    angle = 2.0 * np.pi * np.arange(40) / 40
    circle = np.column_stack([np.cos(angle), np.sin(angle)])
    result = normals(nearest.build(circle[None]), 6)
    np.testing.assert_allclose(np.abs((result.vectors[0] * circle).sum(axis=1)), 1.0, atol=1e-12)


def test_a_neighbourhood_without_a_normal_is_flagged():
    """Coincident points, a single point, a square's corners and, in space, a line: no normal is invented for them, and
    point to plane leaves out their pairs."""
    square = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]])
    for cloud in (np.full((9, 2), 0.3), np.array([[1e8, 2.0]]), square + 5.0):
        result = normals(nearest.build(cloud[None]))
        assert result.flagged.all()
        assert not result.vectors.any()
    line = np.linspace(0.0, 3.0, 20)[:, None] * [1.0, 0.3, -2.0] + [7.0, 0.0, 1.0]
    assert normals(nearest.build(line[None])).flagged.all()
    two = normals(nearest.build(square[None, :2]))
    assert not two.flagged.any()
    np.testing.assert_allclose(two.vectors[0], [[0.0, 1.0]] * 2, atol=1e-15)
    lone = np.vstack([np.column_stack([np.arange(10.0), np.zeros(10)]), np.full((8, 2), 50.0)])
    assert normals(nearest.build(lone[None])).flagged[0].tolist() == [False] * 10 + [True] * 8
    pairing = register(lone + np.array([0.1, 0.2]), lone, "point-to-plane", max_steps=0).detail("pairing")
    assert pairing.used.tolist() == [True] * 10 + [False] * 8
    assert pairing.count == 10
    assert pairing.rms == pytest.approx(0.2)


def test_normals_do_not_depend_on_units_or_place():
    cloud = room("noise").target
    first = normals(nearest.build(cloud[None]))
    second = normals(nearest.build(2.0**40 * cloud[None]))
    np.testing.assert_array_equal(second.vectors, first.vectors)
    np.testing.assert_allclose(second.eigenvalues, 2.0**80 * first.eigenvalues, rtol=1e-14)
    with pytest.raises(ValueError, match="roundness"):
        normals(nearest.build(cloud[None]), 6, 0.0)


def test_points_closer_than_their_rounding_have_no_normal():
    """Far from the origin a cloud of 1e-7 u is just rounding: its directions are accidental, and flagged as such."""
    cloud = 2.0**30 + 1e-7 * np.random.default_rng(1).standard_normal((20, 2))
    assert normals(nearest.build(cloud[None])).flagged.all()
