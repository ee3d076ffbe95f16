"""The figure of the soft family: shares that add up, circles of radius σ, what may rise, controls that take effect."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from functools import partial
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from solvers.methods.soft.shares import filterreg_shares
from tests.widgets.states import frame_after, state_after
from widgets.drawing.picture import Group, Label, Path, Points
from widgets.engine.contract import SEED, Action
from widgets.figures.soft_family.figure import ANCHOR, METHODS, STEPS, VIEW, WIDGET, act, draw, motion
from widgets.figures.soft_family.links import links, threads

STEP, FINISH = Action("press", "step"), Action("press", "finish")
Why = Callable[[str, Mapping[str, str]], None]
WIDTHS = ["held", "estimated", "scheduled"]


run = partial(state_after, WIDGET)


def frame(log: list[Any] | None = None, name: str = "default", **controls: Any) -> dict[str, Any]:
    return frame_after(WIDGET, *(log or []), name=name, **controls)


@pytest.mark.parametrize("method", ["cpd-rigid", "cpd-similarity", "filterreg"])
@pytest.mark.parametrize("sigma", [0.04, 0.5, 2.0])
def test_shares_and_clutter_add_up_to_one(method: str, sigma: float) -> None:
    """The shares of every observation, over the other cloud's components and the clutter, add up to one."""
    state = run(STEP, method=method, sigma=sigma, width="held")
    result = links(method, state.run.now)
    observations = result.shares if method == "filterreg" else result.shares.T
    np.testing.assert_allclose(observations.sum(axis=1) + result.clutter, 1.0, atol=1e-9)
    assert result.side == ("target" if method == "filterreg" else "source")


def test_filterregs_shares_are_what_its_exact_sums_say() -> None:
    """The rows of the figure's matrix sum to the solver's weights, and their weighted means are its targets."""
    state = run(STEP, STEP, method="filterreg").run.now
    P = filterreg_shares(state)
    np.testing.assert_allclose(P.sum(axis=1), state.weights[0], rtol=1e-10)
    np.testing.assert_allclose(P @ state.problem.target[0] / P.sum(axis=1)[:, None], state.targets[0], atol=1e-9)


@pytest.mark.parametrize("method", ["cpd-rigid", "filterreg"])
def test_a_smaller_sigma_hardens_the_assignment_and_moves_nothing(method: str) -> None:
    """With σ set by hand, a smaller σ leaves the pose and reduces a point's effective partners, down to one."""
    states = [run(method=method, width="held", sigma=s) for s in (2.0, 1.0, 0.5, 0.2, 0.04)]
    partners = [links(method, s.run.now).partners for s in states]
    assert all(a > b for a, b in pairwise(partners))
    assert partners[-1] < 1.1
    assert len({s.run.pose.t.tobytes() for s in states}) == 1


def test_without_clutter_the_hardest_assignment_is_the_nearest_point() -> None:
    """With σ → 0 and w = 0, each fixed point is assigned wholly to its nearest moving point, however far away."""
    state = run(width="held", sigma=0.04, clutter=0.0)
    P = links("cpd-rigid", state.run.now).shares
    moved = state.run.pose.apply(state.run.scene.source)
    distances = np.linalg.norm(moved[:, None] - state.run.scene.target, axis=2)
    np.testing.assert_array_equal(P.argmax(axis=0), distances.argmin(axis=0))
    assert P.max(axis=0).min() > 0.9


def test_with_clutter_the_hardest_assignment_lets_go() -> None:
    """With σ → 0 and w > 0, a point without a component within a few σ goes to the clutter."""
    state = run(width="held", sigma=0.04)
    result = links("cpd-rigid", state.run.now)
    moved = state.run.pose.apply(state.run.scene.source)
    distances = np.linalg.norm(moved[:, None] - state.run.scene.target, axis=2).min(axis=0)
    assert (result.clutter[distances > 0.25] > 0.99).all()
    assert (distances > 0.25).sum() > 10


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("width", WIDTHS)
def test_what_is_promised_is_kept(method: str, width: str) -> None:
    """From a near and a far start, the objective never rises where the figure promises that it cannot."""
    for turn, sigma, seed in ((-40.0, 1.1, SEED), (150.0, 0.4, SEED + 13)):
        state = run(FINISH, method=method, width=width, turn=turn, sigma=sigma, seed=seed)
        if state.run.rule.promise != "none":
            assert not state.run.rises
        assert state.run.done


