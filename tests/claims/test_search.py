"""The claims of the chapter 'Search everywhere', checked against the solvers."""

import numpy as np
import pytest

from solvers import Pose, Status, register
from solvers.methods.search import bounds, branch_and_bound
from solvers.metrics import rre, rte
from solvers.odometry import match, prepare
from solvers.scenes.drive import chained, telecom_loop
from solvers.scenes.rooms import ROOM_SETTINGS, room
from solvers.scenes.walls import hall
from solvers.studies.race import SEEDS

METHOD = "branch-and-bound"
ASKED = {"cap": 0.4, "gap": 1e-3}
DRAWS = SEEDS[:12]


def search_apart(scene, best, degrees, **options):
    """The search of all poses turned by more than `degrees` degrees from the pose `best`."""
    mean = scene.source.mean(axis=0, keepdims=True)
    opposite = Pose.from_angle(float(best.angle) + np.pi)
    start = Pose(opposite.R, (best.apply(mean) - opposite.apply(mean))[0])
    return register(
        scene.source, scene.target, METHOD, start=start, turn=np.pi - np.radians(degrees), **{**ASKED, **options}
    )


@pytest.fixture(scope="module")
def halls():
    """Twelve draws of the hall, and the result of searching all poses in each."""
    scenes = [hall(seed=seed) for seed in DRAWS]
    return scenes, [register(s.source, s.target, METHOD, **ASKED) for s in scenes]


def per_point(grid, arms, middle, half):
    """The first-order bound, but with the second-order bound's exact distances to the points."""
    floors = []
    for k in range(0, len(middle), 256):
        at, wide = middle[k : k + 256], half[k : k + 256]
        moved = arms @ Pose.from_angle(at[:, 0]).R.swapaxes(1, 2) + at[:, None, 1:]
        candidates, rest = grid.candidates(moved)
        distances = np.sqrt(np.square(moved[:, :, None] - candidates).sum(axis=-1).min(axis=-1))
        gamma = 2.0 * np.hypot(*arms.T) * np.sin(0.5 * wide[:, :1]) + np.sqrt(2.0) * wide[:, 1:]
        floors.append(np.square(np.clip(np.minimum(distances, rest) - gamma, 0.0, 1.0)).mean(axis=1))
    return np.concatenate([np.zeros(0), *floors])


def test_summing_the_slopes_first_makes_the_proof_short(monkeypatch, why):
    """The noisy room, proved to gaps of 10⁻³ and 3 · 10⁻⁴ u². If the slopes of small boxes are summed before they are
    bounded, fewer than 25,000 boxes are enough for both. If each point is bounded for itself, the first takes 1.5 to
    2.5 times as many, the second more than 100,000."""
    scene = room("noise")
    boxes = {}
    for words, bound in (("summed first", branch_and_bound.fine), ("each point for itself", per_point)):
        monkeypatch.setattr(branch_and_bound, "fine", bound)
        results = [register(scene.source, scene.target, METHOD, **{**ASKED, "gap": gap}) for gap in (1e-3, 3e-4)]
        assert [result.status for result in results] == [Status.PROVED] * 2
        boxes[words] = [int(result.detail("examined")) for result in results]
    why(
        "summing the linear parts before they are bounded",
        {words: f"{one:,} boxes to a gap of 0.001 u², {two:,} to 0.0003 u²" for words, (one, two) in boxes.items()},
    )
    summed, apart = boxes.values()
    assert max(summed) < 25_000
    assert 1.5 * summed[0] < apart[0] < 2.5 * summed[0]
    assert apart[1] > 100_000


def test_the_rounding_of_the_grid_would_keep_a_proof_from_ending():
    """At the proved pose of the noisy room, the grid's bound is more than 2 · 10⁻³ u² below the value, even for a box
    of that one pose; the points' bound equals the value."""
    scene = room("noise")
    result = register(scene.source, scene.target, METHOD, **ASKED)
    (ground,) = result.states[0].ground
    shift = (result.pose.apply(scene.source.mean(axis=0)[None])[0] - ground.middle) / ground.cap
    arguments = ground.grid, ground.arms, np.array([[float(result.pose.angle), *shift]]), np.zeros((1, 2))
    low, exact = (result.objective - ground.cap**2 * bound(*arguments)[0] for bound in (bounds.coarse, bounds.fine))
    assert low > 2e-3
    assert abs(exact) < 1e-9


def test_in_the_hall_a_proof_is_half_a_turn_off_as_often_as_not(halls):
    """Twelve draws, all proved: five are within 5° of the truth, seven within 5° of half a turn from it."""
    scenes, results = halls
    errors = np.degrees([rre(f.pose, s.truth) for f, s in zip(results, scenes, strict=True)])
    assert all(f.status == Status.PROVED for f in results)
    assert np.count_nonzero(errors < 5.0) == 5
    assert np.count_nonzero(errors > 175.0) == 7


