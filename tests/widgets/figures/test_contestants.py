"""The figure of the nine contestants: every link follows from the contestant's own state."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import pytest

from solvers.methods.soft import annealed
from solvers.methods.soft.belief_propagation import marginal_matrix
from solvers.studies.race import CONTESTANTS, Contestant
from widgets.drawing.picture import Arrow, Ellipses, Path, Points, Segments
from widgets.drawing.svg import mark_svg
from widgets.engine.contract import SEED, Action, preset
from widgets.engine.host import Host
from widgets.figures.contestants.figure import CAPTIONS, SEARCH, VIEW, WIDGET, State, act, linked, start
from widgets.figures.contestants.links import LINKS
from widgets.parts.room import problem


def state(*drags: tuple[float, float], seed: int = SEED, **controls: Any) -> State:
    result = start(preset(WIDGET, "default", controls).controls, seed)
    for x, y in drags:
        result = act(result, Action("drag", "source", x, y))
    return result


def frame(log: list[Any] | None = None, **controls: Any) -> dict[str, Any]:
    return Host().render("f", {**preset(WIDGET, "default", controls).plain(), "log": log or []})


def test_there_are_nine_and_all_are_drawn() -> None:
    """One panel, readout and caption for each contestant of the race, in the race's order."""
    names = [c.method for c in CONTESTANTS]
    assert set(LINKS) == set(names) == set(CAPTIONS)
    picture = frame()
    assert [p["name"] for p in picture["panels"]] == names
    assert [r["label"] for r in picture["readouts"]] == [c.label for c in CONTESTANTS]


@pytest.mark.parametrize("point", [1.0, 5.0, 17.0, 27.0, 28.0])
def test_icps_link_is_the_nearest_point(point: float) -> None:
    """Its length is the distance to the nearest target point; beyond the gate, the readout says there is none."""
    case = state(point=point)
    x = case.pose.apply(case.scene.source)[round(point) - 1]
    distance = np.linalg.norm(case.scene.target - x, axis=1).min()
    result = linked(case)["icp"]
    (line,) = result.marks
    assert isinstance(line, Segments)
    assert np.linalg.norm(np.subtract(line.a, line.b)) == pytest.approx(distance)
    assert (result.value == "none within the gate") == (distance > 2.6) == (point == 27.0)


def test_a_walls_residual_is_no_longer_than_the_pairs() -> None:
    """The point is never farther from the wall's line than from the nearest point on the wall."""
    for point in range(1, 27):
        result = linked(state(point=float(point)))
        if result["icp"].value[0].isdigit() and result["point-to-plane"].value[0].isdigit():
            assert float(result["point-to-plane"].value) <= float(result["icp"].value) + 0.011


@pytest.mark.parametrize("method", ["soft-annealed", "association-bp", "hypothesis-mixture"])
def test_soft_targets_lie_among_their_threads(method: str) -> None:
    """The diamond is a mean of target points, so it lies inside their bounding box."""
    case = state()
    marks = linked(case)[method].marks
    (diamond,) = (m for m in marks if isinstance(m, Points))
    assert diamond.shape == "diamond"
    low, high = case.scene.target.min(axis=0), case.scene.target.max(axis=0)
    assert (low <= diamond.xy).all()
    assert (diamond.xy <= high).all()


def test_ransac_ignores_the_pose() -> None:
    """Wherever the source is placed, the motion found by RANSAC takes the point to the same place."""

    def goal(case: State) -> Any:
        return case.known[SEARCH].pose[0].apply(case.scene.source)

    np.testing.assert_array_equal(goal(state()), goal(state((2.0, 1.0), turn=90.0)))
    assert linked(state())[SEARCH].value == linked(state((2.0, 1.0)))[SEARCH].value


def test_mmd_links_nothing() -> None:
    """No mark of its panel starts at the point: only waves, which stay where they are."""
    a, b = (frame([["drag", "source", x, 0.3]]) for x in (-1.0, 1.0))
    waves = [re.findall(r'class="line guide[^>]*>', f["panels"][6]["svg"]) for f in (a, b)]
    assert waves[0] == waves[1]
    assert len(waves[0]) == 2