def rises(method: str, **controls: Any) -> int:
    """The number of steps, over a whole run, at which the negative log-likelihood rises."""
    return len(run(FINISH, method=method, **controls).run.rises)


def test_a_schedule_makes_the_likelihood_fall(why: Why) -> None:
    """With σ on a schedule, the negative log-likelihood of CPD and FilterReg rises at some steps, marked by diamonds.
    With σ estimated it rises at none."""
    methods, widths = ("cpd-rigid", "filterreg"), ("scheduled", "estimated")
    counts = [" · ".join(str(rises(method, width=width)) for method in methods) for width in widths]
    why(
        "how σ is chosen (steps at which the curve rises, CPD · FilterReg)",
        {"on a schedule": counts[0], "estimated": counts[1]},
    )
    assert counts[1] == "0 · 0"
    for method in ("cpd-rigid", "filterreg"):
        picture = frame([["press", "finish"]], method=method, width="scheduled")
        values = {r["name"]: r["value"] for r in picture["readouts"]}
        assert values["promise"] == "at any step"
        assert int(values["rises"].split()[0]) > 0
        assert "diamond outlier" in picture["panels"][1]["svg"]


def test_an_approximate_filter_loses_the_promise(why: Why) -> None:
    """With σ estimated and the lattice in place of exact sums, the negative log-likelihood rises at some step."""
    lattice, exact = (rises("filterreg", filter=sums) for sums in ("lattice", "exact"))
    why("the sums", {"on the lattice": f"the curve rises at {lattice} steps", "exact": f"at {exact}"})
    assert lattice > 0
    assert exact == 0


def test_estimated_sigma_need_not_fall(why: Why) -> None:
    """From a first σ of 0.3 u the estimate grows first; from the figure's default it does not."""
    course, usual = run(FINISH, sigma=0.3).run.course, run(FINISH).run.course
    why(
        "the first σ",
        {
            "0.3 u": f"{course[1].sigma:.2f} u after a step",
            f"{usual[0].sigma:.2g} u": f"{usual[1].sigma:.2f} u after a step",
        },
    )
    assert usual[1].sigma < usual[0].sigma
    assert course[1].sigma > course[0].sigma
    assert course[-1].sigma < course[0].sigma


def test_similarity_collapses_where_the_rigid_form_keeps_its_size(why: Why) -> None:
    """From a turn of 60° with a wide σ the similarity shrinks below 0.3 of its size; the rigid form, lost as well,
    stays at 1."""
    shrunk = run(FINISH, name="similarity").run.course[-1]
    rigid = run(FINISH, name="similarity", method="cpd-rigid").run.course[-1]
    why("the scale", {"free": f"{shrunk.scale:.2f} of its size", "fixed": f"{rigid.scale:.2f}"})
    assert shrunk.scale < 0.3
    assert rigid.scale == 1.0
    assert rigid.rotation > 60.0
    assert "scaled by 0." in frame([["press", "finish"]], name="similarity")["description"]


def test_clutter_needs_a_clutter_term() -> None:
    """With many clutter points, the pose is far off without w and near with it."""
    bad, good = (run(FINISH, clutter=w, junk=10.0).run.course[-1] for w in (0.0, 0.1))
    assert bad.rotation > 5.0 * good.rotation
    assert good.rotation < 5.0


def test_the_two_conventions_differ() -> None:
    """With V = 64 u² and 34 fixed points, 1/N is the denser clutter and takes more."""
    area, count = (frame(density=d)["readouts"] for d in ("area", "count"))
    by_area, by_count = (
        next(float(r["value"]) for r in readouts if r["name"] == "clutter") for readouts in (area, count)
    )
    assert by_count > by_area


def test_threads_have_six_weights_each_half_of_the_next() -> None:
    """A thread's weight is the power of two of its share, and no share below 1/64 is drawn."""
    state = run(sigma=0.6)
    result = links("cpd-rigid", state.run.now)
    moved = state.run.pose.apply(state.run.scene.source)
    lines = threads(moved, state.run.scene.target, result)
    shares = result.shares[result.shares >= 1 / 64]
    weights = np.round(6 * np.asarray(lines.weight))
    assert len(weights) == len(shares)
    assert {*weights} == {1.0, 2.0, 3.0, 4.0, 5.0, 6.0}
    np.testing.assert_array_equal(weights, np.minimum(np.floor(np.log2(shares)) + 7, 6))


