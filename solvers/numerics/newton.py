"""A damped Newton step: a multiple of the identity added to the Hessian makes it a
descent step, and it is capped as a whole.

Solve `(H + λI) Δ = −g` with λ = 0 if the Hessian is positive definite, else with the
first λ of a geometric sequence for which H + λI has a Cholesky factor. It is H + λI
that becomes positive definite, not H. Then Δ is a descent direction, and remains one if
shortened as a whole by one factor; if its parts are capped separately, it may not.

Source: Nocedal & Wright 2006, Numerical optimization, sec. 3.4, algorithm 3.3 (Cholesky
with an added multiple of the identity).
"""

from __future__ import annotations

import numpy as np

from solvers.core.arrays import BoolArray, FloatArray

FIRST = 1e-3
"""The first λ tried after zero, as a fraction of the largest entry of H."""
GROWTH = 4.0
LEAST_PIVOT = 1e-8
"""A pivot below this fraction of the largest entry of H counts as not positive."""


def damped_step(gradient: FloatArray, hessian: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Δ (b, p) and λ (b,) for finite gradients (b, p) and finite symmetric Hessians
    (b, p, p); Δ is zero if H is.
    """
    p = gradient.shape[1]
    with np.errstate(over="ignore", under="ignore", invalid="ignore"):
        size = np.abs(hessian).max(axis=(1, 2))
        finite = np.isfinite(size) & np.isfinite(gradient).all(axis=1) & (size > 0.0)
        # Divided by their sizes, all Hessians try the same few λ, and none overflows.
        unit = np.where(finite, size, 1.0)
        H = np.where(finite[:, None, None], hessian / unit[:, None, None], np.eye(p))
        damping = np.zeros(len(H))
        L, good = cholesky(H)
        while not good.all():
            bad = np.flatnonzero(~good)
            damping[bad] = np.maximum(FIRST, GROWTH * damping[bad])
            L[bad], good[bad] = cholesky(H[bad] + damping[bad, None, None] * np.eye(p))
        g = np.where(finite[:, None], gradient / unit[:, None], 0.0)
        return -_solved(L, g), damping * unit


def capped(step: FloatArray, sizes: tuple[FloatArray, ...]) -> FloatArray:
    """The steps (b, p) times `1 / max(1, sizes …)`: each size (b,) is the length of a
    part divided by its cap.
    """
    factor = np.ones(len(step))
    for size in sizes:
        factor = np.maximum(factor, size)
    return np.asarray(step / factor[:, None])


def cholesky(A: FloatArray) -> tuple[FloatArray, BoolArray]:
    """The lower factors (b, p, p) of symmetric matrices (b, p, p) with entries of order
    one, and whether there is one, (b,).
    """
    p = A.shape[1]
    L = np.zeros_like(A)
    good = np.ones(len(A), dtype=np.bool_)
    for j in range(p):
        pivot = A[:, j, j] - np.square(L[:, j, :j]).sum(axis=1)
        good &= pivot > LEAST_PIVOT
        L[:, j, j] = np.sqrt(np.where(pivot > LEAST_PIVOT, pivot, 1.0))
        for i in range(j + 1, p):
            L[:, i, j] = (A[:, i, j] - (L[:, i, :j] * L[:, j, :j]).sum(axis=1)) / L[:, j, j]
    return L, good


def _solved(L: FloatArray, g: FloatArray) -> FloatArray:
    """`(L Lᵀ)⁻¹ g`."""
    p = g.shape[1]
    x = g.copy()
    for j in range(p):
        x[:, j] = (x[:, j] - (L[:, j, :j] * x[:, :j]).sum(axis=1)) / L[:, j, j]
    for j in reversed(range(p)):
        x[:, j] = (x[:, j] - (L[:, j + 1 :, j] * x[:, j + 1 :]).sum(axis=1)) / L[:, j, j]
    return x
