"""The walkthrough's run: four methods on one scene, all in the same iteration and shown at the same stage of it."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import Any

import numpy as np

from solvers import Pose
from solvers.core.status import Status
from solvers.core.stepper import Batch, advance
from solvers.scenes.rooms import Scene
from solvers.studies.walkthrough import FOUR, begin_walk, scene_poses
from widgets.drawing.picture import Array, Mark, Path, Points, Role, View
from widgets.parts.placing import Placing
from widgets.parts.room import errors

STAGES = 5
"""Stages of one iteration: CPD has five; methods with four hold their last during the fifth."""
POSED = 4  # the stage at which all four have their new pose

VIEW = View(-4.5, 4.5, -3.05, 3.05, width=460.0)
PLACING = Placing(VIEW, limit=(2.0, 1.2), reach=2.9, least=1.5)
ANCHOR = np.zeros(2)
ANCHOR.flags.writeable = False


@dataclass(frozen=True, eq=False)
class Track:
    """One method before and after the current iteration. `after` is None until a stage that needs it is shown; for a
    method that had already stopped it is `before`."""

    name: str
    before: Batch[Any]
    after: Batch[Any] | None = None

    def stepped(self) -> Track:
        """The track with the current iteration's step taken."""
        return self if self.after is not None else replace(self, after=advance(self.before))

    def onward(self) -> Track:
        """The track at the beginning of the next iteration."""
        after = self.stepped().after
        assert after is not None
        return Track(self.name, after)

    @property
    def rests(self) -> bool:
        """Whether it had stopped before the current iteration."""
        return self.before.done

    @property
    def last(self) -> Batch[Any]:
        """The run as far as it has been taken."""
        return self.before if self.after is None else self.after


@dataclass(frozen=True, eq=False)
class Walk:
    """All four methods from one start, in iteration 1, 2, … at stage 1 … 5."""

    scene: Scene
    start: Pose
    tracks: tuple[Track, ...]
    iteration: int = 1
    stage: int = 1

    @property
    def over(self) -> bool:
        """Whether all four have stopped by the end of this iteration."""
        return all(track.last.done for track in self.tracks)

    @property
    def ended(self) -> bool:
        """Whether there are no stages left to show."""
        return self.over and self.stage == STAGES

    def at(self, stage: int) -> Walk:
        """The current iteration at another stage; from the second on, its step is taken."""
        tracks = self.tracks if stage == 1 else tuple(track.stepped() for track in self.tracks)
        return replace(self, tracks=tracks, stage=stage)

    def next(self) -> Walk:
        """The next stage, or the first of the next iteration; at the end the walk stays as it is."""
        if self.stage < STAGES:
            return self.at(self.stage + 1)
        return self if self.over else self._onward().at(1)

    def iterated(self) -> Walk:
        """The same stage one iteration later; the last stage if no iterations are left."""
        whole = self.at(STAGES)
        return whole if whole.over else whole._onward().at(self.stage)

    def finished(self) -> Walk:
        """The last stage of the iteration in which the last of the four stops."""
        walk = self.at(STAGES)
        while not walk.over:
            walk = walk._onward().at(STAGES)
        return walk

    def _onward(self) -> Walk:
        return replace(self, tracks=tuple(track.onward() for track in self.tracks), iteration=self.iteration + 1)

    def looks(self) -> tuple[Look, ...]:
        """What each panel draws: one look per method."""
        return tuple(Look(self, track) for track in self.tracks)


def begun(scene: Scene, start: Pose, project: bool) -> Walk:
    """All four at the first stage of the first iteration, before any step."""
    return Walk(scene, start, tuple(Track(name, begin_walk(name, [scene], [start], project)) for name in FOUR))


@dataclass(frozen=True, eq=False)
class Look:
    """One method at the current stage. before, after: its states before and after the iteration's step, batches of one;
    `after` is `before` until the step is taken. came, went: the scene's poses in these two states."""

    walk: Walk
    track: Track
    before: Any = field(init=False)
    after: Any = field(init=False)
    came: Pose = field(init=False)
    went: Pose = field(init=False)

    def __post_init__(self) -> None:
        for name, pose, batch in (("before", "came", self.track.before), ("after", "went", self.track.last)):
            object.__setattr__(self, name, batch.state())
            object.__setattr__(self, pose, scene_poses(batch, [self.walk.start])[0])

    @property
    def pose(self) -> Pose:
        """The scene's pose at this stage."""
        return self.went if self.walk.stage >= POSED else self.came

    @property
    def steps(self) -> int:
        """The number of steps that led to that pose."""
        return int((self.track.last if self.walk.stage >= POSED else self.track.before).steps[0])

    @property
    def given(self) -> Array:
        """The moving cloud as the method receives it, before any thinning, (150, 2)."""
        return self.walk.start.apply(self.walk.scene.source)

    @property
    def moved(self) -> Array:
        """The moving cloud before the step (150, 2)."""
        return self.came.apply(self.walk.scene.source)

    @property
    def stopped(self) -> str:
        """Why it has stopped, in words; empty while it runs, or if this stage does not show the stop yet."""
        state = self.before if self.walk.stage < POSED else self.after
        return str(state.reason[0]) if Status(int(state.status[0])) != Status.RUNNING else ""

    def errors(self) -> tuple[float, float, float]:
        """The errors against the truth: rotation in degrees, translation in u, scale in percent."""
        truth = self.walk.scene.truth
        scale = 100.0 * (float(self.pose.scale) / float(truth.scale) - 1.0)
        return *errors(self.pose, truth), scale


@dataclass(frozen=True)
class Shown:
    """What a panel shows: its marks, and one line on what was just computed, with its numbers."""

    marks: tuple[Mark, ...]
    words: str
    grid: bool = True


@lru_cache(maxsize=4)
def fixed(scene: Scene) -> tuple[Mark, ...]:
    """The outline at the true pose, and the fixed cloud: the same objects for a scene, so they are rendered once."""
    return (*where(scene), Points(scene.target, "target", "square", radius=2.5))


@lru_cache(maxsize=4)
def where(scene: Scene) -> tuple[Mark, ...]:
    """The outline at the true pose."""
    return tuple(Path(scene.truth.apply(line), "truth", thick=True, weight=0.5) for line in scene.outline)


def outline(scene: Scene, pose: Pose, role: Role) -> tuple[Path, ...]:
    """The curve at a pose."""
    return tuple(Path(pose.apply(line), role) for line in scene.outline)


def carried(look: Look) -> tuple[Mark, ...]:
    """The moving cloud after the step, over its outline before it. In a clean scene the points show the curve by
    themselves, so it is not drawn."""
    scene = look.walk.scene
    return (
        *fixed(scene),
        *(() if look.track.rests else outline(scene, look.came, "ghost")),
        *(() if scene.name == "clean" else outline(scene, look.went, "source")),
        cloud(look.went.apply(scene.source)),
    )


def cloud(points: Array, weight: Array | None = None, radius: float = 2.5) -> Points:
    """Moving points."""
    return Points(points, "source", radius=radius, weight=weight)


def arc(angle: float, first: float, radius: float) -> Array:
    """A turn about the origin by `angle` from the direction `first`, as points (k, 2)."""
    angles = first + np.linspace(0.0, angle, 25)
    return radius * np.stack([np.cos(angles), np.sin(angles)], axis=1)


def held(look: Look) -> Shown:
    """The fifth stage, in which only CPD has something to find."""
    return Shown(carried(look), "Held: this stage is CPD’s, for its variance; there is none here.")
