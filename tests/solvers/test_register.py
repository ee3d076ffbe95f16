import dataclasses
from functools import partial
from pathlib import Path

import numpy as np
import pytest

import solvers
from solvers import METHODS, Pose, Result, Status, register
from solvers.scenes.rooms import kabsch_scene, room

kabsch = partial(register, method="kabsch")


@pytest.fixture
def scene():
    return kabsch_scene("noisy")


@pytest.mark.parametrize("method", sorted(METHODS))
def test_every_method_describes_itself(method):
    """Each method has a one-line summary and a source, and all its options have defaults."""
    entry = METHODS[method]
    assert entry.name == method
    assert entry.summary
    assert "\n" not in entry.summary
    assert entry.source
    assert dataclasses.is_dataclass(entry.options())
    assert entry.max_steps >= 1


@pytest.mark.parametrize("method", sorted(METHODS))
def test_every_method_runs_from_the_front_door(method, scene):
    """Given just two clouds, each method stops with a consistent pose, status and history."""
    result = register(scene.source, scene.target, method)
    assert isinstance(result, Result)
    assert result.method == method
    assert result.status in set(Status) - {Status.RUNNING}
    assert isinstance(result.status, Status)
    assert isinstance(result.reason, str)
    assert 1 <= result.steps <= METHODS[method].max_steps
    assert result.history.poses.batch == result.history.objective.shape == (result.steps + 1,)
    assert np.array_equal(result.history.poses[-1].matrix, result.matrix)
    assert result.history.objective[-1] == result.objective
    assert np.allclose(result.inverse().apply(result.transform(scene.source)), scene.source, atol=1e-12)


def test_the_answer_of_a_closed_form_does_not_depend_on_the_start(scene):
    """From 500 starting poses all over the plane, the fit ends at the same pose, bit for bit."""
    rng = np.random.default_rng(1)
    starts = Pose.from_angle(rng.uniform(-np.pi, np.pi, 500), 10.0 * rng.standard_normal((500, 2)))
    result = kabsch(scene.source, scene.target, start=starts)
    assert np.all(result.status == Status.CONVERGED)
    assert np.all(result.pose.matrix == kabsch(scene.source, scene.target).matrix)
    assert np.array_equal(result.history.poses.t[0], starts.t)
    assert np.all(result.history.objective[0] >= result.history.objective[1])


def test_leading_axes_are_a_batch(scene):
    """Clouds, starts and seeds broadcast against each other, and all results have their common leading axes."""
    source = np.stack([scene.source, scene.source[::-1]])
    result = kabsch(source, scene.target, start=Pose.identity(2, (3, 1)), seed=[1, 2])
    assert result.pose.batch == result.status.shape == result.steps.shape == result.reason.shape == (3, 2)
    assert result.objective.shape == (3, 2)
    assert result.history.poses.batch == (2, 3, 2)
    assert result.detail("singular_values").shape == (3, 2, 2)
    assert result.transform(scene.source).shape == (3, 2, 13, 2)
    for i in range(2):
        alone = kabsch(source[i], scene.target)
        assert np.allclose(result.pose[0, i].matrix, alone.matrix, atol=1e-12)


def test_options_in_numpy_s_small_types_are_those_numbers(scene):
    """Given one by one or as one object: an int8 would overflow in the method's computations."""
    usual = register(scene.source, scene.target, "ransac-congruent", most=70)
    for options in ({"most": np.int8(70)}, {"options": METHODS["ransac-congruent"].options(most=np.int8(70))}):
        assert np.array_equal(register(scene.source, scene.target, "ransac-congruent", **options).matrix, usual.matrix)


def test_a_shorter_history_repeats_its_last_entry(scene):
    """If listed problems take different numbers of steps, the shorter histories repeat their own last pose."""
    stopped = kabsch([scene.source] * 2, [scene.target] * 2, max_steps=0)
    assert stopped.history.objective.shape == (1, 2)
    results = solvers.core.result.side_by_side(
        [kabsch(scene.source, scene.target, max_steps=0), kabsch(scene.source, scene.target)]
    )
    assert results.steps.tolist() == [0, 1]
    assert results.history.objective.shape == (2, 2)
    assert results.history.objective[0, 0] == results.history.objective[1, 0]
    assert results.status.tolist() == [Status.CAPPED, Status.CONVERGED]


