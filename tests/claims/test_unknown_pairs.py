"""The claims of the chapter 'Correspondences unknown', checked against the solvers."""

from itertools import pairwise

import numpy as np
import pytest

import solvers
from solvers import Pose, Status, metrics
from solvers.core.arrays import FloatArray
from solvers.geometry import nearest
from solvers.geometry.normals import normals
from solvers.scenes.rooms import room, room_start
from solvers.studies.race import SEEDS

NEAR, USUAL, FAR = room_start(15.0, 0.5), room_start(45.0, 1.43), room_start(-110.0, 1.43)


def rooms(setting="clean", **options):
    """The clouds of 25 draws of a room, batched into a source and a target array."""
    scenes = [room(setting, seed=seed, **options) for seed in SEEDS]
    return np.stack([s.source for s in scenes]), np.stack([s.target for s in scenes])


def runs(clouds, start, method="icp", **options):
    """One run per draw: the result, and which poses are right, within 5° and 0.2 u."""
    result = solvers.register(*clouds, method, start=start, **options)
    right = (metrics.rre(result.pose, Pose.identity()) < np.radians(5.0)) & (
        metrics.rte(result.pose, Pose.identity()) < 0.2
    )
    return result, right


def at_truth(clouds, method="icp", **options):
    """The pairs that the same rule makes at the true pose."""
    return solvers.register(*clouds, method, max_steps=0, **options).detail("pairing")


def course(clouds, start, method="icp", steps=70, **options):
    """The states of a run, one after each step."""
    states = []
    solvers.register(
        *clouds, method, start=start, max_steps=steps, callback=lambda k, s: states.append(s) and None, **options
    )
    return states


# Match and move


def test_nearest_partners_are_shared_and_left_over():
    """At the near start, in each of 25 draws, ICP pairs each source point with its nearest target point: some of these
    are shared, and others have no partner."""
    source, target = rooms()
    pairs = solvers.register(source, target, max_steps=0, start=NEAR).detail("pairing").rows
    for p, q, rows in zip(NEAR.apply(source), target, pairs, strict=True):
        np.testing.assert_array_equal(rows, np.square(p[:, None] - q).sum(axis=-1).argmin(axis=1))
        assert len(set(rows.tolist())) < len(p)
        assert len(set(rows.tolist())) < len(q)


def test_both_halves_of_a_step_lower_the_sum():
    """In each of twelve steps of 25 draws, neither moving nor matching anew raises the sum of squares over the pairs;
    in the first step, both lower it by more than 1 % in every draw."""
    clouds = rooms("combo")
    start = solvers.register(*clouds, max_steps=0, start=USUAL).detail("pairing")
    rows, sums = start.rows, np.square(start.distances).sum(axis=1)
    states = course(clouds, USUAL, steps=12)
    assert len(states) == 12
    for k, state in enumerate(states):
        partners = np.take_along_axis(clouds[1], rows[..., None], axis=1)
        moved = np.square(state.pose.apply(clouds[0]) - partners).sum(axis=(1, 2))
        squares = np.square(state.pairing.distances).sum(axis=1)
        assert (moved <= sums * (1 + 1e-9)).all()
        assert (squares <= moved * (1 + 1e-9)).all()
        assert k > 0 or ((squares < 0.99 * moved).all() and (moved < 0.99 * sums).all())
        rows, sums = state.pairing.rows, squares


def test_pairs_that_repeat_end_the_run():
    """Once matching changes no partner, the next fit repeats the last one: the pose has come to rest."""
    for seed in SEEDS[:8]:
        scene = room("clean", seed=seed)
        poses, rows = [], []
        for state in course((scene.source, scene.target), NEAR):
            poses.append(state.pose.matrix[0])
            rows.append(state.pairing.rows[0])
        repeats = [k for k in range(1, len(rows)) if (rows[k] == rows[k - 1]).all()]
        assert repeats
        assert repeats[0] >= len(rows) - 2
        np.testing.assert_allclose(poses[-1], poses[repeats[0]], atol=1e-9)


