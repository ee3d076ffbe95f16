"""The claims of the chapters 'The contestants' and 'The soft family', checked against the solvers."""

from itertools import pairwise

import numpy as np
import pytest

from solvers import METHODS, Pose, fit_rigid, register
from solvers.core.method import Problem
from solvers.core.stepper import advance, begin
from solvers.methods.soft import schedule
from solvers.methods.soft.annealed import weights
from solvers.methods.soft.belief_propagation import marginal_matrix
from solvers.methods.soft.cpd import CpdOptions, responsibilities
from solvers.methods.soft.gmmreg import GmmRegOptions
from solvers.methods.soft.shares import clutter_weight
from solvers.metrics import rre
from solvers.scenes.bird import AREA, bird, bird_start
from solvers.scenes.rooms import room
from solvers.studies.benchmark import benchmark
from solvers.studies.race import SEEDS, Controls, contestants, race_problem
from solvers.studies.seeds import seeds

SOFT_THREE = ("soft-annealed", "association-bp", "hypothesis-mixture")


def problem(scene, start=None):
    """One registration of a scene, from the scene's own start by default."""
    start = scene.start if start is None else start
    pose = Pose(start.R[None], start.t[None])
    return Problem(scene.source[None], scene.target[None], np.ones((1, len(scene.source))), pose, np.array([40]))


# CPD


def test_a_step_is_the_weighted_fit_to_soft_targets():
    """A CPD step gives the closed-form fit of the moving points to their soft targets, weighted by responsibility."""
    for seed in SEEDS[:5]:
        scene = bird(seed=seed)
        for method, scale in (("cpd-rigid", False), ("cpd-similarity", True)):
            batch = begin(METHODS[method], problem(scene), CpdOptions(sigma=0.8, volume=AREA))
            P, after = responsibilities(batch.state()), advance(batch).state().pose
            explained = P.sum(axis=1)
            fit = fit_rigid(scene.source, P @ scene.target / explained[:, None], explained)
            np.testing.assert_allclose(fit.pose.R, after.R[0], atol=1e-10)
            if not scale:
                np.testing.assert_allclose(fit.pose.t, after.t[0], atol=1e-9)


def test_lowering_q_is_enough():
    """Every random nearby pose and width that lowers the auxiliary objective lowers the negative log-likelihood at
    least as much: a step need not be the best one."""
    rng = np.random.default_rng(5)
    scene = bird()
    count = 0
    for _ in range(8):
        start = Pose.from_angle(rng.uniform(-3.0, 3.0), rng.uniform(-1.5, 1.5, 2))
        sigma = float(rng.uniform(0.2, 1.5))
        state = begin(METHODS["cpd-rigid"], problem(scene, start), CpdOptions(sigma=sigma, volume=AREA)).state()
        P, before = responsibilities(state), float(state.objective[0])

        def auxiliary(pose, sigma, P=P):
            squares = np.square(pose.apply(scene.source)[:, None] - scene.target).sum(axis=2)
            return (P * squares).sum() / (2 * sigma**2) + P.sum() * 2 * np.log(sigma)

        for _ in range(60):
            turn, shift = rng.normal(0.0, 0.1), rng.normal(0.0, 0.15, 2)
            pose, width = Pose.from_angle(turn, shift).compose(start), sigma * float(np.exp(rng.normal(0.0, 0.1)))
            fall = auxiliary(start, sigma) - auxiliary(pose, width)
            if fall > 0.0:
                options = CpdOptions(sigma=width, volume=AREA)
                after = begin(METHODS["cpd-rigid"], problem(scene, pose), options).state()
                assert before - float(after.objective[0]) >= fall - 1e-9
                count += 1
    assert count > 100


def bird_error(**options):
    """The rotation error in degrees, and σ, after 40 steps of rigid CPD from the figure's start."""
    scene = bird(clutter=options.pop("junk"))
    options = {"sigma": 1.1, "volume": AREA, "max_steps": 40, **options}
    run = register(scene.source, scene.target, "cpd-rigid", start=scene.start, **options)
    return float(np.degrees(rre(run.pose, scene.truth))), float(run.detail("sigma"))