@pytest.mark.parametrize("sigma", [0.3, 1.1, 2.0])
def test_wide_overlaps_do_not_hide_the_clouds(sigma: float) -> None:
    """The shares of the threads at a point add up to one at most; for small σ each equals its overlap."""
    state = run(method="gmmreg", sigma=sigma)
    result = links("gmmreg", state.run.now)
    lines = threads(state.run.pose.apply(state.run.scene.source), state.run.scene.target, result)
    strong = np.unique(np.asarray(lines.a)[np.asarray(lines.weight) > 5.5 / 6], axis=0, return_counts=True)[1]
    assert strong.max(initial=0) <= 2  # each more than a half


def test_a_run_that_cannot_begin_says_why() -> None:
    """Before any step the buttons are disabled, and the note gives the reason."""
    controls = {"method": "filterreg", "width": "scheduled", "filter": "lattice", "sigma": 0.04, "clutter": 0.9}
    picture = frame(**controls, turn=-180.0, offset=0.0, noise=0.0, junk=4.0)
    assert "step" in picture["disabled"]
    assert picture["note"].startswith("Stopped at step 0: ")


@pytest.mark.parametrize("sigma", [0.3, 1.0])
def test_circles_are_sigma_wide(sigma: float) -> None:
    """Their radius in the drawing is σ times the panel's scale, with one circle per component."""
    state = run(width="held", sigma=sigma)
    svg = frame(width="held", sigma=sigma)["panels"][0]["svg"]
    (path,) = re.findall(r'<path class="shape ring source[^"]*" d="([^"]*)"', svg)
    radii = {int(r) for r in re.findall(r"a(\d+) ", path)}
    assert radii == {round(10 * sigma * VIEW.scale)}
    assert path.count("M") == len(state.run.scene.source)


def test_the_chart_window_stays_while_its_meaning_changes() -> None:
    """Likelihood and MMD² share a window, each with its own ticks."""
    assert "MMD²" in frame(method="gmmreg")["panels"][1]["svg"]
    assert "log likelihood" in frame()["panels"][1]["svg"]


def test_what_plays_no_part_is_said() -> None:
    """GMMReg has no clutter, FilterReg no w of zero, CPD no filter: the note says so if one is set."""
    assert "no clutter term" in frame(method="gmmreg")["note"]
    assert "10⁻⁶" in frame(method="filterreg", clutter=0.0)["note"]
    assert "10⁻⁶" in frame([["press", "step"]], method="filterreg", clutter=0.0)["description"]
    assert "10⁻⁶" not in frame([["press", "step"]], method="filterreg", clutter=0.1)["description"]
    assert "not used" in frame(filter="grid")["note"]


def test_back_is_a_prefix_and_a_drag_begins_anew() -> None:
    """A drag puts the source elsewhere, unscaled, with no step taken."""
    state = run(STEP, STEP, Action("drag", "source", 1.0, 0.5), name="similarity")
    assert state.run.steps == 0
    assert float(state.run.pose.scale) == 1.0
    np.testing.assert_allclose(state.run.pose.apply(ANCHOR[None])[0], [1.0, 0.5])


def test_a_change_of_scale_is_no_motion() -> None:
    """A step of the similarity is shown at once; a rigid step is animated."""
    a = run(name="similarity")
    assert motion(a, act(a, STEP)) is None
    b = run()
    assert motion(b, act(b, STEP)) is not None


