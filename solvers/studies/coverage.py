"""The coverage study: how often a 95 % region holds the truth, counted over redrawn scans.

Each draw is registered from its own start, and its region is compared with the truth. A correct region holds the truth
in 95 of 100 draws, chance aside.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from solvers.api import register
from solvers.core import validate
from solvers.core.kinds import of_kind, several
from solvers.core.pose import Pose
from solvers.core.registry import rigid_method_of
from solvers.core.result import Result
from solvers.studies.redrawn import NO_ECHO, Redrawn, redrawn, starts
from solvers.uncertainty import (
    Covariance,
    Spread,
    covariance,
    from_matrix,
    from_starts,
    range_bearing,
    spread_of,
)
from solvers.uncertainty.closed_form import CENSI, HESSIAN
from solvers.uncertainty.matrices import stacked

METHODS = ("icp", "point-to-plane", "gicp")
WAYS = ("hessian", "censi", "starts", "sampled")
GATE = 2.0
LEVEL = 0.95


@dataclass(frozen=True, eq=False)
class CoverageLine:
    """The results of one way of estimating the spread on k draws.

    Attributes
    ----------
    place : str
        "room", "corridor" or "hall".
    method : str
        The registration method.
    way : str
        "hessian", "censi", "starts" (censi, with the start's spread carried through) or
        "sampled".
    covered : int
        The number of draws whose region held the truth.
    count : int
        The number of draws.
    widest : float
        The median of the regions' largest standard deviation, world units; infinite if
        most have a free direction.

    Examples
    --------
    >>> from solvers.uncertainty_study import coverage
    >>> for line in coverage("room", "point-to-plane", ("hessian", "censi"), count=100):
    ...     print(line.way, line.covered >= 80)
    hessian True
    censi True
    """

    place: str
    method: str
    way: str
    covered: int
    count: int
    widest: float


@dataclass(frozen=True, eq=False)
class Runs:
    """k registrations of redrawn scans.

    Attributes
    ----------
    scans : Redrawn
        The scans registered.
    start : Pose
        The starts, (k,).
    spread : tuple of float
        The standard deviations of the starts: degrees and world units.
    noise : float
        σ of a range, in u.
    result : Result
        Of `solvers.register`.
    options : mapping
        The method's options, as passed to `solvers.register`.

    Examples
    --------
    >>> from solvers.uncertainty_study import runs
    >>> runs("room", "icp", 3).result.pose.batch
    (3,)
    """

    scans: Redrawn
    start: Pose
    spread: tuple[float, float]
    noise: float
    result: Result
    options: Mapping[str, Any]


def runs(
    place: str, method: str = "point-to-plane", count: int = 1000, *, seed: int = 40, end: float | None = None,
    noise: float = 0.04, heading: float = 3.0, shift: float = 0.15, **options: Any,
) -> Runs:  # fmt: skip
    """Register redrawn scans, each from its own start near the truth.

    Parameters
    ----------
    place : str
        "room", "corridor" or "hall".
    method : str, default "point-to-plane"
        One of `solvers.METHODS`; it must take weights if a ray may find no echo.
    count : int, default 1000
        How many draws.
    seed : int, default 40
        The seed of all random numbers.
    end : float, optional
        The distance of the end walls from the middle, in u.
    noise : float, default 0.04
        σ of a range, in u.
    heading : float, default 3.0
        The standard deviation of the starts' angle, degrees.
    shift : float, default 0.15
        That of each coordinate of their position, in u.
    **options
        The method's own. "icp", "point-to-plane" and "gicp" get a gate of 2 u unless
        given another.

    Returns
    -------
    Runs
        The scans, the starts and the result.

    Raises
    ------
    ValueError
        If an argument is out of its range, or the method finds a scale.

    Examples
    --------
    >>> from solvers.uncertainty_study import runs
    >>> str(runs("hall", "icp", 3, heading=0.0, shift=0.0).start)
    'Pose(batch=(3,), dim=2)'
    """
    entry = rigid_method_of(method)
    scans = redrawn(place, count, seed=seed, end=end, noise=noise)
    start = starts(scans.truth, count, heading=heading, shift=shift, seed=seed)
    if entry.name in METHODS and not {"gate", "max_distance"} & options.keys():
        options = {"gate": GATE, **options}
    weights = None if scans.weights.all() else scans.weights
    result = register(scans.source, scans.target, method, start=start, weights=weights, **options)
    return Runs(scans, start, (heading, shift), noise, result, options)


def ends_of(draws: Runs) -> Spread:
    """The spread of all end poses.

    Parameters
    ----------
    draws : Runs
        The result of `runs`, with at least two draws.

    Returns
    -------
    Spread
        About the centre of the first source.

    Raises
    ------
    ValueError
        If there is only one draw.

    Examples
    --------
    The hall, with no idea of the heading, has two answers:

    >>> from solvers.uncertainty_study import ends_of, runs
    >>> ends = ends_of(runs("hall", count=60, heading=90.0))
    >>> bool(ends.shares[1] > 0.1), bool(ends.shares[:2].sum() > 0.95)
    (True, True)
    """
    scans = of_kind(draws, Runs, "draws").scans
    echoes = scans.source[0][scans.weights[0] > 0.0]
    middle = echoes.mean(axis=0)
    radius = float(np.sqrt(np.square(echoes - middle).sum(axis=1).mean()))
    return spread_of(draws.result.pose, centre=middle, radius=radius)


def regions(draws: Runs, way: str) -> Covariance:
    """Each draw's own covariance, estimated in one way.

    Parameters
    ----------
    draws : Runs
        The result of `runs`.
    way : str
        "hessian", "censi", "starts" or "sampled". The last uses one matrix for all
        draws, that of the twists between the ends and their mean, about each draw's
        pose.

    Returns
    -------
    Covariance
        Of shape (k,).

    Raises
    ------
    ValueError
        If there is no such way, or the method does not offer it.

    Examples
    --------
    >>> from solvers.uncertainty_study import regions, runs
    >>> regions(runs("room", "icp", 4), "hessian").deviations.shape
    (4, 3)
    """
    scans, result = of_kind(draws, Runs, "draws").scans, draws.result
    if validate.one_of(way, WAYS, "way") == "hessian":
        return covariance(result, "hessian")
    if way == "censi":
        return _censi(draws)
    k = len(result.pose)
    if way == "sampled":
        spread = ends_of(draws).whole
        middle = spread.mean.inverse().apply(spread.centre[None])[0]
        return replace(
            spread, mean=result.pose, centre=result.pose.apply(middle[None])[:, 0],
            deviations=np.tile(spread.deviations, (k, 1)), directions=np.tile(spread.directions, (k, 1, 1)),
            radius=np.tile(spread.radius, k),
        )  # fmt: skip
    noise = _censi(draws)
    heading, shift = draws.spread
    matrix = np.diag(np.square([np.radians(heading), shift, shift]))
    covariances = [
        from_starts(
            scans.source[i], scans.target[i], result.method, noise=noise[i],
            weights=None if scans.weights[i].all() else scans.weights[i],
            start=from_matrix(matrix, draws.start[i], frame="source"), **draws.options,
        )
        for i in range(k)
    ]  # fmt: skip
    return stacked(covariances)


def coverage(
    place: str, method: str = "point-to-plane", ways: tuple[str, ...] | None = None, *, count: int = 1000,
    seed: int = 40, level: float = LEVEL, noise: float = 0.04, heading: float = 3.0, shift: float = 0.15,
    end: float | None = None, **options: Any,
) -> tuple[CoverageLine, ...]:  # fmt: skip
    """Count the draws whose region holds the truth.

    Parameters
    ----------
    place : str
        "room", "corridor" or "hall".
    method : str, default "point-to-plane"
        The registration method.
    ways : tuple of str, optional
        The ways of estimating the spread. None is every way that the method offers: all
        four if it has Censi's formula, as "icp" and "point-to-plane" do; "hessian" and
        "sampled" for "gicp"; "sampled" for methods without a closed form.
    count : int, default 1000
        How many draws.
    seed : int, default 40
        The seed of the draws.
    level : float, default 0.95
        The regions' probability.
    noise : float, default 0.04
        σ of a range, in u.
    heading : float, default 3.0
        The standard deviation of the starts' angle, degrees.
    shift : float, default 0.15
        That of each coordinate of their position, in u.
    end : float, optional
        The distance of the end walls from the middle, in u.
    **options
        As for `runs`.

    Returns
    -------
    tuple of CoverageLine
        One per way.

    Raises
    ------
    ValueError
        If an argument is out of its range.

    Examples
    --------
    >>> from solvers.uncertainty_study import coverage
    >>> (line,) = coverage("corridor", "icp", ("hessian",), count=50)
    >>> line.covered < 25  # it claims far too much
    True
    """
    draws = runs(place, method, count, seed=seed, end=end, noise=noise, heading=heading, shift=shift, **options)
    name = draws.result.method
    usual = WAYS if name in CENSI else ("hessian", "sampled") if name in HESSIAN else ("sampled",)
    lines = []
    for way in usual if ways is None else several(ways, "ways", "names"):
        region = regions(draws, way)
        inside = region.covers(draws.scans.truth, level)
        widest = float(np.median(region.deviations[:, 0]))
        lines.append(CoverageLine(place, method, way, int(np.count_nonzero(inside)), count, widest))
    return tuple(lines)


def _censi(draws: Runs) -> Covariance:
    # A ray without an echo is in no pair, so its noise plays no part.
    p, q = (np.where(np.abs(cloud) < NO_ECHO, cloud, 0.0) for cloud in (draws.scans.source, draws.scans.target))
    noises = range_bearing(p, draws.noise), range_bearing(q, draws.noise)
    return covariance(draws.result, "censi", source_noise=noises[0], target_noise=noises[1])
