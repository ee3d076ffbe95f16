"""A run of ICP with one of three residuals, as figures show it: pairs, pulls, their linear system, the course."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from typing import Any

import numpy as np

from solvers import METHODS, Pose, Status
from solvers.core.arrays import BoolArray
from solvers.core.stepper import Batch, advance, begin
from solvers.methods.icp import surface_icp
from solvers.methods.icp.icp import Pairing
from solvers.metrics import point_error, rre, rte
from solvers.numerics import gauss_newton, robust
from solvers.numerics.gauss_newton import System
from solvers.scenes.rooms import Scene, room
from solvers.scenes.walls import corridor, single_wall
from widgets.drawing.picture import Array, worded
from widgets.parts.room import problem, single

SCENES: dict[str, str] = {"room": "Room", "wall": "One wall", "corridor": "Corridor"}
RESIDUALS: dict[str, str] = {"point": "Point", "plane": "Plane", "gicp": "GICP"}
WEIGHTS: dict[str, str] = {"none": "None", "huber": "Huber", "tukey": "Tukey", "welsch": "Welsch"}
METHOD = {"point": "icp", "plane": "point-to-plane", "gicp": "gicp"}
CALLS = {"room": "room", "wall": "single_wall", "corridor": "corridor"}

FREE_BELOW = 0.05
"""Point to plane treats a direction as free if its eigenvalue is below this fraction of the largest: since noise tilts
normals, no eigenvalue is zero to rounding. GICP's covariances constrain every direction by at least a hundredth."""

STEPS = 40


@dataclass(frozen=True)
class Ask:
    """What to run: a residual, a robust weight, and the fraction of pairs that is trimmed."""

    residual: str
    weight: str
    trim: float

    @property
    def options(self) -> dict[str, Any]:
        """The solver's options that differ from its defaults."""
        settings: dict[str, Any] = {"weight": self.weight} if self.weight != "none" else {}
        if self.trim > 0.0:
            settings["trim"] = self.trim
        return {**settings, "free_below": FREE_BELOW} if self.residual == "plane" else settings


@dataclass(frozen=True)
class Entry:
    """One pose of the course: the residual's RMS, and the errors against the truth in degrees and u; `point` is the
    RMS distance of the source points from where the truth puts them, u."""

    rms: float
    rotation: float
    translation: float
    point: float


@dataclass(frozen=True, eq=False)
class Run:
    """A run so far. began: its start. state: the solver's, a batch of one; pairs and system are those at its pose.
    batch: None until the first step, since a drag begins many runs that take none.

    partners: (m, 2) the target point of each source point. precision: (m, 2, 2). pull: (m,) the length of the pair's
    term in the step's gradient, `w ‖M (x − q)‖`.
    """

    ask: Ask
    scene: Scene
    began: Pose
    state: Any
    batch: Batch[Any] | None
    course: tuple[Entry, ...]
    pairing: Pairing
    partners: Array
    precision: Array
    pull: Array
    system: System

    @cached_property
    def pose(self) -> Pose:
        """The source's current pose."""
        return single(self.state.pose)

    @cached_property
    def scale(self) -> float:
        """The s of the robust weight, u; without a weight, that of the used pairs."""
        if self.ask.weight == "none":
            floor = robust.least_scale(self.state.index.points)
            return float(robust.mad_scale(self.pairing.distances, self.pairing.used, floor)[0])
        return float(self.pairing.threshold[0] / robust.TUNING[self.ask.weight])

    @property
    def moved(self) -> Array:
        """The source points at that pose, (m, 2)."""
        return np.asarray(self.pairing.moved[0])

    @property
    def used(self) -> BoolArray:
        """The pairs that the next step fits, (m,)."""
        return np.asarray(self.pairing.used[0])

    @property
    def steps(self) -> int:
        """The number of steps taken so far."""
        return len(self.course) - 1

    @property
    def done(self) -> bool:
        """Whether the run has stopped."""
        return self.status != Status.RUNNING

    @property
    def status(self) -> Status:
        """The solver's status."""
        return Status(int(self.state.status[0]))

    @property
    def reason(self) -> str:
        """Why the run stopped, in words."""
        return worded(str(self.state.reason[0]))

    @property
    def freedom(self) -> str:
        """What the pairs leave free, in words; empty if they constrain every direction."""
        return worded(gauss_newton.freedom(self.system, 0))

    def step(self) -> Run:
        """The run after one more step; a run that has stopped stays as it is."""
        if self.done:
            return self
        batch = advance(self.batch or self._batch())
        return _read(replace(self, batch=batch), batch.state())

    def _batch(self) -> Batch[Any]:
        now = self.state
        method = replace(METHODS[METHOD[self.ask.residual]], start=lambda instance, options: now)
        return begin(method, now.problem, now.options, STEPS)

    def finish(self) -> Run:
        """The run after all its steps."""
        run = self
        while not run.done:
            run = run.step()
        return run


