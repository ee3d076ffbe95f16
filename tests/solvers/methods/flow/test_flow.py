"""The learned flow: what its network must not depend on, what each step does, and where it holds and fails."""

from __future__ import annotations

import hashlib
import inspect
import json
from pathlib import Path

import numpy as np
import pytest

from solvers import METHODS, Pose, Status, register
from solvers.core.method import Problem
from solvers.core.stepper import advance, begin
from solvers.methods.flow import network
from solvers.methods.flow.flow import FLOW, FLOW_FROM_SOURCE, FlowOptions
from solvers.methods.flow.scenes import HELD_OUT, TRAINING, draw
from solvers.methods.flow.study import POINTS, StudyLine, by_turn, study
from solvers.methods.flow.weights import FOLDER, pack, params, unpack
from solvers.scenes.rooms import room

NAMES = ["flow", "flow-from-source"]
SCENES = draw(TRAINING, 5, 30, 3)


def problem(scenes=SCENES, start=None):
    b = len(scenes.angle)
    seed = np.arange(b, dtype=np.int64)
    weights = np.ones(scenes.source.shape[:2])
    return Problem(scenes.source, scenes.target, weights, start or Pose.identity(2, (b,)), seed)


def rotate(points, angle):
    return Pose.from_angle(angle).apply(points)


def test_a_scene_is_one_shape_seen_twice():
    """Without noise and clutter, every source point moved by the truth lies on the target's outline."""
    quiet = draw(type(TRAINING)("quiet", noise=(0.0, 0.0), clutter=(0.0, 0.0)), 4, 400, 5)
    moved = Pose.from_angle(quiet.angle, quiet.shift).apply(quiet.source)
    nearest = np.linalg.norm(moved[:, :, None] - quiet.target[:, None], axis=-1).min(axis=2)
    assert nearest.max() < 0.1
    assert np.median(nearest) < 0.02


def test_scenes_keep_to_their_kind():
    """Angles are in the kind's range, in both directions, and a smaller source is smaller."""
    scenes = draw(HELD_OUT[2], 200, 10, 1)
    assert np.degrees(np.abs(scenes.angle)).min() >= 135
    assert 0.3 < (scenes.angle > 0).mean() < 0.7
    full, small = (draw(type(TRAINING)("s", scale=s), 20, 30, 2).source for s in (1.0, 0.85))
    spread = [cloud.std(axis=1).sum(axis=-1) for cloud in (full, small)]
    assert spread[1] / spread[0] == pytest.approx(0.85)


def test_what_describes_a_point_does_not_turn_with_the_cloud():
    """Turning a cloud leaves its invariants unchanged; mirroring it changes them."""
    points = SCENES.source - SCENES.source.mean(axis=1, keepdims=True)
    before = network.invariants(points)
    assert network.invariants(rotate(points, 2.1)) == pytest.approx(before, abs=1e-12)
    assert np.abs(network.invariants(points * [-1.0, 1.0]) - before).max() > 0.1


@pytest.mark.parametrize("name", NAMES)
def test_the_order_of_the_points_does_not_matter(name):
    """Points listed in another order each get the same endpoint."""
    p, q, x = (np.random.default_rng(i).normal(size=(9, 2)) for i in range(3))
    order = np.random.default_rng(5).permutation(9)
    x = np.concatenate([x, q])
    first = network.endpoint(params(name), network.encode(params(name), p, q), x, 0.3)
    x = np.concatenate([x[:9][order], q])
    second = network.endpoint(params(name), network.encode(params(name), p[order], q), x, 0.3)
    assert second[:9] == pytest.approx(first[:9][order], abs=1e-10)
    assert second[9:] == pytest.approx(first[9:], abs=1e-10)


def test_attention_is_the_weighted_mean_that_its_formula_says():
    """Agrees with the formula written out head by head and token by token."""
    w = params("flow")
    h = np.random.default_rng(1).normal(size=(6, network.WIDTH))
    size = network.WIDTH // network.HEADS
    q, k, v = np.split(h @ w["layer0.qkv"], 3, axis=-1)
    mixture = np.zeros_like(h)
    for head in range(network.HEADS):
        part = slice(head * size, (head + 1) * size)
        for i in range(6):
            weight = np.exp([q[i, part] @ k[j, part] / np.sqrt(size) for j in range(6)])
            mixture[i, part] = sum(weight[j] * v[j, part] for j in range(6)) / weight.sum()
    assert network._attention(w, "layer0.", h, np) == pytest.approx(mixture @ w["layer0.out"], abs=1e-12)


