"""Gaussian sums over a fixed cloud, filtered on a lattice once and then read off
anywhere, in the plane.

At any query point x they give the moments of the cloud's points y_j under
`K_j = exp(−‖x − y_j‖² / 2σ²)`:

    m⁰ = Σ K_j,   m¹ = Σ K_j y_j,   m² = Σ K_j ‖y_j‖².

Exact sums cost queries × points. A filter spreads the points' values over the vertices
of a lattice (splat), blurs them there, and interpolates at the queries (slice): its
cost grows with their sum, and as long as cloud and σ stay the same, only slicing is left
to do. There are three, with one interface:

- `exact`: the sums themselves.
- `grid`: a square grid of side σ/2. Splat and slice by quadratic B-splines (3 × 3
  vertices), each adding the variance side²/4 wherever a point lies; between them a
  sampled Gaussian of variance `σ² − side²/2`, axis by axis.
- `lattice`: the permutohedral lattice, which in the plane consists of equilateral
  triangles of side σ. Splat and slice by the three barycentric weights, blur by
  (1, 2, 1)/4 along the three directions. Coarse and quick: the effective kernel's variance
  is σ² on average over the positions of points and queries, but its shape depends on them.

The last two are sparse: only vertices that a point reaches are stored, in one sorted list of
codes in which a lattice direction is a constant stride. A kernel's integral is the area
of a vertex's cell; multiplied by 2πσ² over that area the sums are those of the
unnormalised kernel. A query that no vertex covers has m⁰ = 0. The filters' error is
measured by the tests and by `kernel_error`.

Sources: Adams, Baek & Davis 2010, Fast high-dimensional filtering using the
permutohedral lattice (in the plane the general construction is the triangular lattice);
Gao & Tedrake 2019, FilterReg (moments by filtering).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from solvers.core import validate
from solvers.core.arrays import FloatArray, IntArray
from solvers.numerics import gaussians

KINDS = ("exact", "grid", "lattice")

FINEST = 1e-6
"""The least σ, as a fraction of the cloud's extent, that a filter is built with."""

_REACH = 4.0  # standard deviations at which the grid's sampled Gaussian ends
_HEX = np.array([[1.0, -1.0 / np.sqrt(3.0)], [0.0, 2.0 / np.sqrt(3.0)]])  # from Cartesian to triangular coordinates


@dataclass(frozen=True, eq=False)
class FilterMoments:
    """m⁰ (m,), m¹ (m, 2) and m² (m,) at m queries, of the points y − centre: see
    `Filter.centre`.
    """

    mass: FloatArray
    first: FloatArray
    second: FloatArray


class Filter(Protocol):
    """What `build` returns. sigma: world units. centre: (2,) the origin of the moments'
    y.
    """

    @property
    def sigma(self) -> float: ...
    @property
    def centre(self) -> FloatArray: ...
    def query(self, points: FloatArray) -> FilterMoments:
        """The filtered moments at `points` (m, 2)."""


def build(kind: str, points: FloatArray, sigma: float) -> Filter:
    """A filter of the finite cloud (n, 2) with width sigma > 0, at least `FINEST` of the
    cloud's extent.

    kind: one of `KINDS`. Raises ValueError for any other and for a width that is too fine.
    """
    validate.one_of(kind, KINDS, "kind")
    centre = 0.5 * points.min(axis=0) + 0.5 * points.max(axis=0)
    centred = points - centre
    if not sigma >= least_sigma(points[None])[0]:
        raise ValueError(f"sigma: expected at least {FINEST:g} of the cloud's extent, got {sigma!r}")
    values = np.column_stack([np.ones(len(points)), centred, np.square(centred).sum(axis=1)])
    if kind == "exact":
        return Exact(sigma, centre, centred, values)
    side = 0.5 * sigma if kind == "grid" else sigma
    vertices, weights = _vertices(kind, centred / side)
    margin = _blur_reach(kind) + 2
    low, high = vertices.min(axis=(0, 1)) - margin, vertices.max(axis=(0, 1)) + margin
    width = int(high[1] - low[1] + 1)
    codes = (vertices[..., 0] - low[0]) * width + (vertices[..., 1] - low[1])
    splat_codes, at = _distinct(codes)
    spread = weights[..., None] * values[:, None, :]
    columns = [np.bincount(at.ravel(), spread[..., k].ravel(), len(splat_codes)) for k in range(values.shape[1])]
    splat = np.stack(columns, axis=1).astype(np.float64)
    area = side**2 * (1.0 if kind == "grid" else np.sqrt(0.75))
    blurred_codes: IntArray = splat_codes
    blurred: FloatArray = splat * (2.0 * np.pi * sigma**2 / area)
    for stride, kernel in _directions(kind, width):
        blurred_codes, blurred = _blur(blurred_codes, blurred, stride, kernel)
    return Sparse(kind, sigma, centre, side, low, high, splat_codes, splat, blurred_codes, blurred)