@lru_cache(maxsize=4)
def scene_of(name: str, seed: int, noise: float, outliers: float) -> Scene:
    """One of SCENES; outliers: the fraction of each cloud."""
    draw: Callable[..., Scene] = {"room": room, "wall": single_wall, "corridor": corridor}[name]
    return draw(seed=seed, noise=noise, outliers=outliers)


def begun(ask: Ask, scene: Scene, start: Pose) -> Run:
    """A run of the scene from `start`, before its first step."""
    method = METHODS[METHOD[ask.residual]]
    return _begun(ask, scene, start, method.start(problem(scene, start), method.options(**ask.options)))


@lru_cache(maxsize=12)
def kept(ask: Ask, scene: Scene) -> Run:
    """A cached run of the scene, for what does not depend on the start: `anew` begins the runs of a drag from it."""
    return begun(ask, scene, Pose.identity())


def anew(run: Run, start: Pose, beside: Run | None = None) -> Run:
    """The run of the same scene from another start, with the normals and covariances already known.

    beside: a run that has just begun at that start, whose errors are the same.
    """
    instance, now = problem(run.scene, start), run.state
    if run.ask.residual == "point":
        state = METHODS[METHOD["point"]].start(instance, now.options)
    else:
        state = surface_icp.start(instance, now.options, now.index, now.normals, now.covariances)
    return _begun(run.ask, run.scene, start, state, beside)


def _begun(ask: Ask, scene: Scene, start: Pose, state: Any, beside: Run | None = None) -> Run:
    nothing: Any = None
    empty = Run(ask, scene, start, state, None, (), nothing, nothing, nothing, nothing, nothing)
    return _read(empty, state, beside)


def _read(run: Run, state: Any, beside: Run | None = None) -> Run:
    """The run at a solver state: its pairs, system and next course entry are read from it."""
    pairing: Pairing = state.pairing
    partners = state.index.points[:, pairing.rows[0]]
    if run.ask.residual == "point":
        precision = np.broadcast_to(np.eye(2), (*pairing.moved.shape, 2))
        centre = pairing.moved.mean(axis=1)
        system = gauss_newton.system(pairing.moved, partners, precision, pairing.weights, centre, state.radius)
    else:
        precision, system = state.precision, state.system
    left = np.einsum("mij,mj->mi", precision[0], pairing.moved[0] - partners[0])
    rms = float(pairing.rms[0])
    entry = replace(beside.course[0], rms=rms) if beside else _entry(rms, single(state.pose), run.scene)
    return replace(
        run,
        state=state,
        course=(*run.course, entry),
        pairing=pairing,
        partners=partners[0],
        precision=precision[0],
        pull=pairing.weights[0] * np.linalg.norm(left, axis=1),
        system=system,
    )


def _entry(rms: float, pose: Pose, scene: Scene) -> Entry:
    return Entry(
        rms=rms,
        rotation=float(np.degrees(rre(pose, scene.truth))),
        translation=float(rte(pose, scene.truth)),
        point=float(point_error(pose, scene.truth, scene.source)),
    )


def wall_direction(scene: Scene) -> Array:
    """The unit vector along the scene's first wall, (2,)."""
    along = scene.outline[0][1] - scene.outline[0][0]
    return np.asarray(along / np.linalg.norm(along))


def along_across(run: Run) -> tuple[float, float]:
    """How far the source's centroid is from its true position, along the first wall and across it; u, signed."""
    truth = run.scene.truth.apply(run.scene.source)
    off = (run.moved - truth).mean(axis=0)
    x, y = wall_direction(run.scene)
    return float(x * off[0] + y * off[1]), float(x * off[1] - y * off[0])