def test_pairing_a_straight_wall_says_nothing_along_it():
    """Two samplings of one wall, with the source started anywhere along it: ICP stays within a spacing of its start."""
    wall = np.column_stack([np.arange(0.0, 8.0, 0.15), np.zeros(54)])
    part = np.column_stack([np.arange(2.0, 6.0, 0.15), np.zeros(27)])
    for slide in (-1.0, -0.5, 0.6, 1.1):
        result = solvers.register(part, wall, start=Pose.from_angle(0.0, (slide, 0.0)))
        assert result.status == Status.CONVERGED
        assert abs(result.pose.t[0] - slide) < 0.15


# Gate, trim, cap


def test_a_gate_lets_the_rms_rise():
    """With a gate of 0.6 u, the RMS over the pairs used rises within six steps in each of 25 draws, while the pose is
    still more than 35° off; all of them end right, after more than 50 steps."""
    states = course(rooms(), USUAL, gate=0.6)
    rms = np.stack([state.pairing.rms for state in states])
    rises = rms[1:] > rms[:-1] * (1 + 1e-9)
    first = rises.argmax(axis=0) + 1
    assert rises[:5].any(axis=0).all()
    errors = np.stack([metrics.rre(state.pose, Pose.identity()) for state in states])
    assert (errors[first, np.arange(25)] > np.radians(35.0)).all()
    assert (states[50].status == Status.RUNNING).all()
    assert runs(rooms(), USUAL, gate=0.6)[1].all()


def test_trimming_alone_is_a_fixed_count():
    """Trimming a fifth without a gate equals keeping a fixed four fifths: the same poses, step by step."""
    clouds = rooms("outliers")
    trimmed, count = (
        course(clouds, NEAR, method, steps=10, **options)
        for method, options in (("icp", {"trim": 0.2}), ("trimmed-icp", {"keep": 0.8}))
    )
    assert len(trimmed) == 10
    for a, b in zip(trimmed, count, strict=True):
        np.testing.assert_allclose(a.pose.matrix, b.pose.matrix, atol=1e-12)
        assert (a.pairing.count == 106).all()


def test_a_gate_and_a_cap_take_the_same_steps():
    """Gated and capped at one length, the poses agree step by step; the capped sum falls while the gated RMS rises."""
    clouds = rooms()
    gated, capped = (
        course(clouds, USUAL, method, steps=10, **options)
        for method, options in (("icp", {"gate": 0.6}), ("capped-icp", {"cap": 0.6}))
    )
    for a, b in zip(gated, capped, strict=True):
        np.testing.assert_allclose(a.pose.matrix, b.pose.matrix, atol=1e-12)
        np.testing.assert_array_equal(a.pairing.used, b.pairing.used)
    sums = np.stack([state.objective for state in capped])
    assert (np.diff(sums, axis=0) <= 1e-9 * sums[0]).all()
    assert (np.diff(np.stack([state.pairing.rms for state in gated]), axis=0) > 1e-9).any()


def test_a_gate_can_cost_steps(why):
    """From 45°, clean, all 25 draws arrive: with a gate of 0.6 u in over 50 steps in the median, without in half."""
    clouds = rooms()
    (plain, right), (gated, right_gated) = runs(clouds, USUAL), runs(clouds, USUAL, gate=0.6)
    medians = [np.median(run.steps) for run in (gated, plain)]
    why("the gate", {"0.6 u": f"{medians[0]:.0f} steps in the median", "none": f"{medians[1]:.0f} steps"})
    assert right.all()
    assert right_gated.all()
    assert np.median(gated.steps) > 50
    assert 2 * np.median(plain.steps) <= np.median(gated.steps)


def test_a_gate_can_narrow_the_reach(why):
    """From 45° in the noisy room, all 25 draws end right without a gate, at most three with one of 0.6 u."""
    clouds = rooms("noise")
    free, gated = runs(clouds, USUAL)[1], runs(clouds, USUAL, gate=0.6)[1]
    why("the gate", {"0.6 u": f"{gated.sum()} of 25 arrive", "none": f"{free.sum()} of 25 arrive"})
    assert free.all()
    assert gated.sum() <= 3


