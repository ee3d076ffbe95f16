"""The race: nine methods on the same two scans from the same start, for panels, benchmark and sweeps.

One list of contestants with the options that they race with, one set of controls, one way to make the problems;
`solvers.stepper` steps them. RANSAC ignores the starting pose, and its panel says so; among the extras, so does
`correlative`. `graduated-nonconvexity` does not race, because it needs pairs.

It is a controlled experiment: one room, one sampling, options chosen for it. Its ranking does not carry over to other
scenes, and steps of different methods are different amounts of work.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Any

import numpy as np

from solvers.core import validate
from solvers.core.kinds import of_kind, several, shown
from solvers.core.method import Problem
from solvers.core.pose import Pose
from solvers.core.poses import stacked
from solvers.core.registry import ALIASES, METHODS, method_of
from solvers.core.stepper import Batch, begin
from solvers.scenes.rooms import Scene, room, room_start
from solvers.studies.seeds import seeds

SEEDS = seeds(25)
"""The seeds of the benchmark."""
MAX_STEPS = 70
"""The most steps of a contestant."""


@dataclass(frozen=True)
class Controls:
    """The settings of the race.

    Parameters
    ----------
    degrees : float, default 45.0
        The start's rotation about the world's origin, −180 to 180.
    distance : float, default 1.43
        The start's translation, in u, 0 to 100.
    setting : str, default "combo"
        One of `solvers.scenes.ROOM_SETTINGS`.
    noise : float, optional
        σ in u. None is the setting's own.
    outliers : float, optional
        The replaced fraction of each cloud, 0 to 1. None is the setting's own.
    overlap : float, default 1.0
        The fraction of the room that the target sees, 0.1 to 1.
    density : float, default 1.0
        How much denser than usual the source is sampled, 0.2 to 5.

    Raises
    ------
    ValueError
        If the setting is unknown or a number out of its range.

    Examples
    --------
    >>> from solvers.race import Controls
    >>> controls = Controls(degrees=90.0, setting="clean")
    >>> controls.start
    Pose(angle=90°, t=(1.14991, 0.849935), scale=1)
    >>> controls.scene(40).source.shape
    (132, 2)
    """

    degrees: float = 45.0
    distance: float = 1.43
    setting: str = "combo"
    noise: float | None = None
    outliers: float | None = None
    overlap: float = 1.0
    density: float = 1.0

    def __post_init__(self) -> None:
        validate.number(self.degrees, "degrees", -180.0, 180.0)
        validate.number(self.distance, "distance", 0.0, 100.0)
        self.scene(SEEDS[0])

    def scene(self, seed: int) -> Scene:
        """The two scans of a seed.

        Parameters
        ----------
        seed : int
            The seed of the random numbers, not negative.

        Returns
        -------
        Scene
            `solvers.scenes.room` with these controls.

        Raises
        ------
        ValueError
            If the seed is not an integer or is negative.
        """
        return room(
            self.setting,
            seed=seed,
            noise=self.noise,
            outliers=self.outliers,
            overlap=self.overlap,
            density=self.density,
        )

    @property
    def start(self) -> Pose:
        """The starting pose: turned about the world's origin, then shifted."""
        return room_start(self.degrees, self.distance)


@dataclass(frozen=True, eq=False)
class Contestant:
    """A method with the options that it races with.

    Parameters
    ----------
    method : str
        A name of `solvers.METHODS`.
    label : str
        The name on its panel and table row.
    options : mapping
        The method's options by name; those left out keep their defaults.
    note : str
        What a reader must know to interpret its result.

    Examples
    --------
    >>> from solvers.race import Contestant, Controls, race_problem
    >>> problem, truth = race_problem(Controls(), seeds=[40, 53])
    >>> batch = Contestant("icp", "ICP, gated", {"gate": 2.6}).begin(problem)
    >>> batch.pose().batch
    (2,)
    """

    method: str
    label: str
    options: Mapping[str, Any] = field(default_factory=dict)
    note: str = ""

    def begin(self, problem: Problem, max_steps: int = MAX_STEPS) -> Batch[Any]:
        """The contestant's run at its start; step it with `solvers.stepper.advance`.

        Parameters
        ----------
        problem : Problem
            As from `race_problem`.
        max_steps : int, default 70
            The most steps.

        Returns
        -------
        Batch
            The run at its beginning.

        Raises
        ------
        KeyError
            If `solvers.METHODS` has no such method.
        TypeError
            If the method has no such option.
        ValueError
            If an option is out of its range.
        """
        method = METHODS[self.method]
        return begin(method, problem, method.options(**self.options), max_steps)


_GATE = MappingProxyType({"gate": 2.6})
_SURFACE = MappingProxyType({"gate": 2.6, "neighbours": 8, "max_turn": 0.5, "max_shift": 1.5})
_WIDTHS = MappingProxyType({"first": 1.1, "shrink": 0.9, "last": 0.12, "least_support": 0.15, "tolerance": 1e-3})

