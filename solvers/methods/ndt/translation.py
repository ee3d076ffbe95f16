"""Climbing the NDT score by translations alone, recording every step tried: the paths drawn on a score map.

It takes the same damped, capped and halved Newton steps as `ndt.ndt`, with the rotation frozen. No translation repairs
a wrong angle, and with one the highest score over translations need not lie near the truth.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from solvers.core import validate
from solvers.core.arrays import BoolArray, FloatArray
from solvers.core.brief import brief
from solvers.core.status import Status
from solvers.methods.ndt.ndt_map import NdtMap
from solvers.methods.ndt.score import evaluate
from solvers.numerics import newton


@dataclass(frozen=True, eq=False)
class Climb:
    """A climb over translations: k trials in order, the start first.

    Attributes
    ----------
    tried : ndarray of shape (k, 2)
        Translations, world units.
    score : ndarray of shape (k,)
        The score there.
    accepted : ndarray of bool, shape (k,)
        Whether the trial was accepted as the next point; true for the start.
    damping : ndarray of shape (k,)
        λ of the Hessian that the step came from, 0 at the start.
    status : Status
        Converged, stalled, capped or degenerate.
    reason : str
        The same in words.

    Examples
    --------
    >>> import numpy as np
    >>> from solvers.ndt_map import build
    >>> from solvers.ndt_translation import climb
    >>> from solvers.scenes import room
    >>> scene = room("clean")
    >>> path = climb(build(scene.target[None], 0.8, grids=4), scene.source, np.array([0.2, 0.1]))
    >>> path.places[0], path.places.shape == (path.accepted.sum(), 2)
    (array([0.2, 0.1]), True)
    """

    tried: FloatArray
    score: FloatArray
    accepted: BoolArray
    damping: FloatArray
    status: Status
    reason: str

    __repr__ = brief

    @property
    def places(self) -> FloatArray:
        """The accepted translations, (j, 2), from the start to the end."""
        return self.tried[self.accepted]


def climb(
    cells: NdtMap,
    points: FloatArray,
    start: FloatArray,
    *,
    max_shift: float | None = None,
    max_steps: int = 70,
    halvings: int = 8,
    tolerance: float = 1e-6,
) -> Climb:
    """Climb the score of points turned beforehand, by translations alone.

    The climb stops when the next step would be at most `tolerance` cells long, when
    neither the step nor any of its halvings raises the score, after `max_steps` steps,
    or, degenerate, if no point lies in a cell at the start.

    Parameters
    ----------
    cells : NdtMap
        The map of one cloud, as from `solvers.ndt_map.build`.
    points : ndarray of shape (m, 2)
        World units.
    start : ndarray of shape (2,)
        The first translation, world units.
    max_shift : float, optional
        The longest step, world units. None is half a cell.
    max_steps : int, default 70
        The largest number of steps.
    halvings : int, default 8
        The most times that a step which does not raise the score is halved.
    tolerance : float, default 1e-6
        A fraction of a cell.

    Returns
    -------
    Climb
        Every translation tried.

    Raises
    ------
    ValueError
        If the map is of more than one cloud, if `max_shift` is not a length, or if
        another number is negative.

    Examples
    --------
    >>> import numpy as np
    >>> from solvers.ndt_map import build
    >>> from solvers.ndt_translation import climb
    >>> from solvers.scenes import room
    >>> scene = room("clean")
    >>> cells = build(scene.target[None], 0.8, grids=4)
    >>> path = climb(cells, scene.source, np.array([0.2, 0.1]))
    >>> bool((np.diff(path.score[path.accepted]) > 0.0).all())
    True
    """
    if len(cells.size) != 1:
        raise ValueError(f"cells: expected the map of one cloud, got {len(cells.size)}")
    h = float(cells.size[0])
    cap = 0.5 * h if max_shift is None else validate.number(max_shift, "max_shift", 1e-100, 1e100)
    validate.count(max_steps, "max_steps")
    validate.count(halvings, "halvings")
    validate.number(tolerance, "tolerance", 0.0)
    t = np.asarray(start, dtype=np.float64)
    pivot = np.zeros((1, 2))
    current = evaluate(cells, (points + t)[None], pivot)
    trials, score, accepted, damping = [t], [float(current.score[0])], [True], [0.0]

    def ended(status: Status, reason: str) -> Climb:
        return Climb(np.array(trials), np.array(score), np.array(accepted), np.array(damping), status, reason)

    if (current.cells < 0).all():
        return ended(Status.DEGENERATE, "no moved point lies in a cell of the map")
    for _ in range(max_steps):
        step, lam = newton.damped_step(current.gradient[:, :2], current.hessian[:, :2, :2])
        step = newton.capped(step, (np.linalg.norm(step, axis=1) / cap,))
        # So short a step is not tried: its gain is rounding error, and would be accepted on one machine but not on
        # another.
        if float(np.linalg.norm(step)) <= tolerance * h:
            return ended(Status.CONVERGED, "the pose has come to rest")
        for _ in range(halvings + 1):
            trial = _rounded(t + step[0], h)
            new = evaluate(cells, (points + trial)[None], pivot)
            better = bool(new.score[0] > current.score[0])
            trials.append(trial)
            score.append(float(new.score[0]))
            accepted.append(better)
            damping.append(float(lam[0]))
            if better:
                break
            step = 0.5 * step
        if not better:
            return ended(Status.STALLED, "no shorter step raises the score on these cells")
        t, current = trial, new
    return ended(Status.CAPPED, f"the cap of {max_steps} steps was reached")


def _rounded(t: FloatArray, h: float) -> FloatArray:
    """t rounded to about 10⁻¹⁰ of a cell. Where the Hessian is nearly singular a step magnifies earlier errors, and
    the rounding of two machines must not grow into two paths.
    """
    unit = 2.0 ** (np.floor(np.log2(h)) - 34.0)
    return np.asarray(np.where(np.abs(t) < unit * 2.0**52, np.round(t / unit) * unit, t))
