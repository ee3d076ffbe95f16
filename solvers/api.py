"""The entry point: `register(source, target, method=…) -> Result`."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import fields, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from solvers.core import validate
from solvers.core.arrays import FloatArray, IntArray
from solvers.core.cloud_lists import ndim, one_by_one
from solvers.core.kinds import function, shown
from solvers.core.log import debug
from solvers.core.method import Method, Problem
from solvers.core.pose import Pose
from solvers.core.registry import MethodName, method_of
from solvers.core.result import Result, from_batch, side_by_side
from solvers.core.stepper import Callback, begin, run

OTHER_NAMES = {"gate": "max_distance", "cap": "max_distance"}
"""The field's usual name of each option; accepted if the method has that option."""
_GATES = ("gate", "cap", "inlier")
_ROUNDED = 1e-2
"""How far from 1 the scale of a rotation can be whose matrix was rounded to two digits."""
_MEANT = {
    **dict.fromkeys(("init", "initial"), ("start",)),
    **dict.fromkeys(("iterations", "max_iteration", "max_iterations"), ("max_steps",)),
    **dict.fromkeys(("max_distance", "max_correspondence_distance", "max_range"), _GATES),
    "overlap": ("keep",),
    "trim_ratio": ("trim",),
    **dict.fromkeys(("resolution", "voxel_size", "cell_size"), ("cells", "cell")),
    **dict.fromkeys(("threshold", "distance_threshold"), ("inlier", "gate", "cap")),
    **dict.fromkeys(("w", "outlier_ratio"), ("clutter", "outliers")),
}
"""Argument names of other libraries, with the likely names here: suggested in the message, not accepted."""


def register(
    source: ArrayLike | Sequence[ArrayLike],
    target: ArrayLike | Sequence[ArrayLike],
    method: MethodName | str | Method[Any] = "icp",
    *,
    options: Any = None,
    start: Pose | ArrayLike | None = None,
    pairs: ArrayLike | None = None,
    weights: ArrayLike | Sequence[ArrayLike | None] | None = None,
    seed: int | Sequence[int] | IntArray | np.random.Generator | None = 0,
    max_steps: int | None = None,
    callback: Callback | None = None,
    **keywords: Any,
) -> Result:
    """Find the pose that maps the source to the target.

    Leading axes form a batch. Those of `source`, `target`, `start`, `seed`, `pairs` and
    `weights` broadcast against each other: one pair of clouds with a thousand starts is
    a batch of a thousand. Pass clouds of unequal size as a list of (m, d) arrays; they
    are run one by one, and the result is shaped like a batch, even for a list of one.
    The other inputs are then either shared by all clouds or given once for each, as a
    list or as an array with one leading axis.

    Parameters
    ----------
    source : array_like of shape (..., m, d), or list of (m, d) arrays
        The points to move, in world units.
    target : array_like of shape (..., n, d), or list of (n, d) arrays
        The fixed points, in world units.
    method : str or Method, default "icp"
        A name in `METHODS`, or a method of your own (`solvers.stepper.Method`).
    options : object, optional
        The method's own options as one object, an instance of
        `METHODS[method].options`.
    start : Pose or array_like of shape (..., d + 1, d + 1), optional
        Where local methods start: poses, or their homogeneous matrices. None is the
        identity. The scale must be 1 for a method that finds rigid motions.
    pairs : array_like of int, shape (..., k, 2), optional
        Rows of source and target that correspond, for paired methods. None pairs row i
        with row i.
    weights : array_like of shape (..., m) or (..., k), optional
        Weights of the source rows, or of the pairs if given; not negative. None means
        all ones. A list with one entry for each cloud may contain None.
    seed : int, array_like of int of shape (...), Generator or None, default 0
        The seed of random methods, one for all problems or one each; with one each, a
        batch equals its single runs. A Generator draws one for all problems; None uses
        a different seed each time.
    max_steps : int, optional
        The step limit. None is the method's own.
    callback : callable, optional
        Called as `callback(k, state)` after every step k = 1, 2, … with the states of
        all problems (with one leading axis even for a single problem). Returning a true
        value ends the run. Each cloud of a list is a separate run: the states are that
        cloud's, k restarts at 1, and a true value ends only that run.
    **keywords
        The same options one by one: the fields of `METHODS[method].options`.
        `max_distance` is accepted for `gate` and for `cap`.

    Returns
    -------
    Result
        The pose, how the run stopped, and its history, in the shape of the batch.

    Raises
    ------
    ValueError
        If an argument is not a valid point cloud, pose, weight, pair or seed, if shapes
        do not match, if the method or an option is unknown or out of range, or if the
        callback cannot be called. The message names the argument.

    Notes
    -----
    Geometry never raises: a problem that does not determine its answer gets
    `Status.DEGENERATE` and a reason, and the rest of its batch continues. Each method's
    docstring cites its paper.

    Examples
    --------
    Two scans of one room, started 20° and 0.8 u away from the truth:

    >>> import numpy as np
    >>> from solvers import Pose, register
    >>> from solvers.metrics import rre, rte
    >>> from solvers.scenes import room, room_start
    >>> scene = room("clean")
    >>> start = room_start(degrees=20.0, distance=0.8)
    >>> result = register(scene.source, scene.target, "icp", start=start, gate=2.6)
    >>> result.status.label
    'converged'
    >>> print(f"{np.degrees(rre(result.pose, scene.truth)):.2f}°")
    0.16°
    >>> print(f"{rte(result.pose, scene.truth):.3f} u")
    0.008 u

    A batch of three starts:

    >>> starts = Pose.from_angle(np.radians([0.0, 20.0, 170.0]), np.zeros((3, 2)))
    >>> batch = register(scene.source, scene.target, "icp", start=starts)
    >>> batch.matrix.shape
    (3, 3, 3)
    >>> np.degrees(rre(batch.pose, scene.truth)) < 5.0
    array([ True,  True, False])
    """
    solver = method_of(method)
    own = _options(solver, options, keywords)
    function(callback, "callback")
    if isinstance(start, Result):
        raise ValueError("start: expected a Pose or its matrix, got a Result; pass result.pose")
    poses, seeds = validate.start(start), validate.seeds(seed)
    cap = None if max_steps is None else validate.count(max_steps, "max_steps")

    def solve(source: Any, target: Any, start: Any, pairs: Any, weights: Any, seed: Any) -> Result:
        problem, axes = _problem(solver, source, target, start, pairs, weights, seed)
        debug(
            "%s: %d points on to %d, a batch of %d, %s",
            solver.name, problem.source.shape[1], problem.target.shape[1], problem.size, own,
        )  # fmt: skip
        result = from_batch(*run(begin(solver, problem, own, cap), callback), axes)
        debug("%r", result)
        return result

    if _is_list(source, "source") or _is_list(target, "target"):
        return _one_by_one(source, target, poses, pairs, weights, seeds, solve)
    return solve(source, target, poses, pairs, weights, seeds)