def test_pairs_name_the_partners(scene):
    """With `pairs` the clouds may have any sizes and orders; weights then belong to the pairs."""
    rng = np.random.default_rng(2)
    order = rng.permutation(13)
    target = np.vstack([scene.target[order], [[9.0, 9.0]]])
    pairs = np.c_[order, np.arange(13)]
    plain = kabsch(scene.source, scene.target)
    assert np.allclose(kabsch(scene.source, target, pairs=pairs).matrix, plain.matrix, atol=1e-13)
    weights = rng.uniform(0.5, 1.0, 13)
    assert np.allclose(
        kabsch(scene.source, target, pairs=pairs, weights=weights[order]).matrix,
        kabsch(scene.source, scene.target, weights=weights).matrix,
        atol=1e-13,
    )
    batch = kabsch(scene.source, target, pairs=np.stack([pairs[:5], pairs[5:10]]))
    assert batch.pose.batch == (2,)
    assert np.allclose(batch.pose[1].matrix, kabsch(scene.source, target, pairs=pairs[5:10]).matrix, atol=1e-13)


def test_what_is_told_of_partners_is_told_of_the_pairs(scene):
    """With pairs given, correspondences and fitness are per pair, since any two pairs may name the same point."""
    result = kabsch(scene.source, scene.target, pairs=[[5, 5], [2, 2], [9, 9], [9, 9]], weights=[1.0, 1.0, 1.0, 0.0])
    assert result.correspondences.tolist() == [0, 1, 2, -1]
    assert result.fitness == 0.75


@pytest.mark.filterwarnings("error::RuntimeWarning")
@pytest.mark.parametrize(
    ("method", "options"),
    [
        ("mmd", {"damping": 1}),
        ("ransac-congruent", {"inlier": np.float32(1), "most": np.uint8(100), "per_step": np.uint64(6)}),
        ("trimmed-icp", {"keep": np.int8(1)}),
        ("icp", {"gate": np.float16(2), "weight": "huber", "scale": np.float32(1)}),
    ],
)
def test_a_number_counts_and_not_its_type(method, options):
    """Integers may stand for fractions, and numpy's small types, in which sums would overflow, for any number."""
    scene = room("noise", seed=40)
    plain = {name: value if isinstance(value, str) else float(value) for name, value in options.items()}
    plain |= {name: int(plain[name]) for name in ("most", "per_step") if name in plain}
    first, second = (register(scene.source, scene.target, method, max_steps=15, **extra) for extra in (options, plain))
    np.testing.assert_array_equal(first.matrix, second.matrix)
    assert first.status == second.status


def test_icp_is_what_is_asked_for_by_default(scene):
    assert register(scene.source, scene.target).method == "icp"


