"""What a registration returns, for one problem, a batch or a list."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, fields, is_dataclass, replace
from importlib import import_module
from typing import TYPE_CHECKING, Any, cast

import numpy as np
from numpy.typing import ArrayLike

from solvers.core import validate
from solvers.core.arrays import AnyArray, BoolArray, FloatArray, IntArray, ReasonArray, StatusArray, leading
from solvers.core.method import State
from solvers.core.numbers import unequal
from solvers.core.partners import NONE
from solvers.core.pose import Pose
from solvers.core.poses import stacked
from solvers.core.registry import METHODS
from solvers.core.status import RULED, Status, ended
from solvers.core.stepper import Batch, History
from solvers.core.tree import take

if TYPE_CHECKING:
    from solvers.uncertainty.region import Covariance


@dataclass(frozen=True, eq=False)
class Result:
    """What `register` found.

    The leading axes `...` are those of the problem: none for a single one.

    Attributes
    ----------
    method : str
        The method's name.
    pose : Pose
        T with T(source) ≈ target.
    status : ndarray of int8, shape (...), or Status
        How each problem stopped; a `Status` for a single problem.
    reason : ndarray of object, shape (...), or str
        Why it stopped, possibly empty.
    steps : ndarray of int, shape (...), or int
        The steps taken.
    objective : ndarray of shape (...)
        The function that the method minimises, at `pose`; each method has its own, in
        its own unit.
    history : History
        Poses and objective from the start to the last of k steps, (k + 1, ...).
    states : tuple
        The method's final states with all their details: one for a batch, one per cloud
        for a list of clouds. Their arrays have one leading problem axis; `detail` reads
        them in the shape of the problem.
    partners : callable, optional
        `Method.partners` of a method of your own; None for those of `METHODS`.

    Examples
    --------
    >>> import numpy as np
    >>> from solvers import register
    >>> from solvers.scenes import kabsch_scene
    >>> scene = kabsch_scene("clean")
    >>> result = register(scene.source, scene.target, "kabsch")
    >>> result
    Result(kabsch: converged, steps=1, pose=Pose(angle=50°, t=(2.6, 0.9), scale=1))
    >>> result.detail("determinant"), result.converged, result.ended
    (np.int8(1), True, True)
    >>> result.matrix.shape, result.covariance.made_by
    ((3, 3), 'hessian')
    >>> result.correspondences[:3], result.fitness, result.rmse.round(6)
    (array([0, 1, 2]), np.float64(1.0), np.float64(0.0))

    A search also proves how low the objective can be:

    >>> found = register(scene.source, scene.target, "branch-and-bound")
    >>> bool(found.lower <= found.objective), bool(found.gap == found.objective - found.lower)
    (True, True)

    A batch can be indexed and iterated over:

    >>> batch = register(np.stack([scene.source, scene.target]), scene.target, "kabsch")
    >>> [one.status.label for one in batch], batch[1].steps
    (['converged', 'converged'], 1)
    """

    method: str
    pose: Pose
    status: StatusArray | Status
    reason: ReasonArray | str
    steps: IntArray | int
    objective: FloatArray
    history: History
    states: tuple[State, ...]
    partners: Callable[[Any], IntArray] | None = None

    @property
    def converged(self) -> BoolArray | bool:
        """Whether the method's own stopping rule was met; the pose may still be wrong.

        False for `Status.FINISHED`, where the method has no such rule.
        """
        return self.status in RULED if isinstance(self.status, Status) else np.isin(self.status, RULED)

    @property
    def ended(self) -> BoolArray | bool:
        """Whether the method stopped of its own accord: neither `CAPPED` nor `DEGENERATE`, nor cut short, (...).

        For a single problem the same as `bool(status)`; the pose may still be wrong.
        """
        return ended(self.status)

    @property
    def matrix(self) -> FloatArray:
        """The pose as homogeneous matrices, (..., d + 1, d + 1)."""
        return self.pose.matrix

    @property
    def lower(self) -> FloatArray | None:
        """A proved lower bound of the objective over the poses that were searched, (...).

        None for a method that proves nothing.
        """
        if not all(hasattr(state, "lower") for state in self.states):
            return None
        values = np.concatenate([np.atleast_1d(cast(Any, state).lower) for state in self.states])
        return cast(FloatArray, values.reshape(np.shape(self.objective))[()])

    @property
    def gap(self) -> FloatArray | None:
        """How much lower another pose's objective may be, at most, (...).

        It concerns the objective, not the truth. None for a method that proves nothing.
        """
        lower = self.lower
        return None if lower is None else np.asarray(self.objective - lower)[()]

    @property
    def correspondences(self) -> Any:
        """The target row that each source row is paired with at the end, int of shape (..., m).

        −1 where it has no partner; for a list of several clouds a list, one entry per cloud.
        If `pairs` (k, 2) were given, both clouds have one row per pair: entry i is i, or −1
        if pair i is not used, and `pairs[found[found >= 0]]` are the pairs used.
        None for a method without single partners, such as a soft one.
        """
        partners = self._pairing()
        if partners is None:
            return None
        pairings = [partners(state) for state in self.states]
        return [rows[0] for rows in pairings] if len(pairings) > 1 else _shaped(pairings[0], self.pose.batch)

    @property
    def fitness(self) -> FloatArray | None:
        """The fraction of source rows, or of the `pairs` given, with a partner, (...).

        With a gate or a bound that decides which rows have a partner, it says how much of the
        source supports the answer. Without one, and without a trim, `icp` gives every row a
        partner, and the fraction is 1 however wrong the pose; `trimmed-icp` always keeps its
        share. `solvers.verify.evidence(...).share` counts what lies near, whatever the method.
        None if `correspondences` is.
        """
        return self._of_partners(lambda squares, used: used.mean(axis=-1))

    @property
    def rmse(self) -> FloatArray | None:
        """The root mean square distance of the partners at the answer, world units, (...).

        Infinite if there are none, None if `correspondences` is. It is not the error of the
        pose.
        """
        return self._of_partners(
            lambda squares, used: np.where(
                used.any(axis=-1), np.sqrt(squares.sum(axis=-1) / np.maximum(used.sum(axis=-1), 1)), np.inf
            )
        )

    @property
    def covariance(self) -> Covariance | None:
        """The covariance of the pose, in closed form from the last pairs.

        Its `made_by` is "hessian". It estimates the noise from the residuals: from few pairs its regions are too small.
        None for a method without a closed form, in 3-D, and with a scale. It takes each partner as given, and is mostly
        overconfident for methods that find their own pairs: `solvers.uncertainty` has other ways, and its `covariance`
        says how often regions hold the truth.
        """
        return cast("Covariance | None", import_module("solvers.uncertainty.closed_form").offered(self))

    def _pairing(self) -> Callable[[Any], IntArray] | None:
        return METHODS[self.method].partners if self.partners is None and self.method in METHODS else self.partners

    def _of_partners(self, measure: Callable[[FloatArray, BoolArray], FloatArray]) -> FloatArray | None:
        """The values of `measure(squares, used)`, once per state: squared distances, zero without a partner, and
        where there is one, both (b, m)."""
        partners = self._pairing()
        if partners is None:
            return None
        values = []
        for state in self.states:
            rows = partners(state)
            problem, used = state.problem, rows != NONE
            q = np.take_along_axis(problem.target, np.maximum(rows, 0)[..., None], axis=1)
            with np.errstate(under="ignore"):
                squares = np.square(state.pose.apply(problem.source) - q).sum(axis=-1)
                values.append(measure(np.where(used, squares, 0.0), used))
        return np.concatenate(values).reshape(np.shape(self.objective))[()]

    def transform(self, points: ArrayLike | Sequence[ArrayLike]) -> Any:
        """Move points by the pose.

        Parameters
        ----------
        points : array_like of shape (..., n, d), or list of (n, d) arrays
            The points, in source coordinates. Clouds of unequal size are a list, one
            for each problem.

        Returns
        -------
        ndarray of shape (..., n, d), or list of (n, d) arrays
            The points in target coordinates; a list for clouds of unequal size.

        Raises
        ------
        ValueError
            If the points are not of the pose's dimension or do not broadcast with it,
            or there is not one cloud per problem.

        Examples
        --------
        >>> from solvers import register
        >>> result = register([[0.0, 0.0], [2.0, 0.0]], [[1.0, 1.0], [1.0, 3.0]], "kabsch")
        >>> result.transform([[1.0, 3.0]]).round(6)
        array([[-2.,  2.]])
        """
        if not unequal(points):
            return self.pose.apply(cast(ArrayLike, points))
        if self.pose.batch != (len(points),):
            raise ValueError(f"points: there are {len(points)} clouds, but poses of shape {self.pose.batch}")
        return [self.pose[k].apply(cloud) for k, cloud in enumerate(points)]

    def inverse(self) -> Pose:
        """The pose that maps target to source coordinates.

        Returns
        -------
        Pose
            The inverse of `pose`.

        Raises
        ------
        ValueError
            If the pose has a scale of zero.

        Examples
        --------
        >>> from solvers import register
        >>> result = register([[0.0, 0.0], [2.0, 0.0]], [[1.0, 1.0], [1.0, 3.0]], "kabsch")
        >>> result.inverse()
        Pose(angle=-90°, t=(-1, 1), scale=1)
        """
        return self.pose.inverse()

    def detail(self, name: str) -> Any:
        """A field of the final state, in the shape of the problem.

        Parameters
        ----------
        name : str
            A field of the method's state, such as "singular_values" of `kabsch`.

        Returns
        -------
        object
            The field's value; for a list of several clouds a list, one entry per cloud.

        Raises
        ------
        ValueError
            If the state has no such field.
        """
        names = [f.name for f in fields(cast(Any, self.states[0]))]
        validate.one_of(name, names, "name")
        batch = self.pose.batch
        if len(self.states) > 1:
            return [_shaped(getattr(state, name), ()) for state in self.states]
        return _shaped(getattr(self.states[0], name), batch)

    def __getitem__(self, index: Any) -> Result:
        """The result of one problem of a batch, or of several: any numpy index of the leading axes.

        That of one problem is what `register` returns for it alone, with a history as long as its own run.
        """
        if not self.pose.batch:
            raise TypeError("the result of one problem has no parts")
        problems = np.arange(self.pose.R[..., 0, 0].size).reshape(self.pose.batch)[index]
        single, index = problems.ndim == 0, leading(index, self.pose.batch)
        rows = np.ravel(problems)
        steps, status, reason = (np.asarray(value)[index] for value in (self.steps, self.status, self.reason))
        until = (slice(int(steps) + 1 if single else None), *(index if isinstance(index, tuple) else (index,)))
        many = len(self.states) > 1 and rows.size > 0
        return Result(
            method=self.method,
            pose=self.pose[index],
            status=Status(int(status)) if single else status,
            reason=str(reason) if single else reason,
            steps=int(steps) if single else steps,
            objective=self.objective[index],
            history=History(self.history.poses[until], self.history.objective[until]),
            states=tuple(self.states[k] for k in rows) if many else (take(self.states[0], rows),),
            partners=self.partners,
        )

    def __iter__(self) -> Iterator[Result]:
        """The results along a batch's first axis."""
        return (self[k] for k in range(len(self)))

    def __len__(self) -> int:
        """The size of a batch's first axis."""
        if not self.pose.batch:
            raise TypeError("the result of one problem has no length")
        return self.pose.batch[0]

    def __bool__(self) -> bool:
        """As `bool(status)`, for a single problem. Raises ValueError for a batch."""
        if self.pose.batch:
            raise ValueError(f"a batch of shape {self.pose.batch} is neither true nor false; ended has one for each")
        return bool(self.status)

    def __repr__(self) -> str:
        if self.pose.batch:
            count = np.bincount(np.ravel(self.status), minlength=len(Status))
            text = ", ".join(f"{n} {Status(k).label}" for k, n in enumerate(count) if n)
        else:
            text = f"{Status(int(self.status)).label}{f' ({self.reason})' if self.reason else ''}, steps={self.steps}"
        return f"Result({self.method}: {text}, pose={self.pose!r})"