def _options(method: Method[Any], whole: Any, keywords: dict[str, Any]) -> Any:
    names = [f.name for f in fields(method.options)]
    if whole is not None:
        if type(whole) is not method.options:
            raise ValueError(f"options: method {method.name!r} takes {method.options.__name__}, got {shown(whole)}")
        if keywords:
            raise ValueError(f"{next(iter(keywords))}: give the options as one object or one by one, not both")
        own: Any = whole
        return replace(own, **_plain({name: getattr(own, name) for name in names}))
    for option, name in OTHER_NAMES.items():
        if name in keywords and option in names:
            if option in keywords:
                raise ValueError(f"{name}: is another name of {option}; give one of them")
            keywords = {option if key == name else key: value for key, value in keywords.items()}
    for name in keywords:
        if name not in names:
            raise ValueError(f"{name}: no option of method {method.name!r}{_hint(name, method, names)}")
    if method.weighted and "weight" in names and isinstance(keywords.get("weight"), np.ndarray | list | tuple):
        raise ValueError("weight: expected the name of a kernel; did you mean 'weights', one number per row?")
    return method.options(**_plain(keywords))


def _plain(options: dict[str, Any]) -> dict[str, Any]:
    """The options with numpy scalars as Python numbers: arithmetic in numpy's small types could overflow."""
    return {name: validate.scalar(value) for name, value in options.items()}


def _hint(wrong: str, method: Method[Any], options: list[str]) -> str:
    """The end of the message about an unknown option: the name probably meant, and what the method takes."""
    inputs = (("pairs", method.paired), ("weights", method.weighted))
    parameters = [*options, *(name for name, accepted in inputs if accepted)]
    names = [*parameters, "start", "seed", "max_steps"]
    candidates = [name for name in _MEANT[wrong] if name in names] if wrong in _MEANT else [wrong]
    near = validate.nearest(candidates[0], names) if candidates else ""
    return f"{near}; it takes: {', '.join(parameters)}" if parameters else f"{near}; it takes no options"


