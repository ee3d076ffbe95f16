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

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Protocol

import numpy as np

from solvers.core import validate
from solvers.core.arrays import FloatArray, IntArray
from solvers.numerics import gaussians

KINDS = ("exact", "grid", "lattice")

FINEST = 1e-6
"""The least σ, as a fraction of the cloud's extent, that a filter is built with."""

_AROUND = {"grid": 9, "lattice": 3}  # the vertices that a point is spread to
_BLOCK = 2**14  # the most numbers that clouds are spread into at a time, unless one cloud is more
_REACH = 4.0  # standard deviations at which the grid's sampled Gaussian ends
_HEX = 1.0 / np.sqrt(3.0)  # triangular coordinates of (x, y): (x − y/√3, 2y/√3)


@dataclass(frozen=True, eq=False)
class FilterMoments:
    """m⁰ (…, m), m¹ (…, m, 2) and m² (…, m) at m queries, of the points y − centre: see
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
    return build_each(kind, points[None], np.array([sigma]))[0]


def build_each(kind: str, points: FloatArray, sigma: FloatArray) -> list[Filter]:
    """A filter for each of the clouds (b, n, 2) with its width (b,): what `build` gives,
    in fewer calls.
    """
    validate.one_of(kind, KINDS, "kind")
    fine = ~(sigma >= least_sigma(points))
    if fine.any():
        raise ValueError(f"sigma: expected at least {FINEST:g} of the cloud's extent, got {float(sigma[fine][0])!r}")
    centre = 0.5 * points.min(axis=1) + 0.5 * points.max(axis=1)
    centred = points - centre[:, None]
    squares = np.square(centred).sum(axis=2, keepdims=True)
    values = np.concatenate([np.ones_like(squares), centred, squares], axis=2)
    if kind == "exact":
        clouds = zip(sigma.tolist(), centre, centred, values, strict=True)
        return [Exact(*cloud) for cloud in clouds]
    b, n, columns = values.shape
    groups = _groups(b, n * _AROUND[kind] * columns)
    return [each for group in groups for each in _build_sparse(kind, sigma[group], centre[group], values[group])]


def query_each(filters: Sequence[Filter], points: FloatArray) -> FilterMoments:
    """The moments at points (b, m, 2) of b filters of one kind, one for each row of
    points: what `query` gives, with a leading axis, in fewer calls.
    """
    centre = np.stack([each.centre for each in filters])[:, None]
    exact = [each for each in filters if isinstance(each, Exact)]
    with np.errstate(over="ignore"):
        offsets = points - centre
        if exact:
            clouds, values = np.stack([e.points for e in exact]), np.stack([e.values for e in exact])
            return _moments(gaussians.sums(offsets, clouds, np.array([e.sigma for e in exact]), values))
        sparse = [each for each in filters if isinstance(each, Sparse)]
        scaled = offsets / np.array([each.side for each in sparse])[:, None, None]
    b, m, _ = points.shape
    groups = _groups(b, m * _AROUND[sparse[0].kind] * 4)
    return _moments(np.concatenate([_slice(sparse[group], scaled[group]) for group in groups]))


def _groups(b: int, numbers: int) -> list[slice]:
    """Slices of b problems that together take about `_BLOCK` numbers, each of them `numbers`."""
    size = max(1, _BLOCK // numbers)
    return [slice(first, first + size) for first in range(0, b, size)]


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
        return _query_one(self, points)


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
        return _query_one(self, points)

    def places(self, codes: IntArray) -> FloatArray:
        """The positions of the vertices with these codes (`splat_codes` or `codes`),
        (k, 2) in world units.
        """
        width = self.high[1] - self.low[1] + 1
        at = np.stack([codes // width, codes % width], axis=-1) + self.low
        offsets = at if self.kind == "grid" else at @ np.array([[1.0, 0.0], [0.5, np.sqrt(0.75)]])
        return np.asarray(self.centre + self.side * offsets)


def _query_one(filter: Filter, points: FloatArray) -> FilterMoments:
    every = query_each([filter], points[None])
    return FilterMoments(every.mass[0], every.first[0], every.second[0])


def _moments(columns: FloatArray) -> FilterMoments:
    return FilterMoments(columns[..., 0], columns[..., 1:3], columns[..., 3])


@dataclass(frozen=True, eq=False)
class _Boxes:
    """The vertices of b lattices in one list of codes, box after box. low, high: (2, b)
    the first and last vertex of each.
    """

    low: IntArray
    high: IntArray

    @property
    def width(self) -> IntArray:
        """(b,) the stride in the codes of a step along the first coordinate."""
        width: IntArray = self.high[1] - self.low[1] + 1
        return width

    @property
    def edges(self) -> IntArray:
        """(b + 1,) the first code of each box, and the end of the last."""
        sizes = (self.high[0] - self.low[0] + 1) * self.width
        return np.concatenate([[0], np.cumsum(sizes)])

    def code(self, vertices: IntArray) -> IntArray:
        """The codes (b, m, k) of vertices (2, b, m, k), each in its row's box."""
        u, v = vertices - self.low[..., None, None]
        code: IntArray = u * self.width[:, None, None] + v + self.edges[:-1, None, None]
        return code


