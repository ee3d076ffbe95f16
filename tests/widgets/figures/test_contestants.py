"""The figure of the nine contestants: every link follows from the contestant's own state."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import pytest

from solvers.studies.race import CONTESTANTS, Contestant
from widgets.drawing.picture import Points, Segments
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
