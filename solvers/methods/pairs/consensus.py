"""The number of trials that a random search needs, and the sum by which a trial is judged."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from solvers.core import validate
from solvers.core.arrays import FloatArray
from solvers.core.numbers import numbers


def trials(share: ArrayLike, confidence: float, sample: int) -> FloatArray | float:
    """The number of trials after which, with a given probability, one has drawn only right pairs.

    `N = max(1, ⌈log(1 − p) / log(1 − wˢ)⌉)`: 1 at w = 1, infinite at w = 0. It treats
    the s draws of a trial as independent.

    Parameters
    ----------
    share : array_like of shape (...)
        w, the fraction of right pairs, 0 to 1.
    confidence : float
        p, the probability, above 0 and below 1.
    sample : int
        s, the number of pairs drawn in a trial, at least 1.

    Returns
    -------
    ndarray of shape (...), or float
        Whole numbers, or infinity; a float for one w.

    Raises
    ------
    ValueError
        If one of them is out of its range; the message names it.

    References
    ----------
    .. [1] M. A. Fischler, R. C. Bolles, "Random sample consensus: a paradigm for model
       fitting with applications to image analysis and automated cartography", 1981,
       sec. II-B. doi:10.1145/358669.358692

    Examples
    --------
    >>> from solvers.consensus import trials
    >>> trials([0.3, 0.6, 1.0], 0.99, 2)
    array([49., 11.,  1.])
    """
    w = numbers(share, "share")
    if not np.all((w >= 0.0) & (w <= 1.0)):
        raise ValueError(f"share: expected fractions from 0 to 1, got {share!r}")
    if not 0.0 < validate.number(confidence, "confidence") < 1.0:
        raise ValueError(f"confidence: expected a probability above 0 and below 1, got {confidence!r}")
    s = validate.count(sample, "sample", 1)
    with np.errstate(divide="ignore", under="ignore", over="ignore"):
        # A quotient within rounding of a whole number counts as that number.
        exact = np.log1p(-confidence) / np.log1p(-(w**s))
        n = np.where(w > 0.0, np.maximum(1.0, np.ceil(exact * (1.0 - 1e-12))), np.inf)
    return n if n.ndim else float(n)


def capped_sum(squares: FloatArray, inlier: ArrayLike) -> FloatArray:
    """The capped sum of squares, `Σ min(r², ε²)`, over the last axis.

    Parameters
    ----------
    squares : ndarray of shape (..., n)
        Squared residuals r², in u².
    inlier : array_like
        ε, in world units: one number, or an array that broadcasts against `squares`.

    Returns
    -------
    ndarray of shape (...)
        In u².

    References
    ----------
    .. [1] P. H. S. Torr, A. Zisserman, "MLESAC: a new robust estimator with application
       to estimating image geometry", 2000, sec. 4. doi:10.1006/cviu.1999.0832

    Examples
    --------
    >>> import numpy as np
    >>> from solvers.consensus import capped_sum
    >>> capped_sum(np.array([0.01, 0.04, 9.0]), 0.5)
    np.float64(0.3)
    """
    total: FloatArray = np.minimum(squares, np.square(inlier)).sum(axis=-1)
    return total