def _build_sparse(kind: str, sigma: FloatArray, centre: FloatArray, values: FloatArray) -> list[Sparse]:
    """The filters of b clouds, with the values (b, n, 4) at their points."""
    side = 0.5 * sigma if kind == "grid" else sigma
    vertices, weights = _vertices(kind, values[..., 1:3] / side[:, None, None])
    margin = _blur_reach(kind) + 2
    boxes = _Boxes(vertices.min(axis=(2, 3)) - margin, vertices.max(axis=(2, 3)) + margin)
    edges = boxes.edges
    splat_codes, at = _distinct(boxes.code(vertices))
    columns = (weights * column[..., None] for column in np.moveaxis(values, 2, 0))
    splat: FloatArray = np.stack(
        [np.bincount(at.ravel(), column.ravel(), len(splat_codes)) for column in columns], dtype=np.float64
    )
    splat_ends = np.searchsorted(splat_codes, edges)
    area = side**2 * (1.0 if kind == "grid" else np.sqrt(0.75))
    codes: IntArray = splat_codes
    blurred: FloatArray = splat * np.repeat(2.0 * np.pi * sigma**2 / area, np.diff(splat_ends))
    for stride, kernel in _directions(kind, boxes.width):
        each = np.repeat(stride, np.diff(np.searchsorted(codes, edges)))
        codes, blurred = _blur(codes, blurred, each, kernel)
    ends = np.searchsorted(codes, edges)
    return [
        Sparse(
            kind, float(sigma[i]), centre[i], float(side[i]), boxes.low[:, i], boxes.high[:, i],
            splat_codes[before] - edges[i], splat[:, before].T.copy(), codes[after] - edges[i],
            blurred[:, after].T.copy(),
        )
        for i, (before, after) in enumerate(zip(_slices(splat_ends), _slices(ends), strict=True))
    ]  # fmt: skip


def _slices(ends: IntArray) -> list[slice]:
    return [slice(*pair) for pair in pairwise(ends.tolist())]


def _slice(filters: Sequence[Sparse], scaled: FloatArray) -> FloatArray:
    """The four columns (b, m, 4) at places (b, m, 2) in units of each filter's side."""
    boxes = _Boxes(np.stack([each.low for each in filters], axis=1), np.stack([each.high for each in filters], axis=1))
    low, high = boxes.low[..., None, None], boxes.high[..., None, None]
    # Beyond the box, on either side, there is nothing, however far: clip to a margin around it.
    limit = np.maximum(np.abs(low), np.abs(high)).max(axis=0) * 2.0 + 8.0
    vertices, weights = _vertices(filters[0].kind, np.clip(scaled, -limit, limit))
    within = (vertices >= low) & (vertices <= high)
    inside = within[0] & within[1]
    code = np.where(inside, boxes.code(vertices), 0)
    codes = np.concatenate([each.codes + first for each, first in zip(filters, boxes.edges, strict=False)])
    values = np.concatenate([each.values for each in filters])
    at = np.minimum(np.searchsorted(codes, code), len(codes) - 1)
    weights = np.where(inside & (codes[at] == code), weights, 0.0)
    return np.asarray(np.einsum("bmk,bmkc->bmc", weights, values[at]))