def test_the_hall_has_two_optima_of_one_value(halls):
    """The best pose turned by more than 90° from the answer is half a turn from it and within 1e-3 u² of its value."""
    scenes, results = halls
    for scene, best in zip(scenes, results, strict=True):
        second = search_apart(scene, best.pose, 90.0)
        assert second.status == Status.PROVED
        assert np.degrees(rre(second.pose, best.pose)) > 175.0
        assert abs(second.objective - best.objective) < 1e-3


@pytest.mark.parametrize("setting", ["clean", "noise", "combo"])
def test_in_the_room_no_other_heading_comes_near(setting):
    """All poses turned by more than 30° from the answer are proved to lie at least 0.02 u² above its value."""
    for seed in DRAWS[:2]:
        scene = room(setting, seed=seed)
        best = register(scene.source, scene.target, METHOD, **ASKED)
        assert best.status == Status.PROVED
        assert np.degrees(rre(best.pose, scene.truth)) < 5.0
        assert search_apart(scene, best.pose, 30.0, gap=0.02).lower > best.objective + 0.02


def refine(scene, start):
    """The pose where capped ICP from a start ends, and its mean capped squared distance."""
    end = register(scene.source, scene.target, "capped-icp", start=start, cap=ASKED["cap"], max_steps=100)
    return end.pose, float(end.objective) / len(scene.source)


def test_the_best_of_a_grid_leads_to_the_proved_optimum(why):
    """Six settings, two draws each: the grid's best pose lies up to 2.6° and 0.2 u from the truth, and capped ICP from
    it ends within 1e-3 u² of the proved optimum. From that pose turned by 180° about the source's middle, it always
    ends more than 0.01 u² above."""
    scenes = [room(setting, seed=seed) for setting in ROOM_SETTINGS for seed in DRAWS[:2]]
    gaps, turned_gaps, errors = [], [], []
    for scene in scenes:
        coarse = register(scene.source, scene.target, "correlative").pose
        proof = register(scene.source, scene.target, METHOD, **ASKED)
        assert proof.status == Status.PROVED
        errors.append((np.degrees(rre(coarse, scene.truth)), rte(coarse, scene.truth)))
        middle = coarse.apply(scene.source.mean(axis=0, keepdims=True))[0]
        opposite = Pose.from_angle(np.pi, 2.0 * middle).compose(coarse)
        for start, values in ((coarse, gaps), (opposite, turned_gaps)):
            values.append(refine(scene, start)[1] - proof.objective)
    why(
        "the start of capped ICP",
        {
            "the best pose of the grid": f"at most {max(gaps):.4f} u² above the proved optimum",
            "the same, turned half round": f"at least {min(turned_gaps):.4f} u² above",
        },
    )
    assert 0.05 < max(np.array(errors)[:, 1]) < 0.2
    assert 0.5 < max(np.array(errors)[:, 0]) < 2.6
    assert max(gaps) <= 1e-3
    assert min(turned_gaps) > 0.01


@pytest.mark.native
def test_a_loop_of_the_drive_needs_no_prediction(why):
    """Scan 200 of the recorded drive to scan 40. Matches from the wheels' pose, more than 5 m off, and from no motion
    are not believed; the match from the grid's best pose is, and ends within 10 cm and 1° of it. Fewer than one in a
    hundred of the grid's poses were scored."""
    drive = telecom_loop()
    scans, wheels = prepare(drive), chained(drive.motion)
    grid = register(scans.cloud(200), scans.cloud(40), "correlative")
    starts = [wheels[40].inverse().compose(wheels[200]), Pose.identity(2), grid.pose]
    result = match(scans, [200] * 3, [40] * 3, Pose(np.stack([s.R for s in starts]), np.stack([s.t for s in starts])))
    names = ["the wheels", "no motion", "the best pose of the grid"]
    why("the start of the match", {n: f"{s:.0%} explained" for n, s in zip(names, result.share, strict=True)})
    assert result.believed.tolist() == [False, False, True]
    assert result.share[2] > 0.6
    assert max(result.share[:2]) < 0.15
    assert np.linalg.norm(starts[0].t - result.pose.t[2]) > 5.0
    assert np.linalg.norm(grid.pose.t - result.pose.t[2]) < 0.1
    assert np.degrees(rre(grid.pose, result.pose[2])) < 1.0
    assert grid.detail("nodes") < 0.01 * grid.detail("poses")
