"""The MMD objective over a grid of translations at a fixed rotation, and the translation-only paths that descend it.

`‖mean φ(x + t) − mean φ(y)‖²` with the features of `solvers.features`, for a source already turned, `x_i = R p_i`. A
translation multiplies each frequency's complex mean by a phase, `a_k e^{iω_kᵀt}`, and a grid's phases are the product
of its columns' and its rows' phases. The whole map is one product of three small matrices, whatever the number of
points.

The paths take Levenberg-Marquardt steps in t. The surface is not convex. `capped_landscape` does the same for the
capped nearest-neighbour objective.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from solvers.core import validate
from solvers.core.arrays import FloatArray, IntArray, StatusArray
from solvers.core.brief import brief
from solvers.core.kinds import shown
from solvers.core.numbers import moderate, numbers
from solvers.core.status import Status, statuses
from solvers.numerics.fourier_features import mean_features


@dataclass(frozen=True, eq=False)
class Path:
    """The paths of translation-only runs from given starts of shape (..., 2).

    Attributes
    ----------
    points : ndarray of shape (k + 1, ..., 2)
        Translations from the first to the last, world units; a run that stopped earlier
        repeats its last one.
    objective : ndarray of shape (k + 1, ...)
        The objective there.
    steps : ndarray of int, shape (...)
        The steps tried, refused ones included.
    status : ndarray of int8, shape (...)
        Converged, stalled (no step lowers the objective), capped, or degenerate (no
        point within reach).

    Examples
    --------
    >>> import numpy as np
    >>> from solvers.landscape import capped_field
    >>> corners = np.array([[0.0, 0.0], [2.0, 0.0], [2.0, 1.0]])
    >>> path = capped_field(corners, corners + 0.25, 1.0).path([[0.0, 0.0], [9.0, 9.0]])
    >>> path.points[-1].round(6), path.steps
    (array([[0.25, 0.25],
           [9.  , 9.  ]]), array([2, 0]))
    """

    points: FloatArray
    objective: FloatArray
    steps: IntArray
    status: StatusArray

    __repr__ = brief


def one_cloud(points: ArrayLike, name: str) -> FloatArray:
    """A single planar cloud (n, 2), copied so that later changes by the caller have no effect; else a ValueError that
    names it.
    """
    p = validate.cloud(points, name, 2)
    if p.ndim != 2:
        raise ValueError(f"{name}: expected one cloud of shape (n, 2), got {p.shape}")
    return np.array(p, order="C")


def axis(values: ArrayLike, name: str) -> FloatArray:
    """The coordinates (k,) of a grid's columns or rows, at least one and all finite."""
    a = moderate(numbers(values, name), name)
    if a.ndim != 1 or not a.size:
        raise ValueError(f"{name}: expected a row of at least one number, got shape {a.shape}")
    return a


