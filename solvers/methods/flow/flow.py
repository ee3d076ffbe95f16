"""A small learned flow.

A network predicts, step after step, where every point of both clouds belongs.

`flow` follows the structure of Register Any Point [1]_ at toy size. It starts from
noise and generates the coordinates of *both* views in a common frame. From the current
coordinates x_t at time t the network predicts the endpoint. Each view's part of it is
projected onto a rigid motion of the view itself (Procrustes against its condition, the
cloud as given), and the coordinates are noised again with the same draw,
`x_t' = (1 − t') x_0 + t' x̂_1`: an Euler step of the straight flow towards the
projected endpoint. Of several samples, the one with the smallest rigidity residual is
kept, and the pose is read out as `A_target⁻¹ ∘ A_source`, with A_v the fit of view v.

`flow-from-source` is a simpler variant: it starts at the source's own coordinates,
keeps the target's fixed, moves only the source, and reads the pose from a rigid fit
between the source's first and last coordinates.

Neither the objective nor the stop is evidence of alignment: the rigidity residual
measures only how nearly the generated coordinates are a rigid copy of each view, and a
run ends when its time is up. It is then *finished*, not converged: there is no test for
rest, and even the last step moves the points.

Attention compares every point of both clouds with every other, which takes about 105 (m
+ n)² bytes of memory. Clouds of more than 3000 points together are therefore refused.

The networks were trained in minutes on synthetic curves (`flow.scenes`); this is an
analogy to the papers and says nothing about them. `flow` needs no starting pose, but it
is not equivariant: the orientation of the input clouds matters, so a start, if given,
is applied to the source first.

References
----------
.. [1] Y. Pan and others, "Register Any Point: scaling 3D point cloud registration by
   flow matching", 2025. arXiv:2512.01850
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from solvers.core import validate
from solvers.core.arrays import FloatArray, IntArray, ReasonArray, StatusArray
from solvers.core.brief import brief
from solvers.core.extent import EQUAL, at_one_place
from solvers.core.method import Method, Problem
from solvers.core.pose import Pose
from solvers.core.status import Status, mark, reasons, statuses
from solvers.core.tree import CONSTANT, SHARED
from solvers.geometry.rigid import fit_rigid
from solvers.methods.flow import network
from solvers.methods.flow.network import Params
from solvers.methods.flow.weights import FOLDER, params

TINY = float(np.finfo(np.float64).tiny)
FAR = 10.0  # RMS radii: coordinates are clipped here for the network, so that its sums stay finite
MOST = 3000  # points of both clouds together: 0.95 GB
WIDE = 1e9  # one cloud's RMS radius over the other's: beyond it the smaller one is a point to the network


@dataclass(frozen=True)
class FlowOptions:
    """Options of `flow`.

    Parameters
    ----------
    steps : int, default 10
        Euler steps from time 0 to 1.
    samples : int, default 4
        The number of noise draws; the one with the smallest rigidity residual is read
        out.
    project : bool, default True
        Whether to replace each view's endpoint by the nearest rigid motion of the view.

    Raises
    ------
    ValueError
        If an option is out of its range. A run raises it, too, for clouds of more than
        3000 points together.

    Examples
    --------
    >>> from solvers import options, register, scenes
    >>> scene = scenes.room("clean")
    >>> register(scene.source, scene.target, "flow", options=options.FlowOptions(steps=4)).steps
    4
    """

    steps: int = 10
    samples: int = 4
    project: bool = True

    def __post_init__(self) -> None:
        validate.count(self.steps, "steps", 1)
        validate.count(self.samples, "samples", 1)
        validate.flag(self.project, "project")


@dataclass(frozen=True, eq=False)
class FlowState:
    """A pose read out of generated coordinates.

    Lengths are in units of the target's RMS radius, coordinates about the target's centroid: the frame of the network.
    radius: (b,) that unit in u. middle: (b, 2) the target's centroid, home: (b, 2) the source's at the start pose, u.
    tokens: (b, m + n, w) the encoded clouds. noise: (b, S, m + n, 2) the starting coordinates of each of S samples.
    given: (b, m + n, 2) both clouds as the network's input, source first, each about its own centroid. time: (b,) in
    [0, 1]. present: (b, S, m + n, 2) the coordinates at that time. predicted: the endpoint predicted in the last step,
    projected: the same with each view made rigid, views: the poses (b, S) of the two views (source, target). rigidity:
    (b, S) mean squared distance between predicted and its rigid version. chosen: (b,) the sample read out. taken: (b,)
    steps so far. The objective is the rigidity residual of the chosen sample, in u².
    """

    problem: Problem = field(metadata=CONSTANT)
    options: FlowOptions = field(metadata=SHARED)
    radius: FloatArray = field(metadata=CONSTANT)
    middle: FloatArray = field(metadata=CONSTANT)
    home: FloatArray = field(metadata=CONSTANT)
    given: FloatArray = field(metadata=CONSTANT)
    tokens: FloatArray = field(metadata=CONSTANT)
    noise: FloatArray = field(metadata=CONSTANT)
    pose: Pose
    objective: FloatArray
    status: StatusArray
    reason: ReasonArray
    time: FloatArray
    present: FloatArray
    predicted: FloatArray
    projected: FloatArray
    views: tuple[Pose, Pose]
    rigidity: FloatArray
    chosen: IntArray
    taken: IntArray

    __repr__ = brief


def _start(problem: Problem, options: FlowOptions, weights: Params, anchored: bool) -> FlowState:
    b, m, n = problem.size, problem.source.shape[1], problem.target.shape[1]
    validate.few(m, n, m + n <= MOST, f"the flows take at most {MOST} together", MOST // 2)
    with np.errstate(over="ignore", under="ignore", invalid="ignore"):
        source = problem.start.apply(problem.source)
        middle, home = problem.target.mean(axis=1), source.mean(axis=1)
        about = source - home[:, None], problem.target - middle[:, None]
        width, radius = _radius(about[0]), _radius(about[1])
        equal = {"source": at_one_place(source), "target": at_one_place(problem.target)}
        flat = equal["source"] | equal["target"] | ~(np.minimum(width, radius) >= TINY)
        unequal = ~(np.maximum(width, radius) / np.where(flat, 1.0, np.minimum(width, radius)) <= WIDE)
        hopeless = flat | unequal
        unit = np.where(hopeless, 1.0, radius)[:, None, None]
        given = np.where(hopeless[:, None, None], 0.0, np.concatenate(about, axis=1) / unit)
    clipped = given.clip(-FAR, FAR)
    with np.errstate(under="ignore"):
        tokens = network.encode(weights, clipped[:, :m], clipped[:, m:])
    samples = 1 if anchored else options.samples
    if anchored:
        noise = given[:, None]
    else:
        noise = np.stack([np.random.default_rng(s).standard_normal((samples, m + n, 2)) for s in problem.seed])
    blank = Pose.identity(2, (b, samples))
    status, reason = statuses((b,)), reasons((b,))
    for name, hopeless in equal.items():
        status, reason = mark(status, reason, hopeless, Status.DEGENERATE, EQUAL.format(name))
    status, reason = mark(status, reason, flat, Status.DEGENERATE, "a cloud has no width that a number can hold")
    status, reason = mark(
        status, reason, unequal, Status.DEGENERATE, f"one cloud is more than {WIDE:g} times as wide as the other"
    )
    return FlowState(
        problem=problem,
        options=options,
        radius=unit[:, 0, 0],
        middle=middle,
        home=home,
        given=given,
        tokens=tokens,
        noise=noise,
        pose=problem.start,
        objective=np.zeros(b),
        status=status,
        reason=reason,
        time=np.zeros(b),
        present=noise,
        predicted=noise,
        projected=noise,
        views=(blank, blank),
        rigidity=np.zeros((b, samples)),
        chosen=np.zeros(b, dtype=np.int64),
        taken=np.zeros(b, dtype=np.int64),
    )


def _radius(points: FloatArray) -> FloatArray:
    """The RMS radius (b,) of the centred points (b, n, 2)."""
    # Dividing by powers of two is exact and keeps squares from overflowing or vanishing.
    power = np.frexp(np.abs(points).max(axis=(1, 2)))[1]
    squares = np.ldexp(points, -power[:, None, None]) ** 2
    return np.asarray(np.ldexp(np.sqrt(squares.sum(axis=-1).mean(axis=-1)), power))


def _step(state: FlowState, weights: Params, anchored: bool) -> FlowState:
    problem, options = state.problem, state.options
    m = problem.source.shape[1]
    with np.errstate(under="ignore"):
        present = state.present.clip(-FAR, FAR)
        # Problem by problem and sample by sample, so that attention's matrices exist for only one at a time and stay
        # in the processor's cache.
        problems = zip(state.tokens, present, state.time, strict=True)
        predicted = np.stack(
            [
                np.stack([network.endpoint(weights, tokens, sample, time) for sample in samples])
                for tokens, samples, time in problems
            ]
        )
    given = np.broadcast_to(state.given[:, None], predicted.shape)
    if anchored:
        predicted = np.concatenate([predicted[..., :m, :], given[..., m:, :]], axis=-2)
    views = (
        fit_rigid(given[..., :m, :], predicted[..., :m, :]).pose,
        fit_rigid(given[..., m:, :], predicted[..., m:, :]).pose,
    )
    projected = np.concatenate([views[0].apply(given[..., :m, :]), views[1].apply(given[..., m:, :])], axis=-2)
    with np.errstate(over="ignore", under="ignore"):
        rigidity = ((predicted - projected) ** 2).sum(axis=-1).mean(axis=-1)
    taken = state.taken + 1
    time = taken / options.steps
    after = time[:, None, None, None]
    end = projected if options.project else predicted
    chosen = rigidity.argmin(axis=1).astype(np.int64)
    words = "the flow is at its end time, and it has no test of rest"
    status, reason = mark(state.status, state.reason, taken >= options.steps, Status.FINISHED, words)
    return replace(
        state,
        pose=_read_out(state, views, chosen),
        objective=rigidity[np.arange(len(chosen)), chosen] * state.radius**2,
        status=status,
        reason=reason,
        time=time,
        present=(1.0 - after) * state.noise + after * end,
        predicted=predicted,
        projected=projected,
        views=views,
        rigidity=rigidity,
        chosen=chosen,
        taken=taken,
    )


def _read_out(state: FlowState, views: tuple[Pose, Pose], chosen: IntArray) -> Pose:
    """The chosen sample's `A_target⁻¹ ∘ A_source`, taken from the network's frame to
    the world's.
    """
    rows = np.arange(len(chosen))
    relative = views[1][rows, chosen].inverse().compose(views[0][rows, chosen])
    shift = state.middle + state.radius[:, None] * relative.t - np.einsum("bij,bj->bi", relative.R, state.home)
    return Pose.trusted(relative.R, shift).compose(state.problem.start)


_METHODS = {
    "flow": ("both views generated from noise by a small trained network", "in the manner of Pan et al. 2025"),
    "flow-from-source": ("the source moved to the target by a small trained network", "the simplest learned flow"),
}


def flow_method(name: str, folder: str = FOLDER) -> Method[FlowState]:
    """The method `flow` or `flow-from-source` with the weights in `folder`, which are read when a run begins."""
    anchored = name == "flow-from-source"
    summary, source = _METHODS[name]
    return Method(
        name=name,
        any_extent=True,
        summary=summary,
        source=source,
        start=lambda problem, options: _start(problem, options, params(name, folder), anchored),
        step=lambda state: _step(state, params(name, folder), anchored),
        options=FlowOptions,
    )


FLOW = flow_method("flow")
FLOW_FROM_SOURCE = flow_method("flow-from-source")