@settings(max_examples=40, deadline=None)
@given(
    st.sampled_from(list(METHODS)),
    st.sampled_from(WIDTHS),
    st.sampled_from(["exact", "grid", "lattice"]),
    st.floats(0.04, 2.0),
    st.floats(0.0, 0.9),
    st.floats(0.0, 10.0),
    st.tuples(st.floats(-50, 50), st.floats(-50, 50)),
)
def test_hostile_settings_draw(
    method: str, width: str, kind: str, sigma: float, w: float, junk: float, to: tuple[float, float]
) -> None:
    """With any setting and start, a run to the end gives finite text, a status, and no more steps than allowed."""
    log = [["drag", "source", *to], ["press", "step"], ["press", "finish"]]
    picture = frame(log, method=method, width=width, filter=kind, sigma=sigma, clutter=w, junk=junk, noise=0.0)
    assert not re.search(r"nan|inf", "".join(r["value"] for r in picture["readouts"]) + picture["note"])
    assert picture["disabled"] == ["finish", "step"]
    (stop,) = (r["value"] for r in picture["readouts"] if r["name"] == "stop")
    assert int(stop.split()[1]) <= STEPS


def test_the_objective_s_axis_goes_as_high_as_the_objective() -> None:
    """With all sliders at their minimum and the source far off, the objective begins at 17 nats and no line is clipped
    at the window's edge. Without noise and junk it ends below two. The usual run keeps its axis from 2.5 to 4.5."""
    least = {"sigma": 0.04, "clutter": 0.0, "turn": -180.0, "offset": 0.0, "noise": 0.0, "junk": 0.0}
    picture = frame([["drag", "source", 3.5, 2.0], ["press", "step"]], "filterreg", **least)
    panel = picture["panels"][1]["svg"]
    usual = re.findall(r">(\d\.\d)</text>", frame()["panels"][1]["svg"])
    assert usual == ["2.5", "3.0", "3.5", "4.0", "4.5"]
    assert ">15.0</text>" in panel
    clean = frame([["press", "finish"]], noise=0.0, junk=0.0)["panels"][1]["svg"]
    assert min(float(tick) for tick in re.findall(r">(\d\.\d)</text>", clean)) <= 2.0


@pytest.mark.parametrize("method", ["cpd-rigid", "filterreg", "gmmreg"])
def test_the_charts_show_each_step_s_objective_and_sigma(method: str) -> None:
    """In nats by its ticks, an MMD² by powers of ten; a step after which the objective is larger is a diamond; the line
    of the truth is at the same σ."""
    state = run(*[STEP] * 6, method=method)
    fit = state.run
    chart, sigma = (panel for panel in draw(state).panels[1:])
    ticks = {
        float(mark.text.replace("−", "-")): float(np.ravel(mark.xy)[1])
        for mark in chart.marks
        if isinstance(mark, Label) and mark.anchor == "end" and mark.dx == -6
    }
    at, *_, last = ticks
    scale = np.log10 if method == "gmmreg" else float

    def height(value: float) -> float:
        share = (scale(value) - scale(at)) / (scale(last) - scale(at))
        return float(ticks[at] + share * (ticks[last] - ticks[at]))

    dots = np.concatenate([np.reshape(m.xy, (-1, 2)) for m in chart.marks if isinstance(m, Points)])
    dots = dots[np.argsort(dots[:, 0])]
    np.testing.assert_allclose(dots[:, 1], [height(entry.objective) for entry in fit.course], atol=0.02)
    np.testing.assert_allclose(np.diff(dots[:, 0]), 1 / 8)
    raised = [np.reshape(m.xy, (-1, 2)) for m in chart.marks if isinstance(m, Points) and m.shape == "diamond"]
    assert len(raised[0]) == len(fit.rises)
    (truth,) = (np.asarray(m.xy) for m in chart.marks if isinstance(m, Path) and m.role == "truth")
    np.testing.assert_allclose(truth[:, 1], [height(entry.truth) for entry in fit.course], atol=0.02)
    (widths,) = (np.asarray(m.xy) for m in sigma.marks if isinstance(m, Points))
    np.testing.assert_allclose(10.0 ** widths[:, 1], [entry.sigma for entry in fit.course])