def test_from_minus_80_degrees_all_three_fail_in_most_draws():
    """The figure's bird from −80°: in 17 of 25 draws, rigid CPD, FilterReg and GMMReg all end more than 5° off."""
    results = {"volume": AREA, "clutter": 0.1, "tolerance": 1e-3}
    options = {
        "cpd-rigid": {"sigma": 1.1, **results},
        "filterreg": {"filter": "exact", "variance": "estimated", "first": 1.1, **results},
        "gmmreg": {"first": 1.1},
    }
    errors = np.zeros((3, 25))
    for k, seed in enumerate(seeds(25)):
        scene = bird(seed=seed, noise=0.1, clutter=4)
        for i, (method, own) in enumerate(options.items()):
            run = register(scene.source, scene.target, method, start=bird_start(-80.0), max_steps=40, **own)
            errors[i, k] = np.degrees(rre(run.pose, scene.truth))
    failed = errors > 5.0
    assert failed.all(axis=0).sum() == 17


def test_the_clutter_weight_saves_the_run(why):
    """The bird with ten clutter points: with a weight of 0.1 the run ends within 1°, with none more than 80° off."""
    bad, good = bird_error(junk=10, clutter=0.0)[0], bird_error(junk=10, clutter=0.1)[0]
    why("the clutter weight, with ten clutter points", {"none": f"{bad:.1f}° off", "0.1": f"{good:.1f}° off"})
    assert good < 1.0
    assert bad > 80.0


def test_stray_points_hold_sigma_up(why):
    """Without a clutter weight, σ stays above 1 u and the run ends more than 80° off if there are ten clutter points;
    if there are none, σ falls below 0.2 u and the run ends within 1°."""
    (bad, wide), (good, narrow) = (bird_error(junk=junk, clutter=0.0) for junk in (10, 0))
    why(
        "the clutter points, without a clutter weight",
        {
            "ten in each cloud": f"σ stays at {wide:.2f} u, {bad:.1f}° off",
            "none": f"σ falls to {narrow:.2f} u, {good:.1f}° off",
        },
    )
    assert wide > 1.0
    assert bad > 80.0
    assert narrow < 0.2
    assert good < 1.0


def test_a_wider_first_sigma_avoids_the_local_maximum(why):
    """From a turn of 50°, with enough steps to converge: a first σ of 1.1 u ends over 70° off, 1.5 u within 1°."""
    scene, errors = bird(), {}
    for sigma in (1.1, 1.5):
        options = {"sigma": sigma, "clutter": 0.1, "volume": AREA, "max_steps": 300}
        pose = register(scene.source, scene.target, "cpd-rigid", start=bird_start(-50.0), **options).pose
        errors[sigma] = float(np.degrees(rre(pose, scene.truth)))
    why("the first σ", {f"{sigma:g} u": f"{error:.1f}° off" for sigma, error in errors.items()})
    assert errors[1.1] > 70.0
    assert errors[1.5] < 1.0


def test_from_50_degrees_most_draws_succeed():
    """From a turn of 50° with a first σ of 1.1 u, as in the test above, 45 or more of 60 draws end within 5°."""
    scenes = [bird(seed=seed) for seed in seeds(60)]
    errors = [
        np.degrees(rre(run.pose, scene.truth))
        for scene in scenes
        for run in [register(
            scene.source, scene.target, "cpd-rigid", start=bird_start(-50.0), sigma=1.1, clutter=0.1, volume=AREA
        )]
    ]  # fmt: skip
    assert np.count_nonzero(np.array(errors) < 5.0) >= 45


def test_a_local_maximum_of_the_likelihood():
    """From a turn of 50° with a first σ of 1.1 u, rigid CPD converges over 70° off, at a lower likelihood than a run
    from the truth does."""
    scene = bird()
    options = {"sigma": 1.1, "clutter": 0.1, "volume": AREA, "max_steps": 300}
    bad, good = (
        register(scene.source, scene.target, "cpd-rigid", start=start, **options)
        for start in (bird_start(-50.0), scene.truth)
    )
    assert bad.status.label == good.status.label == "converged"
    assert np.degrees(rre(bad.pose, scene.truth)) > 70.0
    assert np.degrees(rre(good.pose, scene.truth)) < 2.0
    assert bad.objective > good.objective + 10.0


def test_the_shrunken_cloud_grows_again_in_a_wrong_place():
    """From a turn of 60° with a first σ of 2 u, the similarity has shrunk below a third of its size after 40 steps;
    given 300, it converges above 0.9 of its size, over 90° off."""
    scene = bird()
    options = {"start": bird_start(-60.0), "sigma": 2.0, "clutter": 0.1, "volume": AREA}
    first, last = (
        register(scene.source, scene.target, "cpd-similarity", max_steps=steps, **options) for steps in (40, 300)
    )
    assert first.pose.scale < 1 / 3
    assert last.status.label == "converged"
    assert last.pose.scale > 0.9
    assert np.degrees(rre(last.pose, scene.truth)) > 90.0