def test_every_control_changes_the_links() -> None:
    before = [p["svg"] for p in frame()["panels"]]
    for change in ({"point": 12.0}, {"turn": 60.0}, {"offset": 2.0}):
        after = [p["svg"] for p in frame(**change)["panels"]]
        assert sum(a != b for a, b in zip(before, after, strict=True)) == len(before)


@pytest.mark.parametrize("contestant", CONTESTANTS, ids=lambda c: c.method)
def test_what_is_kept_changes_no_answer(contestant: Contestant) -> None:
    """Caching changes nothing: each contestant links the moved point exactly as one that begins there does."""
    if contestant.method == SEARCH:
        return
    case = state((2.0, 1.0), turn=30.0)
    fresh = contestant.begin(problem(case.scene, case.pose)).state()
    of = LINKS[contestant.method](fresh, round(case.controls.point) - 1, VIEW)
    cached = linked(case)[contestant.method]
    assert (cached.value, cached.unit) == (of.value, of.unit)
    assert [mark_svg(mark, VIEW, "f") for mark in cached.marks] == [mark_svg(mark, VIEW, "f") for mark in of.marks]


def ends(mark: Segments) -> tuple[np.ndarray, np.ndarray]:
    return np.reshape(mark.a, (-1, 2)), np.reshape(mark.b, (-1, 2))


def of_kind(case: State, method: str, kind: type) -> list[Any]:
    return [mark for mark in linked(case)[method].marks if isinstance(mark, kind)]


@pytest.mark.parametrize("point", [1.0, 5.0, 12.0, 19.0])
def test_planes_link_is_the_foot_on_the_wall_through_the_nearest_point(point: float) -> None:
    """The wall's line and the residual are square to each other and meet there; the readout is the residual."""
    case = state(point=point)
    x = case.pose.apply(case.scene.source)[round(point) - 1]
    q = case.scene.target[np.linalg.norm(case.scene.target - x, axis=1).argmin()]
    wall, whole, residual = of_kind(case, "point-to-plane", Segments)
    (a, b), (_, foot) = (np.reshape(np.stack(ends(mark)), (2, 2)) for mark in (wall, residual))
    np.testing.assert_allclose((a + b) / 2, q, atol=1e-12)
    np.testing.assert_allclose(np.stack(ends(whole)).reshape(2, 2), [x, q], atol=1e-12)
    assert (b - a) @ (foot - x) == pytest.approx(0.0, abs=1e-9)
    along = (b - a) / np.linalg.norm(b - a)
    np.testing.assert_allclose(foot, q + along * ((foot - q) @ along), atol=1e-9)
    result = linked(case)["point-to-plane"]
    assert (result.value, result.unit) == (f"{np.linalg.norm(foot - x):.2f}", "u across")


@pytest.mark.parametrize("turn", [-25.0, 60.0])
def test_gicps_distance_is_in_standard_deviations_of_both_ellipses(turn: float) -> None:
    """The source's covariance is turned with it; the number is Mahalanobis's under the sum of the two."""
    case = state(turn=turn)
    x = case.pose.apply(case.scene.source)[4]
    q = case.scene.target[np.linalg.norm(case.scene.target - x, axis=1).argmin()]
    own, other = of_kind(case, "gicp", Ellipses)
    np.testing.assert_allclose(np.reshape([own.centre, other.centre], (2, 2)), [x, q], atol=1e-12)
    total = np.reshape(own.covariance, (2, 2)) + np.reshape(other.covariance, (2, 2))
    result = linked(case)["gicp"]
    assert result.unit == "deviations"
    assert float(result.value) == pytest.approx(np.sqrt((x - q) @ np.linalg.solve(total, x - q)), abs=5.1e-3)