@pytest.mark.parametrize(("method", "side"), [("cpd-rigid", "target"), ("filterreg", "source")])
def test_a_cross_is_as_strong_as_the_share_that_clutter_takes(method: str, side: str) -> None:
    """On each observation: the points that are not the mixture's components."""
    state = run(STEP, method=method, junk=6.0)
    fit, found = state.run, links(state.run.rule.method, state.run.now)
    marks = draw(state).panels[0].marks
    everything = [*marks, *(part for mark in marks if isinstance(mark, Group) for part in mark.marks)]
    (crosses,) = (m for m in everything if isinstance(m, Points) and m.shape == "cross")
    cloud = fit.pose.apply(fit.scene.source) if side == "source" else fit.scene.target
    np.testing.assert_allclose(crosses.xy, cloud)
    shares = found.shares.sum(axis=1 if side == "source" else 0)
    np.testing.assert_allclose(np.asarray(crosses.weight), 1.0 - shares, atol=1e-9)
    text = {readout.name: readout.value for readout in draw(state).readouts}
    assert float(text["clutter"]) == pytest.approx(100 * (1.0 - shares).mean(), abs=0.051)


@pytest.mark.parametrize(
    ("controls", "note"),
    [
        ({"method": "gmmreg", "width": "scheduled"}, "have no effect."),
        ({"method": "gmmreg", "width": "estimated"}, "have no effect. Its σ follows a schedule."),
        ({"method": "cpd-rigid", "filter": "grid"}, "CPD sums exactly: the filter is not used."),
        ({"method": "cpd-rigid", "filter": "exact"}, ""),
        ({"method": "filterreg", "filter": "grid"}, ""),
    ],
)
def test_a_control_without_effect_is_named_and_only_that(controls: dict[str, Any], note: str) -> None:
    shown = draw(run(**controls)).note
    assert shown.endswith(note)
    assert bool(shown) == bool(note)


def test_only_a_single_step_is_a_motion() -> None:
    before = run(STEP)
    assert motion(before, act(before, STEP)) is not None
    assert motion(before, act(before, FINISH)) is None
    assert motion(before, before) is None


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("width", WIDTHS)
def test_what_never_rises_does_not_change_its_sigma_s_function_either(method: str, width: str) -> None:
    """Where σ changes GMMReg's function, the figure says so: that objective is another one, and may be larger."""
    fit = run(FINISH, method=method, width=width, turn=40.0).run
    values, sigmas = [entry.objective for entry in fit.course], {round(entry.sigma, 9) for entry in fit.course}
    if fit.rule.promise == "never rises":
        assert (np.diff(values) <= 1e-9 * np.abs(values[:-1]) + 1e-12).all()
        assert method != "gmmreg" or len(sigmas) == 1
    if fit.rule.promise == "within a stage":
        assert len(sigmas) > 1


@pytest.mark.parametrize("method", ["cpd-rigid", "filterreg", "gmmreg"])
def test_a_run_rests_only_once_its_schedule_has_ended(method: str) -> None:
    """Even from the truth, where no step moves anything."""
    fit = run(FINISH, method=method, width="scheduled", turn=0.0, offset=0.0, noise=0.0, junk=0.0).run
    assert fit.course[-1].sigma == pytest.approx(fit.rule.last) or "cap of" in fit.stop
    assert fit.steps > 2


def test_gmmregs_objective_is_an_mmd_squared_without_a_unit() -> None:
    """Of both clouds with a Gaussian kernel √2 σ wide: it lies between 0 and 2 at every σ."""
    fit = run(STEP, STEP, method="gmmreg").run

    def mean(a: Any, b: Any) -> float:
        return float(np.exp(-np.square(a[:, None] - b).sum(axis=2) / (4.0 * fit.sigma**2)).mean())

    x, y = fit.pose.apply(fit.scene.source), fit.scene.target
    assert fit.course[-1].objective == pytest.approx(mean(x, x) - 2.0 * mean(x, y) + mean(y, y))


@pytest.mark.parametrize("method", ["cpd-rigid", "filterreg"])
def test_effective_partners_are_the_exponential_of_the_entropy(method: str) -> None:
    """Of each observation's shares, the clutter's among them, on average; GMMReg has no shares."""
    state = run(STEP, method=method).run
    found = links(method, state.now)
    shares = found.shares if found.side == "target" else found.shares.T
    counts = []
    for row in shares:
        whole = [*row[row > 0.0], *([1.0 - row.sum()] if row.sum() < 1.0 else [])]
        counts.append(np.exp(-sum(p * np.log(p) for p in whole if p > 0.0)))
    assert found.partners == pytest.approx(np.mean(counts))
    names = {r.name: r.value for r in draw(run(method="gmmreg")).readouts}
    assert names["partners"] == names["clutter"] == "–"
