"""The walkthrough's run: four methods on one scene, an iteration each, and at which stage of it they are looked at."""

from __future__ import annotations

from collections.abc import Sequence
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
"""Positions of one iteration: CPD has a stage for each; those with four hold their last at the fifth."""
POSED = 4  # the stage at which all four have their new pose

VIEW = View(-4.5, 4.5, -3.05, 3.05, width=460.0)
PLACING = Placing(VIEW, limit=(2.0, 1.2), reach=2.9, least=1.5)
ANCHOR = np.zeros(2)
ANCHOR.flags.writeable = False


@dataclass(frozen=True, eq=False)
class Track:
    """One method: before and after the present iteration. after is None until a stage is looked at that needs it; it
    is `before` for a method that had stopped already."""

    name: str
    before: Batch[Any]
    after: Batch[Any] | None = None

    def stepped(self) -> Track:
        """With the present iteration's step taken, where it was not."""
        return self if self.after is not None else replace(self, after=advance(self.before))

    def onward(self) -> Track:
        """At the beginning of the next iteration."""
        after = self.stepped().after
        assert after is not None
        return Track(self.name, after)

    @property
    def rests(self) -> bool:
        """Whether it had stopped before the present iteration."""
        return self.before.done

    @property
    def last(self) -> Batch[Any]:
        """The run as far as it has been taken."""
        return self.before if self.after is None else self.after


@dataclass(frozen=True, eq=False)
class Walk:
    """All four from one start, in iteration 1, 2, … at stage 1 … 5."""

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
        """Whether there is no stage left to look at."""
        return self.over and self.stage == STAGES

    def at(self, stage: int) -> Walk:
        """The present iteration at another stage: from the second on, its step is taken."""
        tracks = self.tracks if stage == 1 else tuple(track.stepped() for track in self.tracks)
        return replace(self, tracks=tracks, stage=stage)

    def next(self) -> Walk:
        """The next stage, or the first of the next iteration; at the end nothing more."""
        if self.stage < STAGES:
            return self.at(self.stage + 1)
        return self if self.over else self._onward().at(1)

    def iterated(self) -> Walk:
        """The same stage, an iteration later; the last stage where no iteration is left."""
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
        """What each panel draws from."""
        return tuple(Look(self, track) for track in self.tracks)


def begun(scene: Scene, start: Pose, project: bool) -> Walk:
    """All four at the first stage of the first iteration, no step taken."""
    return Walk(scene, start, tuple(Track(name, begin_walk(name, [scene], [start], project)) for name in FOUR))


@dataclass(frozen=True, eq=False)
class Look:
    """One method at the present stage. before, after: its states before and after the iteration's step, batches of one;
    after is `before` as long as the step has not been taken. came, went: the scene's poses in the two."""

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
        """The scene's pose as it stands at this stage."""
        return self.went if self.walk.stage >= POSED else self.came

    @property
    def steps(self) -> int:
        """Steps behind that pose."""
        return int((self.track.last if self.walk.stage >= POSED else self.track.before).steps[0])

    @property
    def given(self) -> Array:
        """The moving cloud as the method was given it, before any thinning, (150, 2)."""
        return self.walk.start.apply(self.walk.scene.source)

    @property
    def moved(self) -> Array:
        """The moving cloud before the step (150, 2)."""
        return self.came.apply(self.walk.scene.source)

    @property
    def stopped(self) -> str:
        """Why it has stopped, in words, as far as the stage shows it; empty while it runs."""
        state = self.before if self.walk.stage < POSED else self.after
        return str(state.reason[0]) if Status(int(state.status[0])) != Status.RUNNING else ""

    def errors(self) -> tuple[float, float, float]:
        """Against the truth: of the rotation in degrees, of the translation in u, of the scale in percent."""
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
    """The outline where it belongs, and the fixed cloud: the same objects for one scene, turned into markup once."""
    return (*where(scene), Points(scene.target, "target", "square", radius=2.5))


@lru_cache(maxsize=4)
def where(scene: Scene) -> tuple[Mark, ...]:
    """The outline where it belongs."""
    return tuple(Path(scene.truth.apply(line), "truth", thick=True, weight=0.5) for line in scene.outline)


def outline(scene: Scene, pose: Pose, role: Role, weight: float = 1.0) -> tuple[Path, ...]:
    """The curve at a pose."""
    return tuple(Path(pose.apply(line), role, weight=weight) for line in scene.outline)


def carried(look: Look) -> tuple[Mark, ...]:
    """The moving cloud where the step has put it, over its outline before. Clean points show the curve themselves."""
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


def arc(angle: float, first: float = 0.0, radius: float = 1.2, about: Sequence[float] = (0.0, 0.0)) -> Array:
    """A turn by `angle` from the direction `first`, as points (k, 2)."""
    angles = first + np.linspace(0.0, angle, 25)
    return np.asarray(about) + radius * np.stack([np.cos(angles), np.sin(angles)], axis=1)


def held(look: Look) -> Shown:
    """The stage in which CPD alone has something to find."""
    return Shown(carried(look), "Held while CPD finds its variance; there is none here.")
