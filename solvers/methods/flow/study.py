"""The held-out study of the learned flows: how often they are right on scenes like those of training and on others."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from solvers.core.arrays import FloatArray
from solvers.core.method import Problem
from solvers.core.pose import Pose
from solvers.core.stepper import Batch, begin, run
from solvers.methods.flow.flow import FlowOptions, FlowState, flow_method
from solvers.methods.flow.scenes import HELD_OUT, Draw, Kind, draw
from solvers.methods.flow.weights import FOLDER
from solvers.metrics import rre

POINTS = 40
SEED = 99  # of the scenes; training uses only larger seeds
DEGREES = 5.0
LENGTH = 0.1  # RMS radii of the shape

VARIANTS = {
    "flow": ("flow", FlowOptions()),
    "flow, one sample": ("flow", FlowOptions(samples=1)),
    "flow, not projected": ("flow", FlowOptions(project=False)),
    "flow-from-source": ("flow-from-source", FlowOptions()),
}


@dataclass(frozen=True)
class StudyLine:
    """The results of a variant on one kind of scene.

    degrees, length: the median errors of rotation, and of translation in RMS radii of
    the shape. turned: how many of `count` scenes have a rotation error below 5°.
    placed: how many have a translation error below 0.1 radii as well.
    """

    variant: str
    kind: str
    count: int
    degrees: float
    length: float
    turned: int
    placed: int


def study(
    kinds: Sequence[Kind] = HELD_OUT,
    variants: Sequence[str] = tuple(VARIANTS),
    count: int = 200,
    seed: int = SEED,
    folder: str = FOLDER,
) -> list[StudyLine]:
    """Run every variant on `count` scenes of every kind, of unit RMS radius, with the weights in `folder`."""
    lines = []
    for kind in kinds:
        scenes = draw(kind, count, POINTS, seed)
        for name in variants:
            lines.append(_line(name, kind, *errors(scenes, name, folder)))
    return lines


def errors(scenes: Draw, variant: str, folder: str = FOLDER, block: int = 50) -> tuple[FloatArray, FloatArray]:
    """The rotation errors in degrees and translation errors in u of a variant on scenes, (b,) each.

    The translation is compared at the source's centroid, where a wrong rotation does
    not add to it.
    """
    name, options = VARIANTS[variant]
    method = flow_method(name, folder)
    turns, shifts = [], []
    for at in range(0, len(scenes.angle), block):
        rows = slice(at, at + block)
        source, target = scenes.source[rows], scenes.target[rows]
        b = len(source)
        seeds = np.arange(at, at + b, dtype=np.int64)
        problem = Problem(source, target, np.ones(source.shape[:2]), Pose.identity(2, (b,)), seeds)
        pose = _end(begin(method, problem, options))
        truth = Pose.from_angle(scenes.angle[rows], scenes.shift[rows])
        middle = source.mean(axis=1, keepdims=True)
        turns.append(np.degrees(rre(pose, truth)))
        shifts.append(np.linalg.norm(pose.apply(middle) - truth.apply(middle), axis=-1)[:, 0])
    return np.concatenate(turns), np.concatenate(shifts)


def _end(batch: Batch[FlowState]) -> Pose:
    return run(batch)[0].pose()


def _line(variant: str, kind: Kind, degrees: FloatArray, length: FloatArray) -> StudyLine:
    within = degrees < DEGREES
    return StudyLine(
        variant,
        kind.name,
        len(degrees),
        float(np.median(degrees)),
        float(np.median(length)),
        int(within.sum()),
        int((within & (length < LENGTH)).sum()),
    )


def by_turn(edges: Sequence[float], variant: str, count: int = 100, seed: int = SEED) -> list[StudyLine]:
    """Run a variant on scenes like those of training, turned by angles between neighbouring `edges`, in degrees."""
    kinds = [replace(HELD_OUT[0], name=f"{low:g}–{high:g}°", turn=(low, high)) for low, high in pairwise(edges)]
    return study(kinds, [variant], count, seed)
