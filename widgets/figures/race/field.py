"""The race's field: what each contestant's panel says, and one contestant's run, step by step on one problem."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from types import MappingProxyType
from typing import Any

from solvers import Pose
from solvers.core.method import Problem
from solvers.core.status import Status
from solvers.core.stepper import Batch, advance
from solvers.studies.benchmark import CLOSE_DEGREES, is_close
from solvers.studies.race import CONTESTANTS, EXTRAS, Contestant
from widgets.drawing.picture import Panel, Role, worded
from widgets.parts.room import errors, single

NINTH = "ninth"
STAND_IN = "hypothesis-mixture"  # another contestant may take its panel


@dataclass(frozen=True)
class Entry:
    """A contestant as the race shows it.

    short: its name in the chart. role, dashed, dotted: its line, here and in every chart of the race. note: what it is
    and is not.
    """

    contestant: Contestant
    short: str
    role: Role
    dashed: bool
    dotted: bool
    note: str


_SAID: tuple[tuple[str, str, Role, str, str], ...] = (
    ("icp", "ICP", "by-nearest", "",
     "Nearest points within 2.6 u, fitted in closed form. No trimming, no robust weight."),
    ("point-to-plane", "to plane", "by-nearest", "-",
     "Distances to the target’s lines. Along a wall it slides freely."),
    ("gicp", "GICP", "by-nearest", ".",
     "A covariance at every point of both clouds: a surface model, not measured noise."),
    ("ransac-congruent", "RANSAC", "by-samples", "",
     "Pairs of points equally far apart, anywhere: it ignores the start."),
    ("ndt", "NDT", "by-cells", "",
     "Gaussian cells of 2.4 u, then 1.2 u. The score is not a likelihood."),
    ("soft-annealed", "soft", "by-weights", "",
     "Soft targets on a fixed schedule: a heuristic, not CPD."),
    ("mmd", "MMD", "by-means", "",
     "Means of 32 random waves at four lengths. No pairs, and no model of clutter."),
    ("association-bp", "BP", "by-marginals", "",
     "One-to-one marginals by belief propagation: an experiment, not a tracker."),
    ("hypothesis-mixture", "hypotheses", "by-marginals", "-",
     "Averaged one-to-one draws: an experiment, not PMBM, which models births and existence."),
    ("trimmed-icp", "trimmed", "by-nearest", "-.",
     "Always the nearest 80 % of the pairs, whatever the overlap is."),
    ("fast-robust-icp", "fast robust", "by-nearest", "-.",
     "A robust weight that narrows, and extrapolated steps. Point to point only."),
    ("kiss-threshold-icp", "KISS", "by-nearest", "-.",
     "Its threshold comes from the start’s error; KISS-ICP uses a history of motions."),
    ("cpd-rigid", "CPD", "by-weights", "-.",
     "A mixture on the moving cloud with 12 % clutter. The width is estimated."),
    ("filterreg", "FilterReg", "by-weights", "-.",
     "A mixture on the fixed cloud, summed on a lattice: approximate, not exact EM."),
    ("gmmreg", "GMMReg", "by-means", "-.",
     "The distance between two mixtures, a Gaussian per point. There is no E-step."),
    ("ndt-d2d", "D2D-NDT", "by-cells", "-.",
     "Gaussians of both clouds’ cells. The points themselves are not used."),
    ("branch-and-bound", "search", "by-nearest", "-.",
     "All poses in boxes, with a proof for the capped distances. The start is one candidate."),
    ("correlative", "grid", "by-cells", "-",
     "The best of a grid of poses, which includes the true heading. It ignores the start."),
)  # fmt: skip

ENTRIES: Mapping[str, Entry] = MappingProxyType(
    {
        one.method: Entry(one, short, role, "-" in dash, "." in dash, note)
        for one in (*CONTESTANTS, *EXTRAS)
        for method, short, role, dash, note in _SAID
        if method == one.method
    }
)
"""Method → its entry; first the nine, in the order of their panels."""


def field(ninth: str = STAND_IN) -> tuple[Entry, ...]:
    """The nine that run, with `ninth` in the last panel."""
    return tuple(ENTRIES[ninth if c.method == STAND_IN else c.method] for c in CONTESTANTS)


@dataclass(frozen=True, eq=False)
class Run:
    """One contestant on one problem.

    batch: None until the first step. pose: the source's current one. rotation, translation: the errors after 0, 1, …
    steps, in degrees and u. panel: its drawing, the same object as long as nothing in it changes.
    """

    entry: Entry
    problem: Problem
    truth: Pose
    pose: Pose
    rotation: tuple[float, ...]
    translation: tuple[float, ...]
    batch: Batch[Any] | None = None
    panel: Panel | None = None

    @cached_property
    def first(self) -> Batch[Any]:
        """Its batch at the start, begun on first use: normals, maps and candidate pairs take as long as half a step."""
        return self.entry.contestant.begin(self.problem)

    @property
    def ready(self) -> bool:
        """Whether the run has begun, so that its next step needs no preparation."""
        return self.batch is not None or "first" in self.__dict__

    @property
    def method(self) -> str:
        """The name of its method."""
        return self.entry.contestant.method

    @property
    def seat(self) -> str:
        """The name of its panel; that of the last panel does not depend on who is in it."""
        return NINTH if self.method == STAND_IN or self.entry.contestant in EXTRAS else self.method

    @property
    def steps(self) -> int:
        """The number of steps taken so far."""
        return len(self.rotation) - 1

    @property
    def done(self) -> bool:
        """Whether it has stopped."""
        return self.batch is not None and self.batch.done

    @property
    def status(self) -> Status:
        """The solver's status."""
        return Status.RUNNING if self.batch is None else Status(int(self.batch.state().status[0]))

    @property
    def reason(self) -> str:
        """Why it stopped, in words, or ""."""
        return "" if self.batch is None else worded(str(self.batch.state().reason[0]))

    @property
    def turned(self) -> bool:
        """Whether its rotation error is below the demo's threshold."""
        return self.rotation[-1] < CLOSE_DEGREES

    @property
    def close(self) -> bool:
        """Whether both errors are below the demo's thresholds."""
        return bool(is_close(self.rotation[-1], self.translation[-1]))


def waiting(entry: Entry, problem: Problem, truth: Pose) -> Run:
    """A contestant at the start, which has not processed the clouds yet."""
    pose = single(problem.start)
    turn, shift = errors(pose, truth)
    return Run(entry, problem, truth, pose, (turn,), (shift,))


def stepped(run: Run) -> Run:
    """The run after one more step; a run that has stopped is returned as it is."""
    if run.done:
        return run
    batch = run.first if run.batch is None else run.batch
    if batch.done:  # it stopped at once, since the clouds do not determine a pose for it
        return replace(run, batch=batch, panel=None)
    batch = advance(batch)
    pose = single(batch.pose())
    turn, shift = errors(pose, run.truth)
    return replace(
        run,
        batch=batch,
        pose=pose,
        rotation=(*run.rotation, turn),
        translation=(*run.translation, shift),
        panel=None,
    )