def test_a_callback_is_called_after_every_step(scene):
    calls = []
    kabsch(scene.source, scene.target, callback=lambda k, state: calls.append((k, state.pose.batch)))
    assert calls == [(1, (1,))]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"method": "kabash"}, r"method: 'kabash' is unknown, did you mean 'kabsch'\?"),
        ({"method": 3}, "method: 3 is unknown"),
        ({"start": kabsch([[0.0, 0.0]], [[0.0, 0.0]])}, "start: expected a Pose or its matrix, got a Result; pass"),
        ({"wieghts": None}, r"wieghts: no option of method 'kabsch', did you mean 'weights'\?"),
        ({"maxsteps": 3}, r"did you mean 'max_steps'\?"),
        ({"frobnicate": 1}, "frobnicate: no option of method 'kabsch'; it takes: pairs, weights$"),
        ({"source": np.zeros(3)}, r"source: expected shape \(\.\.\., n, d\)"),
        ({"source": np.zeros((13, 1))}, "source: expected at least 2 coordinates"),
        ({"source": np.zeros((0, 2))}, "source: is empty"),
        ({"source": [[1.0, 2.0], [3.0]]}, "source: rows of unequal length"),
        ({"target": np.zeros((13, 3))}, "target: expected 2 coordinates per point, got 3"),
        ({"target": np.zeros((12, 2))}, r"target: .*pass pairs=\(k, 2\)"),
        ({"target": np.full((13, 2), "x")}, r"target: expected real numbers, got dtype <U1; \.astype\(float\)"),
        ({"target": np.zeros((13, 2), dtype=object)}, r"target: .* got dtype object; \.astype\(float\)"),
        ({"target": np.array([[1, 2], [3]], dtype=object)}, r"target: .* dtype object, an array of sequences; list\("),
        ({"target": np.zeros((13, 2), dtype=complex)}, "target: expected real numbers, got dtype complex128$"),
        ({"target": np.zeros(13, dtype=[("x", "f8"), ("y", "f8")])}, "target: .* got dtype .*; stack its fields"),
        ({"source": "scan.csv"}, r"source: .* got str; read the file first \(solvers\.cloud_text\.read\)"),
        ({"source": Path("scan.csv")}, r"source: .* got \w+Path; read the file first"),
        ({"source": None}, "source: expected real numbers, got NoneType$"),
        ({"source": np.zeros((2, 13, 2)), "target": np.zeros((3, 13, 2))}, "do not broadcast"),
        ({"weights": np.ones(4)}, r"weights: expected shape \(\.\.\., 13\)"),
        ({"weights": -np.ones(13)}, "weights: must not be negative"),
        ({"pairs": [[0, 13]]}, "pairs: column 1 names target row 13, but the rows go from 0 to 12"),
        ({"pairs": [[-1, 0]]}, "pairs: column 0 names source row -1"),
        ({"pairs": [[0.0, 1.0]]}, "pairs: expected integers"),
        ({"pairs": [0, 1]}, r"pairs: expected shape \(\.\.\., k, 2\)"),
        ({"start": [0.2, 0.1, 0.0]}, r"start: is neither .*, got \(3,\); Pose\.from_angle\(radians, \(x, y\)\) makes"),
        ({"start": np.diag([1.0, -1.0, 1.0])}, "start: is neither .*a reflection"),
        ({"start": "here"}, "start: expected real numbers, got str$"),
        ({"weights": "tukey"}, "weights: expected real numbers, got str$"),
        (
            {"method": "icp", "weights": "tukey"},
            "weights: expected real numbers, got str; a kernel is chosen by weight='tukey'$",
        ),
        ({"method": "icp", "weight": np.ones(132)}, r"weight: expected the name of a kernel; did you mean 'weights'"),
        ({"method": "icp", "weight": [1.0] * 13}, r"weight: expected the name of a kernel; did you mean 'weights'"),
        ({"method": "icp", "weight": 3}, r"weight: 3 is unknown; known: "),
        ({"method": "icp", "gate": np.ones(132)}, r"gate: expected a number, got an array of shape \(132,\)$"),
        ({"method": "gicp", "max_turn": np.ones(132)}, r"max_turn: expected a number, got an array of shape \(132,\)$"),
        ({"seed": 0.5 * np.ones(99)}, r"seed: expected a non-negative .*, got an array of shape \(99,\)$"),
        ({"max_steps": {k: k for k in range(99)}}, "max_steps: expected an integer, got {0: 0, 1: 1.{40,60}…$"),
        ({"callback": 3}, "callback: expected a function, got 3"),
        ({"callback": "x", "max_steps": 0}, "callback: expected a function, got 'x'"),
        ({"method": "ndt", "cells": np.eye(2)}, r"cells: expected a number, got \[1\.0, 0\.0\]"),
        ({"method": "ndt", "cells": []}, "cells: expected a number or several, got none"),
        ({"method": "ndt", "offset": np.array(2.0)}, r"offset: expected two numbers, got 2\.0"),
        ({"source": np.ones((2, 150))}, r"source: .*2 points in 150 dimensions.*pass source\.T"),
        ({"source": np.ones((2, 8))}, r"source: .*2 points in 8 dimensions.*pass source\.T"),
        ({"source": np.ones((2, 2, 150))}, r"source: .*2 points in 150 dim.*pass numpy\.swapaxes\(source, -1, -2\)"),
        ({"source": np.ones((2, 1, 3, 4))}, r"source: .*3 points in 4 dimensions"),
        ({"target": np.ones((2, 13))}, r"target: .*2 points in 13 dimensions.*pass target\.T"),
        ({"source": np.ma.masked_less(np.eye(2), 0.5)}, "source: a masked array hides 2 numbers"),
        ({"target": np.ma.masked_less(np.eye(2), 0.5)}, "target: a masked array hides 2 numbers"),
        ({"weights": np.ma.masked_less(np.arange(13.0), 5.0)}, "weights: a masked array hides 5 numbers"),
        ({"pairs": np.ma.masked_equal(np.ones((9, 2), dtype=int), 1)}, "pairs: a masked array hides 18 numbers"),
        ({"start": np.ma.masked_equal(np.eye(3), 0.0)}, "start: a masked array hides 6 numbers"),
        ({"seed": np.ma.masked_equal([1, 2], 2)}, "seed: a masked array hides 1 number; leave its row out"),
        ({"start": Pose.identity(3)}, "start: moves points in 3 dimensions"),
        ({"start": Pose.trusted(np.diag([1.0, -1.0]), np.zeros(2))}, "start.R: is a reflection"),
        ({"start": Pose.trusted(2.0 * np.eye(2), np.zeros(2))}, "start.R: is not orthogonal"),
        ({"start": Pose.trusted(np.eye(2), np.array([np.nan, 0.0]))}, "start.t: 1 of 2 numbers is not finite"),
        ({"source": np.where(np.arange(26.0) < 2, np.inf, 0.0).reshape(13, 2)}, "source: 2 of 26 numbers are not"),
        ({"start": Pose.trusted(np.eye(2), np.zeros(2), np.nan)}, "start.scale: nan is not finite"),
        ({"start": Pose.trusted(np.eye(2), np.zeros(2), -1.0)}, "start.scale: must be positive"),
        ({"start": Pose.identity(2, (0,))}, "holds no problem"),
        ({"seed": -1}, "seed: expected non-negative"),
        ({"seed": 1.5}, "seed: expected a non-negative integer"),
        ({"max_steps": -1}, "max_steps: must be at least 0"),
        ({"max_steps": 2.0}, "max_steps: expected an integer"),
        ({"max_steps": 10**22}, "max_steps: must be at most 2147483647"),
        ({"method": "ransac", "most": 10**400}, "most: must be at most 2147483647"),
        ({"method": "icp", "gate": 10**400}, "gate: expected a finite number, got one beyond 1e308$"),
        ({"method": "icp", "gate": 10**30}, r"gate: expected a number, got an integer .* 63 bits; pass 1e\+30$"),
        ({"method": "icp", "gate": np.nan}, "gate: expected a number, got nan$"),
        ({"method": "branch-and-bound", "cap": np.nan}, r"cap: expected a finite number of at most 1e\+100, got nan$"),
        ({"method": "icp", "weights": np.ones(13, bool)}, r"weights: .* dtype bool; \.astype\(float\) makes numbers"),
        ({"method": "icp", "gate": np.array([0.5])}, "gate: expected a number, got array"),
        ({"method": "icp", "gate": np.array(True)}, "gate: expected a number, got True"),
        ({"method": "icp", "weight": "huber", "scale": np.float32(0)}, "scale: expected a finite number"),
        ({"method": "branch-and-bound", "cap": 1e300}, "cap: expected a finite number"),
        ({"method": "branch-and-bound", "shift": 1e300}, "shift: expected a finite number"),
        ({"method": "ndt", "grids": 1.0}, "grids: expected an integer"),
        ({"method": "flow", "project": "no"}, "project: expected True or False, got 'no'"),
        ({"source": [np.zeros((13, 2))] * 2, "target": [np.zeros((13, 2))] * 3}, "target: there are 3, but 2 clouds"),
        ({"source": [np.eye(2), np.full((2, 2), np.nan)], "target": [np.eye(2)] * 2}, "cloud 1 of the list: source"),
        ({"source": [np.eye(2)] * 2, "target": np.ones((3, 2, 2))}, "target: there are 3, but 2 clouds"),
        ({"source": [np.eye(2)] * 2, "target": np.ones((2, 3, 2, 2))}, r"target: .*one for each, .*\(2, 3, 2, 2\)"),
        ({"source": [np.eye(2)] * 2, "target": np.eye(2), "weights": np.ones((3, 2, 2))}, "weights: .*one for each"),
        ({"source": [np.eye(2)] * 2, "target": np.eye(2), "seed": [[1, 2], [3, 4]]}, "seed: expected one for all 2"),
        ({"source": [np.eye(2)] * 2, "start": Pose.identity(2, (2, 2))}, r"start: expected one for all 2 .*\(2, 2\)"),
        ({"source": [np.eye(2)] * 2, "target": np.eye(2), "weights": [np.ones((2, 2)), np.ones(2)]}, "cloud 0 .*one"),
        ({"source": [np.eye(2), np.ones((2, 2, 2))]}, r"source: .* number 1 of the list is of shape \(2, 2, 2\)"),
        ({"target": [np.eye(2), np.ones(2)]}, r"target: expected clouds .* number 1 of the list is of shape \(2,\)"),
        ({"source": [None, np.eye(2)]}, r"source: expected clouds .* number 0 of the list is no array"),
        ({"source": [np.eye(2), [[1.0], [2.0, 3.0]]]}, r"source: .* number 1 of the list is of unequal rows"),
        ({"source": [np.eye(2)] * 2, "target": np.eye(2), "seed": [1, 2, 3]}, "seed: there are 3, but 2 clouds"),
    ],
)
def test_what_is_wrong_is_said_by_name(arguments, message, scene):
    """Wrong shapes, unknown names and options, bad pairs and poses give a ValueError, with the nearest right name."""
    with pytest.raises(ValueError, match=message):
        register(**{"source": scene.source, "target": scene.target, "method": "kabsch", **arguments})


