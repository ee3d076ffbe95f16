"""The claims of the chapter 'Climb', checked against the solvers."""

import numpy as np
import pytest

from solvers import Pose, Status, register
from solvers.methods.ndt import ndt, ndt_map
from solvers.methods.ndt.score import evaluate
from solvers.metrics import rre, rte
from solvers.numerics import newton
from solvers.numerics.fits import rms_radius
from solvers.scenes.walls import ndt_room, single_wall
from solvers.studies.seeds import seeds

SEEDS = seeds(25)
DOWN_RIGHT = np.array([0.83205, -0.5547])
CAPS = {"max_shift": 0.5, "max_turn": 0.2, "max_steps": 45}
FINE = (3.2, 1.6, 0.8)


@pytest.fixture(scope="module")
def draws():
    """Source and target of 25 draws of the room."""
    scenes = [ndt_room(seed=seed) for seed in SEEDS]
    return np.stack([s.source for s in scenes]), np.stack([s.target for s in scenes])


def has_arrived(pose):
    """Whether each pose is within 2° and 0.1 u of the truth, which is the identity."""
    truth = Pose.identity(batch=pose.batch)
    return (np.degrees(rre(pose, truth)) < 2.0) & (rte(pose, truth) < 0.1)


def around(centre, degrees, distance, count=16):
    """Starts on a circle: their centroid `distance` from the true one, turned by `degrees` to alternate sides."""
    way = np.arange(count) * 2 * np.pi / count
    R = Pose.from_angle(np.where(np.arange(count) % 2, 1.0, -1.0) * np.radians(degrees)).R
    return Pose(R, centre + distance * np.stack([np.cos(way), np.sin(way)], axis=1) - R @ centre)


def hessians(cells, row, moved, radius):
    """Gradients and Hessians with respect to (tx, ty, ρφ) of moved clouds (k, m, 2), all on one cloud's map."""
    score = evaluate(cells, moved, moved.mean(axis=1), np.full(len(moved), row))
    return ndt.scaled(score.gradient, score.hessian, np.full(len(moved), radius))


def test_the_score_jumps_at_a_border():
    """A shift of 10⁻⁹ u changes a scan's score by more than 0.01 across a cell's border, elsewhere by less than
    10⁻⁶."""
    scene = ndt_room()
    cells = ndt_map.build(scene.target[None], 0.8, grids=4)
    x = np.linspace(0.0, 0.1, 401)
    moved = scene.source + np.stack([x, np.zeros_like(x)], axis=1)[:, None]
    pairs = [moved, moved + np.array([1e-9, 0.0])]
    # Each point's first border to the right, on the first grid: just before it and just after.
    wall = scene.source[:, 0]
    border = np.ceil(wall / 0.8) * 0.8 - wall
    across = np.stack([border - 5e-10, np.zeros_like(border)], axis=1)
    crossing = scene.source + across[:, None]
    jumps = []
    for a, b in ((pairs[0], pairs[1]), (crossing, crossing + np.array([1e-9, 0.0]))):
        first, second = (
            evaluate(cells, at, np.zeros((len(at), 2)), np.zeros(len(at), dtype=int), derivatives=False)
            for at in (a, b)
        )
        jumps.append(np.abs(second.score - first.score))
    assert np.median(jumps[0]) < 1e-6
    assert np.median(jumps[1]) > 0.01


def test_beyond_one_sigma_the_curvature_is_negative():
    """The second derivative of −exp(−q²/2σ²) is s (1 − q²/σ²)/σ²: positive within σ of the mean, negative beyond."""
    line = np.column_stack([np.linspace(-0.49, 0.49, 50), 0.5 + 0.01 * np.sin(np.arange(50.0))])
    cells = ndt_map.build((line + np.array([0.5, 0.0]))[None], 1.0)
    mean, precision = cells.mean[0, 0], cells.precision[0, 0]
    sigma = 1.0 / np.sqrt(precision[0, 0])
    for q in (0.0, 0.5, 0.9, 1.1, 1.5):
        at = evaluate(cells, (mean + np.array([q * sigma, 0.0]))[None, None], np.zeros((1, 2)))
        expected = np.exp(-0.5 * q**2) * (1.0 - q**2) / sigma**2
        assert at.hessian[0, 0, 0] == pytest.approx(expected, rel=1e-9)