def arrivals(clouds, start, used, steps=70):
    """Rotation errors, degrees, and translation errors, u, of 25 draws fitted to the pairs that `used` selects."""
    source, target = clouds
    pose = Pose(*(np.broadcast_to(part, (len(source), *part.shape)) for part in (start.R, start.t)))
    for k in range(steps):
        squares = np.square(pose.apply(source)[:, :, None] - target[:, None]).sum(axis=3)
        partners = np.take_along_axis(target, squares.argmin(axis=2)[..., None], axis=1)
        weights = used(k, np.sqrt(squares.min(axis=2))).astype(float)
        pose = solvers.fit_rigid(source, partners, weights).pose
    return off_truth(pose)


def off_truth(pose):
    """Rotation errors, degrees, and translation errors, u."""
    return np.degrees(metrics.rre(pose, Pose.identity())), metrics.rte(pose, Pose.identity())


def test_a_gate_leaves_out_the_pairs_with_most_to_say(why):
    """The same start and room: leaving out the pairs beyond 0.6 u, at most three of 25 draws arrive; leaving out as
    many at random, all do; adding the gate only after ten steps, at least 23 do."""
    rng = np.random.default_rng(1)

    def at_random(k, distances):
        count = (distances <= 0.6).sum(axis=1, keepdims=True)
        return rng.random(distances.shape).argsort(axis=1).argsort(axis=1) < count

    rules = {
        "those beyond 0.6 u": lambda k, d: d <= 0.6,
        "as many at random": at_random,
        "those beyond 0.6 u, from the eleventh step on": lambda k, d: (d <= 0.6) | (k < 10),
    }
    ends = {name: arrivals(rooms("noise"), USUAL, rule) for name, rule in rules.items()}
    counts = {name: int(((turn < 5.0) & (shift < 0.2)).sum()) for name, (turn, shift) in ends.items()}
    why("which pairs are left out", {name: f"{count} of 25 arrive" for name, count in counts.items()})
    gate, random, later = counts.values()
    assert gate <= 3
    assert random == 25
    assert later >= 23


def test_a_gate_lets_the_rms_rise_by_the_pairs_that_come_in(why):
    """The same 25 runs: over all pairs used the RMS rises at more than 200 steps; over those that the previous step had
    used too, it rises at none of these."""
    states = course(rooms(), USUAL, gate=0.6)
    all_pairs = old_pairs = 0
    for before, after in pairwise(states):
        rises = after.pairing.rms > before.pairing.rms * (1 + 1e-9)
        squares = np.where(before.pairing.used, np.square(after.pairing.distances), 0.0).sum(axis=1)
        over_old = np.sqrt(squares / before.pairing.used.sum(axis=1))
        all_pairs += int(rises.sum())
        old_pairs += int((rises & (over_old > before.pairing.rms * (1 + 1e-9))).sum())
    why(
        "over which pairs the RMS is taken",
        {
            "all within the gate": f"it rises at {all_pairs} steps of 25 runs",
            "without those that just came in": f"at {old_pairs} of them",
        },
    )
    assert all_pairs > 200
    assert old_pairs == 0


def test_trimming_junk_lowers_the_error(why):
    """With a fifth of both scans junk, keeping 80 % of the pairs more than halves the median translation error."""
    clouds = rooms("outliers")
    (plain, right), (trimmed, right_trimmed) = runs(clouds, NEAR), runs(clouds, NEAR, "trimmed-icp", keep=0.8)
    errors = [np.median(metrics.rte(result.pose, Pose.identity())) for result in (plain, trimmed)]
    why(
        "how many pairs are kept",
        {"the nearest 80 %": f"{errors[1]:.3f} u off in the median", "all": f"{errors[0]:.3f} u off"},
    )
    assert right.all()
    assert right_trimmed.all()
    assert errors[1] < errors[0] / 2


# Starts, stops and wrong fits


