"""The chapters' claims on pose graphs: how errors spread, what a false edge does, and what a kernel can tell."""

import numpy as np

from solvers import Pose
from solvers.posegraph import Edges, marginals, optimise
from solvers.studies.race import SEEDS
from tests.solvers.posegraph.graphs import INFORMATION, chained, noisy_streets, with_wrong_loop
from widgets.figures import pose_loop

DRAWS = range(25)


def distance(poses, truth):
    """The RMS distance of the poses from the true ones, in u."""
    return float(np.sqrt(np.square(poses.t - truth.t).sum(axis=1).mean()))


def ring(n, excess):
    """A drive round a circle of 10 u in n poses; all edges have σ = 0.01 u and are exact, except the loop-closing last
    one, which is off by `excess` σ."""
    angle = np.linspace(0.0, 2.0 * np.pi, n, endpoint=False)
    truth = Pose.from_angle(angle + np.pi / 2.0, 10.0 * np.column_stack([np.cos(angle), np.sin(angle)]))
    nodes = np.arange(n)
    exact = Edges.between(truth, nodes, (nodes + 1) % n, np.diag([1e4, 1e4, 1.0 / 0.003**2]))
    shift = np.where(nodes[:, None] == n - 1, excess * 0.01 / np.sqrt(2.0), 0.0)
    return truth, Edges(exact.i, exact.j, Pose(exact.relative.R, exact.relative.t + shift), exact.information)


def test_one_gap_is_spread_over_the_whole_loop():
    """In a ring of 225 poses, only the loop edge is wrong, by 0.22 u. Before optimisation that edge carries all of χ²;
    afterwards every edge carries less than a hundredth of the sum, which has itself fallen to less than a hundredth."""
    truth, edges = ring(225, 22.0)
    result = optimise(truth, edges)
    before = optimise(truth, edges, max_steps=0).chi2
    assert before[-1] > 0.999 * before.sum()
    assert result.chi2.max() < 0.01 * result.total
    assert result.total < 0.01 * before.sum()


def left_of_the_loop(seed, heading, stiffness=1.0):
    """The share of χ² that solving leaves of the figure's four poses. heading: the factor by which the loop's error of
    heading is changed, 1, 0 or −1. stiffness: that by which σ of every turn is divided."""
    run = pose_loop.start(pose_loop.Controls(), seed).run
    loop, edges = pose_loop.LOOP, run.edges
    R = edges.relative.R.copy()
    agreeing = run.poses.R[edges.i[loop]].T @ run.poses.R[edges.j[loop]]
    R[loop] = agreeing @ np.linalg.matrix_power(agreeing.T @ R[loop], heading)
    information = edges.information * np.diag([1.0, 1.0, stiffness**2])
    changed = Edges(edges.i, edges.j, Pose(R, edges.relative.t), information)
    return optimise(run.poses, changed).total / optimise(run.poses, changed, max_steps=0).total


def test_turns_take_up_most_of_a_loops_shift(why):
    """The figure's four poses, with a loop whose error is a shift alone: solving leaves less than a fifth of χ² in each
    of 25 draws, but a quarter if the σ of turns is a hundredth as large."""
    free, stiff = (np.array([left_of_the_loop(seed, 0, k) for seed in SEEDS]) for k in (1.0, 100.0))
    why(
        "whether poses may turn",
        {name: f"{100 * s.min():.0f} to {100 * s.max():.0f} % is left" for name, s in (("yes", free), ("no", stiff))},
    )
    assert len(SEEDS) == 25
    assert free.max() < 0.2
    assert (np.abs(stiff - 0.25) < 1e-3).all()


def test_the_figures_loop_needs_the_same_turns_for_both_its_errors(why):
    """The figure's four poses: of χ² solving leaves less than a tenth, but more than a third if the loop's error of
    heading, 10°, has the other sign."""
    same, other = (left_of_the_loop(40, heading) for heading in (1, -1))
    why(
        "the sign of the loop's error of heading",
        {"as it is": f"{100 * same:.0f} % is left", "the other": f"{100 * other:.0f} % is left"},
    )
    assert same < 0.1
    assert other > 1.0 / 3.0


def test_loops_shorten_the_way_that_errors_add_up_over():
    """A walk over 60 crossings with 31 loops, in ten draws: along the walk alone the poses are more than 0.2 u off
    (RMS), and the loops more than halve that in every draw."""
    for seed in range(10):
        truth, start, edges, _ = noisy_streets(seed)
        before, after = distance(start, truth), distance(optimise(start, edges).poses, truth)
        assert before > 0.2
        assert after < 0.5 * before