def test_most_starts_have_an_indefinite_hessian(draws):
    """Of eight starts 10° and 0.5 u off around each of 25 draws, more than 180 of 200 have a Hessian with a negative
    smallest eigenvalue, but not all."""
    sources, targets = draws
    cells = ndt_map.build(targets, 0.8, grids=4)
    count = 0
    for i, source in enumerate(sources):
        centre, radius = source.mean(axis=0), float(rms_radius(source[None])[0])
        _, H = hessians(cells, i, around(centre, 10.0, 0.5, 8).apply(source), radius)
        count += int((np.linalg.eigvalsh(H)[:, 0] < 0.0).sum())
    assert 180 < count < 200


def test_units_do_not_change_a_scaled_step():
    """With the room in centimetres, the step in (tx, ty, ρφ) is the same motion; the step in (tx, ty, φ) is not."""
    scene = ndt_room()
    steps = {"scaled": [], "bare": []}
    for unit in (1.0, 100.0):
        moved = unit * around(scene.source.mean(axis=0), 10.0, 0.5, 8).apply(scene.source)
        cells = ndt_map.build(unit * scene.target[None], 0.8 * unit, grids=4)
        for name, radius in (("scaled", float(rms_radius(unit * scene.source[None])[0])), ("bare", 1.0)):
            g, H = hessians(cells, 0, moved, radius)
            step, _ = newton.damped_step(g, H)
            steps[name].append(step / np.array([unit, unit, radius]))
    np.testing.assert_allclose(*steps["scaled"], rtol=1e-6, atol=1e-9)
    assert np.abs(steps["bare"][0] - steps["bare"][1]).max() > 0.01


def test_coarse_to_fine_from_the_figures_start(draws, why):
    """From 25° and 1.4 u, cells of 0.8 u alone arrive in one of 25 draws, the run over 3.2 → 1.6 → 0.8 u in all 25."""
    start = Pose.from_angle(np.full(25, np.radians(25.0)), 1.4 * DOWN_RIGHT)
    counts = [int(has_arrived(register(*draws, "ndt", start=start, cells=h, **CAPS).pose).sum()) for h in (0.8, FINE)]
    why("the cells", {"3.2, 1.6, then 0.8 u": f"{counts[1]} of 25 arrive", "0.8 u": f"{counts[0]} of 25 arrive"})
    assert counts == [1, 25]


def figure_run(cells, max_shift=0.5, max_turn=0.2, grids=4):
    """The first figure's run from 25° and 1.4 u: the result, and its states after each step."""
    scene, states = ndt_room(), []
    result = register(
        scene.source, scene.target, "ndt", start=Pose.from_angle(np.radians(25.0), 1.4 * DOWN_RIGHT), cells=cells,
        grids=grids, max_shift=max_shift, max_turn=max_turn, max_steps=45, callback=lambda k, s: states.append(s),
    )  # fmt: skip
    return result, states


def test_short_steps_lead_to_the_same_summit_from_coarse_cells_alone():
    """Steps of at most 0.05 u and 0.04 rad: coarse to fine, more than half of those on the coarsest cells are as long
    as that, and the run ends within 10⁻³ u and 0.01° of where it ends with longer ones. On cells of 0.8 u the ends lie
    more than 0.1 u apart."""
    for cells, same in ((FINE, True), (0.8, False)):
        (usual, _), (short, states) = figure_run(cells), figure_run(cells, 0.05, 0.04)
        gap = float(rte(usual.pose, short.pose))
        assert gap < 1e-3 if same else gap > 0.1
        if same:
            assert np.degrees(rre(usual.pose, short.pose)) < 0.01
            coarsest = [s.step[0] for s in states if s.level[0] == 0]
            full = [max(np.hypot(*step[:2]) / 0.05, abs(step[2]) / 0.04) > 1.0 - 1e-9 for step in coarsest]
            assert len(full) > 20
            assert sum(full) > 0.5 * len(full)


def test_one_grid_halves_more_steps_than_four_in_the_figures_draw():
    """Coarse to fine from the figure's start: more than twice as many with one grid."""
    single, four = (sum(int(s.halved[0] > 0) for s in figure_run(FINE, grids=grids)[1]) for grids in (1, 4))
    assert single > 2 * four > 0


def test_reach_around_the_truth(draws, why):
    """Of 96 starts 20° and 1 u off, sixteen around each of six draws, 2 arrive at one cell size, 93 coarse to fine."""
    counts = []
    for h in (0.8, FINE):
        runs = [
            register(source, target, "ndt", start=around(source.mean(axis=0), 20.0, 1.0), cells=h, **CAPS)
            for source, target in zip(draws[0][:6], draws[1][:6], strict=True)
        ]
        counts.append(sum(int(has_arrived(run.pose).sum()) for run in runs))
    why("the cells", {"3.2, 1.6, then 0.8 u": f"{counts[1]} of 96 arrive", "0.8 u": f"{counts[0]} of 96 arrive"})
    assert counts == [2, 93]


