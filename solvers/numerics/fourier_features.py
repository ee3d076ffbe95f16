"""Random Fourier features: a cloud as a short vector, its mean feature, that a rigid
motion moves smoothly.

With frequencies `ω_k ~ N(0, ℓ⁻² I)`, k = 1 … D, a point has the feature
`φ(x) = [cos ω₁ᵀx … cos ω_Dᵀx, sin ω₁ᵀx … sin ω_Dᵀx]/√D`, and `φ(x)ᵀφ(y)` estimates the
Gaussian kernel `exp(−‖x − y‖²/2ℓ²)`; the squared distance of two clouds' mean features
estimates their squared maximum mean discrepancy, MMD². `exact_squared_mmd` is what it
tends to as D grows.

Other frequencies make another kernel: its spectral density is what they are drawn from
(Bochner's theorem). Laplace numbers of variance ℓ⁻² along each axis make the product of
Cauchy kernels `Π 1/(1 + x_j²/2ℓ²)`, x the difference of two points: as round at zero as
the Gaussian, with a longer tail, which depends on the axes. That of the Laplace kernel
`exp(−‖x − y‖/ℓ)` is the multivariate Cauchy density in d dimensions, `∝ (1 +
ℓ²‖ω‖²)^(−(d + 1)/2)`: a Gaussian vector divided by the size of one more Gaussian
number. Its tail is heavy. The kernel has a kink at zero, and among a few dozen waves
one is some hundred times as short as ℓ.

Frequencies are kept in units of 1/ℓ, so that one draw serves every length scale. The
cost is linear in the points: sums run over blocks. Sine and cosine are computed here, both at
once, by their series on an eighth of a turn and one doubling: numpy's own took eight
times as long, and differ from one machine to another in the last bit.

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
    """`count` frequencies for each seed of (b,), in units of 1/ℓ: (b, count, dim).

    kernel: "gaussian", standard normal; "laplace", multivariate Cauchy in the same
    directions; "cauchy", Laplace along each axis, variance 1. draw: another number,
    another draw from the same seed.
    """
    validate.one_of(kernel, KERNELS, "kernel")
    drawn = []
    for s in seed:
        random = np.random.default_rng(s if draw == 0 else (int(s), draw))
        if kernel == "cauchy":
            drawn.append(random.laplace(scale=np.sqrt(0.5), size=(count, dim)))
            continue
        z = random.standard_normal((count, dim))
        if kernel == "laplace":
            z /= np.maximum(np.abs(random.standard_normal((count, 1))), 1e-12)
        drawn.append(z)
    return np.stack(drawn)


def cos_sin(turns: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The cosine and sine of angles given in full turns, of any shape, to 1e-15 beside
    the rounding of the angle.
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

    points: (b, n, d); frequencies: (b, D, d) in radians per unit. Both answers (b, D, 1
    + d): `Σ_i cos(ω_kᵀx_i) [1, x_i]` and the same of the sine.
    """
    b, n, d = points.shape
    D = frequencies.shape[1]
    per_turn: FloatArray = np.ascontiguousarray(frequencies.swapaxes(1, 2)) / _TURN
    factors = np.ones((b, n, 1 + d))
    factors[..., 1:] = points
    total = np.zeros((2, b, D, 1 + d))
    for some, part in _blocks(b, n, D):
        c, s = cos_sin(points[some, part] @ per_turn[some])
        total[0, some] += c.swapaxes(1, 2) @ factors[some, part]
        total[1, some] += s.swapaxes(1, 2) @ factors[some, part]
    return total[0], total[1]


def mean_features(points: FloatArray, frequencies: FloatArray) -> FloatArray:
    """The mean feature of each cloud: points (b, n, d), frequencies (b, D, d) in
    radians per unit, answer (b, 2D).
    """
    n, D = points.shape[1], frequencies.shape[1]
    c, s = feature_sums(points, frequencies)
    mean: FloatArray = np.concatenate([c[..., 0], s[..., 0]], axis=-1) / (n * np.sqrt(D))
    return mean


def exact_squared_mmd(
    source: ArrayLike, target: ArrayLike, length: ArrayLike, kernel: str = "gaussian"
) -> FloatArray:
    """MMD² of two clouds under a kernel, by default `exp(−‖x − y‖²/2ℓ²)`, exactly: the
    V-statistic, diagonal included.

    source: (..., m, d), target: (..., n, d), length: (...) ℓ, positive, in world units;
    the answer (...). `MMD² = mean k(x, x′) − 2 mean k(x, y) + mean k(y, y′)`, never
    negative up to rounding. The cost is quadratic, the memory that of one block.
    Raises ValueError for what is not a cloud, for a length that is not positive and for an
    unknown kernel.
    """
    p = validate.cloud(source, "source")
    q = validate.cloud(target, "target", p.shape[-1])
    ell = np.asarray(length, dtype=np.float64)
    if not (np.isfinite(ell).all() and (ell > 0.0).all()):
        raise ValueError(f"length: expected positive finite numbers, got {length!r}")
    axes = validate.batch_shape(source=p.shape[:-2], target=q.shape[:-2], length=ell.shape)
    p, q = (np.broadcast_to(x, (*axes, *x.shape[-2:])).reshape(-1, *x.shape[-2:]) for x in (p, q))
    ells = np.broadcast_to(ell, axes).reshape(-1)
    value = [
        mean_kernel(x, x, e, kernel) - 2.0 * mean_kernel(x, y, e, kernel) + mean_kernel(y, y, e, kernel)
        for x, y, e in zip(p, q, ells, strict=True)
    ]
    mmd: FloatArray = np.array(value).reshape(axes)
    return mmd[()]


def mean_kernel(x: FloatArray, y: FloatArray, length: float, kernel: str = "gaussian") -> float:
    """The mean of the kernel over all pairs of points of two clouds (m, d) and (n, d):
    `exp(−‖x − y‖²/2ℓ²)`, for "laplace" `exp(−‖x − y‖/ℓ)`, for "cauchy" `Π 1/(1 + (x_j −
    y_j)²/2ℓ²)`.
    """
    validate.one_of(kernel, KERNELS, "kernel")
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
