"""Graphs with known true poses, for the tests of pose graphs."""

from __future__ import annotations

import numpy as np

from solvers import Pose
from solvers.posegraph import Edges

INFORMATION = np.diag([1 / 0.05**2, 1 / 0.05**2, 1 / 0.02**2])


def chained(relative: Pose, first: Pose) -> Pose:
    """The poses along a chain of relative poses that starts at `first`."""
    poses = [first]
    for k in range(relative.batch[0]):
        poses.append(poses[-1].compose(relative[k]))
    return Pose(np.stack([p.R for p in poses]), np.stack([p.t for p in poses]))


def with_noise(edges: Edges, noise: np.ndarray) -> Edges:
    """The edges with a residual of `noise` (e, 3) at poses that they agreed with: E = Z⁻¹ Tᵢ⁻¹ Tⱼ is that pose."""
    error = Pose.from_angle(noise[:, 2], noise[:, :2])
    return Edges(edges.i, edges.j, edges.relative.compose(error.inverse()), edges.information)


def streets(n: int = 60, seed: int = 4) -> tuple[Pose, Edges, np.ndarray]:
    """A walk over the crossings of a town, 1 u apart: the true poses, exact edges along the walk and between visits to
    the same crossing, and which edges are such loops."""
    rng = np.random.default_rng(seed)
    position, heading = np.zeros(2), 0
    headings, positions = [heading], [position]
    directions = np.array([[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0]])
    while len(positions) < n:
        heading = (heading + int(rng.choice([-1, 0, 0, 1]))) % 4
        if np.abs(position + directions[heading]).max() <= 3.0:
            position = position + directions[heading]
            headings.append(heading)
            positions.append(position)
    truth = Pose.from_angle(np.array(headings) * np.pi / 2, np.array(positions))
    i, j = list(range(n - 1)), list(range(1, n))
    for b in range(n):
        visits = [a for a in range(b - 3) if np.array_equal(positions[a], positions[b])]
        if visits:
            i.append(visits[0])
            j.append(b)
    return truth, Edges.between(truth, i, j, INFORMATION), np.arange(len(i)) >= n - 1


def noisy_streets(seed: int = 0, n: int = 60) -> tuple[Pose, Pose, Edges, np.ndarray]:
    """The true poses, the poses along the noisy walk alone, the noisy edges, and which of these are loops."""
    truth, edges, loops = streets(n)
    noise = np.random.default_rng(seed).normal(size=(len(edges), 3)) * [0.05, 0.05, 0.02]
    edges = with_noise(edges, noise)
    return truth, chained(edges.relative[: n - 1], truth[0]), edges, loops


def with_wrong_loop(edges: Edges, loops: np.ndarray, i: int, j: int, relative: Pose) -> tuple[Edges, np.ndarray]:
    """The edges with a false loop added, and the mask of loops extended by it."""
    edge = Edges([i], [j], Pose(relative.R[None], relative.t[None]), INFORMATION)
    return Edges.joined([edges, edge]), np.append(loops, True)