def _problem(
    method: Method[Any], source: Any, target: Any, start: Any, pairs: Any, weights: Any, seeds: IntArray
) -> tuple[Problem, tuple[int, ...]]:
    """The validated problem, its leading axes flattened into one, and the shape of those axes."""
    p = validate.cloud(source, "source")
    d = p.shape[-1]
    q = validate.cloud(target, "target", d)
    if method.dims is not None and d not in method.dims:
        choices = " or ".join(str(k) for k in method.dims)
        raise ValueError(f"source: method {method.name!r} works in {choices} dimensions, the points have {d}")
    if pairs is not None:
        if not method.paired:
            raise ValueError(f"pairs: method {method.name!r} finds its own partners and takes none")
        k = validate.pairs(pairs, p.shape[-2], q.shape[-2])
        p, q = _gather(p, k[..., 0], "source"), _gather(q, k[..., 1], "target")
    elif method.paired:
        p, q = validate.matched(p, q, "; pass pairs=(k, 2) to name the partners")
    if weights is not None and not method.weighted:
        raise ValueError(f"weights: method {method.name!r} takes none")
    kernel = isinstance(weights, str) and any(f.name == "weight" for f in fields(method.options))
    w = validate.weights(weights, p.shape[-2], text=f"; a kernel is chosen by weight={weights!r}" if kernel else "")
    pose = validate.pose(start, d)
    if not method.scaled:
        rounded = (np.abs(np.asarray(pose.scale) - 1.0) < _ROUNDED).all()
        hint = ", or if its matrix was rounded, pass Pose(p.R, p.t) of p = Pose.from_matrix(matrix)" if rounded else ""
        advice = f"scale the source first{hint}: method {method.name!r} finds rigid motions and starts at scale 1"
        pose = validate.unscaled(pose, "start", advice)
    batch = validate.batch_shape(
        source=p.shape[:-2], target=q.shape[:-2], weights=w.shape[:-1], start=pose.batch, seed=seeds.shape
    )
    if 0 in batch:
        raise ValueError(f"start, seed: a batch of shape {batch} holds no problem")

    # Copies, because a state that shared memory with the caller's clouds would change with them. In C order, because
    # numpy sums in memory order, which affects the last digits.
    p, q, w = (np.array(values, order="C") for values in (p, q, w))

    def flat(a: Any, tail: tuple[int, ...]) -> Any:
        return np.broadcast_to(a, (*batch, *tail)).reshape(-1, *tail)

    poses = Pose.trusted(flat(pose.R, (d, d)), flat(pose.t, (d,)), flat(np.asarray(pose.scale), ()))
    return Problem(
        flat(p, p.shape[-2:]), flat(q, q.shape[-2:]), flat(w, w.shape[-1:]), poses, flat(seeds, ())
    ), batch


def _gather(points: FloatArray, rows: IntArray, name: str) -> FloatArray:
    batch = validate.batch_shape(**{name: points.shape[:-2], "pairs": rows.shape[:-1]})
    points = np.broadcast_to(points, (*batch, *points.shape[-2:]))
    rows = np.broadcast_to(rows, (*batch, rows.shape[-1]))
    return np.take_along_axis(points, rows[..., None], axis=-2)


def _is_list(clouds: Any, name: str) -> bool:
    """Whether this is a list of clouds, rather than one array or nested numbers. Raises ValueError if only some of its
    entries are clouds.
    """
    if not isinstance(clouds, list | tuple) or not clouds:
        return False
    axes = [ndim(c) for c in clouds]
    if 2 in axes and set(axes) != {2}:
        k = next(k for k, n in enumerate(axes) if n != 2)
        description = "of unequal rows" if axes[k] < 0 else f"of shape {np.shape(clouds[k])}" if axes[k] else "no array"
        raise ValueError(f"{name}: expected clouds of shape (m, d), but number {k} of the list is {description}")
    return set(axes) == {2}


def _one_by_one(
    source: Any, target: Any, start: Any, pairs: Any, weights: Any, seeds: IntArray, solve: Callable[..., Result]
) -> Result:
    """Run each cloud of a list separately, and join the results."""
    inputs = {"source": source, "target": target, "start": start, "pairs": pairs, "weights": weights, "seed": seeds}
    lists = {name: inputs[name] for name in ("source", "target") if _is_list(inputs[name], name)}
    n = len(next(iter(lists.values())))
    if "source" in lists:
        dims = one_by_one(n, lambda k: validate.cloud(source[k], "source").shape[-1])
        index = next((k for k in range(n) if dims[k] != dims[0]), 0)
        if index:
            message = f"number 0 of the list has {dims[0]} and number {index} has {dims[index]}"
            raise ValueError(f"source: expected clouds of one dimension, but {message}")
    # Every other input is shared by all clouds, or given once for each: as a list, or as
    # an array with one leading axis.
    axes = {"source": 2, "target": 2, "pairs": 2, "weights": 1, "seed": 0}
    extra = {name: ndim(x) - axes[name] for name, x in inputs.items() if name in axes and name not in lists}
    extra["start"] = len(start.batch) if isinstance(start, Pose) else 0
    for name in extra:
        x = inputs[name]
        rows = isinstance(x, list | tuple) and (extra[name] < 0 or any(row is None for row in x))
        if rows or extra[name] == 1:
            lists[name] = x
        elif extra[name] > 1:
            shape = x.batch if isinstance(x, Pose) else np.shape(x)
            raise ValueError(f"{name}: expected one for all {n} clouds or one for each, got the shape {shape}")
    for name, x in lists.items():
        if len(x) != n:
            raise ValueError(f"{name}: there are {len(x)}, but {n} clouds")

    def solved(k: int) -> Result:
        result = solve(**{name: lists[name][k] if name in lists else x for name, x in inputs.items()})
        if result.pose.batch:
            raise ValueError(f"is to be one problem, but has leading axes {result.pose.batch}")
        return result

    return side_by_side(one_by_one(n, solved))
