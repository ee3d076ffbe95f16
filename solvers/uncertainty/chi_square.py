"""Quantiles of the χ² distribution for up to three degrees of freedom."""

from __future__ import annotations

from math import erfc, exp, gamma, log1p, pi, pow, sqrt

from solvers.core import validate


def quantile(level: float, freedom: int = 3) -> float:
    """The χ² quantile for 1, 2 or 3 degrees of freedom.

    With 2 degrees of freedom the distribution function, 1 − e^(−x/2), is inverted in
    closed form. The others are inverted by bisection: up to a half the distribution
    function as a series (Abramowitz & Stegun 1964, 26.4.6), above it the closed forms
    of its complement, erfc(√(x/2)) and erfc(√(x/2)) + √(2x/π) e^(−x/2) (26.4.4), so
    that no digits are lost at levels near 0 or 1.

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

    low, high = 0.0, 1.0
    while _below(high, freedom, level) and high < 1e3:
        high *= 2.0
    while low < (middle := 0.5 * (low + high)) < high:
        low, high = (middle, high) if _below(middle, freedom, level) else (low, middle)
    return 0.5 * (low + high)


def _below(x: float, freedom: int, level: float) -> bool:
    """Whether a χ² variable of 1 or 3 degrees of freedom lies below x with less than the probability `level`."""
    if level > 0.5:
        return erfc(sqrt(0.5 * x)) + (sqrt(2.0 * x / pi) * exp(-0.5 * x) if freedom == 3 else 0.0) > 1.0 - level
    term = total = pow(0.5 * x, 0.5 * freedom) * exp(-0.5 * x) / gamma(0.5 * freedom + 1.0)
    divisor = freedom
    while term > 1e-17 * total:
        divisor += 2
        term *= x / divisor
        total += term
    return total < level
