"""Quantiles of the χ² distribution for up to three degrees of freedom."""

from __future__ import annotations

from math import erf, exp, log1p, pi, sqrt

from solvers.core import validate


def quantile(level: float, freedom: int = 3) -> float:
    """The χ² quantile for 1, 2 or 3 degrees of freedom.

    The distribution functions have closed forms, erf(√(x/2)), 1 − e^(−x/2) and erf(√(x/2)) − √(2x/π) e^(−x/2)
    (Abramowitz & Stegun 1964, 26.4.4 and 26.4.5). The second is inverted in closed form, the others by bisection.

    Parameters
    ----------
    level : float
        The probability, above 0 and below 1.
    freedom : int, default 3
        The degrees of freedom: 1, 2 or 3.

    Returns
    -------
    float
        The number below which a χ² variable lies with that probability.

    Raises
    ------
    ValueError
        If the level or the degrees of freedom are out of range.

    Examples
    --------
    >>> from solvers.uncertainty import quantile
    >>> [round(quantile(0.95, k), 3) for k in (1, 2, 3)]
    [3.841, 5.991, 7.815]
    """
    if not 0.0 < validate.number(level, "level") < 1.0:
        raise ValueError(f"level: expected a probability above 0 and below 1, got {level!r}")
    if freedom not in (1, 2, 3):
        raise ValueError(f"freedom: expected 1, 2 or 3 degrees of freedom, got {freedom!r}")

    if freedom == 2:
        return -2.0 * log1p(-level)

    def below(x: float) -> float:
        return erf(sqrt(0.5 * x)) - (sqrt(2.0 * x / pi) * exp(-0.5 * x) if freedom == 3 else 0.0)

    low, high = 0.0, 1.0
    while below(high) < level and high < 1e3:
        high *= 2.0
    while low < (middle := 0.5 * (low + high)) < high:
        low, high = (middle, high) if below(middle) < level else (low, middle)
    return 0.5 * (low + high)