def test_a_false_loop_bends_the_map(why):
    """The same walk in 25 draws: one false loop edge, which places a crossing on another 3 u away, puts the poses more
    than four times as far off, in every draw."""
    ratio = []
    for seed in DRAWS:
        truth, start, edges, loops = noisy_streets(seed)
        wrong, _ = with_wrong_loop(edges, loops, 3, 40, Pose.identity())
        ratio.append((distance(optimise(start, edges).poses, truth), distance(optimise(start, wrong).poses, truth)))
    without, bent = np.array(ratio).T
    why(
        "the false edge",
        {"there": f"{np.median(bent):.2f} u off in the median", "not there": f"{np.median(without):.2f} u"},
    )
    assert (bent > 4.0 * without).all()


def test_a_kernel_lets_go_of_false_loops(why):
    """Ten false loops beside 31 right ones, in ten draws: with Cauchy and with dynamic covariance scaling on the loops,
    the poses are less than 1.5 times as far off as without the false loops, in every draw; with Huber, or without a
    kernel, in none."""
    counts = dict.fromkeys(("none", "huber", "cauchy", "dcs"), 0)
    rng = np.random.default_rng(1)
    for seed in range(10):
        truth, start, edges, loops = noisy_streets(seed)
        right = distance(optimise(start, edges).poses, truth)
        wrong, among = edges, loops
        while len(wrong) < len(edges) + 10:
            i, j = sorted(rng.integers(0, 60, 2).tolist())
            if j - i > 5 and np.linalg.norm(truth.t[i] - truth.t[j]) > 1.5:
                wrong, among = with_wrong_loop(wrong, among, i, j, Pose.identity())
        for kernel in counts:
            counts[kernel] += distance(optimise(start, wrong, kernel=kernel, robust=among).poses, truth) < 1.5 * right
    why("the kernel", {name: f"{count} of 10 draws near" for name, count in counts.items()})
    assert counts["dcs"] == counts["cauchy"] == 10
    assert counts["none"] == counts["huber"] == 0


def test_of_a_single_loop_a_kernel_cannot_tell_whether_it_is_right():
    """A ring of 225 poses with a single loop, started from odometry: dynamic covariance scaling believes a loop edge
    that is 30 σ wrong in full, and leaves one that is 50 σ wrong less than a thousandth of its information."""
    for excess, least, most in ((30.0, 0.999, 1.0), (50.0, 0.0, 0.001)):
        truth, edges = ring(225, excess)
        loops = np.arange(225) == 224
        start = chained(edges.relative[:224], truth[0])
        weight = optimise(start, edges, kernel="dcs", robust=loops, max_steps=300).weights[-1]
        assert least <= weight <= most


def test_closing_the_loop_says_more_of_where_the_far_side_is():
    """Closing the loop cuts the halfway pose's standard deviations across and along to less than 0.8 of what they were,
    and that of its heading to less than half."""
    truth, edges = ring(40, 0.0)
    chain, closed = (np.sqrt(np.diagonal(marginals(truth, subset, [20])[0])) for subset in (edges[:39], edges))
    assert (closed[:2] < 0.8 * chain[:2]).all()
    assert closed[2] < 0.5 * chain[2]


def test_information_says_who_gives_way(why):
    """If turns on the spot do not add up to a full circle, a surer edge takes less of the excess."""
    took = {}
    for factor in (1.0, 9.0):
        turns = Pose.from_angle(np.full(4, (2.0 * np.pi + 0.4) / 4.0), np.zeros((4, 2)))
        information = np.array([factor * INFORMATION, INFORMATION, INFORMATION, INFORMATION])
        nodes = np.arange(4)
        result = optimise(chained(turns[:3], Pose.identity()), Edges(nodes, (nodes + 1) % 4, turns, information))
        took[factor] = float(np.degrees((2.0 * np.pi + 0.4) / 4.0 - result.poses.angle[1]))
    why("how sure the first edge is", {f"{f:.0f} times": f"it takes {d:.2f}° of 22.9°" for f, d in took.items()})
    assert abs(took[1.0] - np.degrees(0.1)) < 1e-6
    assert abs(took[9.0] - np.degrees(0.4) / 28.0) < 1e-6
