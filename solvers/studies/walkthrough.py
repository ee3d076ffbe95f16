"""The four methods of the walkthrough with its options: similarity CPD, FilterReg, MMD-Reg and a learned flow.

All four get the moving cloud already moved by the start, and no starting pose. A run therefore finds the motion from
there, and the scene's pose is that motion composed with the start.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType
from typing import Any

import numpy as np

from solvers.core import validate
from solvers.core.method import Method, Problem
from solvers.core.pose import Pose
from solvers.core.poses import stacked
from solvers.core.stepper import Batch, begin
from solvers.methods.flow.flow import FLOW, FlowOptions
from solvers.methods.mmd.mmd import MMD, MmdOptions
from solvers.methods.soft.cpd import SIMILARITY, CpdOptions
from solvers.methods.soft.filterreg import FILTERREG, FilterRegOptions
from solvers.scenes.fish import SIDE
from solvers.scenes.rooms import Scene

AREA = SIDE**2
"""V, u²: both mixtures spread their clutter with density 1/V. A parameter of the demo."""
EVERY = 4
"""The flow gets every fourth point, since it was trained on clouds of 28 to 48."""
MOST = 120
"""The most steps."""

FOUR: Mapping[str, tuple[Method[Any], Any]] = MappingProxyType(
    {
        "cpd": (SIMILARITY, CpdOptions(clutter=0.12, volume=AREA, tolerance=1e-3)),
        "filterreg": (FILTERREG, FilterRegOptions(filter="grid", clutter=0.25, volume=AREA, tolerance=1e-3)),
        "mmd": (MMD, MmdOptions(lengths=(1.5, 0.8, 0.5), count=48)),
        "flow": (FLOW, FlowOptions()),
    }
)
"""Maps each name to a method and its options, in the order of the panels."""
MIXTURES = ("cpd", "filterreg")
"""The methods of `FOUR` whose mixture has a clutter part."""


def begin_walk(
    name: str, scenes: Sequence[Scene], starts: Sequence[Pose], project: bool = True, most: int = MOST
) -> Batch[Any]:
    """Begin one of the four methods on scenes of equal size, without taking a step.

    Parameters
    ----------
    name : str
        A key of `FOUR`.
    scenes : sequence of Scene
        b scenes, as from `solvers.walk_scenes.fish`, with equal numbers of points.
    starts : sequence of Pose
        The initial pose of each scene's moving cloud.
    project : bool, default True
        Whether to make the flow's endpoints rigid; ignored by the other methods.
    most : int, default 120
        The most steps.

    Returns
    -------
    Batch
        The run at its beginning, of b problems.

    Raises
    ------
    ValueError
        If there is no method of that name, if there are not as many starts as scenes,
        or if the scenes differ in size.

    Examples
    --------
    >>> from solvers.walk_scenes import fish, fish_start
    >>> from solvers.walkthrough import begin_walk
    >>> batch = begin_walk("cpd", [fish("clean")], [fish_start()])
    >>> batch.done, batch.max_steps
    (False, 120)
    """
    method, options = FOUR[validate.one_of(name, FOUR, "name")]
    if name == "flow":
        options = replace(options, project=project)
    if len(scenes) != len(starts) or not len(scenes):
        raise ValueError(f"starts: expected one for each scene, and a scene, got {len(starts)} for {len(scenes)}")
    if len({(len(scene.source), len(scene.target)) for scene in scenes}) > 1:
        raise ValueError("scenes: expected equally many points in each")
    thin = slice(None, None, EVERY if name == "flow" else 1)
    source = np.stack([start.apply(scene.source)[thin] for scene, start in zip(scenes, starts, strict=True)])
    target = np.stack([scene.target[thin] for scene in scenes])
    b, m, _ = source.shape
    seeds = np.array([scene.seed for scene in scenes], dtype=np.int64)
    problem = Problem(source, target, np.ones((b, m)), Pose.identity(2, (b,)), seeds)
    return begin(method, problem, options, most)


def scene_poses(batch: Batch[Any], starts: Sequence[Pose]) -> Pose:
    """The current poses of the scenes.

    Each is the start followed by the motion found so far.

    Parameters
    ----------
    batch : Batch
        A run of b problems, from `begin_walk`.
    starts : sequence of Pose
        The starts passed to `begin_walk`, rigid motions.

    Returns
    -------
    Pose
        Of shape (b,).

    Examples
    --------
    >>> import numpy as np
    >>> from solvers.metrics import rre
    >>> from solvers.stepper import run
    >>> from solvers.walk_scenes import fish, fish_start
    >>> from solvers.walkthrough import begin_walk, scene_poses
    >>> scene, start = fish("clean"), fish_start()
    >>> batch, history = run(begin_walk("cpd", [scene], [start]))
    >>> np.degrees(rre(scene_poses(batch, [start]), scene.truth)) < 1.0
    array([ True])
    """
    return batch.pose().compose(stacked(starts))


def clutter(name: str) -> float:
    """The weight w of the clutter in the mixture of "cpd" or "filterreg".

    Parameters
    ----------
    name : str
        "cpd" or "filterreg"; the other two have no mixture.

    Returns
    -------
    float
        From 0 to 1.

    Raises
    ------
    ValueError
        If the name is any other.

    Examples
    --------
    >>> from solvers.walkthrough import clutter
    >>> clutter("cpd"), clutter("filterreg")
    (0.12, 0.25)
    """
    return float(FOUR[validate.one_of(name, MIXTURES, "name")][1].clutter)