def test_levels_have_summits_of_their_own(draws):
    """Climbed to rest from the truth on each of the three cell sizes, the poses of successive sizes differ by more than
    10⁻³ (u plus radians) in at least 20 of 25 draws."""
    truth = Pose.identity(batch=(25,))
    ends = [register(*draws, "ndt", start=truth, cells=h, **CAPS).pose for h in FINE]
    for a, b in ((0, 1), (1, 2)):
        gaps = rte(ends[a], ends[b]) + rre(ends[a], ends[b])
        assert (gaps > 1e-3).sum() >= 20


def test_too_coarse_a_level_loses_a_good_start():
    """One grid, started 5° and 0.2 u off: cells of 1.2 u arrive, the run over 4.8 → 2.4 → 1.2 u ends over 10° away."""
    scene = ndt_room()
    start = Pose.from_angle(np.radians(5.0), 0.2 * DOWN_RIGHT)
    levels = (1.2, (4.8, 2.4, 1.2))
    fine, several = (register(scene.source, scene.target, "ndt", start=start, cells=h, grids=1, **CAPS) for h in levels)
    assert has_arrived(fine.pose)
    assert np.degrees(rre(several.pose, scene.truth)) > 10.0


def reach_in_degrees(source, target, way, cells):
    """The largest angle, in steps of 2°, up to which every start turned about the centroid arrives."""
    centre, angles = source.mean(axis=0), np.arange(2, 59, 2)
    R = Pose.from_angle(way * np.radians(angles)).R
    result = has_arrived(register(source, target, "ndt", start=Pose(R, centre - R @ centre), cells=cells, **CAPS).pose)
    return int(angles[np.argmin(result)]) - 2


def test_there_is_no_universal_capture_angle(draws):
    """In three draws, turned either way, all starts arrive up to an angle that varies between 28° and 48°; with a last
    level of 0.6 u, it varies between 18° and 28°."""
    reach = {
        cells: [
            reach_in_degrees(source, target, way, cells)
            for source, target in zip(draws[0][:3], draws[1][:3], strict=True)
            for way in (1, -1)
        ]
        for cells in (FINE, (2.4, 1.2, 0.6))
    }
    assert [(min(result), max(result)) for result in reach.values()] == [(28, 48), (18, 28)]


def test_converged_far_from_the_truth(draws):
    """From 90°, none of 25 draws arrives, with cells of 0.8 u or coarse to fine, and all stop before the cap; 20 of the
    coarse-to-fine runs report convergence."""
    start = Pose.from_angle(np.full(25, np.radians(90.0)), DOWN_RIGHT)
    for h in (0.8, FINE):
        run = register(*draws, "ndt", start=start, cells=h, **CAPS)
        assert not has_arrived(run.pose).any()
        assert (np.degrees(rre(run.pose, Pose.identity(batch=(25,)))) > 20.0).all()
        assert (run.status != Status.CAPPED).all()
    assert (run.status == Status.CONVERGED).sum() == 20


def test_the_truth_is_seldom_the_summit(draws):
    """Started at the truth on cells of 0.8 u, 22 of 25 draws end at a higher score, the others at the same score."""
    sources, targets = draws
    run = register(sources, targets, "ndt", start=Pose.identity(batch=(25,)), cells=0.8, **CAPS)
    cells = ndt_map.build(targets, 0.8, grids=4)
    truth = evaluate(cells, sources, sources.mean(axis=1)).score
    assert (-run.objective > truth + 1e-9).sum() == 22
    assert (-run.objective >= truth - 1e-9).all()


def test_a_wall_is_weak_along_itself():
    """On one wall, a run converges more than 0.5 u off along it, with a condition number above 100 and its weak
    direction within 5° of the wall."""
    scene = single_wall()
    start = Pose.from_angle(0.0, (0.6, 0.2))
    run = register(scene.source, scene.target, "ndt", start=start, cells=(1.6, 0.8))
    along = np.array([8.0, 2.8]) / np.hypot(8.0, 2.8)
    assert run.status == Status.CONVERGED
    assert abs(run.pose.t @ along) > 0.5
    assert run.detail("condition") > 100.0
    weak = run.detail("weak")
    assert abs(weak[:2] @ along) > np.cos(np.radians(5.0))
