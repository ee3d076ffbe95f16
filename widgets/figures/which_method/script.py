"""The Python script for a path: its scenes, its runs and its numbers, with numpy and solvers alone."""

from __future__ import annotations

from collections.abc import Sequence

from widgets.engine.script import called, named
from widgets.figures.which_method.rules import RUNGS, Answers
from widgets.figures.which_method.trial import APART, NOISE, OF, SEEN, STARTS, TREES, WRONG, kept, options

HEAD = """import numpy as np
from solvers import Pose, register
from solvers.metrics import rre, rte
from solvers.scenes import {scene}, room_start

seeds = [40 + 13 * k for k in range({of})]
"""
GROVE = """

def grove(seed):
    rng = np.random.default_rng(seed)
    trunks = np.empty((0, 2))
    for place in rng.uniform((-5.0, -3.2), (5.0, 3.2), (2000, 2)):
        if len(trunks) < {trees} and (not len(trunks) or np.hypot(*(trunks - place).T).min() > {apart}):
            trunks = np.vstack([trunks, place])
    source, target = (trunks + {noise} * rng.standard_normal(trunks.shape) for _ in range(2))
    return source, target[np.sort(np.argsort(trunks[:, 0])[:{kept}])]


source, target = (np.stack(clouds) for clouds in zip(*map(grove, seeds)))
truth = Pose.identity(2, (len(seeds),))
"""
SCENES = """scenes = [{call} for seed in seeds]
source, target = np.stack([s.source for s in scenes]), np.stack([s.target for s in scenes])
truth = Pose(np.stack([s.truth.R for s in scenes]), np.stack([s.truth.t for s in scenes]))
"""
TAIL = """
print("points_source", source.shape[1])
print("points_target", target.shape[1])
print("rotation_start", np.degrees(np.median(rre(start, truth))))
"""
ENDS = """
turn, shift = np.degrees(rre(pose, truth)), rte(pose, truth)
print("found", np.count_nonzero((turn < 5.0) & (shift < 0.2)))
print("rotation_error", np.median(turn))
"""


def script(path: Sequence[str], a: Answers, tried: bool) -> str:
    """The scenes and the start, and the path's runs if it was tried."""
    degrees, distance = STARTS[a.start]
    lines = HEAD.format(scene="kabsch_scene" if a.pairs != "none" else "room", of=OF) + _scenes(a)
    lines += f"start = room_start({degrees}, {distance}).compose(truth)\n"
    if not tried:
        return lines + TAIL
    for k, name in enumerate(path):
        arguments = ["source", "target", f'"{RUNGS[name].method}"', f"start={'pose' if k else 'start'}", "seed=seeds"]
        arguments += named(options(name, a.start == "near" or k > 0))
        lines += "\n".join(called("pose = register", *arguments, after=".pose")) + "\n"
    return lines + TAIL + ENDS


def _scenes(a: Answers) -> str:
    if a.pairs != "none":
        return SCENES.format(call=f'kabsch_scene("noisy", seed=seed, outliers={WRONG[a.pairs]})')
    if a.surfaces == "walls":
        return SCENES.format(call=f'room("combo", seed=seed, overlap={SEEN[a.overlap]})')
    return GROVE.format(trees=TREES, apart=APART, noise=NOISE, kept=kept(SEEN[a.overlap]))