CONTESTANTS: tuple[Contestant, ...] = (
    Contestant("icp", "ICP", _GATE),
    Contestant("point-to-plane", "Point to plane", _SURFACE),
    Contestant("gicp", "GICP", {**_SURFACE, "tangent": 1.0, "normal": 0.01}),
    Contestant(
        "ransac-congruent", "RANSAC", {"per_step": 32, "tolerance": 0.28, "inlier": 0.32, "separation": 2.0},
        "searches everywhere: it ignores the starting pose",
    ),
    Contestant("ndt", "NDT", {"cells": (2.4, 1.2), "max_shift": 0.5, "max_turn": 0.2}),
    Contestant("soft-annealed", "Soft targets", {**_WIDTHS, "miss": 0.12}, "a heuristic, not CPD"),
    Contestant(
        "mmd", "MMD-Reg", {"count": 32, "lengths": (2.4, 1.2, 0.6, 0.3), "tolerance": 1e-5, "decrease": 1e-5}
    ),
    Contestant("association-bp", "Association BP", {**_WIDTHS, "miss": 0.12, "sweeps": 6}, "an experiment, no tracker"),
    Contestant(
        "hypothesis-mixture", "Hypothesis mixture", {**_WIDTHS, "miss": 0.12, "count": 12},
        "an experiment, not PMBM: no Poisson part, no existence, no posterior handed on",
    ),
)  # fmt: skip
"""The nine contestants of the race, in the order of their panels."""

EXTRAS: tuple[Contestant, ...] = (
    Contestant("trimmed-icp", "Trimmed ICP", {"keep": 0.8}, "told that 80 % of the source has a partner"),
    Contestant("fast-robust-icp", "Fast and robust ICP"),
    Contestant("kiss-threshold-icp", "KISS threshold", {}, "its threshold comes from the start alone"),
    Contestant("cpd-rigid", "Rigid CPD", {"clutter": 0.12}),
    Contestant("filterreg", "FilterReg", {"filter": "lattice", "clutter": 0.25}),
    Contestant("gmmreg", "GMMReg"),
    Contestant("ndt-d2d", "D2D-NDT", {"cells": (2.4, 1.2), "max_shift": 0.5, "max_turn": 0.2}),
    Contestant(
        "branch-and-bound", "Branch and bound", {"cap": 0.4, "gap": 1e-3},
        "searches everywhere: the starting pose is one ceiling of many",
    ),
    Contestant(
        "correlative", "Correlative", {},
        "searches a grid of poses everywhere and ignores the start; the race's true heading is on the grid",
    ),
)
"""Other contestants that may replace one of the nine."""


def contestants(names: Sequence[str] | None = None) -> tuple[Contestant, ...]:
    """The contestants of the given methods: the nine, then the extras, each in their order.

    Parameters
    ----------
    names : sequence of str, optional
        Names of methods, or common aliases of them. None is the nine.

    Returns
    -------
    tuple of Contestant
        In the order of the panels, whatever the order of the names.

    Raises
    ------
    ValueError
        If `names` is not a sequence, or a method is unknown or does not race.

    Examples
    --------
    >>> from solvers.race import contestants
    >>> len(contestants())
    9
    >>> [c.label for c in contestants(["ndt", "icp"])]
    ['ICP', 'NDT']
    """
    if names is None:
        return CONTESTANTS
    entrants = [racing(name, "contestants") for name in several(names, "contestants", "names of methods")]
    return tuple(c for c in (*CONTESTANTS, *EXTRAS) if c in entrants)


def racing(name: object, argument: str) -> Contestant:
    """The contestant for a method's name; else a ValueError that says why there is none."""
    racers = {c.method: c for c in (*CONTESTANTS, *EXTRAS)}
    own = ALIASES.get(name, name) if isinstance(name, str) else name
    if isinstance(own, str) and own in METHODS and own not in racers:
        reason = "it needs pairs and the race has none" if method_of(own).paired else "no options are chosen for it"
        others = ", ".join(sorted(racers))
        raise ValueError(f"{argument}: {name!r} does not race, because {reason}; those that race: {others}")
    return racers[validate.one_of(own, racers, argument)]


def race_problem(controls: Controls, seeds: Sequence[int] = SEEDS) -> tuple[Problem, Pose]:
    """The problems of these seeds as one batch, and the true poses.

    All seeds of one setting have clouds of one size.

    Parameters
    ----------
    controls : Controls
        The settings of the race.
    seeds : sequence of int
        One per problem, not negative; by default the benchmark's 25, 40 + 13k.

    Returns
    -------
    problem : Problem
        s problems, all from the start of the controls.
    truth : Pose
        The s true poses.

    Raises
    ------
    ValueError
        If `controls` are not Controls, or the seeds are not a sequence, are not
        integers, are negative or are missing.

    Examples
    --------
    >>> from solvers.race import Controls, race_problem
    >>> problem, truth = race_problem(Controls(setting="clean"))
    >>> problem.size, truth.batch
    (25, (25,))
    """
    of_kind(controls, Controls, "controls")
    values = several(seeds, "seeds", "integers")
    seed_array = validate.seeds(values, "seeds")
    if seed_array.ndim != 1:
        raise ValueError(f"seeds: expected a sequence of integers, got {shown(values)}")
    scenes = [controls.scene(int(s)) for s in seed_array]
    source, target = (np.stack([getattr(s, name) for s in scenes]) for name in ("source", "target"))
    start = Pose.trusted(np.broadcast_to(controls.start.R, (len(scenes), 2, 2)), controls.start.t)
    truth = stacked([s.truth for s in scenes])
    return Problem(source, target, np.ones(source.shape[:2]), start, seed_array), truth
