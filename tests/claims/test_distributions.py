"""The claims of the chapter on comparing distributions: waves, their means, and where the minimum lies."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from solvers import METHODS, Pose, register
from solvers.core.method import Problem
from solvers.core.stepper import begin, run
from solvers.metrics import rre, rte
from solvers.numerics import fourier_features
from solvers.numerics.fourier_features import exact_squared_mmd, mean_features, mean_kernel, unit_frequencies
from solvers.scenes.rooms import room, room_start
from solvers.studies.benchmark import benchmark
from solvers.studies.race import SEEDS, Controls, contestants
from widgets.drawing.picture import Arrow
from widgets.engine.contract import parsed
from widgets.figures.mmd import WIDGET

SCHEDULE = (2.4, 1.2, 0.6, 0.3)


def complex_means(points, frequencies):
    """The mean of each wave as a complex number, (D,)."""
    D = len(frequencies)
    mean = mean_features(points[None], frequencies[None])[0] * np.sqrt(D)
    return mean[:D] + 1j * mean[D:]


def estimate(x, y, length, seed, count):
    """‖r‖² from `count` waves of one draw."""
    frequencies = unit_frequencies(np.array([seed]), count, 2) / length
    gap = mean_features(x[None], frequencies) - mean_features(y[None], frequencies)
    return float(np.square(gap).sum())


def test_waves_cost_as_much_a_point_however_many(monkeypatch):
    """Comparing two clouds by 64 waves takes one angle per wave and point: twice the points take twice the angles."""
    counts = []

    def counting(turns, cos_sin=fourier_features.cos_sin):
        counts.append(turns.size)
        return cos_sin(turns)

    monkeypatch.setattr(fourier_features, "cos_sin", counting)
    costs = []
    for n in (50, 100, 200):
        counts.clear()
        x, y = np.random.default_rng(n).standard_normal((2, n, 2))
        estimate(x, y, 1.0, 0, 64)
        costs.append(sum(counts))
    assert costs == [64 * 2 * n for n in (50, 100, 200)]


@cache
def ends(lengths, degrees=45.0, distance=1.43, overlap=1.0):
    """Rotation errors, °, and translation errors, u, of the 25 seeds in the clean room, as one batch."""
    method, start = METHODS["mmd"], room_start(degrees, distance)
    scenes = [room("clean", seed=seed, overlap=overlap) for seed in SEEDS]
    n = min(len(scene.target) for scene in scenes)
    assert all(len(scene.target) == n for scene in scenes)
    b = len(scenes)
    source, target = (np.stack([getattr(scene, name) for scene in scenes]) for name in ("source", "target"))
    starts = Pose(np.tile(start.R, (b, 1, 1)), np.tile(start.t, (b, 1)))
    problem = Problem(source, target, np.ones(source.shape[:2]), starts, np.array(SEEDS))
    pose = run(begin(method, problem, method.options(lengths=lengths, count=32)))[0].pose()
    return np.degrees(rre(pose, Pose.identity(2, (b,)))), rte(pose, Pose.identity(2, (b,)))


def test_only_the_cross_term_knows_the_pose():
    """In the clean room, over a full turn and several shifts, exact MMD² plus twice the mean kernel between the clouds
    is constant. With 32 waves at ℓ = 1.2 u, the squared length of the source's own mean ranges from 0.186 to 0.222."""
    scene = room("clean")
    frequencies = unit_frequencies(np.array([40]), 32, 2) / 1.2
    own, sums = [], []
    for degrees in range(0, 360, 5):
        for shift in ((0.0, 0.0), (0.3, -1.0), (4.0, 2.0)):
            moved = Pose.from_angle(np.radians(degrees), shift).apply(scene.source)
            sums.append(float(exact_squared_mmd(moved, scene.target, 1.2)) + 2 * mean_kernel(moved, scene.target, 1.2))
            own.append(float(np.square(mean_features(moved[None], frequencies)).sum()))
    assert np.ptp(sums) < 1e-12
    assert (round(min(own), 3), round(max(own), 3)) == (0.186, 0.222)


