"""Runs the race step by step, natively or in the page's Python, and records every problem's pose after each step."""

import json

import numpy as np

from solvers import METHODS
from solvers.core.method import Problem
from solvers.core.stepper import advance, begin
from solvers.scenes.rooms import kabsch_scene
from solvers.studies.benchmark import line
from solvers.studies.race import CONTESTANTS, Controls, race_problem


def main(text):
    """The poses after "one step" of every method and along each contestant's "course", and its final "counts"."""
    arguments = json.loads(text)
    controls = Controls(setting=arguments["setting"], degrees=arguments["degrees"])
    problem, truth = race_problem(controls)
    course, counts = {}, {}
    for contestant in CONTESTANTS:
        batch = contestant.begin(problem)
        poses = [flat(batch.pose())]
        while not batch.done:
            batch = advance(batch)
            poses.append(flat(batch.pose()))
        course[contestant.method] = np.stack(poses).tolist()
        row = line(contestant, batch, truth, 0.0)
        counts[contestant.method] = [row.turned, row.close]
    return json.dumps({"one step": one_step(problem), "course": course, "counts": counts})


def one_step(room):
    """The poses after one step of every method with default options, all from one start."""
    scenes = [kabsch_scene("noisy", seed=int(seed)) for seed in room.seed]
    source, target = (np.stack([getattr(scene, name) for scene in scenes]) for name in ("source", "target"))
    pairs = Problem(source, target, np.ones(source.shape[:2]), room.start, room.seed)
    after = {}
    for name, method in METHODS.items():
        batch = begin(method, pairs if method.paired else room)
        after[name] = flat(advance(batch).pose()).tolist()
    return after


def flat(pose):
    """R, t and scale of b poses, as (b, 7)."""
    scale = np.broadcast_to(pose.scale, pose.t.shape[:-1])[..., None]
    return np.concatenate([pose.R.reshape(*pose.R.shape[:-2], 4), pose.t, scale], axis=-1)