def test_one_over_n_depends_on_the_unit():
    """Switching to millimetres leaves the motion unchanged under the volume convention, but not under the paper's."""
    scene = bird(noise=0.25, clutter=10)
    results = {}
    for unit in (1.0, 1000.0):
        start = Pose(scene.start.R, unit * scene.start.t)
        for paper, volume in ((False, AREA * unit**2), (True, float(len(scene.target)))):
            options = {"sigma": 1.1 * unit, "clutter": 0.3, "volume": volume, "max_steps": 60}
            run = register(unit * scene.source, unit * scene.target, "cpd-rigid", start=start, **options)
            results[unit, paper] = run.pose.apply(unit * scene.source) / unit
    np.testing.assert_allclose(results[1000.0, False], results[1.0, False], atol=1e-9)
    assert np.abs(results[1000.0, True] - results[1.0, True]).max() > 0.01


def test_one_over_v_does_not_depend_on_the_sampling():
    """If every point of both clouds is doubled, the clutter's shares stay the same with 1/V, and all fall with 1/N."""
    scene = bird()

    def shares(copies, volume):
        start = Pose(scene.start.R[None], scene.start.t[None])
        source, target = (np.repeat(c, copies, axis=0)[None] for c in (scene.source, scene.target))
        p = Problem(source, target, np.ones(source.shape[:2]), start, np.array([40]))
        paper = float(target.shape[1])
        state = begin(METHODS["cpd-rigid"], p, CpdOptions(sigma=0.8, volume=volume or paper)).state()
        return 1.0 - state.row[0][::copies]

    np.testing.assert_allclose(shares(2, AREA), shares(1, AREA), atol=1e-12)
    mask = shares(1, None) > 1e-9
    assert (shares(2, None)[mask] < shares(1, None)[mask]).all()


# GMMReg, and the heuristic


def test_a_far_point_does_not_pull_in_gmmreg():
    """A fixed point far beyond σ changes the gradient only by the factor n/(n + 1), which comes from its count."""
    scene = bird(clutter=0)
    stray = np.vstack([scene.target, [[40.0, 25.0]]])
    n = len(scene.target)
    plain, more = (
        begin(METHODS["gmmreg"], Problem(scene.source[None], target[None], np.ones((1, len(scene.source))),
                                         Pose(scene.start.R[None], scene.start.t[None]), np.array([40])),
              GmmRegOptions(first=0.8)).state()
        for target in (scene.target, stray)
    )  # fmt: skip
    assert np.abs(plain.gradient).max() > 1e-3
    np.testing.assert_allclose(more.gradient * (n + 1) / n, plain.gradient, rtol=1e-10)


def test_the_heuristics_weight_moves_with_bandwidth_and_count():
    """The clutter weight equivalent to a constant of 0.12 grows as σ shrinks and falls as points are added; at fixed σ
    and count, a mixture with that weight gives the same support."""
    n, V = len(room("combo").target), 64.0
    w = [clutter_weight(0.12, sigma, n, V) for sigma in (1.1, 0.5, 0.12)]
    assert w[0] < w[1] < w[2]
    assert clutter_weight(0.12, 0.5, 2 * n, V) < w[1]
    scene = room("combo")
    start = Pose.identity()
    soft = register(scene.source, scene.target, "soft-annealed", start=start, max_steps=0, first=0.5, miss=0.12)
    options = {"filter": "exact", "first": 0.5, "clutter": w[1], "volume": V, "max_steps": 0}
    mixture = register(scene.source, scene.target, "filterreg", start=start, **options)
    np.testing.assert_allclose(soft.detail("support"), mixture.detail("weights"), rtol=1e-9)


# The contestants


@pytest.mark.parametrize("method", ["icp", "soft-annealed", "mmd"])
def test_smooth_or_not_along_a_line(method):
    """Along a straight line of poses in 200, 800 and 3200 steps: the slope of ICP's objective always jumps by more than
    a quarter of its largest value, where partners change; the largest change in the slopes of soft targets at fixed
    width and of MMD falls with the step."""
    scene = bird()
    options = {"icp": {}, "soft-annealed": {"first": 0.5, "last": 0.5}, "mmd": {"lengths": (1.0,)}}[method]

    def jump(count):
        shifts = np.linspace(-0.4, 0.4, count)
        poses = Pose(np.broadcast_to(scene.truth.R, (count, 2, 2)), scene.truth.t + shifts[:, None] * [1.0, 0.0])
        p = Problem(
            np.broadcast_to(scene.source, (count, *scene.source.shape)).copy(),
            np.broadcast_to(scene.target, (count, *scene.target.shape)).copy(),
            np.ones((count, len(scene.source))), poses, np.full(count, 40),
        )  # fmt: skip
        state = begin(METHODS[method], p, METHODS[method].options(**options)).state()
        value = state.objective
        if method == "soft-annealed":  # the score that a step at fixed width never raises
            value = np.log1p(state.support / (1.0 - state.support)).sum(axis=1)
        slope = np.diff(value) / (shifts[1] - shifts[0])
        return np.abs(np.diff(slope)).max() / np.abs(slope).max()

    jumps = [jump(200 * times + 1) for times in (1, 4, 16)]
    if method == "icp":
        assert min(jumps) > 0.25
    else:
        assert all(fine < 0.3 * coarse < 0.01 for coarse, fine in pairwise(jumps))