def test_details_are_read_by_name(scene):
    result = kabsch(scene.source, scene.target)
    assert result.detail("determinant") == 1
    assert result.detail("singular_values").shape == (2,)
    with pytest.raises(ValueError, match=r"did you mean 'determinant'\?"):
        result.detail("determinent")


def test_a_result_shows_how_it_stopped(scene):
    assert repr(kabsch(scene.source, scene.target)).startswith("Result(kabsch: converged, steps=1, pose=Pose(angle=")
    assert "degenerate (all source points" in repr(kabsch(np.zeros((3, 2)), np.eye(3)[:, :2]))
    batch = kabsch(np.stack([scene.source, 0 * scene.source]), scene.target)
    assert repr(batch) == "Result(kabsch: 1 converged, 1 degenerate, pose=Pose(batch=(2,), dim=2))"


def test_the_list_of_methods_cannot_be_changed():
    with pytest.raises(TypeError):
        METHODS["mine"] = METHODS["kabsch"]


def test_the_package_names_its_version_and_little_else():
    assert solvers.__version__
    assert len(solvers.__all__) <= 10
    assert all(hasattr(solvers, name) for name in solvers.__all__)


def test_a_status_reads_as_a_word():
    """A status prints as its name in words, also in a column of a table; as a number where a number is asked for."""
    assert f"{Status.CONVERGED!s}|{Status.STALLED:>8}|{Status.PROVED:d}" == "converged| stalled|5"