def is_near(a, b, tolerance):
    """Whether arrays have the same shape and all entries within `tolerance`: fast for large ones, which pytest.approx
    compares one by one."""
    return a.shape == b.shape and np.abs(a - b).max() <= tolerance


@pytest.mark.parametrize("method", [FLOW, FLOW_FROM_SOURCE])
def test_a_step_predicts_makes_rigid_and_noises_again_by_the_same_draw(method):
    """x at the next time is (1 − t) x₀ + t times the rigid endpoint, with x₀ as drawn at the start."""
    m = SCENES.source.shape[1]
    batch = begin(method, problem())
    for k in range(1, 11):
        batch = advance(batch)
        state = batch.state()
        t = k / 10
        assert state.time == pytest.approx(t)
        assert is_near(state.present, (1 - t) * state.noise + t * state.projected, 1e-12)
        for part in (slice(0, m), slice(m, None)):
            result, points = state.projected[..., part, :], state.given[:, None, part]
            distances = [np.linalg.norm(c[..., :, None, :] - c[..., None, :, :], axis=-1) for c in (result, points)]
            assert is_near(distances[0], np.broadcast_to(distances[1], distances[0].shape), 1e-9)
        error = ((state.predicted - state.projected) ** 2).sum(-1).mean(-1)
        assert is_near(state.rigidity, error, 1e-12)
        assert (state.rigidity[range(5), state.chosen] == state.rigidity.min(axis=1)).all()
    assert batch.done
    assert (batch.state().status == Status.FINISHED).all()


def test_without_projection_the_endpoint_itself_is_followed():
    """With project=False, the step uses the prediction itself."""
    state = advance(begin(FLOW, problem(), FlowOptions(project=False))).state()
    assert state.present == pytest.approx(0.9 * state.noise + 0.1 * state.predicted, abs=1e-12)
    assert np.abs(state.predicted - state.projected).max() > 1e-3


def test_the_pose_is_read_out_from_both_views():
    """A_target⁻¹ ∘ A_source in world coordinates puts the source where its generated copy lies in the target."""
    state = advance(begin(FLOW, problem())).state()
    m = SCENES.source.shape[1]
    for i in range(5):
        points = state.projected[i, state.chosen[i], :m]
        local = state.views[1][i, state.chosen[i]].inverse().apply(points)
        world = state.middle[i] + state.radius[i] * local
        assert state.pose[i].apply(SCENES.source[i]) == pytest.approx(world, abs=1e-9)


def test_the_flow_from_the_source_leaves_the_target_alone():
    """Only the source moves, and its one start gives one sample."""
    state = advance(begin(FLOW_FROM_SOURCE, problem())).state()
    m = SCENES.source.shape[1]
    assert state.present.shape[1] == 1
    assert state.present[:, 0, m:] == pytest.approx(state.given[:, m:], abs=1e-9)


@pytest.mark.parametrize("name", NAMES)
def test_place_and_unit_of_the_world_do_not_matter(name):
    """With both clouds shifted by different amounts and in other units, the motion is the same in those units."""
    p, q = SCENES.source[0], SCENES.target[0]
    first = register(p, q, method=name, seed=7)
    second = register(100 * p + [30, -7], 100 * q + [-5, 900], method=name, seed=7)
    assert second.transform(100 * p + [30, -7]) == pytest.approx(100 * first.transform(p) + [-5, 900], abs=1e-6)


@pytest.mark.parametrize("name", NAMES)
def test_a_start_is_another_way_to_hand_over_the_source(name):
    """The network sees the source as placed by the start."""
    p, q = SCENES.source[1], SCENES.target[1]
    start = Pose.from_angle(0.4, (0.2, -0.3))
    result = register(p, q, method=name, start=start, seed=3)
    moved = register(start.apply(p), q, method=name, seed=3)
    assert result.transform(p) == pytest.approx(moved.transform(start.apply(p)), abs=1e-9)


@pytest.mark.parametrize("name", NAMES)
def test_one_place_for_all_points_is_degenerate(name):
    """A spread of zero cannot be scaled."""
    result = register(np.ones((5, 2)), SCENES.target[0], method=name)
    assert result.status == Status.DEGENERATE
    assert np.isfinite(result.pose.matrix).all()


def test_packing_keeps_a_number_to_half_a_level():
    """A column's numbers are restored to within half of its largest divided by 127."""
    random = np.random.default_rng(0)
    arrays = {shape.name: random.normal(size=shape.size) for shape in network.shapes()}
    result = unpack(pack(arrays))
    for name, values in arrays.items():
        step = np.abs(values.reshape(-1, values.shape[-1])).max(axis=0) / 127
        assert (np.abs(result[name] - values) <= 0.5001 * step + 1e-7).all()
    with pytest.raises(ValueError, match="bytes"):
        unpack(b"no")