def test_near_starts_arrive_and_far_ones_stop_elsewhere(why):
    """From 15° all 25 draws of the clean room end right; from −110° none does, and at least 23 report convergence."""
    clouds = rooms()
    (near, right), (far, right_far) = runs(clouds, NEAR), runs(clouds, FAR)
    why(
        "the start",
        {"−110° and 1.43 u": f"{right_far.sum()} of 25 arrive", "15° and 0.5 u": f"{right.sum()} of 25 arrive"},
    )
    assert right.all()
    assert (near.status == Status.CONVERGED).all()
    assert not right_far.any()
    assert (far.status == Status.CONVERGED).sum() >= 23
    assert (metrics.rre(far.pose, Pose.identity()) > np.radians(90.0)).all()


def test_a_loose_tolerance_only_stops_sooner(why):
    """Stopping at an RMS change below 5 % instead of a millionth takes fewer steps in every draw, and leaves a larger
    error on average; all 50 runs report that they converged."""
    clouds = rooms()
    (tight, _), (loose, _) = (runs(clouds, USUAL, rms_tolerance=t) for t in (1e-6, 0.05))
    errors = [np.degrees(metrics.rre(result.pose, Pose.identity())).mean() for result in (tight, loose)]
    why(
        "the change of the RMS at which a run stops",
        {"5 %": f"{errors[1]:.2f}° off on average", "a millionth": f"{errors[0]:.2f}° off"},
    )
    assert (loose.steps < tight.steps).all()
    assert (np.stack([tight.status, loose.status]) == Status.CONVERGED).all()
    assert errors[1] > errors[0]


def pillars(first: int, last: int) -> FloatArray:
    """A row of equal pillars, 2 u apart, numbered from first to last, (n, 2)."""
    angle = np.linspace(0.0, 2.0 * np.pi, 12, endpoint=False)
    pillar = 0.2 * np.column_stack([np.cos(angle), np.sin(angle)])
    return np.concatenate([pillar + np.array([2.0 * k, 0.0]) for k in range(first, last + 1)])


def test_equal_pillars_fit_one_period_off():
    """Three of seven equal pillars, 2 u apart, started nearer to the next one: they fit it, one period off, without any
    residual."""
    row, piece = pillars(0, 6), pillars(2, 4)
    for start, shift in ((0.3, 0.0), (1.7, 2.0)):
        result = solvers.register(piece, row, start=Pose.from_angle(0.0, (start, 0.1)))
        assert result.status == Status.CONVERGED
        assert result.pose.t[0] == pytest.approx(shift, abs=1e-9)
        assert result.detail("pairing").rms < 1e-9


def test_the_end_of_a_row_tells_its_periods_apart():
    """Three pillars from within the row fit exactly both at the truth and one period off. If one of them is the last of
    the row, they fit exactly only at the truth, and have an RMS above 0.5 u one period off."""
    row = pillars(0, 6)
    for last, least in ((4, 0.0), (6, 0.5)):
        for start in (0.3, 1.7):
            guess = Pose.from_angle(0.0, (start, 0.1))
            rms = solvers.register(pillars(last - 2, last), row, start=guess).detail("pairing").rms
            assert rms > least if start > 1.0 and least else rms < 1e-9


def test_what_is_seen_once_pulls_on_every_fit(why):
    """If the target sees six tenths of the room, plain ICP fails from near in all 25 draws, and a gate of 0.6 u saves
    all."""
    clouds = rooms(overlap=0.6)
    plain, gated = runs(clouds, NEAR)[1], runs(clouds, NEAR, gate=0.6)[1]
    why("the gate", {"none": f"{plain.sum()} of 25 arrive", "0.6 u": f"{gated.sum()} of 25 arrive"})
    assert not plain.any()
    assert gated.all()


def test_without_what_is_seen_once_plain_icp_arrives(why):
    """The same rooms and start: plain ICP fails in all 25 draws, but arrives in all without the source points that are,
    at the truth, farther than 0.3 u from everything the target saw."""
    clouds = rooms(overlap=0.6)
    count = 0
    for source, target in zip(*clouds, strict=True):
        common = source[np.linalg.norm(source[:, None] - target, axis=2).min(axis=1) < 0.3]
        degrees, units = off_truth(solvers.register(common, target, start=NEAR).pose)
        count += int(degrees < 5.0 and units < 0.2)
    plain = runs(clouds, NEAR)[1].sum()
    why(
        "which source points there are",
        {"all": f"{plain} of 25 arrive", "those of walls that the target saw": f"{count} of 25 arrive"},
    )
    assert plain == 0
    assert count == 25