def test_a_start_may_be_a_matrix(scene):
    """A homogeneous matrix, or a batch of them, starts a run at the same pose as the equivalent Pose."""
    starts = Pose.from_angle([0.1, -0.3], [[0.2, 0.0], [0.0, 0.1]])
    by_pose = register(scene.source, scene.target, start=starts)
    by_matrix = register(scene.source, scene.target, start=starts.matrix)
    assert np.array_equal(by_pose.history.objective, by_matrix.history.objective)
    in_list = register([scene.source] * 2, [scene.target] * 2, start=starts.matrix)
    assert np.allclose(in_list.matrix, by_pose.matrix, atol=1e-12)


def test_in_space_a_start_is_a_matrix_of_four_rows(rng, scene):
    points = rng.standard_normal((40, 3))
    start = Pose.from_rotvec([0.1, -0.2, 0.3], (0.2, 0.0, -0.1))
    result = register(points, start.apply(points), start=start.matrix)
    assert np.array_equal(result.history.poses.matrix[0], start.matrix)
    assert result.history.objective[0] < 1e-28
    with pytest.raises(ValueError, match="start: moves points in 3 dimensions, the clouds have 2"):
        register(scene.source, scene.target, start=np.eye(4))


@pytest.mark.parametrize("shape", [(2, 3), (3, 3), (1, 2), (2, 2), (3, 2), (5, 2, 3), (4, 150)])
def test_few_points_are_no_transposed_cloud(shape, rng):
    """One to three points of the plane or of space, batches of them, and four points in any dimension are accepted."""
    cloud = rng.standard_normal(shape)
    assert register(cloud, cloud, "kabsch").pose.batch == shape[:-2]


def test_a_masked_array_is_refused_where_points_are_moved(scene):
    """The pose and the result refuse it, since its mask would be lost."""
    points = np.ma.masked_less(scene.source, 0.0)
    for move in (kabsch(scene.source, scene.target).transform, Pose.identity().apply):
        with pytest.raises(ValueError, match=r"^points: a masked array hides \d+ numbers; leave their rows out"):
            move(points)


def test_a_masked_array_that_hides_nothing_is_an_array(scene):
    bare = register(np.ma.asarray(scene.source), scene.target)
    assert np.array_equal(bare.matrix, register(scene.source, scene.target).matrix)


