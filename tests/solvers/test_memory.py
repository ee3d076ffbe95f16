"""The memory that the most demanding methods state they need, and the sizes that they refuse."""

import tracemalloc

import numpy as np
import pytest

from solvers import METHODS, Pose, Result, Status, register
from solvers.core.method import Problem
from solvers.methods.flow import flow
from solvers.methods.soft import radius_pairs
from solvers.thinning import thinned
from solvers.uncertainty import spread_of

PAIRED = ("association-bp", "hypothesis-mixture")
FLOWS = ("flow", "flow-from-source")


def peak(run):
    """The peak memory that a run allocates, bytes."""
    tracemalloc.start()
    try:
        run()
        return tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()


@pytest.mark.native
@pytest.mark.parametrize("method", PAIRED)
def test_a_listed_pair_takes_what_is_said(method, rng):
    """At a σ that lists all pairs, each takes 50 to 70 bytes, whatever their number: the limit is below a gigabyte."""
    for m, n in ((700, 700), (1400, 350)):
        source, target = rng.standard_normal((m, 2)), rng.standard_normal((n, 2))
        most = peak(lambda p=source, q=target: register(p, q, method, first=10.0, last=9.0, max_steps=1))
        assert 50 < most / (m * n) < 70
    assert 0.5e9 < 68 * radius_pairs.MOST < 1e9


@pytest.mark.native
@pytest.mark.parametrize("method", FLOWS)
def test_attention_takes_what_is_said(method, rng):
    """Attention takes 95 to 120 bytes for every two points of both clouds, under 110 with 300 points in each, however
    many samples there are."""
    most = {}
    for count, samples in ((150, 1), (300, 1), (150, 4)):
        source, target = rng.standard_normal((count, 2)), rng.standard_normal((count, 2))
        most[count, samples] = peak(
            lambda p=source, q=target, s=samples: register(p, q, method, samples=s, max_steps=1)
        ) / (2 * count) ** 2
    assert all(95 < size < 120 for size in most.values()), most
    assert most[300, 1] < 110
    assert 0.5e9 < 105 * flow.MOST**2 < 1e9


@pytest.mark.parametrize("method", [*PAIRED, *FLOWS])
def test_more_is_refused_and_the_way_out_is_named(method):
    """The message names the larger cloud, both counts, the limit, and a call that thins the cloud enough to fit."""
    many, few = np.random.default_rng(40).standard_normal((5000, 2)), np.zeros((2900, 2))
    for source, target, name in ((many, few, "source"), (few, many, "target")):
        with pytest.raises(ValueError, match=rf"^{name}: its 5000 points and the .*'s 2900 are too many: ") as caught:
            register(source, target, method)
        words = str(caught.value)
        assert ("3000 together" if method in FLOWS else "14,000,000 pairs") in words
        size = int(words.split("thinned(points, ")[1].split(")")[0])
        assert len(thinned(many, size)) <= size
        assert (2 * size if method in FLOWS else size * size) <= (flow.MOST if method in FLOWS else radius_pairs.MOST)


def test_the_limit_itself_is_taken():
    """3741 points in each cloud make fewer than 14 million pairs and are accepted; one more in each is too many."""
    def problem(n):
        cloud = np.zeros((1, n, 2))
        return Problem(cloud, cloud, np.ones((1, n)), Pose.identity(2, (1,)), np.zeros(1, dtype=np.int64))

    radius_pairs.few_enough(problem(3741), "a method")
    with pytest.raises(ValueError, match=r"^source: its 3742 points and .* too many: a method takes"):
        radius_pairs.few_enough(problem(3742), "a method")


@pytest.mark.parametrize("method", FLOWS)
def test_a_flow_that_ends_says_by_what(method):
    """A flow's last step still moves the points: it has finished, not converged, and the reason names the end time."""
    rng = np.random.default_rng(40)
    cloud, clouds = rng.standard_normal((30, 2)), []
    result: Result = register(
        cloud, Pose.from_angle(0.3).apply(cloud), method,
        callback=lambda k, state: clouds.append(state.pose.apply(cloud[None])[0]) and None,
    )  # fmt: skip
    assert result.status is Status.FINISHED
    assert result.status
    assert not result.converged
    assert result.steps == METHODS[method].options().steps
    assert result.reason == "the flow is at its end time, and it has no test of rest"
    assert np.sqrt(np.square(clouds[-1] - clouds[-2]).sum(axis=1).mean()) > 1e-4


@pytest.mark.native
def test_the_modes_of_many_ends_take_no_matrix(rng):
    """Four times as many ends take less than six times the memory, not sixteen times."""
    most = {}
    for count in (500, 2000):
        poses = Pose.from_angle(rng.standard_normal(count), rng.standard_normal((count, 2)))
        most[count] = peak(lambda p=poses: spread_of(p, centre=(0.0, 0.0), radius=1.0, apart=0.1))
    assert most[2000] < 6.0 * most[500]