def test_a_shift_turns_the_mean():
    """The mean of wave ω over a cloud moved by t is the old mean times e^(iωᵀt): turned, with the same length."""
    random = np.random.default_rng(2)
    points, frequencies, shift = random.normal(size=(30, 2)), random.normal(size=(8, 2)), np.array([0.7, -1.9])
    before, after = complex_means(points, frequencies), complex_means(points + shift, frequencies)
    assert after == pytest.approx(before * np.exp(1j * frequencies @ shift), abs=1e-12)
    means = complex_means(Pose.from_angle(0.5).apply(points), frequencies)
    assert np.abs(np.abs(means) - np.abs(before)).max() > 0.05


def arrow(*drags):
    """The source's arrow on the circle of the chapter's first figure, after drags of its handles."""
    record = parsed(WIDGET, {"log": [["drag", *drag] for drag in drags]})
    state = WIDGET.start(record.controls, record.seed)
    for action in record.log:
        state = WIDGET.act(state, action)
    (circle,) = (panel for panel in WIDGET.draw(state).panels if panel.name == "phases")
    (mark,) = (mark for mark in circle.marks if isinstance(mark, Arrow) and mark.role == "source")
    return np.asarray(mark.b)


def test_a_drag_turns_the_arrow_and_a_turn_changes_its_length():
    """In the figure, each of three drags of the source's middle turns its arrow by more than 20° and keeps its length;
    each of two turns of the source changes the length by more than a tenth."""
    before = arrow()
    for position in ((2.0, 1.0), (-1.5, 0.3), (0.4, -1.2)):
        after = arrow(("source", *position))
        assert np.hypot(*after) == pytest.approx(np.hypot(*before), abs=1e-12)
        assert after @ before < np.cos(np.radians(20.0)) * (before @ before)
    for position in ((0.0, 3.0), (3.0, -1.0)):
        assert abs(np.hypot(*arrow(("turn", *position))) / np.hypot(*before) - 1.0) > 0.1


def test_zero_only_for_the_same_cloud():
    """Exact MMD² of random clouds is positive, zero for a reordered copy, and positive again if one point has moved."""
    random = np.random.default_rng(3)
    for _ in range(20):
        x, y = random.normal(size=(12, 2)), random.normal(size=(9, 2))
        assert exact_squared_mmd(x, y, 0.8) > 0
        assert exact_squared_mmd(x, x[::-1], 0.8) == pytest.approx(0, abs=1e-14)
        moved = x.copy()
        moved[0] += 0.05
        assert exact_squared_mmd(x, moved, 0.8) > 1e-7


def test_more_waves_are_more_faithful(why):
    """400 draws: the mean is the exact value to within four standard errors; 16 times the waves quarter the spread."""
    random = np.random.default_rng(4)
    x, y = random.normal(size=(20, 2)), random.normal(size=(25, 2)) + 0.6
    exact = float(exact_squared_mmd(x, y, 1.0))
    few, many = (np.array([estimate(x, y, 1.0, seed, D) for seed in range(400)]) for D in (8, 128))
    why("the waves", {"8": f"a spread of {few.std():.4f}", "128": f"a spread of {many.std():.4f}"})
    for result in (few, many):
        assert abs(result.mean() - exact) < 4 * result.std() / 20
    assert 3.2 < few.std() / many.std() < 5.0


def test_one_wave_cannot_tell_a_crest_from_the_next():
    """A cloud and its copy shifted by one wavelength along ω have the same mean; a second wave tells them apart."""
    points = np.random.default_rng(5).normal(size=(15, 2))
    waves = np.array([[1.5, -0.4], [0.3, 2.0]])
    shift = 2 * np.pi * waves[0] / (waves[0] @ waves[0])
    gap = np.abs(complex_means(points + shift, waves) - complex_means(points, waves))
    assert gap[0] < 1e-12
    assert gap[1] > 0.05


