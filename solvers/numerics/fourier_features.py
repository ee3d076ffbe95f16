"""Random Fourier features: a cloud as a short vector, its mean feature, which changes
smoothly with a rigid motion.

With frequencies `ω_k ~ N(0, ℓ⁻² I)`, k = 1 … D, a point has the feature
`φ(x) = [cos ω₁ᵀx … cos ω_Dᵀx, sin ω₁ᵀx … sin ω_Dᵀx]/√D`, and `φ(x)ᵀφ(y)` estimates the
Gaussian kernel `exp(−‖x − y‖²/2ℓ²)`; the squared distance of two clouds' mean features
estimates their squared maximum mean discrepancy, MMD². `exact_squared_mmd` is its limit
as D grows.

Other frequencies give another kernel, whose spectral density is the distribution they
are drawn from (Bochner's theorem). Laplace numbers of variance ℓ⁻² along each axis give
the product of Cauchy kernels `Π 1/(1 + x_j²/2ℓ²)`, x the difference of two points: as
round at zero as the Gaussian, with a longer tail, which depends on the axes. The spectral
density of the Laplace kernel `exp(−‖x − y‖/ℓ)` is the multivariate Cauchy density in d
dimensions, `∝ (1 + ℓ²‖ω‖²)^(−(d + 1)/2)`: a Gaussian vector divided by the size of one
more Gaussian number. Its tail is heavy, since the kernel has a kink at zero: of 32 such
waves in the plane the shortest is typically ℓ/7 long, of the Gaussian kernel's some 2 ℓ.

Frequencies are kept in units of 1/ℓ, so that one draw serves every length scale. The
cost is linear in the points: sums run over blocks. Sine and cosine are computed here, both at
once, by their series for half the angle, up to a quarter of a turn, and one doubling:
numpy's own take longer, and differ from one machine to another in the last bit.

Sources: Rahimi & Recht 2007, Random features for large-scale kernel machines (the
features, and in fig. 1 the Cauchy kernel; the Laplace kernel there is a product over
coordinates, not this one, which no rotation changes); Rasmussen & Williams 2006, Gaussian processes for
machine learning, eq. 4.15 (the density, ν = ½); Gretton et al. 2012, A kernel
two-sample test, eq. 5 (the V-statistic of MMD², the diagonal included).
"""

from __future__ import annotations

from collections.abc import Iterator
from math import factorial

import numpy as np
from numpy.typing import ArrayLike

from solvers.core import validate
from solvers.core.arrays import FloatArray, IntArray
from solvers.core.kinds import shown
from solvers.core.numbers import numbers

BLOCK = 2**14
"""Points times frequencies handled at a time: four buffers of this size stay in the processor's cache."""

_TURN = 2.0 * np.pi
# sin(πf) = f·P(f²) and cos(πf) = Q(f²) for |f| ≤ ½, highest power first; the next terms
# are below 1e-16.
_SIN = tuple((-1.0) ** k * np.pi ** (2 * k + 1) / factorial(2 * k + 1) for k in range(10, -1, -1))
_COS = tuple((-1.0) ** k * np.pi ** (2 * k) / factorial(2 * k) for k in range(11, -1, -1))


KERNELS = ("gaussian", "laplace", "cauchy")


def unit_frequencies(
    seed: IntArray, count: int, dim: int, kernel: str = "gaussian", draw: int = 0
) -> FloatArray:
    """Frequencies for each seed, for a length scale of 1.

    Divide them by ℓ for a kernel of that length scale.

    Parameters
    ----------
    seed : ndarray of int, shape (b,)
        The seeds of the random numbers.
    count : int
        D, the frequencies per seed.
    dim : int
        d, the dimension of the points.
    kernel : str, default "gaussian"
        "gaussian": standard normal. "laplace": multivariate Cauchy in the same
        directions. "cauchy": Laplace along each axis, of variance 1.
    draw : int, default 0
        Each number gives another draw from the same seed.

    Returns
    -------
    ndarray of shape (b, count, dim)
        Radians per ℓ.

    Raises
    ------
    ValueError
        If the kernel is unknown, `seed` is not a row of seeds, or another argument is
        not a count.

    References
    ----------
    .. [1] A. Rahimi, B. Recht, "Random features for large-scale kernel machines", 2007,
       fig. 1 (which density goes with which kernel).
    .. [2] C. E. Rasmussen, C. K. I. Williams, "Gaussian processes for machine
       learning", 2006, eq. 4.15 (the density of the Laplace kernel, ν = ½).

    Examples
    --------
    >>> import numpy as np
    >>> from solvers.features import unit_frequencies
    >>> unit_frequencies(np.array([40, 53]), 16, 2).shape
    (2, 16, 2)
    """
    validate.one_of(kernel, KERNELS, "kernel")
    seeds = validate.seeds(seed)
    if seeds.ndim != 1:
        raise ValueError(f"seed: expected a row of seeds, shape (b,), got {seeds.shape}")
    for name, value, least in (("count", count, 1), ("dim", dim, 1), ("draw", draw, 0)):
        validate.count(value, name, least)
    frequencies = []
    for s in seeds:
        random = np.random.default_rng(s if draw == 0 else (int(s), draw))
        if kernel == "cauchy":
            frequencies.append(random.laplace(scale=np.sqrt(0.5), size=(count, dim)))
            continue
        z = random.standard_normal((count, dim))
        if kernel == "laplace":
            z /= np.maximum(np.abs(random.standard_normal((count, 1))), 1e-12)
        frequencies.append(z)
    return np.stack(frequencies)


