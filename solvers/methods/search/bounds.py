"""Lower bounds of the mean capped squared distance over boxes of rigid motions of the plane.

Lengths are in units of the cap, which is 1 here. A motion turns the source about its
centroid and then places the centroid. A box holds all turns φ within ±δ of its middle
and all places within ±h along x and along y. Anywhere in it point i, at ρ_i from the
centroid, is at most

    γ_i = 2 ρ_i sin(min(δ, π) / 2) + √2 h

from where the box's middle puts it. Two bounds follow, with d_i the distance to the
cloud at the middle:

- `coarse`: a distance falls by no more than the point moves, so E ≥ mean min(max(0, d_i
  − γ_i), 1)². It needs one look-up per point and is too low by about 2 d_i γ_i: near a
  minimum, boxes must become as small as the gap. The grid's rounding is added to γ_i,
  so that even a single pose has a bound below its value.
- `fine`: with v the vector from the nearest target point, d²(x + u) ≥ ‖v‖² + 2 v·u +
  a_i for every move ‖u‖ ≤ γ_i, where a_i ≤ 0 is the most that a change of partner, or
  the cap, may gain. The linear parts are summed over the points *before* they are
  bounded. At a minimum they cancel, and the remaining slack falls with the square of
  the box's size.

References
----------
.. [1] T. M. Breuel, "Implementation techniques for geometric branch-and-bound matching
   methods", 2003 (boxes of planar motions). doi:10.1016/S1077-3142(03)00026-2
.. [2] J. Yang, H. Li, D. Campbell, Y. Jia, "Go-ICP", 2016, sec. 4 (`coarse`, for balls
   of turns in space). doi:10.1109/TPAMI.2015.2513405
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from solvers.core.arrays import BoolArray, FloatArray, IntArray
from solvers.methods.search.distance_grid import ROUNDING, DistanceGrid

BLOCK = 2**17
"""The most numbers in a temporary array of the coarse bound; one that fits the cache is twice as fast."""
_LOSS = 1.0 - 1e-5  # more than float32 loses in a sum


@dataclass(frozen=True, eq=False)
class Boxes:
    """k boxes of motions.

    Attributes
    ----------
    middle : ndarray of shape (k, 3)
        The turn in radians, and the place of the source's centroid, x and y.
    half : ndarray of shape (k, 2)
        δ in radians, and h.
    bound : ndarray of shape (k,)
        No motion of the box has a smaller objective.
    """

    middle: FloatArray
    half: FloatArray
    bound: FloatArray

    def __len__(self) -> int:
        return len(self.bound)

    def of(self, rows: IntArray | BoolArray | slice) -> Boxes:
        """The boxes at `rows`, an index array, a slice or a mask."""
        return Boxes(self.middle[rows], self.half[rows], self.bound[rows])


def joined(*parts: Boxes) -> Boxes:
    """The boxes of all parts, concatenated."""
    return Boxes(
        np.concatenate([p.middle for p in parts]),
        np.concatenate([p.half for p in parts]),
        np.concatenate([p.bound for p in parts]),
    )


def split(boxes: Boxes, reach: float) -> Boxes:
    """Split each box into two halves of its turns or four quarters of its places, whichever range moves points more.

    reach: the distance from the centroid at which a turn's motion is measured. The parts inherit the bound.
    """
    by_turn = 2.0 * reach * np.sin(0.5 * np.minimum(boxes.half[:, 0], np.pi)) >= np.sqrt(2.0) * boxes.half[:, 1]
    parts = []
    for group, signs in (
        (boxes.of(by_turn), np.array([(-1.0, 0.0, 0.0), (1.0, 0.0, 0.0)])),
        (boxes.of(~by_turn), np.array([(0.0, x, y) for x in (-1.0, 1.0) for y in (-1.0, 1.0)])),
    ):
        k = len(signs)
        half = np.repeat(group.half, k, axis=0) * np.where(signs[0, 0] != 0.0, (0.5, 1.0), (1.0, 0.5))
        middle = np.repeat(group.middle, k, axis=0) + np.tile(signs, (len(group), 1)) * half[:, [0, 1, 1]]
        parts.append(Boxes(middle, half, np.repeat(group.bound, k)))
    return joined(*parts)


def coarse(grid: DistanceGrid, arms: FloatArray, middle: FloatArray, half: FloatArray) -> FloatArray:
    """The first-order bound from the grid, (k,). arms: (m, 2) the source relative to its centroid. Computed in float32
    and lowered by more than float32 may lose.
    """
    a, reach = (arms / grid.cell).astype(np.float32), 2.0 * np.hypot(arms[:, 0], arms[:, 1]).astype(np.float32)
    c, s = (f(middle[:, 0]).astype(np.float32)[:, None] for f in (np.cos, np.sin))
    at = ((middle[:, 1:] - grid.low) / grid.cell).astype(np.float32)
    turn = np.sin(0.5 * np.minimum(half[:, 0], np.pi)).astype(np.float32)[:, None]
    far = grid.cell * (np.abs(at).max(initial=0.0) + np.abs(a).max()) + np.abs(grid.low).max()
    slack = (np.sqrt(2.0) * half[:, 1] + grid.error + ROUNDING * far).astype(np.float32)[:, None]
    out = np.empty(len(middle))
    k = max(1, BLOCK // len(arms))
    for i in range(0, len(middle), k):
        b = slice(i, i + k)
        x = c[b] * a[:, 0] - s[b] * a[:, 1]
        y = s[b] * a[:, 0] + c[b] * a[:, 1]
        x += at[b, 0, None]
        y += at[b, 1, None]
        d = grid.look_up(x, y)
        d -= turn[b] * reach
        d -= slack[b]
        np.clip(d, 0.0, 1.0, out=d)
        out[b] = np.square(d, out=d).sum(axis=1)
    return out * (_LOSS / len(arms))


def fine(grid: DistanceGrid, arms: FloatArray, middle: FloatArray, half: FloatArray) -> FloatArray:
    """The second-order bound from the listed points, (k,), or the first-order one where that is higher."""
    out = np.empty(len(middle))
    k = max(1, BLOCK // (4 * arms.size))
    for i in range(0, len(middle), k):
        b = slice(i, i + k)
        out[b] = _fine(grid, arms, middle[b], half[b])
    return out


def _fine(grid: DistanceGrid, arms: FloatArray, middle: FloatArray, half: FloatArray) -> FloatArray:
    c, s = np.cos(middle[:, 0, None]), np.sin(middle[:, 0, None])
    rotated = np.stack([c * arms[:, 0] - s * arms[:, 1], s * arms[:, 0] + c * arms[:, 1]], axis=-1)
    points = rotated + middle[:, None, 1:]
    candidates, others = grid.candidates(points)
    vx, vy = points[..., 0, None] - candidates[..., 0], points[..., 1, None] - candidates[..., 1]
    squares = vx * vx + vy * vy
    first = squares.argmin(axis=-1)[..., None]
    v = np.stack([np.take_along_axis(vx, first, -1), np.take_along_axis(vy, first, -1)], axis=-1)[..., 0, :]
    least = np.take_along_axis(squares, first, -1)[..., 0]
    d = np.sqrt(least)

    delta, h = np.minimum(half[:, 0], np.pi), half[:, 1]
    gamma = 2.0 * np.hypot(arms[:, 0], arms[:, 1]) * np.sin(0.5 * delta)[:, None] + np.sqrt(2.0) * h[:, None]
    plain = np.square(np.clip(np.minimum(d, others) - gamma, 0.0, 1.0))
    # Another partner: ‖v_j + u‖² − ‖v‖² − 2 v·u ≥ (d_j² − d²) − 2 e u + u², with e its distance from the nearest.
    vx -= v[..., :1]
    vy -= v[..., 1:]
    e = np.sqrt(vx * vx + vy * vy)
    u = np.minimum(gamma[..., None], e)
    squares -= least[..., None]
    squares -= (2.0 * e - u) * u
    # Likewise for the cap and for points not listed; the nearest itself gains nothing.
    ends = np.minimum(1.0, np.square(np.maximum(others - gamma, 0.0)))
    base = least + np.minimum(np.minimum(squares.min(axis=-1), 0.0), ends - least - 2.0 * d * gamma)
    linear = (d < 1.0) & (base >= plain)
    slope = np.where(linear[..., None], 2.0 * v, 0.0)
    total = slope.sum(axis=1)
    twist = (slope[..., 1] * rotated[..., 0] - slope[..., 0] * rotated[..., 1]).sum(axis=1)
    along = (slope * rotated).sum(axis=(1, 2))
    level = np.where(linear, base, plain).sum(axis=1)
    level -= h * np.abs(total).sum(axis=1) + np.sin(np.minimum(delta, 0.5 * np.pi)) * np.abs(twist)
    level -= (1.0 - np.cos(delta)) * np.maximum(along, 0.0)
    bound: FloatArray = np.maximum(level, plain.sum(axis=1)) / len(arms)
    return bound
