"""Objectives over a grid of translations, the rotation held, and the translation-only
paths that descend on them.

Two objectives of `t`, for a source already turned, `x_i = R p_i`:

- MMD: `‖mean φ(x + t) − mean φ(y)‖²` with the features of `solvers.features`. A
  translation multiplies each frequency's complex mean by a phase, `a_k e^{iω_kᵀt}`, and
  the phase of a grid is a product of its columns' and its rows': the whole map is one
  product of three small matrices, whatever the number of points.
- capped nearest neighbour: `(1/M) Σ_i min(min_j ‖x_i + t − y_j‖², τ²)`, M the number of
  all source points. Which target points can be nearest anywhere within a small square
  is found once (`CappedField`); a query looks only at those.

The paths: `mmd_path` takes Levenberg-Marquardt steps in t. `nearest_path` moves by the
mean offset of the pairs within τ, which is a descent step for the capped objective
itself: with the pairs and the set fixed the mean is the best translation for the sum
over the set, and pairing anew, each point taking the smaller of its distance and τ,
lowers it again. Neither surface is convex.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from solvers.core import validate
from solvers.core.arrays import FloatArray, IntArray, StatusArray
from solvers.core.status import Status, statuses
from solvers.numerics.fourier_features import mean_features

_BLOCK = 2**15


@dataclass(frozen=True, eq=False)
class Path:
    """The courses of translation-only runs from given starts of shape (..., 2).

    points: (k + 1, ..., 2) translations from the start to the last, world units; a run
    that stopped earlier repeats its last. objective: (k + 1, ...), at them. steps:
    (...) taken. status: (...): converged, stalled (no step lowers the objective),
    capped, or degenerate (no point within reach).
    """

    points: FloatArray
    objective: FloatArray
    steps: IntArray
    status: StatusArray


def _one_cloud(points: ArrayLike, name: str) -> FloatArray:
    p = validate.cloud(points, name, 2)
    if p.ndim != 2:
        raise ValueError(f"{name}: expected one cloud of shape (n, 2), got {p.shape}")
    return p


def _axis(values: ArrayLike, name: str) -> FloatArray:
    return validate.cloud(np.asarray(values, dtype=np.float64)[..., None] * np.ones(2), name)[:, 0]


@dataclass(frozen=True, eq=False)
class MmdField:
    """The MMD objective as a function of the translation: `‖a_k e^{iω_kᵀt} − b_k‖²`.
    Make it by `mmd_field`.

    frequencies: (D, 2) in radians per unit; moving, fixed: (D,) the complex mean
    features at t = 0, with 1/√D in them.
    """

    frequencies: FloatArray
    moving: FloatArray
    fixed: FloatArray

    def values(self, t: ArrayLike) -> FloatArray:
        """The objective at translations (..., 2): (...)."""
        value: FloatArray = np.square(np.abs(self._residual(np.asarray(t, dtype=np.float64)))).sum(axis=-1)
        return value[()]

    def grid(self, xs: ArrayLike, ys: ArrayLike) -> FloatArray:
        """The objective at all (xs[i], ys[j]): (len(ys), len(xs)), rows being y."""
        x, y = _axis(xs, "xs"), _axis(ys, "ys")
        across, up = (np.exp(1j * np.outer(v, w)) for v, w in zip((x, y), self.frequencies.T, strict=True))
        up *= self.moving * np.conj(self.fixed)
        # The real part by two real products: small ones stay on one thread, which on a
        # busy machine is not a detail.
        cross = up.real @ across.real.T - up.imag @ across.imag.T
        level = np.square(np.abs(self.moving)).sum() + np.square(np.abs(self.fixed)).sum()
        grid: FloatArray = np.maximum(level - 2.0 * cross, 0.0)
        return grid

    def path(
        self, start: ArrayLike, *, max_steps: int = 70, tolerance: float = 1e-6, damping: float = 1e-3
    ) -> Path:
        """Levenberg-Marquardt in t from starts (..., 2); a step is accepted only if it
        lowers the objective, and is at most one over the root mean square frequency
        (one length scale) long.

        It converges when a step is at most `tolerance` (world units) long; it stalls
        after eight refused steps.
        """
        t = _starts(start)
        shape, t = t.shape[:-1], t.reshape(-1, 2)
        # In units of one over the largest frequency, so that nothing overflows.
        unit = 1.0 / max(float(np.abs(self.frequencies).max()), 1e-300)
        w = self.frequencies * unit
        reach = 1.0 / max(float(np.sqrt(np.square(w).mean())), 1e-300)
        value, lam = self.values(t), np.full(len(t), damping)
        status, refused = statuses((len(t),)), np.zeros(len(t), dtype=np.int64)
        steps = np.zeros(len(t), dtype=np.int64)
        course, level = [t], [value]
        while (status == Status.RUNNING).any() and len(course) <= max_steps:
            r = self._residual(t)
            J = 1j * (r + self.fixed)[..., None] * w
            H, g = np.real(np.conj(J).swapaxes(1, 2) @ J), np.real(np.einsum("skd,sk->sd", np.conj(J), r))
            top = np.maximum(np.trace(H, axis1=1, axis2=2), np.finfo(np.float64).tiny)
            move = -np.linalg.solve(H + (np.maximum(lam, 1e-12) * top)[:, None, None] * np.eye(2), g[..., None])[..., 0]
            length = np.linalg.norm(move, axis=1)
            move *= np.minimum(1.0, reach / np.maximum(length, 1e-300))[:, None]
            running = status == Status.RUNNING
            length = np.minimum(length, reach) * unit
            trial = t + unit * move
            new = self.values(trial)
            won = running & (new < value)
            t, value = np.where(won[:, None], trial, t), np.where(won, new, value)
            lam = np.where(won, np.maximum(0.2 * lam, 1e-9), 8.0 * lam)
            refused = np.where(won, 0, refused + 1)
            steps += running
            status = np.where(running & (length <= tolerance), np.int8(Status.CONVERGED), status)
            status = np.where((status == Status.RUNNING) & (refused >= 8), np.int8(Status.STALLED), status)
            course.append(t)
            level.append(value)
        return _path(course, level, steps, status, shape)

    def _residual(self, t: FloatArray) -> FloatArray:
        residual: FloatArray = self.moving * np.exp(1j * (t @ self.frequencies.T)) - self.fixed
        return residual


def mmd_field(turned: ArrayLike, target: ArrayLike, frequencies: ArrayLike) -> MmdField:
    """The MMD objective over translations of `turned` (m, 2), the rotated source,
    against `target` (n, 2), with frequencies (D, 2) in radians per unit (unit
    frequencies over ℓ). Raises ValueError for what is not a planar cloud.
    """
    p, q, w = _one_cloud(turned, "turned"), _one_cloud(target, "target"), _one_cloud(frequencies, "frequencies")
    D = len(w)
    means = (mean_features(x[None], w[None])[0] for x in (p, q))
    moving, fixed = (mean[:D] + 1j * mean[D:] for mean in means)
    return MmdField(w, moving, fixed)


@dataclass(frozen=True, eq=False)
class CappedField:
    """The capped nearest-neighbour objective as a function of the translation. Make it
    by `capped_field`.

    turned: (m, 2); target: (n, 2); cap: τ, world units. The plane around the target is
    divided into squares of side `side` from `corner`, `shape` of them (columns, rows);
    `candidates` (squares + 1, k) holds, square by square, the target rows that can be
    nearest to a point of it and within the cap, padded by n; the last row stands for
    the outside, which the cap keeps away from all. By the triangle inequality a
    candidate is no farther from the middle than the nearest is, plus the diagonal.
    """

    turned: FloatArray
    target: FloatArray
    cap: float
    corner: FloatArray
    side: float
    shape: tuple[int, int]
    candidates: IntArray

    def nearest(self, x: FloatArray, y: FloatArray) -> tuple[IntArray, FloatArray]:
        """The target row nearest to each point (x, y), (k,) both, and
        `min(min_j ‖x − y_j‖², τ²)`, (k,). Of equally near rows it is the lowest; n, the
        number of target points, where none lies within the cap.
        """
        n = len(self.target)
        with np.errstate(over="ignore", invalid="ignore"):
            column, row = np.floor((x - self.corner[0]) / self.side), np.floor((y - self.corner[1]) / self.side)
            inside = (column >= 0.0) & (column < self.shape[0]) & (row >= 0.0) & (row < self.shape[1])
            place = np.where(inside, row * self.shape[0] + column, len(self.candidates) - 1).astype(np.int64)
        best, who = np.full(len(x), np.square(self.cap)), np.full(len(x), n, dtype=np.int64)
        left = np.arange(len(x))
        qx, qy = np.append(self.target[:, 0], np.inf), np.append(self.target[:, 1], np.inf)
        for k in range(self.candidates.shape[1]):
            # Candidates come first, padding after: a point that has no more of them is
            # done.
            near = self.candidates[place, k]
            more = np.flatnonzero(near < n)
            if 2 * more.size < near.size:
                left, place, near, x, y = left[more], place[more], near[more], x[more], y[more]
                if not left.size:
                    break
            dx, dy = x - qx[near], y - qy[near]
            dx *= dx
            dy *= dy
            dx += dy
            closer = np.flatnonzero((dx < best[left]) | ((dx == best[left]) & (who[left] == n) & (near < n)))
            best[left[closer]], who[left[closer]] = dx[closer], near[closer]
        return who, best

    def values(self, t: ArrayLike) -> FloatArray:
        """The objective at translations (..., 2): (...)."""
        moves = np.asarray(t, dtype=np.float64)
        flat = moves.reshape(-1, 2)
        total = np.empty(len(flat))
        size = max(1, _BLOCK // len(self.turned))
        for i in range(0, len(flat), size):
            total[i : i + size] = self._pairs(flat[i : i + size])[1].mean(axis=1)
        return total.reshape(moves.shape[:-1])[()]

    def grid(self, xs: ArrayLike, ys: ArrayLike) -> FloatArray:
        """The objective at all (xs[i], ys[j]): (len(ys), len(xs)), rows being y. Some
        rows at a time make a map that refines as it goes.
        """
        x, y = _axis(xs, "xs"), _axis(ys, "ys")
        return self.values(np.stack(np.broadcast_arrays(x[None, :], y[:, None]), axis=-1))

    def path(self, start: ArrayLike, *, max_steps: int = 70, tolerance: float = 1e-6) -> Path:
        """Gated ICP in t from starts (..., 2): each step the mean offset of the pairs
        within the cap. The capped objective never rises. It converges when a step is at
        most `tolerance` (world units) long, and is degenerate where no pair is within
        the cap.
        """
        t = _starts(start)
        shape, t = t.shape[:-1], t.reshape(-1, 2)
        n, s = len(self.target), len(t)
        status, steps = statuses((s,)), np.zeros(s, dtype=np.int64)
        who, squares = self._pairs(t)
        value = squares.mean(axis=1)
        course, level = [t], [value]
        going = np.arange(s)
        while going.size and len(course) <= max_steps:
            used = who < n
            reached = used.any(axis=1)
            status[going[~reached]] = Status.DEGENERATE
            going, used, who = going[reached], used[reached], who[reached]
            if not going.size:
                break
            offset = self.target[np.where(used, who, 0)] - self.turned - t[going, None]
            move = np.where(used[..., None], offset, 0.0).sum(axis=1) / used.sum(axis=1)[:, None]
            t, value = t.copy(), value.copy()
            t[going] += move
            who, squares = self._pairs(t[going])
            value[going] = squares.mean(axis=1)
            steps[going] += 1
            course.append(t)
            level.append(value)
            still = np.linalg.norm(move, axis=1) <= tolerance
            status[going[still]] = Status.CONVERGED
            going, who = going[~still], who[~still]
        return _path(course, level, steps, status, shape)

    def _pairs(self, t: FloatArray) -> tuple[IntArray, FloatArray]:
        """Nearest rows and capped squares of the cloud at translations t (s, 2): (s, m)
        both.
        """
        moved = t[:, None] + self.turned
        who, squares = self.nearest(moved[..., 0].ravel(), moved[..., 1].ravel())
        return who.reshape(moved.shape[:-1]), squares.reshape(moved.shape[:-1])


def capped_field(turned: ArrayLike, target: ArrayLike, cap: float, *, squares: int = 2**13) -> CappedField:
    """The capped nearest-neighbour objective over translations of `turned` (m, 2), the
    rotated source, against `target` (n, 2), with the cap τ in world units.

    squares: about how many the plane is divided into; fewer take less to make and each
    query longer, the values are the same. Raises ValueError for what is not a planar
    cloud, a cap that is not positive, a count below one.
    """
    p, q = _one_cloud(turned, "turned"), _one_cloud(target, "target")
    tau = validate.number(cap, "cap", 1e-100, 1e100)
    most = validate.count(squares, "squares", 1)
    with np.errstate(over="ignore", under="ignore"):
        low, high = q.min(axis=0), q.max(axis=0)
        reach = min(tau, float((high - low).max()) + tau)
        wide = high - low + 2.0 * reach
        # Squares about as small as the points are apart: few candidates each, and not
        # too many squares.
        side = max(float(np.sqrt(wide[0] * wide[1] / most)), float(wide.max()) / most)
    columns, rows = (max(1, int(np.ceil(w / side))) for w in wide)
    corner = low - reach
    x, y = corner[0] + (np.arange(columns) + 0.5) * side, corner[1] + (np.arange(rows) + 0.5) * side
    middles = np.stack(np.broadcast_arrays(x[None, :], y[:, None]), axis=-1).reshape(-1, 2)
    half = 0.5 * np.sqrt(2.0) * side * (1.0 + 1e-9)
    found: list[IntArray] = []
    size = max(1, 2**18 // len(q))
    for i in range(0, len(middles), size):
        part = middles[i : i + size]
        d = np.sqrt(np.square(part[:, None, 0] - q[:, 0]) + np.square(part[:, None, 1] - q[:, 1]))
        able = (d <= d.min(axis=1, keepdims=True) + 2.0 * half) & (d <= tau + half)
        count = able.sum(axis=1)
        square, row = np.nonzero(able)
        listed = np.full((len(part), max(1, int(count.max()))), len(q), dtype=np.int64)
        listed[square, np.arange(len(row)) - np.repeat(np.cumsum(count) - count, count)] = row
        found.append(listed)
    candidates = np.full((len(middles) + 1, max(x.shape[1] for x in found)), len(q), dtype=np.int64)
    done = 0
    for listed in found:
        candidates[done : done + len(listed), : listed.shape[1]] = listed
        done += len(listed)
    return CappedField(p, q, tau, corner, side, (columns, rows), candidates)


def _starts(start: ArrayLike) -> FloatArray:
    t = np.asarray(start, dtype=np.float64)
    if t.ndim < 1 or t.shape[-1] != 2 or not np.isfinite(t).all():
        raise ValueError(f"start: expected finite translations of shape (..., 2), got {start!r}")
    return t


def _path(
    course: list[FloatArray], level: list[FloatArray], steps: IntArray, status: StatusArray, shape: tuple[int, ...]
) -> Path:
    status = np.where(status == Status.RUNNING, np.int8(Status.CAPPED), status)
    return Path(
        np.stack(course).reshape(-1, *shape, 2),
        np.stack(level).reshape(-1, *shape),
        steps.reshape(shape),
        status.reshape(shape),
    )