def cos_sin(turns: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The cosine and the sine of angles given in full turns.

    Accurate to 1e-15, apart from the rounding of the angle.

    Parameters
    ----------
    turns : ndarray of any shape
        The angles, 1 for a full turn.

    Returns
    -------
    cosine : ndarray of the same shape
        cos(2π turns).
    sine : ndarray of the same shape
        sin(2π turns).

    Examples
    --------
    >>> import numpy as np
    >>> from solvers.features import cos_sin
    >>> cosine, sine = cos_sin(np.array([0.0, 0.125, 1.5]))
    >>> cosine.round(4)
    array([ 1.    ,  0.7071, -1.    ])
    """
    f = turns - np.rint(turns)
    z = f * f
    s, c = z * _SIN[0], z * _COS[0]
    for out, series in ((s, _SIN), (c, _COS)):
        for a in series[1:-1]:
            out += a
            out *= z
        out += series[-1]
    s *= f
    # Now sine and cosine of half the angle: double it.
    c *= s
    c *= 2.0
    s *= s
    s *= -2.0
    s += 1.0
    return s, c


def feature_sums(points: FloatArray, frequencies: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Cosines and sines summed over the points, alone and times each coordinate.

    Parameters
    ----------
    points : ndarray of shape (b, n, d)
        The clouds, in world units.
    frequencies : ndarray of shape (b, D, d)
        ω_k, in radians per unit.

    Returns
    -------
    cosines : ndarray of shape (b, D, 1 + d)
        `Σ_i cos(ω_kᵀx_i) [1, x_i]`.
    sines : ndarray of shape (b, D, 1 + d)
        The same for the sine.

    Examples
    --------
    >>> import numpy as np
    >>> from solvers.features import feature_sums
    >>> points = np.array([[[0.0, 0.0], [1.0, 0.0]]])
    >>> cosines, sines = feature_sums(points, np.array([[[np.pi, 0.0]]]))
    >>> cosines
    array([[[ 0., -1.,  0.]]])
    """
    b, n, d = points.shape
    D = frequencies.shape[1]
    per_turn: FloatArray = np.ascontiguousarray(frequencies.swapaxes(1, 2)) / _TURN
    factors = np.ones((b, n, 1 + d))
    factors[..., 1:] = points
    total = np.zeros((2, b, D, 1 + d))
    for group, part in _blocks(b, n, D):
        c, s = cos_sin(points[group, part] @ per_turn[group])
        total[0, group] += c.swapaxes(1, 2) @ factors[group, part]
        total[1, group] += s.swapaxes(1, 2) @ factors[group, part]
    return total[0], total[1]


def mean_features(points: FloatArray, frequencies: FloatArray) -> FloatArray:
    """The mean feature of each cloud.

    The squared distance of two clouds' mean features estimates their MMD².

    Parameters
    ----------
    points : ndarray of shape (b, n, d)
        The clouds, in world units.
    frequencies : ndarray of shape (b, D, d)
        ω_k, in radians per unit: those of `unit_frequencies` over ℓ.

    Returns
    -------
    ndarray of shape (b, 2D)
        The mean of `[cos ω₁ᵀx … cos ω_Dᵀx, sin ω₁ᵀx … sin ω_Dᵀx]/√D`.

    References
    ----------
    .. [1] A. Rahimi, B. Recht, "Random features for large-scale kernel machines", 2007.

    Examples
    --------
    >>> import numpy as np
    >>> from solvers.features import exact_squared_mmd, mean_features, unit_frequencies
    >>> p, q = np.array([[0.0, 0.0]]), np.array([[1.0, 0.0]])
    >>> waves = unit_frequencies(np.array([40]), 4096, 2)
    >>> apart = mean_features(p[None], waves) - mean_features(q[None], waves)
    >>> np.square(apart).sum().round(2), exact_squared_mmd(p, q, 1.0).round(2)
    (np.float64(0.79), np.float64(0.79))
    """
    n, D = points.shape[1], frequencies.shape[1]
    c, s = feature_sums(points, frequencies)
    mean: FloatArray = np.concatenate([c[..., 0], s[..., 0]], axis=-1) / (n * np.sqrt(D))
    return mean


def exact_squared_mmd(
    source: ArrayLike, target: ArrayLike, length: ArrayLike, kernel: str = "gaussian"
) -> FloatArray:
    """The exact MMD² of two clouds under a kernel.

    The V-statistic, diagonal included: `MMD² = mean k(x, x′) − 2 mean k(x, y) + mean
    k(y, y′)`, never negative up to rounding. The cost is quadratic in the points, with
    the memory of one block.

    Parameters
    ----------
    source : array_like of shape (..., m, d)
        One cloud, in world units.
    target : array_like of shape (..., n, d)
        The other.
    length : array_like of shape (...)
        ℓ, positive, in world units.
    kernel : str, default "gaussian"
        "gaussian", "laplace" or "cauchy", as for `mean_kernel`.

    Returns
    -------
    ndarray of shape (...)
        MMD², with the leading axes of the three broadcast.

    Raises
    ------
    ValueError
        If an argument is not a cloud, a length is not a positive number, the kernel is
        unknown, or leading axes do not broadcast.

    References
    ----------
    .. [1] A. Gretton, K. M. Borgwardt, M. J. Rasch, B. Schölkopf, A. Smola, "A kernel
       two-sample test", 2012, eq. 5.

    Examples
    --------
    >>> from solvers.features import exact_squared_mmd
    >>> exact_squared_mmd([[0.0, 0.0]], [[1.0, 0.0]], [0.5, 2.0]).round(3)
    array([1.729, 0.235])
    """
    validate.one_of(kernel, KERNELS, "kernel")
    p = validate.cloud(source, "source")
    q = validate.cloud(target, "target", p.shape[-1])
    ell = numbers(length, "length")
    if not (np.isfinite(ell).all() and (ell > 0.0).all()):
        raise ValueError(f"length: expected positive finite numbers, got {shown(length)}")
    axes = validate.batch_shape(source=p.shape[:-2], target=q.shape[:-2], length=ell.shape)
    p, q = (np.broadcast_to(x, (*axes, *x.shape[-2:])).reshape(-1, *x.shape[-2:]) for x in (p, q))
    ells = np.broadcast_to(ell, axes).reshape(-1)
    value = [
        _mean_kernel(x, x, e, kernel) - 2.0 * _mean_kernel(x, y, e, kernel) + _mean_kernel(y, y, e, kernel)
        for x, y, e in zip(p, q, ells, strict=True)
    ]
    mmd: FloatArray = np.array(value).reshape(axes)
    return mmd[()]


def mean_kernel(x: FloatArray, y: FloatArray, length: float, kernel: str = "gaussian") -> float:
    """The mean of a kernel over all pairs of points of two clouds.

    Parameters
    ----------
    x : ndarray of shape (m, d)
        One cloud, in world units.
    y : ndarray of shape (n, d)
        The other.
    length : float
        ℓ, positive, in world units.
    kernel : str, default "gaussian"
        "gaussian": `exp(−‖x − y‖²/2ℓ²)`. "laplace": `exp(−‖x − y‖/ℓ)`. "cauchy": `Π
        1/(1 + (x_j − y_j)²/2ℓ²)`.

    Returns
    -------
    float
        From 0 to 1.

    Raises
    ------
    ValueError
        If `x` or `y` is not one cloud, or their dimensions differ, if the kernel is
        unknown, or if the length is not a positive number.

    Examples
    --------
    >>> import numpy as np
    >>> from solvers.features import mean_kernel
    >>> x, y = np.array([[0.0, 0.0]]), np.array([[3.0, 4.0]])
    >>> round(mean_kernel(x, y, 5.0, "laplace"), 4)
    0.3679
    """
    validate.one_of(kernel, KERNELS, "kernel")
    if not validate.number(length, "length") > 0.0:
        raise ValueError(f"length: expected a positive number, got {length!r}")
    p = validate.cloud(x, "x")
    q = validate.cloud(y, "y", p.shape[-1])
    for name, points in (("x", p), ("y", q)):
        if points.ndim != 2:
            raise ValueError(f"{name}: expected one cloud of shape (n, d), got {points.shape}")
    return _mean_kernel(p, q, length, kernel)


def _mean_kernel(x: FloatArray, y: FloatArray, length: float, kernel: str) -> float:
    total = 0.0
    with np.errstate(over="ignore", under="ignore"):
        for _, part in _blocks(1, len(x), len(y)):
            squares, product = np.zeros((len(x[part]), len(y))), np.ones((len(x[part]), len(y)))
            for k in range(x.shape[1]):
                square = np.square((x[part, None, k] - y[None, :, k]) / length)
                if kernel == "cauchy":
                    product /= 1.0 + 0.5 * square
                squares += square
            if kernel != "cauchy":
                product = np.exp(-0.5 * squares if kernel == "gaussian" else -np.sqrt(squares))
            total += float(product.sum())
    return total / (len(x) * len(y))


def _blocks(b: int, n: int, width: int) -> Iterator[tuple[slice, slice]]:
    """Slices of problems and of points that keep their product with `width` within the
    block size.
    """
    together = max(1, BLOCK // (n * width))
    size = max(1, BLOCK // width) if together == 1 else n
    for i in range(0, b, together):
        for j in range(0, n, size):
            yield slice(i, i + together), slice(j, j + size)