def _vertices(kind: str, points: FloatArray) -> tuple[IntArray, FloatArray]:
    """The vertices (2, b, m, k) around places (b, m, 2) in units of the side, and their
    weights (b, m, k), which add up to 1.
    """
    x, y = points[..., 0], points[..., 1]
    if kind == "grid":
        places = np.stack([x, y])
        nearest = np.floor(places + 0.5)
        f = places - nearest
        w = np.stack([0.5 * np.square(0.5 - f), 0.75 - np.square(f), 0.5 * np.square(0.5 + f)], axis=-1)
        around = np.stack(np.meshgrid([-1, 0, 1], [-1, 0, 1], indexing="ij")).reshape(2, 1, 1, 9)
        weights = (w[0][..., :, None] * w[1][..., None, :]).reshape(*x.shape, 9)
        return nearest.astype(np.int64)[..., None] + around, weights
    # Triangular coordinates: each rhombus of the lattice is two triangles, told apart
    # by the sum of the fractions.
    p = np.stack([x - _HEX * y, 2.0 * _HEX * y])
    corner = np.floor(p)
    f = p - corner
    upper = f[0] + f[1] > 1.0
    g = np.where(upper, 1.0 - f[::-1], f)
    first = corner.astype(np.int64) + upper
    side = np.where(upper, -1, 1)
    along_x, along_y = np.array([side * ~upper, side * upper]), np.array([side * upper, side * ~upper])
    # In the upper triangle the far corner comes first, and its neighbours lie one step
    # back.
    weights = np.stack([1.0 - (g[0] + g[1]), g[0], g[1]], axis=-1)
    return np.stack([first, first + along_x, first + along_y], axis=-1), weights


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


def _directions(kind: str, width: IntArray) -> list[tuple[IntArray, FloatArray]]:
    """The strides (b,) of each lattice direction in the codes, and the kernel along it."""
    one = np.ones_like(width)
    if kind == "grid":
        return [(width, _sampled()), (one, _sampled())]
    binomial = np.array([0.25, 0.5, 0.25])
    return [(width, binomial), (one, binomial), (width - 1, binomial)]


def _blur(codes: IntArray, columns: FloatArray, stride: IntArray, kernel: FloatArray) -> tuple[IntArray, FloatArray]:
    """The columns (4, k) convolved along one direction, of each vertex's stride (k,), at
    all vertices that this reaches.
    """
    reach = len(kernel) // 2
    out_codes, at = _distinct(codes + stride * np.arange(-reach, reach + 1)[:, None])
    to = at.ravel()
    # Counting into bins is quicker than adding whole rows tap by tap.
    out = [np.bincount(to, np.outer(kernel, column).ravel(), len(out_codes)) for column in columns]
    return out_codes, np.stack(out)


def _distinct(codes: IntArray) -> tuple[IntArray, IntArray]:
    """The codes without repetition, ascending, and the index of each given one among them."""
    low = codes.min()
    span = int(codes.max() - low) + 1
    if span > 64 * codes.size:
        distinct, at = np.unique(codes, return_inverse=True)
        return distinct, at.reshape(codes.shape).astype(np.int64, copy=False)
    # A table of the whole box is ten times quicker than sorting, if it is not much larger
    # than its contents.
    offsets = codes - low
    present = np.zeros(span, dtype=np.bool_)
    present[offsets] = True
    distinct = np.flatnonzero(present)
    index = np.empty(span, dtype=np.int64)  # read only where it is written
    index[distinct] = np.arange(len(distinct))
    return distinct + low, index[offsets]


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
