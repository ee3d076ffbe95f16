"""ICP with a threshold derived from how far off motion predictions were, after KISS-ICP.

The gate and the weight come from one number σ, fixed for the run: pairs within `3σ` are
used, weighted by the kernel of Geman and McClure `w(r) = 1 / (1 + (r/κ)²)²` with
`κ = σ/3`, which leaves few parameters to set.

KISS-ICP follows a moving scanner and takes σ² as the mean of δ² over the past errors
(θ, t) of its motion prediction, `δ = 2 r_max sin(θ/2) + ‖t‖`, which bounds how far a
point within r_max of the origin was off. A single pair of clouds has no such history.
Here the deviation of the start replaces it: `angle` and `shift` where given, else the
start pose's own motion, as if the prediction had been to stand still and the start were
the correction. As in the original, `initial` counts as a first error and a deviation
below `least` is ignored: `σ² = (initial² + δ²) / 2`, or `initial²`. The paper takes 2 m
and 0.1 m, for scans of streets; here both are fractions of the target's size, since
clouds come in any unit.

The objective is that of `capped-icp` with this kernel, `Σ 2ρ(min(r, 3σ))`, and never
rises.

Differences: the fit of the weighted pairs is the closed form, not one Gauss-Newton
step; distance and κ both enter the kernel squared (with an unsquared κ the kernel would
change with the units). Left out, since there is no sequence: motion prediction,
undistortion, the voxel map and its sampling.

References
----------
.. [1] I. Vizzo and others, "KISS-ICP: in defense of point-to-point ICP", 2023, sec. III
   (adaptive threshold, alignment). doi:10.1109/LRA.2023.3236571
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from solvers.core import validate
from solvers.core.arrays import FloatArray
from solvers.core.method import Method, Problem
from solvers.methods.icp.icp import IcpState, partners, start_with, step
from solvers.methods.icp.options import CappedOptions
from solvers.numerics.fits import lengths


@dataclass(frozen=True)
class KissOptions:
    """Options of `kiss-threshold-icp`.

    The origin of the coordinates counts as the scanner's position. Far from it, as in a
    national grid, the slightest turn is a deviation of kilometres and every pair is
    used: subtract the scanner's position first.

    Parameters
    ----------
    angle : float, optional
        How far off the start's rotation may be, radians, 0 to π. None is the start
        pose's own rotation.
    shift : float, optional
        How far off the start's translation may be, world units. None is the start
        pose's own.
    initial : float, optional
        σ before anything is known, world units. None is 0.6 of the target's RMS radius.
    least : float, optional
        The smallest deviation that counts, world units. None is 0.03 of that radius.
    tolerance : float, default 1e-6
        The run stops when a step's RMS motion of the source points is at most this
        fraction of their RMS radius.

    Raises
    ------
    ValueError
        If an option is out of its range.

    Examples
    --------
    >>> from solvers import options, register
    >>> from solvers.scenes import room
    >>> scene = room("clean")
    >>> sure = options.KissOptions(angle=0.1, shift=0.2)
    >>> register(scene.source, scene.target, "kiss-threshold-icp", options=sure).status.name
    'CONVERGED'
    """

    angle: float | None = None
    shift: float | None = None
    initial: float | None = None
    least: float | None = None
    tolerance: float = 1e-6

    def __post_init__(self) -> None:
        for name, value in (("angle", self.angle), ("shift", self.shift)):
            if value is not None:
                validate.number(value, name, 0.0, np.pi if name == "angle" else 1e100)
        if self.initial is not None:
            validate.number(self.initial, "initial", 1e-100, 1e100)
        if self.least is not None:
            validate.number(self.least, "least", 0.0)
        validate.number(self.tolerance, "tolerance", 0.0)


def deviation(problem: Problem, options: KissOptions) -> FloatArray:
    """δ, (b,), in world units; r_max is the distance from the origin of the source's
    farthest point with a weight.
    """
    farthest = np.where(problem.weights > 0.0, np.linalg.norm(problem.source, axis=2), 0.0).max(axis=1)
    # ‖R − I‖_F = 2√2 sin(θ/2) in the plane and in space.
    half = np.linalg.norm(problem.start.R - np.eye(problem.dim), axis=(1, 2)) / np.sqrt(8.0)
    if options.angle is not None:
        half = np.full(problem.size, np.sin(0.5 * options.angle))
    shift = np.linalg.norm(problem.start.t, axis=1) if options.shift is None else options.shift
    delta: FloatArray = 2.0 * farthest * half + shift
    return delta


def sigma(problem: Problem, options: KissOptions) -> FloatArray:
    """σ, (b,), in world units."""
    delta = deviation(problem, options)
    initial = lengths(options.initial, 0.6, problem.target)
    least = lengths(options.least, 0.03, problem.target)
    return np.where(delta > least, np.hypot(initial, delta) / np.sqrt(2.0), initial)


def _start(problem: Problem, options: KissOptions) -> IcpState:
    with np.errstate(over="ignore", under="ignore"):
        s = sigma(problem, options)
        within = CappedOptions(weight="geman-mcclure", tuning=1.0, tolerance=options.tolerance)
        return start_with(problem, within, 3.0 * s, s / 3.0)


KISS = Method(
    name="kiss-threshold-icp",
    summary="ICP whose gate and robust weight follow from how far off the start may be",
    source="Vizzo et al. 2023",
    start=_start,
    step=step,
    partners=partners,
    options=KissOptions,
    weighted=True,
    dims=(2, 3),
)
