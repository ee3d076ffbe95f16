"""Redrawn scans, and how often a region holds the truth."""

import numpy as np
import pytest

from solvers import Pose
from solvers.uncertainty_study import (
    NO_ECHO,
    PLACES,
    REACH,
    STANDS,
    coverage,
    ends_of,
    redrawn,
    regions,
    runs,
    starts,
    walls_of,
)


def distances(points, walls):
    """Each point's distance to the nearest wall."""
    a, b = (np.concatenate(ends) for ends in ([w[:-1] for w in walls], [w[1:] for w in walls]))
    along = b - a
    at = np.clip(((points[:, None] - a) * along).sum(-1) / np.square(along).sum(-1), 0.0, 1.0)
    return np.linalg.norm(points[:, None] - a - at[..., None] * along, axis=-1).min(axis=1)


@pytest.mark.parametrize("place", PLACES)
def test_without_noise_every_echo_lies_on_a_wall_and_the_truth_joins_the_scans(place):
    scans = redrawn(place, 2, noise=0.0)
    echo = scans.weights[1] > 0.0
    points = scans.source[1][echo]
    assert distances(STANDS[place][0].apply(points), scans.walls).max() < 1e-9
    assert distances(STANDS[place][1].apply(scans.truth.apply(points)), scans.walls).max() < 1e-9
    assert np.linalg.norm(points, axis=1).max() < REACH
    assert (scans.source[1][~echo] == 0.0).all()
    far = np.abs(scans.target[1]).max(axis=1) == NO_ECHO
    assert distances(STANDS[place][1].apply(scans.target[1][~far]), scans.walls).max() < 1e-9


def test_the_ends_are_seen_in_the_room_and_not_in_the_corridor():
    assert (redrawn("room", 3).weights == 1.0).all()
    corridor = redrawn("corridor", 3, noise=0.0)
    places = STANDS["corridor"][0].apply(corridor.source[0][corridor.weights[0] > 0.0])
    assert 0.5 < corridor.weights.mean() < 0.95
    assert np.abs(np.abs(places[:, 1]) - 1.6).max() < 1e-9


def test_more_draws_leave_the_first_and_noise_stretches_them():
    few, many = redrawn("hall", 3), redrawn("hall", 8)
    np.testing.assert_array_equal(many.source[:3], few.source)
    clean, more = redrawn("hall", 3, noise=0.0), redrawn("hall", 3, noise=0.08)
    np.testing.assert_allclose(more.target - clean.target, 2.0 * (few.target - clean.target), atol=1e-12)
    assert not np.allclose(few.source[0], few.source[1])


def test_starts_spread_as_they_are_told_and_about_the_truth():
    truth = Pose.from_angle(1.0, (2.0, 0.0))
    result = starts(truth, 4000, heading=10.0, shift=0.3)
    difference = truth.inverse().compose(result)
    assert np.degrees(difference.angle).std() == pytest.approx(10.0, rel=0.05)
    np.testing.assert_allclose(difference.t.std(axis=0), 0.3, rtol=0.05)
    np.testing.assert_array_equal(starts(truth, 3, heading=0.0, shift=0.0).matrix, np.tile(truth.matrix, (3, 1, 1)))


@pytest.mark.parametrize(
    ("truth", "message"),
    [
        (None, "expected a Pose, got NoneType"),
        (Pose.identity(3), "moves points in 3 dimensions, the starts are of the plane"),
        (Pose.identity(2, (4,)), r"expected a single pose, got a batch of shape \(4,\)"),
    ],
)
def test_starts_spread_about_a_single_pose_of_the_plane(truth, message):
    with pytest.raises(ValueError, match=f"^truth: {message}"):
        starts(truth, 4)


def test_a_spread_is_one_number():
    with pytest.raises(ValueError, match=r"^shift: expected a number"):
        starts(Pose.identity(), 4, shift=np.array([0.1, 0.2]))


def test_a_line_counts_what_its_regions_hold():
    trials = runs("room", count=60)
    (line,) = coverage("room", ways=("censi",), count=60)
    inside = regions(trials, "censi").covers(trials.scans.truth)
    assert (line.covered, line.count) == (int(inside.sum()), 60)