def test_ransacs_motion_lays_its_pair_on_the_target_s() -> None:
    """The pair is drawn where the source lies, as long as its congruent one; the arrow leads to the motion's place, and
    the readout counts the points that then lie within reach of a target point."""
    case = state((1.0, 0.5), turn=40.0)
    known = case.known[SEARCH]
    own, other = (np.asarray(mark.xy) for mark in of_kind(case, SEARCH, Path))
    pose = known.pose[0]
    in_source = case.pose.inverse().apply(own)
    assert np.linalg.norm(in_source[:, None] - case.scene.source, axis=2).min(axis=1).max() < 1e-9
    assert np.linalg.norm(other[:, None] - case.scene.target, axis=2).min(axis=1).max() < 1e-9
    assert np.linalg.norm(own[1] - own[0]) == pytest.approx(np.linalg.norm(other[1] - other[0]), abs=0.6)
    np.testing.assert_allclose(pose.apply(in_source).mean(axis=0), other.mean(axis=0), atol=0.3)
    (arrow,) = of_kind(case, SEARCH, Arrow)
    np.testing.assert_allclose(arrow.a, case.pose.apply(case.scene.source)[4])
    np.testing.assert_allclose(arrow.b, pose.apply(case.scene.source)[4])
    assert linked(case)[SEARCH].value == f"{int(known.count[0])} of {len(case.scene.source)}"


def test_ndts_cells_are_those_that_hold_the_point() -> None:
    """At most one for each grid, each with a line from the point to the Gaussian's mean, the stronger the more it
    scores."""
    case = state()
    x = case.pose.apply(case.scene.source)[4]
    (ellipses,), (lines,) = of_kind(case, "ndt", Ellipses), of_kind(case, "ndt", Segments)
    a, b = ends(lines)
    np.testing.assert_allclose(a, np.broadcast_to(x, a.shape))
    np.testing.assert_allclose(b, ellipses.centre)
    off = b - x
    scores = np.exp(-0.5 * np.einsum("ki,kij,kj->k", off, np.linalg.inv(np.asarray(ellipses.covariance)), off))
    np.testing.assert_allclose(np.asarray(lines.weight), scores, rtol=0.05)
    value, count = linked(case)["ndt"].value.split(" of ")
    assert int(value) == len(b) <= int(count) == 4


@pytest.mark.parametrize("method", ["soft-annealed", "association-bp", "hypothesis-mixture"])
def test_a_thread_is_a_level_stronger_if_its_weight_is_twice_as_large(method: str) -> None:
    """From above 1/64; the diamond is the weighted mean, and what is left over is the unlinked share."""
    case = state()
    contestant = next(c for c in CONTESTANTS if c.method == method)
    fresh = contestant.begin(problem(case.scene, case.pose)).state()
    weights = {"soft-annealed": annealed.weights, "association-bp": marginal_matrix}.get(method)
    if weights is None:
        partners = fresh.assignments[0, :, 4]
        row = np.array([(partners == j).mean() for j in range(len(case.scene.target))])
    else:
        row = weights(fresh)[4]
    (lines,), (diamond,) = of_kind(case, method, Segments), of_kind(case, method, Points)
    _, b = ends(lines)
    np.testing.assert_allclose(b, case.scene.target[row > 1 / 64])
    levels = np.array([sum(w >= 2.0**-k for k in range(1, 7)) / 6.0 for w in row[row > 1 / 64]])
    np.testing.assert_allclose(np.asarray(lines.weight), levels)
    assert linked(case)[method].value == f"{100 * (1 - row.sum()):.0f}"
    np.testing.assert_allclose(np.reshape(diamond.xy, 2), row @ case.scene.target / row.sum(), atol=1e-6)


def test_mmds_troughs_lie_half_way_between_its_crests() -> None:
    case = state()
    crests, troughs = of_kind(case, "mmd", Segments)
    (a, b), (c, d) = ends(crests), ends(troughs)
    middles, between = (a + b) / 2, (c + d) / 2
    wave = middles[1] - middles[0]
    np.testing.assert_allclose(np.diff(middles, axis=0), np.broadcast_to(wave, (len(middles) - 1, 2)), atol=1e-9)
    np.testing.assert_allclose(between - middles, np.broadcast_to(wave / 2, middles.shape), atol=1e-9)
    fresh = next(c for c in CONTESTANTS if c.method == "mmd").begin(problem(case.scene, case.pose)).state()
    waves = fresh.frequencies[0] / fresh.length[0]
    assert 2 * np.pi / np.linalg.norm(wave) == pytest.approx(np.linalg.norm(waves, axis=1).max())
    np.testing.assert_allclose((b - a) @ wave, 0.0, atol=1e-9)
    assert (np.linalg.norm(middles, axis=1) < np.hypot(VIEW.x1, VIEW.y1)).all()
    assert any(np.linalg.norm(middle) < 1e-12 for middle in middles)
