"""Evidence for judging a registration when the truth is unknown.

Overlap, residuals, conditioning, agreement: none of them is a proof. All points of a scan
share whatever misled the fit, so a wrong pose that lays wall on wall passes every check.
Only independent information, such as a motion prediction, can tell (`solvers.metrics.rre`
and `rte` against the predicted pose). The thresholds are up to the caller.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, TypeVar, cast

import numpy as np
from numpy.typing import ArrayLike

from solvers.api import register
from solvers.core import validate
from solvers.core.arrays import FloatArray
from solvers.core.brief import brief
from solvers.core.cloud_lists import ndim, one_by_one
from solvers.core.kinds import of_kind
from solvers.core.method import Method
from solvers.core.numbers import array, unequal
from solvers.core.pose import Pose
from solvers.core.registry import method_of
from solvers.core.status import Status
from solvers.geometry import downsample, nearest
from solvers.geometry.normals import normals
from solvers.numerics import gauss_newton
from solvers.numerics.fits import weighted_centroid, weighted_radius

_Judgement = TypeVar("_Judgement")
_AXES = {"source": 2, "target": 2, "weights": 1, "seed": 0}
"""The number of axes that each argument has for a single cloud."""
SPACINGS = 3.0
"""The default reach in point spacings of the target: longer than the noise and than the gap between two points."""


@dataclass(frozen=True, eq=False)
class Evidence:
    """What two clouds say about a pose.

    A moved source point is explained if a target point lies within reach of it.

    Attributes
    ----------
    explained : ndarray of bool, shape (..., m)
        Which of the moved source points are explained; for a list of clouds of unequal
        size, a list of such arrays.
    share : ndarray of shape (...)
        The fraction of source points that are explained.
    rms : ndarray of shape (...)
        The root mean square distance of the explained points to their nearest target
        points, in world units; 0 if none is explained.
    weakest : ndarray of shape (...)
        The smallest eigenvalue of their point-to-plane system
        (`solvers.numerics.gauss_newton`) divided by the largest: 0 if a motion is free.

    Examples
    --------
    >>> from solvers.verify import evidence
    >>> from solvers.wall_scenes import single_wall
    >>> wall = single_wall(noise=0.0)
    >>> found = evidence(wall.source, wall.target, wall.truth)
    >>> float(found.share), bool(found.weakest < 1e-9)
    (1.0, True)
    """

    explained: Any
    share: FloatArray
    rms: FloatArray
    weakest: FloatArray

    __repr__ = brief


def usual_reach(target: ArrayLike | Sequence[ArrayLike]) -> FloatArray:
    """The default distance within which a target point explains a source point.

    Parameters
    ----------
    target : array_like of shape (..., n, d), or list of (n, d) arrays
        The fixed points, in world units. Pass clouds of unequal size as a list.

    Returns
    -------
    ndarray of shape (...)
        Three times each target's point spacing (`solvers.thinning.spacing`), in world
        units; 1 if all its points are equal.

    Raises
    ------
    ValueError
        If `target` is not a cloud.

    Examples
    --------
    >>> from solvers.verify import usual_reach
    >>> usual_reach([[0.0, 0.0], [2.0, 0.0], [4.0, 0.0]])
    np.float64(6.0)
    """
    if unequal(target):
        return np.array(one_by_one(len(target), lambda k: usual_reach(target[k])))
    q = validate.cloud(cast(ArrayLike, target), "target")
    reaches = [SPACINGS * downsample.spacing(cloud) or 1.0 for cloud in q.reshape(-1, *q.shape[-2:])]
    return np.array(reaches).reshape(q.shape[:-2])[()]


def evidence(
    source: ArrayLike | Sequence[ArrayLike], target: ArrayLike | Sequence[ArrayLike], pose: Pose,
    reach: float | None = None,
) -> Evidence:  # fmt: skip
    """Judge poses by the clouds alone, in the plane.

    Leading axes broadcast against each other, and clouds of unequal size are passed as
    lists, both as for `solvers.register`.

    Parameters
    ----------
    source : array_like of shape (..., m, 2), or list of (m, 2) arrays
        The points to move, in world units.
    target : array_like of shape (..., n, 2), or list of (n, 2) arrays
        The fixed points.
    pose : Pose
        The poses to judge, of shape (...).
    reach : float, optional
        The distance within which a target point explains a source point: in world
        units, of the order of spacing and noise. None is each target's `usual_reach`.

    Returns
    -------
    Evidence
        What is explained, how closely, and whether a motion is free.

    Raises
    ------
    ValueError
        If `pose` is not a Pose, if an argument is not planar, if leading axes do not
        broadcast, or if the reach is not positive.

    Examples
    --------
    A pose half a turn off explains a rectangular hall as well as the truth does:

    >>> import numpy as np
    >>> from solvers import Pose
    >>> from solvers.verify import evidence
    >>> from solvers.wall_scenes import hall
    >>> scene = hall()
    >>> evidence(scene.source, scene.target, scene.truth).share.round(2)
    np.float64(1.0)
    >>> wrong = Pose.from_angle(np.pi)
    >>> evidence(scene.source, scene.target, wrong).share.round(2)
    np.float64(1.0)
    """
    if unequal(source) or unequal(target):
        inputs = {"source": source, "target": target, "pose": of_kind(pose, Pose, "pose")}
        return _side_by_side(_one_by_one(inputs, lambda **own: evidence(**own, reach=reach)))
    p, q = validate.cloud(cast(ArrayLike, source), "source"), validate.cloud(cast(ArrayLike, target), "target")
    of_kind(pose, Pose, "pose")
    for name, d in (("source", p.shape[-1]), ("target", q.shape[-1]), ("pose", pose.dim)):
        if d != 2:
            raise ValueError(f"{name}: evidence is planar, expected 2 dimensions, got {d}")
    near = usual_reach(q) if reach is None else validate.number(reach, "reach", 1e-100, 1e100)
    axes = validate.batch_shape(source=p.shape[:-2], target=q.shape[:-2], pose=pose.batch)
    if 0 in axes:
        raise ValueError(f"pose: a batch of shape {axes} holds nothing to judge")
    moved, index = _flat(pose.apply(p), axes), nearest.build(_flat(q, axes))
    rows, squares = index.nearest(moved)
    explained = nearest.within(squares, np.broadcast_to(near, axes).reshape(-1))
    rms = np.sqrt(np.where(explained, squares, 0.0).sum(axis=1) / np.maximum(explained.sum(axis=1), 1))
    surface = normals(index)
    has_normal = explained & ~np.take_along_axis(surface.flagged, rows, axis=1)
    n = np.take_along_axis(surface.vectors, rows[..., None], axis=1)
    partners = np.take_along_axis(index.points, rows[..., None], axis=1)
    used = has_normal.astype(np.float64)
    centre, radius = weighted_centroid(moved, used), weighted_radius(moved, used)
    system = gauss_newton.system(moved, partners, n[..., :, None] * n[..., None, :], used, centre, radius)
    largest = system.eigenvalues[:, -1]
    weakest = np.where(largest > 0.0, system.eigenvalues[:, 0] / np.where(largest > 0.0, largest, 1.0), 0.0)
    return Evidence(
        explained.reshape(*axes, -1),
        explained.mean(axis=1).reshape(axes)[()],
        rms.reshape(axes)[()],
        np.maximum(weakest, 0.0).reshape(axes)[()],
    )


def _one_by_one(inputs: dict[str, Any], judge: Callable[..., _Judgement]) -> list[_Judgement]:
    """Call `judge` for each cloud of a list, with its own or the shared value of each input, by name."""
    n = len(inputs["source"] if unequal(inputs["source"]) else inputs["target"])
    axes = {name: _extra_axes(x, name) for name, x in inputs.items()}
    for name, x in inputs.items():
        if axes[name] not in (0, 1) or (axes[name] == 1 and len(x) != n):
            raise ValueError(f"{name}: expected one for all {n} clouds, or one for each")
    return one_by_one(n, lambda k: judge(**{name: x[k] if axes[name] else x for name, x in inputs.items()}))


def _extra_axes(x: Any, name: str) -> int:
    """The number of leading axes of an argument given with lists of clouds: 1 for an entry per cloud, 0 if shared."""
    if isinstance(x, Pose):
        return len(x.batch)
    if isinstance(x, list | tuple) and any(row is None or 0 < _AXES[name] == ndim(row) for row in x):
        return 1
    return 0 if x is None and name == "weights" else array(x, name).ndim - _AXES[name]


def _side_by_side(parts: list[Evidence]) -> Evidence:
    return Evidence(
        [part.explained for part in parts],
        *(np.array([getattr(part, name) for part in parts]) for name in ("share", "rms", "weakest")),
    )


def _flat(points: FloatArray, axes: tuple[int, ...]) -> FloatArray:
    """The clouds (..., n, 2) broadcast to the leading axes `axes` and flattened to one per problem, (b, n, 2)."""
    return np.broadcast_to(points, (*axes, *points.shape[-2:])).reshape(-1, *points.shape[-2:])


def halves(
    source: ArrayLike | Sequence[ArrayLike], target: ArrayLike | Sequence[ArrayLike], pose: Pose,
    method: str | Method[Any] = "icp", *, weights: ArrayLike | Sequence[ArrayLike | None] | None = None, **options: Any,
) -> FloatArray:  # fmt: skip
    """How far apart two runs end, each on half of the source points.

    One gets every second point from the first on, the other the rest. Both get the
    whole target (with a paired method, their points' partners) and begin at `pose`.
    Agreement does not make the pose right: both runs may come to rest at the same wrong
    one. Clouds of unequal size are passed as lists, as for `solvers.register`.

    Parameters
    ----------
    source : array_like of shape (..., m, d), or list of (m, d) arrays
        The points to move, in world units, m ≥ 2.
    target : array_like of shape (..., n, d), or list of (n, d) arrays
        The fixed points.
    pose : Pose
        Where both runs start, of shape (...).
    method : str or Method, default "icp"
        As for `solvers.register`.
    weights : array_like of shape (..., m), or list, optional
        Weights of all source points; each run uses those of its half. For a list of
        clouds, a list has one entry per cloud, None for no weights.
    **options
        As for `solvers.register`, except `start` and `pairs`.

    Returns
    -------
    ndarray of shape (...)
        The RMS distance between where the two end poses put the source, world units;
        NaN if a run is degenerate: where half of the points do not determine a pose,
        agreement would say nothing.

    Raises
    ------
    ValueError
        If the source is a single point, if `pose` is not a Pose, if `pairs` or `start`
        is given, or if `solvers.register` rejects an argument.

    Examples
    --------
    >>> from solvers.scenes import room, room_start
    >>> from solvers.verify import halves
    >>> scene = room("clean")
    >>> apart = halves(scene.source, scene.target, room_start(20.0, 0.8), gate=2.6)
    >>> bool(apart < 0.1)
    True
    """
    if unequal(source) or unequal(target):
        inputs = {"source": source, "target": target, "pose": of_kind(pose, Pose, "pose"), "weights": weights}
        if "seed" in options:
            inputs["seed"] = validate.seeds(options.pop("seed"))
        return np.array(_one_by_one(inputs, lambda **own: halves(**own, method=method, **options)))
    p = validate.cloud(cast(ArrayLike, source), "source")
    validate.pose(of_kind(pose, Pose, "pose"), p.shape[-1], "pose")
    if p.shape[-2] < 2:
        raise ValueError("source: one point has no two halves")
    if "start" in options:
        raise ValueError("start: both runs begin at the pose that is judged; leave it out")
    if "pairs" in options:
        raise ValueError("pairs: they name rows of the whole source, and each run sees half of it")
    q = validate.matched(p, cast(ArrayLike, target))[1] if method_of(method).paired else None
    w = None if weights is None else validate.weights(cast(ArrayLike, weights), p.shape[-2])
    ends, valid = [], np.True_
    for part in (0, 1):
        half = None if w is None else w[..., part::2]
        fixed = target if q is None else q[..., part::2, :]
        result = register(p[..., part::2, :], fixed, method, start=pose, weights=half, **options)
        ends.append(result.pose.apply(p))
        valid = valid & (np.asarray(result.status) != Status.DEGENERATE)
    apart: FloatArray = np.sqrt(np.square(ends[0] - ends[1]).sum(axis=-1).mean(axis=-1))
    return np.where(valid, apart, np.nan)[()]