@dataclass(frozen=True, eq=False)
class MmdField:
    """The MMD objective as a function of the translation: `‖a_k e^{iω_kᵀt} − b_k‖²`.

    Make it by `mmd_field`.

    Attributes
    ----------
    frequencies : ndarray of shape (D, 2)
        ω_k, radians per unit.
    moving : ndarray of complex, shape (D,)
        a_k, the source's mean features at t = 0, including the factor 1/√D.
    fixed : ndarray of complex, shape (D,)
        b_k, the target's.

    Examples
    --------
    >>> import numpy as np
    >>> from solvers.landscape import mmd_field
    >>> corners = np.array([[0.0, 0.0], [2.0, 0.0], [2.0, 1.0]])
    >>> field = mmd_field(corners, corners + 0.25, [[1.0, 0.0], [0.0, 1.0]])
    >>> field.values([0.25, 0.25]).round(6), field.grid([-0.5, 0.25, 1.0], [0.25]).argmin()
    (np.float64(0.0), np.int64(1))
    >>> field.path([0.0, 0.0]).points[-1].round(4)
    array([0.25, 0.25])
    """

    frequencies: FloatArray
    moving: FloatArray
    fixed: FloatArray

    __repr__ = brief

    def values(self, t: ArrayLike) -> FloatArray:
        """The objective at translations.

        Parameters
        ----------
        t : array_like of shape (..., 2)
            World units.

        Returns
        -------
        ndarray of shape (...)
            Dimensionless.

        Raises
        ------
        ValueError
            If `t` is not finite or not of that shape.
        """
        return self._values(translations(t, "t"))[()]

    def grid(self, xs: ArrayLike, ys: ArrayLike) -> FloatArray:
        """The objective at all (xs[i], ys[j]).

        Parameters
        ----------
        xs : array_like of shape (c,)
            World units.
        ys : array_like of shape (r,)
            World units.

        Returns
        -------
        ndarray of shape (r, c)
            Dimensionless. Rows are y.

        Raises
        ------
        ValueError
            If `xs` or `ys` is not a row, is empty or not finite.
        """
        x, y = axis(xs, "xs"), axis(ys, "ys")
        across, up = (np.exp(1j * np.outer(v, w)) for v, w in zip((x, y), self.frequencies.T, strict=True))
        up *= self.moving * np.conj(self.fixed)
        # Take the real part by two real products: small ones stay on one thread, which matters on a busy machine.
        cross = up.real @ across.real.T - up.imag @ across.imag.T
        level = np.square(np.abs(self.moving)).sum() + np.square(np.abs(self.fixed)).sum()
        grid: FloatArray = np.maximum(level - 2.0 * cross, 0.0)
        return grid

    def path(
        self, start: ArrayLike, *, max_steps: int = 70, tolerance: float = 1e-6, damping: float = 1e-3
    ) -> Path:
        """Levenberg-Marquardt in t from given starts.

        A step is accepted only if it lowers the objective, and is at most one over the
        root mean square frequency (one length scale) long. A run stalls after eight
        refused steps in a row.

        Parameters
        ----------
        start : array_like of shape (..., 2)
            Translations, world units.
        max_steps : int, default 70
            The most steps.
        tolerance : float, default 1e-6
            World units. A run converges when a step is at most so long.
        damping : float, default 1e-3
            The first step's λ, as a fraction of the Hessian's trace.

        Returns
        -------
        Path
            The paths, one per start.

        Raises
        ------
        ValueError
            If `start` is not finite or not of that shape, or another argument is
            negative or not finite.
        """
        t = translations(start, "start")
        validate.count(max_steps, "max_steps")
        for name, number in (("tolerance", tolerance), ("damping", damping)):
            validate.number(number, name, 0.0)
        shape, t = t.shape[:-1], t.reshape(-1, 2)
        # In units of the inverse of the largest frequency, so that nothing overflows.
        unit = 1.0 / max(float(np.abs(self.frequencies).max()), 1e-300)
        w = self.frequencies * unit
        reach = 1.0 / max(float(np.sqrt(np.square(w).mean())), 1e-300)
        value, lam = self._values(t), np.full(len(t), damping)
        status, refusals = statuses((len(t),)), np.zeros(len(t), dtype=np.int64)
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
            new = self._values(trial)
            improved = running & (new < value)
            t, value = np.where(improved[:, None], trial, t), np.where(improved, new, value)
            lam = np.where(improved, np.maximum(0.2 * lam, 1e-9), 8.0 * lam)
            refusals = np.where(improved, 0, refusals + 1)
            steps += running
            status = np.where(running & (length <= tolerance), np.int8(Status.CONVERGED), status)
            status = np.where((status == Status.RUNNING) & (refusals >= 8), np.int8(Status.STALLED), status)
            course.append(t)
            level.append(value)
        return course_of(course, level, steps, status, shape)

    def _values(self, t: FloatArray) -> FloatArray:
        value: FloatArray = np.square(np.abs(self._residual(t))).sum(axis=-1)
        return value

    def _residual(self, t: FloatArray) -> FloatArray:
        residual: FloatArray = self.moving * np.exp(1j * (t @ self.frequencies.T)) - self.fixed
        return residual


def mmd_field(turned: ArrayLike, target: ArrayLike, frequencies: ArrayLike) -> MmdField:
    """The MMD objective over the translations of a rotated source.

    Parameters
    ----------
    turned : array_like of shape (m, 2)
        The source, turned beforehand, in world units.
    target : array_like of shape (n, 2)
        The cloud that stays.
    frequencies : array_like of shape (D, 2)
        ω_k in radians per unit: those of `solvers.features.unit_frequencies` over ℓ.

    Returns
    -------
    MmdField
        The objective.

    Raises
    ------
    ValueError
        If one of the three is not a single cloud of planar points.

    Examples
    --------
    >>> import numpy as np
    >>> from solvers.features import unit_frequencies
    >>> from solvers.landscape import mmd_field
    >>> from solvers.scenes import room
    >>> scene = room("clean")
    >>> frequencies = unit_frequencies(np.array([40]), 32, 2)[0] / 0.8
    >>> field = mmd_field(scene.source, scene.target, frequencies)
    >>> field.grid([-1.0, 0.0, 1.0], [0.0, 0.5]).argmin()
    np.int64(1)
    >>> path = field.path([[0.4, -0.3], [3.0, 3.0]])
    >>> path.points.shape[1:], path.steps.shape
    ((2, 2), (2,))
    """
    p, q, w = one_cloud(turned, "turned"), one_cloud(target, "target"), one_cloud(frequencies, "frequencies")
    D = len(w)
    means = (mean_features(x[None], w[None])[0] for x in (p, q))
    moving, fixed = (mean[:D] + 1j * mean[D:] for mean in means)
    return MmdField(w, moving, fixed)


def translations(values: ArrayLike, name: str) -> FloatArray:
    """Finite translations (..., 2); else a ValueError that names the argument."""
    t = numbers(values, name)
    if t.ndim < 1 or t.shape[-1] != 2 or not np.isfinite(t).all():
        raise ValueError(f"{name}: expected finite translations of shape (..., 2), got {shown(values)}")
    return t


def course_of(
    course: list[FloatArray], level: list[FloatArray], steps: IntArray, status: StatusArray, shape: tuple[int, ...]
) -> Path:
    """The path of s starts, from lists with one entry per step, in the shape of the starts; runs not yet ended are
    capped.
    """
    status = np.where(status == Status.RUNNING, np.int8(Status.CAPPED), status)
    return Path(
        np.stack(course).reshape(len(course), *shape, 2),
        np.stack(level).reshape(len(level), *shape),
        steps.reshape(shape),
        status.reshape(shape),
    )
