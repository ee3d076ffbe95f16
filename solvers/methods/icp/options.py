"""The options of ICP and of its two descent variants: which pairs count, and when a run has come to rest."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from solvers.core import validate
from solvers.numerics import robust


@dataclass(frozen=True)
class IcpOptions:
    """Options of `icp`.

    Parameters
    ----------
    gate : float, default inf
        Pairs farther apart are not used, world units.
    trim : float, default 0.0
        The fraction of the gated pairs to leave out, farthest first, 0 to below 1.
    weight : str, default "none"
        A kernel of `solvers.numerics.robust`: "none", "huber", "tukey", "welsch" or
        "geman-mcclure".
    tuning : float, optional
        The kernel's constant. None takes the usual one. It and `scale` have no effect
        if `weight` is "none".
    scale : float, optional
        The kernel's scale s, world units. None takes it from the median distance of the
        pairs used, afresh at every step, and never below 3e-4 of the target's RMS
        radius.
    tolerance : float, default 1e-6
        The run stops when a step's RMS motion of the source points in use is at most
        this fraction of their RMS radius.
    rms_tolerance : float, default 1e-6
        The run also stops when the same number of pairs is used and their RMS has
        changed by at most this fraction.

    Raises
    ------
    ValueError
        If an option is out of its range.

    Examples
    --------
    >>> from solvers import options, register
    >>> from solvers.scenes import room
    >>> scene = room("clean")
    >>> gated = options.IcpOptions(gate=0.5, trim=0.1)
    >>> register(scene.source, scene.target, "icp", options=gated).correspondences.shape
    (132,)
    """

    gate: float = np.inf
    trim: float = 0.0
    weight: str = "none"
    tuning: float | None = None
    scale: float | None = None
    tolerance: float = 1e-6
    rms_tolerance: float = 1e-6

    def __post_init__(self) -> None:
        _check_length(self.gate, "gate")
        if not 0.0 <= validate.number(self.trim, "trim") < 1.0:
            raise ValueError(f"trim: expected a fraction from 0 to below 1, got {self.trim!r}")
        _check_rest(self)


@dataclass(frozen=True)
class TrimmedOptions:
    """Options of `trimmed-icp`.

    Parameters
    ----------
    keep : float, default 0.8
        The fraction of the source points, above 0 to 1, whose pairs are used: the
        nearest, always `max(1, round(keep · m))` of them.
    weight : str, default "none"
        A kernel of `solvers.numerics.robust`: "none", "huber", "tukey", "welsch" or
        "geman-mcclure".
    tuning : float, optional
        The kernel's constant. None takes the usual one. It and `scale` have no effect
        if `weight` is "none".
    scale : float, optional
        The kernel's scale s, world units. None takes it from the median distance of the
        pairs used, afresh at every step, and never below 3e-4 of the target's RMS
        radius.
    tolerance : float, default 1e-6
        The run stops when a step's RMS motion of the source points in use is at most
        this fraction of their RMS radius.
    rms_tolerance : float, default 0.0
        Above 0, the run also stops when the RMS of the pairs used has changed by at
        most this fraction.

    Raises
    ------
    ValueError
        If an option is out of its range.

    Examples
    --------
    >>> from solvers import options, register
    >>> source = [[0.0, 0.0], [1.0, 0.0], [9.0, 0.0], [1.0, 1.0]]
    >>> half = options.TrimmedOptions(keep=0.5)
    >>> register(source, [[0.0, 0.1], [1.0, 0.1]], "trimmed-icp", options=half).correspondences
    array([ 0,  1, -1, -1])
    """

    keep: float = 0.8
    weight: str = "none"
    tuning: float | None = None
    scale: float | None = None
    tolerance: float = 1e-6
    rms_tolerance: float = 0.0

    def __post_init__(self) -> None:
        if not 0.0 < validate.number(self.keep, "keep") <= 1.0:
            raise ValueError(f"keep: expected a fraction above 0, up to 1, got {self.keep!r}")
        _check_rest(self)


@dataclass(frozen=True)
class CappedOptions:
    """Options of `capped-icp`.

    Parameters
    ----------
    cap : float, optional
        The distance at which a pair's loss stops growing, world units. None is half the
        target's RMS radius.
    weight : str, default "none"
        A kernel of `solvers.numerics.robust`: "none", "huber", "tukey", "welsch" or
        "geman-mcclure".
    tuning : float, optional
        The kernel's constant. None takes the usual one. It and `scale` have no effect
        if `weight` is "none".
    scale : float, optional
        The kernel's scale s, world units. None takes it from the median distance of the
        pairs used, afresh at every step, and never below 3e-4 of the target's RMS
        radius.
    tolerance : float, default 1e-6
        The run stops when a step's RMS motion of the source points in use is at most
        this fraction of their RMS radius.
    rms_tolerance : float, default 0.0
        Above 0, the run also stops when the same number of pairs is used and their RMS
        has changed by at most this fraction.

    Raises
    ------
    ValueError
        If an option is out of its range.

    Examples
    --------
    >>> from solvers import options, register
    >>> near = options.CappedOptions(cap=0.4)
    >>> register([[0.0, 0.0], [1.0, 0.0]], [[0.0, 0.1], [1.0, 0.1]], "capped-icp", options=near).detail("reach")
    np.float64(0.4)
    """

    cap: float | None = None
    weight: str = "none"
    tuning: float | None = None
    scale: float | None = None
    tolerance: float = 1e-6
    rms_tolerance: float = 0.0

    def __post_init__(self) -> None:
        if self.cap is not None:
            _check_length(self.cap, "cap")
        _check_rest(self)


AnyOptions = IcpOptions | TrimmedOptions | CappedOptions


def _check_length(value: float, name: str) -> None:
    if not validate.reach(value, name) > 0.0:
        raise ValueError(f"{name}: expected a positive length, got {value!r}")


def _check_rest(options: AnyOptions) -> None:
    robust.check_options(options.weight, options.tuning, options.scale)
    validate.number(options.tolerance, "tolerance", 0.0)
    validate.number(options.rms_tolerance, "rms_tolerance", 0.0)
