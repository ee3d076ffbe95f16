"""How records of arrays are displayed at a prompt."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import fields, is_dataclass, replace

import numpy as np
import pytest

from solvers import METHODS, Pose, cloud_text, fit_rigid, g2o, ndt_map, ndt_score, register
from solvers.drives import telecom_loop
from solvers.mug_scene import mug
from solvers.odometry import match, prepare
from solvers.posegraph import Edges, begin, optimise
from solvers.race import Controls, race_problem
from solvers.scans import two_scans
from solvers.scenes import kabsch_scene
from solvers.stepper import begin as begin_run
from solvers.uncertainty import spread_of
from solvers.verify import evidence

PROBLEM = race_problem(Controls(setting="clean"), seeds=[40])[0]


def records() -> Iterator[object]:
    """One record of each kind that users handle, at its usual size."""
    scene, drive = kabsch_scene("clean"), telecom_loop()
    result = register(scene.source, scene.target, "icp")
    scans = prepare(drive)
    yield from (scene, drive, scans, two_scans(), mug(), result.history, result.covariance)
    yield cloud_text.read(b"0 0\n" * 400)
    poses = Pose.from_angle(np.zeros(400), np.arange(800.0).reshape(400, 2))
    edges = Edges.between(poses, np.arange(399), np.arange(1, 400), np.eye(3))
    yield from (edges, begin(poses, edges), optimise(poses, edges), g2o.read(g2o.write(poses, edges)))
    yield spread_of(poses, centre=(0.0, 0.0), radius=1.0)
    yield match(scans, [1, 2], [0, 1], drive.motion[[1, 2]])
    yield evidence(scene.source, scene.target, result.pose)
    cells = ndt_map.build(scene.target[None], 1.0)
    yield from (cells, ndt_score.evaluate(cells, scene.source[None], np.zeros((1, 2))))
    yield from (fit_rigid(scene.source, scene.target), begin_run(METHODS["icp"], PROBLEM), PROBLEM)


@pytest.mark.parametrize("record", list(records()), ids=lambda record: type(record).__name__)
def test_a_record_shows_itself_in_a_short_line(record: object) -> None:
    text = repr(record)
    assert text.startswith(f"{type(record).__name__}(")
    assert "\n" not in text
    assert len(text) < 700


@pytest.mark.parametrize("name", METHODS)
def test_a_state_shows_itself_in_a_line(name: str) -> None:
    """Records within it that would be long stand by their names: what a method keeps beside its pose may be large."""
    p, q = PROBLEM.source, PROBLEM.target
    m = min(p.shape[1], q.shape[1])
    problem = replace(PROBLEM, source=p[:, :m], target=q[:, :m], weights=np.ones((1, m)))  # rows may be pairs
    batch = begin_run(METHODS[name], problem)
    state = batch.state()
    text = repr(state)
    assert "State(problem=Problem(…), " in text
    assert repr(batch) == f"Batch({name}: {batch.rows.size} of 1 running, at most {batch.max_steps} steps)"
    for part in (text, *(repr(value) for f in fields(state) if is_dataclass(value := getattr(state, f.name)))):
        assert "\n" not in part
        assert len(part) < 900


def test_small_arrays_are_shown_whole_and_large_ones_by_shape() -> None:
    text = repr(kabsch_scene("clean"))
    assert "source=float64 array of shape (13, 2)" in text
    assert "truth=Pose(angle=50°" in text
    estimate = evidence([[0.0, 0.0], [1.0, 0.0]], [[0.0, 0.0], [1.0, 0.0]], Pose.identity(), reach=0.1)
    assert "explained=[ True, True]" in repr(estimate)
    assert "share=1." in repr(estimate)
    assert repr(two_scans()).endswith("walls=3 arrays)")