def test_who_may_be_claimed_more_than_once():
    """At the race's start, over 5 seeds, some target point is claimed more than three times in total by soft targets,
    none more than 1.25 times by the association marginals, and none more than once by one hypothesis."""
    sums = {"soft": [], "bp": [], "hypothesis": []}
    for seed in SEEDS[:5]:
        task, _ = race_problem(Controls(), [seed])
        state = {c.method: c.begin(task).state() for c in contestants(list(SOFT_THREE))}
        sums["soft"].append(weights(state["soft-annealed"]).sum(axis=0).max())
        sums["bp"].append(marginal_matrix(state["association-bp"]).sum(axis=0).max())
        partners = state["hypothesis-mixture"].assignments[0]
        sums["hypothesis"].append(max(np.bincount(row[row >= 0]).max() for row in partners))
    assert min(sums["soft"]) > 3.0
    assert max(sums["bp"]) < 1.25
    assert set(sums["hypothesis"]) == {1}


def test_rivals_keep_the_marginals_unlinked(why):
    """The tip of the tail, with the source 2.4 u away: the one-to-one marginals leave more than 60 % of it unlinked,
    but less than 20 % if it is the source's only point. Soft targets leave the same share in both cases."""
    scene, start = bird(), bird_start(0.0, 2.4)

    def unlinked_share(method, source):
        (contestant,) = contestants([method])
        result = register(source, scene.target, method, start=start, max_steps=0, seed=40, **contestant.options)
        return 1.0 - float(result.detail("support")[0])

    rivals, alone = (unlinked_share("association-bp", source) for source in (scene.source, scene.source[:1]))
    why(
        "the other points of the source",
        {"they are there": f"{100 * rivals:.0f} % of the tip unlinked", "there are none": f"{100 * alone:.0f} %"},
    )
    assert rivals > 0.6
    assert alone < 0.2
    soft = [unlinked_share("soft-annealed", source) for source in (scene.source, scene.source[:1])]
    assert soft[0] == pytest.approx(soft[1], abs=1e-12)


def test_points_without_partners_do_not_pull(why, monkeypatch):
    """The clean room from 45° and 1.43 u, the source twice as dense: association BP is right on no seed of 25, and on
    all if each source point with a pair in reach pulls towards the same soft target with weight one."""
    associated = schedule.associated

    def in_full(state, mass, moment):
        linked = mass > 0.0
        return associated(state, linked.astype(float), moment / np.where(linked, mass, 1.0)[..., None])

    def right():
        (line,) = benchmark(Controls(setting="clean", density=2.0), contestants=contestants(["association-bp"]))
        return line.close

    by_share = right()
    monkeypatch.setattr(schedule, "associated", in_full)
    full = right()
    why("how hard a point pulls", {"as it is linked": f"{by_share} of 25 are right", "in full": f"{full} of 25"})
    assert (by_share, full) == (0, 25)


def test_mmd_looks_at_no_pair():
    """The residual is built from one phase per moving point and wave; the target enters only by its mean, computed once
    per length scale. No pair of points is compared."""
    scene = bird()
    for count in (16, 64):
        state = begin(METHODS["mmd"], problem(scene), METHODS["mmd"].options(count=count, lengths=(1.0,))).state()
        waves = state.frequencies[0] / state.length[0]
        moved = scene.start.apply(scene.source)
        phases = moved @ waves.T  # m · D of them: the target's n points enter only by their mean
        assert phases.shape == (len(scene.source), count)
        mean = np.concatenate([np.cos(phases).mean(axis=0), np.sin(phases).mean(axis=0)]) / np.sqrt(count)
        np.testing.assert_allclose(state.moving_mean[0], mean, atol=1e-12)
        np.testing.assert_allclose(state.residual[0], mean - state.fixed_mean[0], atol=1e-12)