def test_a_larger_length_scale_is_not_simply_safer(why):
    """Clean room, 45°, 25 seeds, D = 32: more runs end below 5° with ℓ = 1.2 u than with 0.3 u or with 4 u."""
    counts = [int((ends((length,))[0] < 5).sum()) for length in (0.3, 1.2, 4.0)]
    messages = {f"{length:g} u": f"{k} of 25 below 5°" for length, k in zip((0.3, 1.2, 4.0), counts, strict=True)}
    why("the length scale", {name: messages[name] for name in ("1.2 u", "0.3 u", "4 u")})
    assert counts[0] < counts[1] > counts[2]


def test_a_large_length_scale_leads_to_its_own_minimum():
    """ℓ = 4 u: all 25 seeds end below 45° and 1.43 u, none below 7°, and within 1° of where runs from the truth end."""
    degrees, units = ends((4.0,))
    assert (degrees < 45).all()
    assert (units < 1.43).all()
    assert (degrees > 7).all()
    from_truth = ends((4.0,), 0.0, 0.0)
    assert np.abs(degrees - from_truth[0]).max() < 1
    assert np.abs(units - from_truth[1]).max() < 0.02


def test_a_short_length_scale_lacks_reach_and_a_long_one_leads_astray(why):
    """The figure's clean room, 25 draws. With ℓ = 0.3 u at most three runs are right from its start, 30° and 1 u, and
    all from the truth. With 4 u none is, and both starts lead to one place, to 0.1° and 0.01 u. At the start the kernel
    of a point and its true place is below 0.05 for most points with 0.3 u, above 0.6 for all with 4 u."""
    begun, right, apart = room_start(30.0, 1.0), {}, []
    for seed in SEEDS:
        scene = room("clean", seed=seed)
        gap = np.linalg.norm(begun.apply(scene.source) - scene.truth.apply(scene.source), axis=1)
        assert np.mean(np.exp(-0.5 * np.square(gap / 0.3)) < 0.05) > 0.75
        assert np.exp(-0.5 * np.square(gap / 4.0)).min() > 0.6
        for name, start in (("the figure's", begun), ("the truth", scene.truth)):
            runs = [
                register(scene.source, scene.target, "mmd", start=start, lengths=x, seed=seed, max_steps=40).pose
                for x in (0.3, 4.0)
            ]
            close = [np.degrees(rre(pose, scene.truth)) < 5.0 and rte(pose, scene.truth) < 0.2 for pose in runs]
            right[name] = right.get(name, 0) + np.array(close, dtype=int)
            apart.append(runs[1])
    why(
        "the start",
        {name: f"with 0.3 u {short} of 25 are right, with 4 u {long}" for name, (short, long) in right.items()},
    )
    assert right["the figure's"][0] <= 3
    assert [right["the truth"][0], right["the figure's"][1], right["the truth"][1]] == [25, 0, 0]
    for one, other in zip(apart[::2], apart[1::2], strict=True):
        assert np.degrees(rre(one, other)) < 0.1
        assert rte(one, other) < 0.01


def test_the_unseen_part_moves_the_minimum_of_long_waves(why):
    """ℓ = 4 u, started at the truth, 25 seeds: all end more than 7° off. With the target cut to what the source has
    seen, all end within 5°."""
    ends_at = {}
    for cut in (False, True):
        degrees = []
        for seed in SEEDS:
            scene = room("clean", seed=seed)
            target = scene.target
            if cut:  # from the first to the last point, along the outline, that has a source point near
                near = np.linalg.norm(target[:, None] - scene.source, axis=2).min(axis=1) < 0.15
                first, last = np.flatnonzero(near)[[0, -1]]
                target = target[first : last + 1]
            result = register(scene.source, target, "mmd", seed=seed, lengths=(4.0,), count=32)
            degrees.append(np.degrees(rre(result.pose, Pose.identity())))
        ends_at[cut] = np.array(degrees)
    why(
        "what the target has seen",
        {
            "the whole room": f"{np.median(ends_at[False]):.1f}° off in the median",
            "what the source has seen": f"{np.median(ends_at[True]):.1f}° off",
        },
    )
    assert (ends_at[False] > 7.0).all()
    assert (ends_at[True] < 5.0).all()