def test_a_wall_alone_makes_a_better_fit_than_the_truth(why):
    """If the target sees little more than one wall, all 25 gated runs converge, but at least 15 are wrong with an RMS
    below that of the same rule at the truth. With six tenths seen, all are right."""
    clouds = rooms("noise", overlap=0.35)
    result, right = runs(clouds, NEAR, gate=0.6)
    below = result.detail("pairing").rms < at_truth(clouds, gate=0.6).rms
    right_more = runs(rooms("noise", overlap=0.6), NEAR, gate=0.6)[1]
    why(
        "how much of the room the target sees",
        {"35 %": f"{(~right).sum()} of 25 wrong", "60 %": f"{(~right_more).sum()} of 25 wrong"},
    )
    assert right_more.all()
    assert (result.status == Status.CONVERGED).all()
    assert (below & ~right).sum() >= 15


def test_stripes_pull_a_trimmed_fit_along_the_walls(why):
    """In the striped room plain ICP ends right from near in all 25 draws. With 80 % of the pairs kept, at least 15 end
    more than 0.2 u but less than half a degree off, at an RMS below 0.075 u."""
    clouds = rooms("striped")
    _, right = runs(clouds, NEAR)
    result, _ = runs(clouds, NEAR, "trimmed-icp", keep=0.8)
    wrong = metrics.rte(result.pose, Pose.identity()) > 0.2
    why(
        "how many pairs are kept",
        {"the nearest 80 %": f"{wrong.sum()} of 25 more than 0.2 u off", "all": f"{(~right).sum()} of 25"},
    )
    assert right.all()
    assert wrong.sum() >= 15
    assert (metrics.rre(result.pose, Pose.identity())[wrong] < np.radians(0.5)).all()
    assert (result.detail("pairing").rms[wrong] < 0.075).all()


def test_stripes_trim_the_walls_that_would_object():
    """When such a trimmed run ends more than 0.2 u off, it leaves out more than nine tenths of the source points on
    vertical walls on average, and 5 to 15 % of those on horizontal ones."""
    source, target = rooms("striped")
    result, _ = runs((source, target), NEAR, "trimmed-icp", keep=0.8)
    n, used = normals(nearest.build(source)).vectors, result.detail("pairing").used
    vertical = np.abs(n[..., 0]) > np.abs(n[..., 1])
    rows = np.flatnonzero(metrics.rte(result.pose, Pose.identity()) > 0.2)
    shares = [[(~used[i][vertical[i] == side]).mean() for i in rows] for side in (True, False)]
    assert np.mean(shares[0]) > 0.9
    assert 0.05 < np.mean(shares[1]) < 0.15


def test_sparing_the_walls_that_object_saves_the_trimmed_fit(why):
    """The same rooms and start, a fifth of the pairs left out: leaving out the farthest of all, at least 15 of 25 draws
    end more than 0.2 u off; leaving out the farthest on horizontal walls, none does."""
    source, target = rooms("striped")
    n = normals(nearest.build(source)).vectors
    vertical, fifth = np.abs(n[..., 0]) > np.abs(n[..., 1]), round(0.2 * source.shape[1])

    def farthest(distances):
        return (-distances).argsort(axis=1).argsort(axis=1) >= fifth

    rules = {
        "the farthest of all": lambda k, d: farthest(d),
        "the farthest on horizontal walls": lambda k, d: farthest(np.where(vertical, -1.0, d)),
    }
    counts = [int((arrivals((source, target), NEAR, rule, 100)[1] > 0.2).sum()) for rule in rules.values()]
    messages = [f"{count} of 25 more than 0.2 u off" for count in counts]
    why("which fifth of the pairs is trimmed", dict(zip(rules, messages, strict=True)))
    assert counts[0] >= 15
    assert counts[1] == 0