def from_batch(done: Batch[Any], history: History, axes: tuple[int, ...]) -> Result:
    """The result of one run, its problem axis reshaped to the leading axes `axes`."""
    state, partners = done.state(), done.method.partners
    registered = METHODS.get(done.method.name)
    return Result(
        method=done.method.name,
        pose=_shaped(state.pose, axes),
        status=_shaped(state.status, axes) if axes else Status(int(state.status[0])),
        reason=_shaped(state.reason, axes),
        steps=_shaped(done.steps, axes) if axes else int(done.steps[0]),
        objective=_shaped(state.objective, axes),
        history=History(_shaped(history.poses, axes, 1), _shaped(history.objective, axes, 1)),
        states=(state,),
        partners=None if registered and registered.partners is partners else partners,
    )


def side_by_side(results: Sequence[Result]) -> Result:
    """Single results joined into that of a batch; shorter histories repeat their last
    entry.
    """
    longest = max(len(r.history.objective) for r in results)

    def course(series: Callable[[History], AnyArray]) -> AnyArray:
        return np.stack([_lengthened(series(r.history), longest) for r in results], axis=1)

    return Result(
        method=results[0].method,
        pose=stacked([r.pose for r in results]),
        status=np.array([r.status for r in results], dtype=np.int8),
        reason=np.array([r.reason for r in results], dtype=object),
        steps=np.array([r.steps for r in results], dtype=np.int64),
        objective=np.array([r.objective for r in results]),
        history=History(
            Pose.trusted(
                course(lambda h: h.poses.R),
                course(lambda h: h.poses.t),
                course(lambda h: np.asarray(h.poses.scale)),
            ),
            course(lambda h: h.objective),
        ),
        states=tuple(state for r in results for state in r.states),
        partners=results[0].partners,
    )


def _lengthened(course: AnyArray, length: int) -> AnyArray:
    return course[np.minimum(np.arange(length), len(course) - 1)]


def _shaped(value: Any, axes: tuple[int, ...], at: int = 0) -> Any:
    """Reshape the problem axis at position `at` to `axes`; an array left without axes
    becomes a scalar.
    """
    if isinstance(value, Pose):
        return Pose.trusted(*(_shaped(np.asarray(getattr(value, part)), axes, at) for part in ("R", "t", "scale")))
    if isinstance(value, np.ndarray):
        return value.reshape((*value.shape[:at], *axes, *value.shape[at + 1 :]))[()]
    if is_dataclass(value) and not isinstance(value, type):
        own = [f.name for f in fields(value) if not f.metadata.get("shared")]
        return replace(value, **{name: _shaped(getattr(value, name), axes, at) for name in own})
    return value