def test_a_schedule_does_better_than_a_fixed_length_scale(why):
    """On the same 25 seeds, 2.4, 1.2, 0.6 and 0.3 u in turn bring more below 5° and 0.2 u than each does alone."""
    counts = {}
    for lengths in (SCHEDULE, *((length,) for length in SCHEDULE)):
        degrees, units = ends(lengths)
        counts[lengths] = int(((degrees < 5) & (units < 0.2)).sum())
    names = {lengths: ", ".join(f"{length:g}" for length in lengths) + " u" for lengths in counts}
    why("the length scales", {names[lengths]: f"{k} of 25 below 5° and 0.2 u" for lengths, k in counts.items()})
    assert all(counts[SCHEDULE] > counts[(length,)] for length in SCHEDULE)


def test_other_waves_than_gaussian_ones():
    """The race's MMD-Reg on 'combo' from 45° and 1.43 u, 25 seeds: at least 22 succeed with one draw of the waves or
    one per stage, at most 4 with Laplace's kernel (Cauchy frequencies), at least 20 with Laplace frequencies."""
    (contestant,) = contestants(["mmd"])
    variants = ({}, {"redraw": True}, {"kernel": "laplace"}, {"kernel": "cauchy"})
    entries = [replace(contestant, options={**contestant.options, **options}) for options in variants]
    single, anew, laplace, cauchy = (
        line.close
        for line in benchmark(Controls(degrees=45.0, distance=1.43, setting="combo"), contestants=entries)
    )
    assert min(single, anew) >= 22
    assert laplace <= 4
    assert cauchy >= 20


def test_the_truth_is_not_the_minimum():
    """In the clean room, 25 seeds, ℓ = 1.2 u: exact MMD² is positive at the truth, and smaller a short shift away."""
    ways = 0.2 * np.stack([np.cos(np.arange(8) * np.pi / 4), np.sin(np.arange(8) * np.pi / 4)], axis=1)
    for seed in SEEDS:
        scene = room("clean", seed=seed)
        value = exact_squared_mmd(scene.source, scene.target, 1.2)
        assert value > 1e-3
        assert exact_squared_mmd(scene.source + ways[:, None], scene.target, 1.2).min() < value


def test_missing_overlap_moves_the_minimum(why):
    """From the truth, 25 seeds, ℓ = 1.2 u: all end below 5° if the target sees the whole room, but fewer than ten if it
    sees only 80 % of it."""
    whole, part = (ends((1.2,), 0.0, 0.0, overlap)[0] for overlap in (1.0, 0.8))
    why(
        "how much of the room the target sees",
        {"four fifths": f"{(part < 5).sum()} of 25 stay within 5°", "all of it": f"{(whole < 5).sum()} of 25"},
    )
    assert (whole < 5).all()
    assert (part < 5).sum() < 10


def test_a_small_length_scale_suffers_less_from_missing_overlap(why):
    """From the truth, 25 seeds, 80 % of the room in the target: with ℓ = 0.3 u all end below 5°, with 1.2 u fewer than
    ten."""
    stay = {length: int((ends((length,), 0.0, 0.0, 0.8)[0] < 5).sum()) for length in (0.3, 1.2)}
    why("the length scale, with four fifths seen", {f"{at:g} u": f"{k} of 25 stay within 5°" for at, k in stay.items()})
    assert stay[0.3] == 25
    assert stay[1.2] < 10
