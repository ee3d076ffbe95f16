"""The two constants, d₁ and d₂, by which a share of outliers changes the NDT score.

Each cell's Gaussian is mixed with a uniform density, `c₁ exp(−½ e) + c₂` with e the
squared Mahalanobis distance. The negative logarithm of this has no simple derivatives,
so it is approximated by another Gaussian, `d₁ exp(−½ d₂ e) + d₃`, equal to it at e = 0,
at e = 1 and as e → ∞. Only `ρ = c₁/c₂` enters:

    d₁ = −log(1 + ρ),    d₂ = −2 log( log(1 + ρ e^{−½}) / log(1 + ρ) ).

All cells share them, so the score keeps its form: all covariances are divided by d₂,
which lies below one, and all values are multiplied by −d₁, which moves no optimum. As
the share of outliers goes to one, ρ goes to zero, d₂ to one, and the shape becomes that
of the plain score, `exp(−½ e)`: the plain score trusts the points least. As the share
goes to zero, so does d₂, and the score becomes a sum of squared distances.

How ρ follows from a share p is a choice. [1]_ takes c₁ and c₂ such that the mixture has
probability one within a cell. The implementation in the Point Cloud Library takes
`c₁ = 10 (1 − p)` and `c₂ = p/h³` for cells of side h, which depends on the unit of
length. Here `ρ = 10 (1 − p)/p`, the value that this gives for cells of side one.

References
----------
.. [1] M. Magnusson, "The three-dimensional normal-distributions transform", doctoral
   thesis, Örebro University, 2009, ch. 6, eq. 6.8.
"""

from __future__ import annotations

import numpy as np

from solvers.core import validate

PEAK = 10.0
"""The ratio of a Gaussian's peak to the uniform density at equal shares."""


def check_share(outliers: float | None) -> None:
    """Raise ValueError unless `outliers` is strictly between 0 and 1, or None for no mixture."""
    if outliers is not None and not 0.0 < validate.number(outliers, "outliers") < 1.0:
        raise ValueError(f"outliers: expected a share above 0 and below 1, or None, got {outliers!r}")


def constants(outliers: float | None) -> tuple[float, float]:
    """−d₁ and d₂ for a share of outliers, 0 < share < 1; 1 and 1 for None, the plain
    score.
    """
    if outliers is None:
        return 1.0, 1.0
    with np.errstate(over="ignore"):
        ratio = np.divide(PEAK * (1.0 - outliers), outliers)
    top, at_one = np.log1p(ratio), np.log1p(ratio * np.exp(-0.5))
    if np.isinf(ratio):  # below a share of 6e-308; there 1 counts as nothing beside the ratio
        top = np.log(PEAK) - np.log(outliers)
        at_one = top - 0.5
    return float(top), float(-2.0 * np.log(at_one / top))
