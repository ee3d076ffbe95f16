"""The benchmark: the race run to its end on many seeds at once, with errors against the truth, steps and time.

`benchmark` does it in one call. A page that must stay responsive steps by itself: `Contestant.begin`, then
`solvers.stepper.advance` while there is time, then `line`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache
from time import perf_counter
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from solvers.core import validate
from solvers.core.arrays import BoolArray, FloatArray, IntArray, StatusArray
from solvers.core.brief import brief
from solvers.core.kinds import function, of_kind, or_usual, several
from solvers.core.pose import Pose
from solvers.core.registry import METHODS
from solvers.core.status import Status
from solvers.core.stepper import Batch, advance
from solvers.metrics import rre, rte
from solvers.studies.race import CONTESTANTS, MAX_STEPS, SEEDS, Contestant, Controls, race_problem, racing

CLOSE_DEGREES = 5.0
CLOSE_DISTANCE = 0.2


def is_close(degrees: ArrayLike, distance: ArrayLike) -> BoolArray:
    """Which poses are close to the truth: a rotation error below 5°, a translation error below 0.2 u.

    Parameters
    ----------
    degrees : array_like of shape (...)
        Rotation errors in degrees.
    distance : array_like of shape (...)
        Translation errors in world units.

    Returns
    -------
    ndarray of shape (...)
        True where both are below.

    Examples
    --------
    >>> from solvers.studies.benchmark import is_close
    >>> is_close([4.9, 4.9, 5.0], [0.19, 0.2, 0.19])
    array([ True, False, False])
    """
    close: BoolArray = np.less(degrees, CLOSE_DEGREES) & np.less(distance, CLOSE_DISTANCE)
    return close


@dataclass(frozen=True, eq=False)
class Line:
    """The results of one contestant on s problems.

    Attributes
    ----------
    contestant : Contestant
        Who ran.
    rre : ndarray of shape (s,)
        Rotation errors in degrees.
    rte : ndarray of shape (s,)
        Translation errors in world units.
    steps : ndarray of int64, shape (s,)
        The steps taken.
    status : ndarray of int8, shape (s,)
        How each run stopped, a `solvers.Status`.
    pose : Pose
        The s end poses.
    seconds : float
        Wall time of the run, start included.

    Examples
    --------
    >>> from solvers.benchmark import benchmark
    >>> from solvers.race import Controls, contestants
    >>> easy = Controls(degrees=10.0, distance=0.2, setting="clean")
    >>> (line,) = benchmark(easy, seeds=[40, 53], contestants=contestants(["gicp"]))
    >>> line.close, line.turned, line.rre.shape
    (2, 2, (2,))
    >>> line.median_rre < 5.0, line.median_rte < 0.2, line.median_steps > 1.0, sum(line.stops.values())
    (True, True, True, 2)
    """

    contestant: Contestant
    rre: FloatArray
    rte: FloatArray
    steps: IntArray
    status: StatusArray
    pose: Pose
    seconds: float

    __repr__ = brief

    @property
    def median_rre(self) -> float:
        """Median rotation error, degrees."""
        return float(np.median(self.rre))

    @property
    def median_rte(self) -> float:
        """Median translation error, world units."""
        return float(np.median(self.rte))

    @property
    def turned(self) -> int:
        """How many have a rotation error below 5°."""
        return int(np.count_nonzero(self.rre < CLOSE_DEGREES))

    @property
    def close(self) -> int:
        """How many have a rotation error below 5° and a translation error below 0.2 u."""
        return int(np.count_nonzero(is_close(self.rre, self.rte)))

    @property
    def median_steps(self) -> float:
        """Median number of steps.

        Steps of different methods are different amounts of work.
        """
        return float(np.median(self.steps))

    @property
    def stops(self) -> dict[str, int]:
        """The number of runs per kind of stop: 'converged', 'stalled', … None of them means success."""
        count = np.bincount(self.status, minlength=len(Status))
        return {Status(k).label: int(n) for k, n in enumerate(count) if n}


def line(contestant: Contestant, batch: Batch[Any], truth: Pose, seconds: float) -> Line:
    """A contestant's row of the table, from the current state of its run.

    Parameters
    ----------
    contestant : Contestant
        Who runs.
    batch : Batch
        The run, finished or not.
    truth : Pose
        The s true poses.
    seconds : float
        The wall time so far.

    Returns
    -------
    Line
        Errors, steps and stops.

    Raises
    ------
    ValueError
        If an argument is not of the type given above.

    Examples
    --------
    >>> from solvers.benchmark import line
    >>> from solvers.race import Controls, contestants, race_problem
    >>> (icp,) = contestants(["icp"])
    >>> problem, truth = race_problem(Controls(), seeds=[40, 53])
    >>> round(line(icp, icp.begin(problem), truth, 0.0).median_rre, 6)
    45.0
    """
    of_kind(contestant, Contestant, "contestant")
    pose = of_kind(batch, Batch, "batch").pose()
    return Line(
        contestant, np.degrees(rre(pose, truth)), rte(pose, truth), batch.steps, batch.state().status, pose, seconds
    )


def benchmark(
    controls: Controls | None = None,
    *,
    seeds: Sequence[int] = SEEDS,
    contestants: Sequence[Contestant | str] = CONTESTANTS,
    max_steps: int = MAX_STEPS,
    progress: Callable[[Contestant], Any] | None = None,
) -> tuple[Line, ...]:
    """Run contestants on the scenes of all seeds and measure them against the truth.

    Each contestant runs all seeds in one batch.

    Parameters
    ----------
    controls : Controls, optional
        The race's settings. None takes the defaults.
    seeds : sequence of int
        One per problem; by default the benchmark's 25, 40 + 13k.
    contestants : sequence of Contestant or str
        Who runs, in this order: contestants or names of methods that race; by default
        the nine.
    max_steps : int, default 70
        The most steps of a contestant.
    progress : callable, optional
        Called as `progress(contestant)` before each; a true return value ends the
        benchmark there.

    Returns
    -------
    tuple of Line
        One per contestant that ran.

    Raises
    ------
    ValueError
        If an argument is not of the type given above, if the seeds are not integers,
        are negative or are missing, if a name is not that of a method that races, if a
        contestant's method needs pairs, or an option of a contestant is out of its
        range.
    KeyError, TypeError
        As `Contestant.begin`.

    Examples
    --------
    >>> from solvers.benchmark import benchmark
    >>> from solvers.race import Controls
    >>> easy = Controls(degrees=10.0, distance=0.2, setting="clean")
    >>> for line in benchmark(easy, seeds=[40, 53, 66], contestants=["icp", "gicp"]):
    ...     print(line.contestant.label, line.close, "of 3 close")
    ICP 3 of 3 close
    GICP 3 of 3 close
    """
    entrants = [
        racing(entry, "contestants") if isinstance(entry, str) else of_kind(entry, Contestant, "contestants")
        for entry in several(contestants, "contestants", "contestants or of names of methods")
    ]
    for contestant in entrants:
        if contestant.method in METHODS and METHODS[contestant.method].paired:
            needs = "it needs pairs and the race has none"
            raise ValueError(f"contestants: {contestant.method!r} does not race, because {needs}")
    validate.count(max_steps, "max_steps")
    function(progress, "progress")
    problem, truth = race_problem(or_usual(controls, Controls, "controls"), seeds)
    lines = []
    for contestant in entrants:
        if progress is not None and progress(contestant):
            break
        start = perf_counter()
        batch = contestant.begin(problem, max_steps)
        while not batch.done:
            batch = advance(batch)
        lines.append(line(contestant, batch, truth, perf_counter() - start))
    return tuple(lines)


def entry(method: str, name: str, **controls: Any) -> float:
    """One entry of the table on the benchmark's 25 seeds.

    Parameters
    ----------
    method : str
        A method that races.
    name : str
        "median_rre" (degrees), "median_rte" (world units), "turned", "close",
        "median_steps", or a kind of stop to count, such as "converged".
    **controls
        Of `solvers.race.Controls`.

    Returns
    -------
    float
        The entry. The run is cached, so its other entries cost nothing.

    Raises
    ------
    ValueError
        If the method is unknown or does not race, the name is unknown, or a control is
        out of its range.
    TypeError
        If there is no such control.

    Examples
    --------
    >>> from solvers.benchmark import entry
    >>> entry("icp", "turned", degrees=10.0, distance=0.2, setting="clean")
    25.0
    """
    validate.one_of(name, [*_ENTRIES, *(status.label for status in Status)], "name")
    result = _run(racing(method, "method"), Controls(**controls))
    return float(getattr(result, name)) if name in _ENTRIES else float(result.stops.get(name, 0))


_ENTRIES = ("median_rre", "median_rte", "turned", "close", "median_steps")


@cache
def _run(contestant: Contestant, controls: Controls) -> Line:
    (row,) = benchmark(controls, contestants=[contestant])
    return row


def table(lines: Sequence[Line]) -> str:
    """The benchmark's table as text, one row per contestant.

    Parameters
    ----------
    lines : sequence of Line
        The result of `benchmark`.

    Returns
    -------
    str
        A heading, the rows, and the total time in milliseconds.

    Raises
    ------
    ValueError
        If `lines` is not a sequence of Line.

    Examples
    --------
    >>> from solvers.benchmark import table
    >>> print(table([]).splitlines()[0].split())
    ['method', 'RRE', 'RTE', 'RRE<5°', 'and', '<.2u', 'steps', 'ms', 'stops', '(of', '0)']
    """
    lines = [of_kind(entry, Line, "lines") for entry in several(lines, "lines", "Line")]
    n = len(lines[0].rre) if lines else 0
    head = f"{'method':20}{'RRE':>9}{'RTE':>9}{'RRE<5°':>9}{'and <.2u':>10}{'steps':>7}{'ms':>8}  stops (of {n})"
    rows = [
        f"{x.contestant.label:20}{x.median_rre:8.2f}°{x.median_rte:7.3f} u{x.turned:9d}{x.close:10d}"
        f"{x.median_steps:7.0f}{1e3 * x.seconds:8.0f}  " + ", ".join(f"{n} {name}" for name, n in x.stops.items())
        for x in lines
    ]
    total = f"{'all':20}{'':44}{1e3 * sum(x.seconds for x in lines):8.0f}"
    return "\n".join([head, *rows, total])
