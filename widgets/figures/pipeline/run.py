"""A registration in stages, as its figure shows it: a proposal, its refinement, and the signs that judge the result."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from solvers import Pose
from solvers.api import register
from solvers.metrics import rre
from solvers.scenes.rooms import ROOM_SETTINGS, Scene, room
from solvers.scenes.walls import corridor, hall
from solvers.studies.benchmark import is_close
from solvers.verify import Evidence, evidence, halves
from widgets.drawing.picture import number
from widgets.parts.room import errors

SCENES: dict[str, str] = {
    "clean": "Clean room", "striped": "Striped", "combo": "Combo", "hall": "Hall", "corridor": "Corridor",
}  # fmt: skip
METHODS_OF = {"point": "icp", "plane": "point-to-plane", "gicp": "gicp"}
REACH = 0.3  # u: a source point is explained if a target point is within this distance
LEAST_HELD = 0.02
LARGEST_RMS = 0.18  # u
FARTHEST_HALVES = 0.2  # u
SEARCH: dict[str, Any] = {"separation": 2.0, "tolerance": 0.28, "inlier": 0.32}  # u, for the proposal, as in the race
CALLS = dict.fromkeys(SCENES, "room") | {"hall": "hall", "corridor": "corridor"}


@lru_cache(maxsize=16)
def scene_of(name: str, seed: int, noise: float, outliers: float, overlap: float) -> Scene:
    """One of SCENES; outliers: the fraction of each cloud; overlap: the fraction of a room's outline that the target
    sees."""
    if name in ROOM_SETTINGS:
        return room(name, seed=seed, noise=noise, outliers=outliers, overlap=overlap)
    return {"hall": hall, "corridor": corridor}[name](seed=seed, noise=noise, outliers=outliers)


@dataclass(frozen=True, eq=False)
class Stage:
    """A stage that is done. name: 'start', 'propose' or 'refine'. stop: how it stopped, in words."""

    name: str
    pose: Pose
    stop: str = ""


@lru_cache(maxsize=16)
def proposed(scene: Scene, steps: int) -> Stage:
    """The pose that RANSAC finds in `steps` steps of 32 hypotheses. It does not depend on the start, so dragging the
    source needs no further search."""
    result = register(scene.source, scene.target, "ransac-congruent", seed=scene.seed, max_steps=steps, **SEARCH)
    return Stage("propose", result.pose, f"{result.status}, step {result.steps}")


@lru_cache(maxsize=16)
def refined(scene: Scene, stage: Stage, residual: str, gate: float) -> Stage:
    """The pose at which ICP with this residual stops, starting from that of the stage before."""
    result = register(scene.source, scene.target, METHODS_OF[residual], start=stage.pose, gate=gate)
    return Stage("refine", result.pose, f"{result.status}, step {result.steps}")


@dataclass(frozen=True)
class Sign:
    """One sign. said: its value as text. asked: the requirement. met: whether it is met. at, limit: both in [0, 1]
    along its scale, `at` None before there is a value. more: whether larger values are better."""

    name: str
    said: str
    asked: str
    met: bool
    at: float | None
    limit: float
    more: bool


@dataclass(frozen=True, eq=False)
class Judgement:
    """The clouds' evidence at a pose, how far apart two halves end (u; None at the start, before any run, and where one
    finds no pose), by how many degrees the predicted turn is missed, and the five signs in order."""

    evidence: Evidence
    apart: float | None
    turn: float
    signs: tuple[Sign, ...]

    @property
    def failed(self) -> tuple[str, ...]:
        """The names of the signs that are not met."""
        return tuple(sign.name for sign in self.signs if not sign.met)


@lru_cache(maxsize=16)
def _evidence(scene: Scene, stage: Stage) -> Evidence:
    return evidence(scene.source, scene.target, stage.pose, REACH)


@lru_cache(maxsize=16)
def _halves_apart(scene: Scene, stage: Stage, residual: str, gate: float) -> float | None:
    apart = float(halves(scene.source, scene.target, stage.pose, METHODS_OF[residual], gate=gate))
    return None if np.isnan(apart) else apart


def judged(
    scene: Scene, stages: tuple[Stage, ...], residual: str, gate: float, least: float, trust: float
) -> Judgement:
    """The signs at the last stage's pose. least: the fraction that must be explained; trust: by how many degrees the
    turn of the first stage, the prediction, may be missed; 180 if it is not used."""
    pose, predicted = stages[-1].pose, stages[0].pose
    measures = _evidence(scene, stages[-1])
    share, rms, weakest = float(measures.share), float(measures.rms), float(measures.weakest)
    has_share = share > 0.0  # if nothing is explained, there are no residuals, and nothing constrains the pose
    apart = _halves_apart(scene, stages[-1], residual, gate) if len(stages) > 1 else None
    turn = float(np.degrees(rre(pose, predicted)))
    is_held = weakest >= LEAST_HELD
    conditioning = ratio(weakest, np.inf if is_held else LEAST_HELD)
    enough = share >= least - 1e-9
    share_text = f"{number(100 * share, 0 if enough else _apart(100 * share, 100 * least, 0))} %"
    signs = (
        Sign("overlap", share_text, f"≥ {number(100 * least, 0)} %", enough, share, least, True),
        _small("residual", rms if has_share else None, LARGEST_RMS, 0.3, "u", 3),
        Sign(
            "conditioning", conditioning if has_share else "–", f"≥ {LEAST_HELD}", is_held,
            _decades(weakest) if has_share else None, _decades(LEAST_HELD), True,
        ),
        _small("two halves", apart, FARTHEST_HALVES, 0.5, "u", 3),
        _small("prediction", turn, trust, 180.0, "°", 0),
    )  # fmt: skip
    return Judgement(measures, apart, turn, signs)


def _small(name: str, value: float | None, limit: float, full: float, unit: str, decimals: int) -> Sign:
    gap = "" if unit == "°" else " "
    requirement = f"≤ {limit:g}{gap}{unit}" if limit < full else "not required"
    if value is None:
        return Sign(name, "–", requirement, limit >= full, None, limit / full, False)
    met = value <= limit + 1e-6
    text = f"{number(value, decimals if met else _apart(value, limit, decimals))}{gap}{unit}"
    return Sign(name, text, requirement, met, min(value / full, 1.0), min(limit / full, 1.0), False)


def _apart(value: float, limit: float, decimals: int) -> int:
    """At least this many decimals, and enough to show that a value differs from the limit it misses."""
    return next(k for k in range(decimals, 16) if round(value, k) != round(limit, k))


def ratio(value: float, missed: float = np.inf) -> str:
    """A ratio as text, with decimals down to the least value of the logarithmic scale; apart from a limit it misses."""
    return number(value, _apart(value, missed, 3 if value >= 0.01 else 4))


def _decades(value: float) -> float:
    """A ratio's place on a logarithmic scale from 0, at a ten-thousandth, to 1, at one."""
    return float(np.clip(1.0 + np.log10(max(value, 1e-4)) / 4.0, 0.0, 1.0))


def right(scene: Scene, pose: Pose) -> bool:
    """Whether both errors of a pose are below the benchmark's limits."""
    return bool(is_close(*errors(pose, scene.truth)))