@pytest.mark.parametrize("name", NAMES)
def test_the_weights_are_those_of_the_log(name):
    """The shipped weights are those that the training logged."""
    log = json.loads(Path(FOLDER, "log.json").read_text("utf-8"))
    digest = hashlib.sha256(Path(FOLDER, f"{name}.int8").read_bytes()).hexdigest()
    assert digest == log["networks"][name]["sha256"]
    losses = [loss for _, loss in log["networks"][name]["loss"]]
    assert losses[-1] < 0.2 * losses[0]


@pytest.mark.native
def test_the_study_of_the_log_is_what_the_weights_give():
    """A sample of the held-out table, recomputed, agrees with the log."""
    log = json.loads(Path(FOLDER, "log.json").read_text("utf-8"))
    lines = {(line["variant"], line["kind"]): StudyLine(**line) for line in log["held_out"]}
    for line in study(HELD_OUT[:3], ["flow-from-source"]):
        entry = lines[line.variant, line.kind]
        assert abs(line.turned - entry.turned) <= 1
        assert abs(line.placed - entry.placed) <= 1
        assert line.degrees == pytest.approx(entry.degrees, rel=0.01)


@pytest.mark.native
@pytest.mark.parametrize("variant", ["flow", "flow, one sample"])
def test_it_holds_where_it_was_trained_and_fails_beyond(variant):
    """Up to 90° the rotation is within 5° on most of 40 scenes, from 135° on hardly any, both with one sample and with
    the most rigid of four."""
    near, far = (by_turn(edges, variant, 40)[0] for edges in ([0.0, 90.0], [135.0, 180.0]))
    assert near.turned > 27
    assert far.turned < 4


def test_both_are_methods_like_the_others():
    """They are registered in the plane, and the seed determines the answer."""
    assert {name: METHODS[name].dims for name in NAMES} == dict.fromkeys(NAMES, (2,))
    p, q = SCENES.source[0], SCENES.target[0]
    runs = [register(p, q, method="flow", seed=s).pose.matrix for s in (1, 1, 2)]
    assert (runs[0] == runs[1]).all()
    assert np.abs(runs[0] - runs[2]).max() > 0


@pytest.mark.native
def test_the_study_is_of_other_scenes_than_the_training():
    """In both trainings, step s draws its batch from the seed in the log plus s. The study's seed is outside both
    ranges. Drawn in batches of the same size, since equal seeds would then give equal scenes, its scenes do not occur
    in a sample of the training's."""
    log = json.loads(Path(FOLDER, "log.json").read_text("utf-8"))
    study_seed = inspect.signature(study).parameters["seed"].default
    for first in (log["seed"], log["again"]["seed"]):
        assert study_seed not in range(first, first + log["steps"] + 1)
    held_out = draw(TRAINING, log["batch"], POINTS, study_seed).target
    for seed in range(log["seed"], log["seed"] + log["steps"], 97):
        target = draw(TRAINING, log["batch"], POINTS, seed).target
        assert np.abs(held_out[:, None] - target[None]).max(axis=(2, 3)).min() > 0.1


@pytest.mark.parametrize("method", ["flow", "flow-from-source"])
@pytest.mark.parametrize("unit", [1e-300, 1e-170, 1e149])
def test_the_unit_changes_nothing(method, unit):
    """Units scaled by powers of ten, even so that squares of coordinates under- or overflow, give the same motion."""
    scene = room("clean", seed=40)
    source, target = scene.source[::8], scene.target[::8]
    plain, result = (register(source * k, target * k, method, steps=3, samples=1) for k in (1.0, unit))
    assert result.status == Status.FINISHED
    assert result.pose.angle == pytest.approx(plain.pose.angle, abs=1e-6)
    np.testing.assert_allclose(result.pose.t / unit, plain.pose.t, atol=1e-6)


@pytest.mark.parametrize("method", ["flow", "flow-from-source"])
@pytest.mark.parametrize(("source", "target"), [(1.0, 1e-12), (1e-12, 1.0), (1e100, 1e-100), (1e-300, 1e149)])
def test_a_cloud_that_is_a_point_beside_the_other_is_degenerate(method, source, target):
    """The network would see a single place; no number on the way leaves float64's range."""
    scene = room("clean", seed=40)
    result = register(scene.source[::8] * source, scene.target[::8] * target, method)
    assert result.status == Status.DEGENERATE
    assert result.reason == "one cloud is more than 1e+09 times as wide as the other"