def least_sigma(points: FloatArray) -> FloatArray:
    """The least σ, (b,), that a filter of the clouds (b, n, d) may have."""
    extent = (points.max(axis=1) - points.min(axis=1)).max(axis=1)
    return np.asarray(np.maximum(FINEST * extent, 1e-140))


@dataclass(frozen=True, eq=False)
class Exact:
    """The exact sums, of the values (n, 4) at the centred points (n, 2)."""

    sigma: float
    centre: FloatArray
    points: FloatArray
    values: FloatArray

    def query(self, points: FloatArray) -> FilterMoments:
        """The moments at `points` (m, 2)."""
        with np.errstate(over="ignore"):
            rows = (points - self.centre)[None]
        return _moments(gaussians.sums(rows, self.points[None], np.array([self.sigma]), self.values[None])[0])


@dataclass(frozen=True, eq=False)
class Sparse:
    """A cloud's values on lattice vertices: m⁰, m¹ (2) and m², four columns.

    side: of the lattice, world units. low, high: (2,) the first and last vertex of its
    box. splat_codes (k,) ascending and splat (k, 4): what the points were spread to.
    codes (K,) ascending and values (K, 4): blurred.
    """

    kind: str
    sigma: float
    centre: FloatArray
    side: float
    low: IntArray
    high: IntArray
    splat_codes: IntArray
    splat: FloatArray
    codes: IntArray
    values: FloatArray

    def query(self, points: FloatArray) -> FilterMoments:
        """The moments at `points` (m, 2), interpolated between vertices."""
        with np.errstate(over="ignore"):
            scaled = (points - self.centre) / self.side
        # Beyond the box, on either side, there is nothing, however far: clip to a margin around it.
        limit = float(np.abs([self.low, self.high]).max()) * 2.0 + 8.0
        vertices, weights = _vertices(self.kind, np.clip(scaled, -limit, limit))
        inside = ((vertices >= self.low) & (vertices <= self.high)).all(axis=2)
        code = np.where(inside, self._code(vertices), 0)
        at = np.minimum(np.searchsorted(self.codes, code), len(self.codes) - 1)
        weights = np.where(inside & (self.codes[at] == code), weights, 0.0)
        return _moments(np.einsum("mk,mkc->mc", weights, self.values[at]))

    def places(self, codes: IntArray) -> FloatArray:
        """The positions of the vertices with these codes (`splat_codes` or `codes`),
        (k, 2) in world units.
        """
        width = self.high[1] - self.low[1] + 1
        at = np.stack([codes // width, codes % width], axis=-1) + self.low
        offsets = at if self.kind == "grid" else at @ np.linalg.inv(_HEX).T
        return np.asarray(self.centre + self.side * offsets)

    def _code(self, vertices: IntArray) -> IntArray:
        width = self.high[1] - self.low[1] + 1
        code: IntArray = (vertices[..., 0] - self.low[0]) * width + (vertices[..., 1] - self.low[1])
        return code


def _moments(columns: FloatArray) -> FilterMoments:
    return FilterMoments(columns[:, 0], columns[:, 1:3], columns[:, 3])


def _vertices(kind: str, points: FloatArray) -> tuple[IntArray, FloatArray]:
    """The vertices (m, k, 2) around places (m, 2) in units of the side, and their
    weights (m, k), which add up to 1.
    """
    if kind == "grid":
        nearest = np.floor(points + 0.5)
        f = points - nearest
        w = np.stack([0.5 * np.square(0.5 - f), 0.75 - np.square(f), 0.5 * np.square(0.5 + f)], axis=1)
        around = np.stack(np.meshgrid([-1, 0, 1], [-1, 0, 1], indexing="ij"), axis=-1).reshape(9, 2)
        weights = (w[:, :, None, 0] * w[:, None, :, 1]).reshape(-1, 9)
        return nearest.astype(np.int64)[:, None] + around, weights
    # Triangular coordinates: each rhombus of the lattice is two triangles, told apart
    # by the sum of the fractions.
    p = points @ _HEX.T
    corner = np.floor(p)
    f = p - corner
    upper = f.sum(axis=1) > 1.0
    g = np.where(upper[:, None], 1.0 - f[:, ::-1], f)
    first = corner.astype(np.int64) + upper[:, None]
    side = np.where(upper, -1, 1)[:, None]
    # In the upper triangle the far corner comes first, and its neighbours lie one step
    # back.
    second = first + side * np.where(upper[:, None], [0, 1], [1, 0])
    third = first + side * np.where(upper[:, None], [1, 0], [0, 1])
    weights = np.column_stack([1.0 - g.sum(axis=1), g])
    return np.stack([first, second, third], axis=1), weights


def _sampled() -> FloatArray:
    """The grid's blur: a Gaussian of variance σ² − side²/2 at multiples of the side
    σ/2, of sum 1.
    """
    variance = 4.0 - 0.5
    k = np.arange(-_blur_reach("grid"), _blur_reach("grid") + 1)
    g = np.exp(-0.5 * k**2 / variance)
    return np.asarray(g / g.sum())


def _blur_reach(kind: str) -> int:
    """The largest number of vertices that a blur reaches along one coordinate."""
    return int(np.ceil(_REACH * np.sqrt(3.5))) if kind == "grid" else 3


def _directions(kind: str, width: int) -> list[tuple[int, FloatArray]]:
    """The stride of each lattice direction in the codes, and the kernel along it."""
    if kind == "grid":
        return [(width, _sampled()), (1, _sampled())]
    binomial = np.array([0.25, 0.5, 0.25])
    return [(width, binomial), (1, binomial), (width - 1, binomial)]


def _blur(codes: IntArray, values: FloatArray, stride: int, kernel: FloatArray) -> tuple[IntArray, FloatArray]:
    """The values convolved along one direction, at all vertices that this reaches."""
    reach = len(kernel) // 2
    taps = codes + stride * np.arange(-reach, reach + 1)[:, None]
    out_codes, at = _distinct(taps)
    to = at.ravel()
    out = np.empty((len(out_codes), values.shape[1]))
    for k, column in enumerate(values.T):  # counting into bins is quicker than adding whole rows tap by tap
        out[:, k] = np.bincount(to, np.outer(kernel, column).ravel(), len(out_codes))
    return out_codes, out


def _distinct(codes: IntArray) -> tuple[IntArray, IntArray]:
    """The codes without repetition, ascending, and the index of each given one among them."""
    low = codes.min()
    span = int(codes.max() - low) + 1
    if span > 64 * codes.size:
        distinct, at = np.unique(codes, return_inverse=True)
        return distinct, at.reshape(codes.shape).astype(np.int64, copy=False)
    # A table of the whole box is ten times quicker than sorting, if it is not much larger
    # than its contents.
    present = np.zeros(span, dtype=np.bool_)
    present[codes - low] = True
    return np.flatnonzero(present) + low, (np.cumsum(present) - 1)[codes - low]


def kernel_error(kind: str, sigma: float = 1.0, seed: int = 0, samples: int = 1000) -> tuple[float, float]:
    """Measure how far a filter's m⁰ of one point is from `exp(−r²/2σ²)`: the largest and
    the root mean square difference, over `samples` random places of point and query that
    lie within 4 σ of each other in both coordinates.
    """
    rng = np.random.default_rng(seed)
    # A second point, out of reach, moves the lattice's origin off the first, which must
    # not always lie on a vertex.
    pairs = rng.uniform(-0.5, 0.5, (samples // 20, 2, 2)) + np.array([[0.0, 0.0], [70.0, 90.0]])
    queries = pairs[:, :1] + rng.uniform(-4.0, 4.0, (samples // 20, 20, 2))
    mass = np.stack([build(kind, sigma * p, sigma).query(sigma * q).mass for p, q in zip(pairs, queries, strict=True)])
    error = mass - np.exp(-0.5 * np.square(queries - pairs[:, :1]).sum(axis=2))
    return float(np.abs(error).max()), float(np.sqrt(np.square(error).mean()))