def test_tiny_noise_turns_the_two_closed_forms_round():
    """In the room, point to plane: at the usual noise Censi's regions hold the truth more often than the Hessian's, at
    a quarter of it in two thirds of the draws and at an eighth in a quarter, the Hessian's in all but a few."""
    usual, small, tiny = (
        [line.covered for line in coverage("room", "point-to-plane", ("hessian", "censi"), count=100, noise=s)]
        for s in (0.04, 0.01, 0.005)
    )
    assert usual[0] < usual[1] > 90
    assert 55 < small[1] < 75 < 95 < small[0]
    assert tiny[1] < 35 < 95 < tiny[0]


def test_a_sampled_region_is_the_same_about_every_pose():
    trials = runs("room", count=40)
    outcome = regions(trials, "sampled")
    whole = ends_of(trials).whole
    np.testing.assert_array_equal(outcome.deviations, np.tile(whole.deviations, (40, 1)))
    assert outcome[3].distance(trials.result.pose[3]) == pytest.approx(0.0, abs=1e-12)


def test_what_is_no_set_of_runs_is_refused():
    message = "draws: expected Runs, got Result; solvers.uncertainty_study.runs makes them"
    result = runs("room", "icp", 2).result
    for call in (lambda: ends_of(result), lambda: regions(result, "hessian")):
        with pytest.raises(ValueError, match=f"^{message}"):
            call()
    with pytest.raises(ValueError, match=r"^poses: expected two or more"):
        ends_of(runs("room", "icp", 1))


def test_starts_carried_through_add_to_the_closed_form():
    trials = runs("room", "icp", 5)
    more, closed = regions(trials, "starts"), regions(trials, "censi")
    assert (more.deviations[:, 0] > closed.deviations[:, 0]).all()


def test_each_method_is_counted_in_the_ways_that_it_has():
    assert [line.way for line in coverage("room", "gicp", count=3)] == ["hessian", "sampled"]
    assert [line.way for line in coverage("room", "icp", count=3)] == ["hessian", "censi", "starts", "sampled"]
    assert [line.way for line in coverage("room", "generalized-icp", count=3)] == ["hessian", "sampled"]
    assert [line.way for line in coverage("room", "trimmed-icp", count=3)] == ["hessian", "censi", "starts", "sampled"]
    assert [line.way for line in coverage("room", "ndt", count=3)] == ["sampled"]
    with pytest.raises(ValueError, match="method: 'similarity' finds a scale"):
        coverage("room", "similarity", count=3)
    with pytest.raises(ValueError, match="gicp"):
        coverage("room", "gicp", ("censi",), count=3)
    with pytest.raises(ValueError, match=r"^ways: expected a sequence of names, got 'hessian'"):
        coverage("room", "icp", "hessian", count=3)


def test_options_are_the_method_s_own():
    """The gate is 2 u by default, and absent for methods without one; methods that take no weights work if every ray
    has an echo."""
    assert runs("room", "icp", 2).options == {"gate": 2.0}
    assert runs("room", "icp", 2, gate=0.5).options == {"gate": 0.5}
    assert runs("room", "icp", 2, max_distance=0.5).options == {"max_distance": 0.5}
    assert runs("room", "generalized-icp", 2).options == {"gate": 2.0}
    assert runs("room", "trimmed-icp", 2, keep=0.7).options == {"keep": 0.7}
    (line,) = coverage("room", "trimmed-icp", ("hessian",), count=3, keep=0.7)
    assert line.count == 3
    with pytest.raises(ValueError, match="weights"):
        runs("corridor", "trimmed-icp", 2)


@pytest.mark.parametrize("wrong", [
    {"place": "cellar"}, {"count": 0}, {"end": 1.0}, {"noise": -1.0}, {"rays": 3}, {"seed": -1},
])  # fmt: skip
def test_what_is_no_setting_is_refused(wrong):
    with pytest.raises(ValueError, match=next(iter(wrong))):
        redrawn(**wrong)


def test_the_walls_stand_where_they_are_put():
    assert np.abs(walls_of("room", 4.0)[0]).max() == 4.0
    assert len(walls_of("hall")) == 1
    with pytest.raises(ValueError, match="way"):
        coverage("room", ways=("guess",), count=3)