def test_a_seed_may_be_drawn(scene):
    """A generator gives each call a new number, reproducibly for the same generator; None works without one."""

    def draw(seed):
        return register(scene.source, scene.target, "ransac", seed=seed).states[0].problem.seed

    first, second = np.random.default_rng(3), np.random.default_rng(3)
    a, b = draw(first), draw(first)
    assert a != b
    assert [a, b] == [draw(second), draw(second)]
    assert draw(None) != draw(None)


def test_a_status_is_true_where_the_method_came_to_its_end():
    own = (Status.CONVERGED, Status.STALLED, Status.PROVED, Status.FINISHED)
    assert [bool(status) for status in Status] == [status in own for status in Status]
    ends = register([[0.0, 0.0], [1.0, 0.0]], [[0.0, 0.0], [1.0, 0.0]], "kabsch")
    failure = register([[0.0, 0.0], [0.0, 0.0]], [[0.0, 0.0], [1.0, 0.0]], "kabsch")
    assert ends.converged is True
    assert failure.converged is False
    batch = register(
        np.array([[[0.0, 0.0], [1.0, 0.0]], [[0.0, 0.0], [0.0, 0.0]]]), np.array([[0.0, 0.0], [1.0, 0.0]]), "kabsch"
    )
    assert batch.converged.tolist() == [True, False]


def test_ended_is_true_where_a_status_is_of_one_problem_and_of_each_of_a_batch():
    """`ended` gives the truth of each problem's status, which `bool(status)` cannot do for a batch's array."""
    two = np.array([[[0.0, 0.0], [1.0, 0.0]], [[0.0, 0.0], [0.0, 0.0]]])
    pair = register(two, two[0], "kabsch")
    assert pair.ended.tolist() == [True, False]
    for cloud, ended in zip(two, (True, False), strict=True):
        assert register(cloud, two[0], "kabsch").ended is ended
    assert register([two[0]] * 2, [two[0]] * 2, "kabsch").ended.tolist() == [True, True]
    for status in Status:
        batch = dataclasses.replace(pair, status=np.full(2, status, dtype=np.int8))
        assert batch.ended.tolist() == [bool(status)] * 2


@pytest.mark.parametrize("method", ["kabsch", "ransac", "icp", "point-to-plane", "ndt", "cpd-rigid", "gmmreg", "mmd"])
@pytest.mark.parametrize("batched", [False, True])
def test_an_answer_does_not_depend_on_how_the_clouds_lie_in_memory(method, batched):
    """Column-major and row-major clouds give the same result, bit for bit."""
    scene = kabsch_scene("noisy") if METHODS[method].paired else room("noise")
    p, q = scene.source, scene.target
    if batched:
        p, q = np.stack([p, 1.01 * p, p[::-1]]), np.stack([q, q, q[::-1]])
    w = {"weights": 1.0 + np.arange(p.size // 2).reshape(p.shape[:-1])} if METHODS[method].weighted else {}
    by_rows = register(p, q, method, max_steps=8, **w)
    extra = {name: np.asfortranarray(values) for name, values in w.items()}
    by_columns = register(np.asfortranarray(p), np.asfortranarray(q), method, max_steps=8, **extra)
    np.testing.assert_array_equal(by_columns.matrix, by_rows.matrix)
    np.testing.assert_array_equal(by_columns.history.objective, by_rows.history.objective)


def test_an_array_without_axes_is_a_number():
    scene = room("clean")
    usual = register(scene.source, scene.target, "icp", gate=0.5, max_steps=9)
    result = register(scene.source, scene.target, "icp", gate=np.array(0.5), max_steps=np.array(9))
    assert np.array_equal(result.pose.matrix, usual.pose.matrix)
    assert register(scene.source, scene.target, "icp", gate=np.array(np.inf)).status
    assert type(result.detail("options").gate) is float


OPEN = "the rotation is undefined"


@pytest.mark.parametrize("method", ["icp", "trimmed-icp", "kabsch"])
def test_of_many_equal_points_it_is_said_that_they_are_equal(method):
    """Rounding of their mean must not make equal points look distinct."""
    source = np.random.default_rng(3).standard_normal((5000, 2))
    for name, p, q in (("target", source, np.full((5000, 2), 0.1)), ("source", np.full((5000, 2), 0.1), source)):
        assert register(p, q, method).reason.replace(" with weight", "") == f"all {name} points are equal: {OPEN}"
