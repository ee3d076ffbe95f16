"""Replay: the same record gives the same frame, whatever the host did before."""

from __future__ import annotations

import gc
import inspect
import json
import re
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from widgets.drawing.picture import Group, Mark, Panel, Picture, Points, View
from widgets.drawing.svg import mark_svg, panel_svg
from widgets.engine.contract import Widget, preset
from widgets.engine.host import Host, _rounded, _view
from widgets.engine.registry import WIDGETS
from widgets.figures import ladder_map, ndt_score, three_residuals, two_poses
from widgets.figures.kabsch import WIDGET
from widgets.figures.landscape import figure as landscape

PLAIN = preset(WIDGET, "noisy").plain()
SOLVE = ["press", "solve"]


def record(*log: list[Any], **controls: Any) -> dict[str, Any]:
    return {**PLAIN, "controls": {**PLAIN["controls"], **controls}, "log": list(log)}


def fresh(plain: dict[str, Any]) -> str:
    """The frame from a fresh host."""
    return Host().frame(json.dumps({"figure": "fig-solve", "record": plain}))


ACTION = st.one_of(
    st.just(SOLVE),
    st.tuples(st.just("drag"), st.sampled_from(["source", "turn"]), st.floats(-6, 6), st.floats(-4, 4)).map(list),
)
STEP = st.tuples(st.sampled_from(["append", "replace", "back", "reset", "noise", "reseed"]), ACTION, st.floats(0, 0.6))


@settings(max_examples=40, deadline=None)
@given(st.lists(STEP, min_size=1, max_size=10))
def test_a_host_with_a_past_draws_what_a_fresh_one_draws(steps: list[tuple[str, list[Any], float]]) -> None:
    """Byte for byte, after every append, replaced drag, step back, reset, control change and new draw."""
    host, log, noise, seed = Host(), [], 0.12, 40
    for kind, action, value in steps:
        if kind == "append":
            log = [*log, action]
        elif kind == "replace":
            log = [*log[:-1], action]
        elif kind == "back":
            log = log[:-1]
        elif kind == "reset":
            log = []
        elif kind == "noise":
            noise = value
        else:
            seed += 13
        plain = {**record(*log, noise=noise), "seed": seed}
        assert host.frame(json.dumps({"figure": "fig-solve", "record": plain})) == fresh(plain)


def _counting() -> tuple[Host, list[str]]:
    """A host over the Kabsch widget, and the list in which it notes every start and act."""
    calls: list[str] = []

    def start(controls: Any, seed: int) -> Any:
        calls.append("start")
        return WIDGET.start(controls, seed)

    def act(state: Any, action: Any) -> Any:
        calls.append("act")
        return WIDGET.act(state, action)

    return Host({"kabsch": replace(WIDGET, start=start, act=act)}), calls


def test_one_action_costs_one_act() -> None:
    """An appended action, a replaced drag and a step back replay nothing whose state is cached."""
    host, calls = _counting()
    host.render("f", record(SOLVE, ["drag", "source", 0, 0]))
    assert calls == ["start", "act", "act"]
    for log, cost in (
        ([SOLVE, ["drag", "source", 0, 1]], ["act"]),
        ([SOLVE, ["drag", "source", 0, 1], SOLVE], ["act"]),
        ([SOLVE, ["drag", "source", 0, 1]], []),
        ([], []),
        ([SOLVE], ["act"]),
    ):
        calls.clear()
        host.render("f", record(*log))
        assert calls == cost


def test_figures_do_not_share_their_past() -> None:
    """Two figures of the same widget on a page replay independently, and their ids differ."""
    host, calls = _counting()
    first, second = host.render("fig-a", record(SOLVE)), host.render("fig-b", record())
    assert calls.count("start") == 2
    assert host.render("fig-a", record(SOLVE)) == first
    assert 'id="fig-b-main-source"' in second["panels"][0]["svg"]
    assert "fig-a" not in json.dumps(second)


def test_a_panel_that_is_handed_on_is_drawn_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """While a scan is dragged, the room beside it is not rendered again; a new room is."""
    names: list[str] = []

    def count(panel: Panel, *rest: Any) -> str:
        names.append(panel.name)
        return panel_svg(panel, *rest)

    monkeypatch.setattr("widgets.engine.host.panel_svg", count)
    plain, host = preset(two_poses.WIDGET).plain(), Host()
    host.render("f", plain)
    for x in (1.0, 2.0):
        host.render("f", {**plain, "log": [["drag", "source", x, 0.0]]})
    assert names == ["world", "robot", "robot", "robot"]
    variant = {**plain, "seed": 53}
    assert host.render("f", variant) == Host().render("f", variant)


def test_a_mark_that_panels_share_is_drawn_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """Three panels share a view and a cloud, one of them inside a group: the cloud is rendered once, and not again for
    the next picture."""
    marks: list[Mark] = []

    def count(mark: Mark, view: View, prefix: str) -> str:
        marks.append(mark)
        return mark_svg(mark, view, prefix)

    monkeypatch.setattr("widgets.engine.host.mark_svg", count)
    view, cloud = View(0, 1, 0, 1), Points([[0.5, 0.5]], "target")

    def draw(state: int) -> Picture:
        own = [Points([[0.1 * state, 0.1 * k]], "source") for k in range(3)]
        group = Group("source", (cloud, own[2]))
        parts: tuple[tuple[Mark, ...], ...] = ((cloud, own[0]), (cloud, own[1]), (group,))
        return Picture(tuple(Panel(f"p{k}", "", view, parts[k]) for k in range(3)), (), "")

    widget = replace(
        WIDGET,
        start=lambda controls, seed: 0,
        act=lambda state, action: state + 1,
        draw=draw,
        motion=lambda before, after: None,
        python=lambda state: "",
    )
    host = Host({"kabsch": widget})
    first = host.render("f", PLAIN)
    assert [type(mark) for mark in marks] == [Points] * 4
    assert marks[0] is cloud
    assert all('class="dot m target" d="M3200 3200h1"' in panel["svg"] for panel in first["panels"])
    assert 'id="f-p2-source"' in first["panels"][2]["svg"]
    marks.clear()
    second = host.render("f", record(SOLVE))
    assert cloud not in marks
    assert second["panels"] == Host({"kabsch": widget}).render("f", record(SOLVE))["panels"]


def test_a_failure_leaves_no_half_replayed_log() -> None:
    """After an action raises, the next record is replayed from scratch and drawn correctly."""

    def act(state: Any, action: Any) -> Any:
        if action.x == 3.0:
            raise RuntimeError("broken")
        return WIDGET.act(state, action)

    host, plain = Host({"kabsch": replace(WIDGET, act=act)}), record(SOLVE, ["drag", "source", 1, 1])
    host.render("fig-solve", plain)
    with pytest.raises(RuntimeError, match="broken"):
        host.render("fig-solve", record(["drag", "source", 3, 1]))
    assert host.frame(json.dumps({"figure": "fig-solve", "record": plain})) == fresh(plain)


def test_an_unknown_widget_is_named() -> None:
    with pytest.raises(ValueError, match="no widget 'kabsh'; did you mean 'kabsch'"):
        Host().render("f", {**PLAIN, "widget": "kabsh"})


def test_the_frame_is_plain_and_its_numbers_are_short() -> None:
    """Places have four decimals, percentages three, and no zero is negative: nothing differs between processors."""
    text = fresh(record(["drag", "source", -0.0, 0.0], ["drag", "turn", 1, 0]))
    frame = json.loads(text)
    assert "-0.0," not in text
    assert "NaN" not in text
    for handle in frame["handles"]:
        for point in (handle["world"], *handle["keys"].values()):
            assert all(v == round(v, 4) for v in point)
        assert all(v == round(v, 3) for v in (handle["left"], handle["top"]))


def test_a_handle_says_as_a_slider_where_it_is() -> None:
    """A turning one its angle, of a full turn in degrees; a moving one its x, of its panel's window."""
    frame = Host().render("f", PLAIN)
    handles = {handle["kind"]: handle for handle in frame["handles"]}
    left, right, *_ = frame["panels"][0]["view"]
    assert handles["turn"]["slider"] == [-180.0, 180.0, float(handles["turn"]["value"].replace("−", "-").rstrip("°"))]
    assert handles["move"]["slider"] == [left, right, round(handles["move"]["world"][0], 2)]


def test_ties_and_zero_are_rounded_one_way() -> None:
    """Values that two processors compute on either side of a tie, or of zero, give the same number."""
    assert str(_rounded(-2e-5, 4)) == "0.0"
    assert [str(_rounded(v, 4)) for v in (-1e-12, 0.00005 - 1e-14, 0.00005 + 1e-14)] == ["0.0", "0.0001", "0.0001"]


def test_a_view_tells_window_size_and_padding() -> None:
    """In the order in which the page unpacks it."""
    panel = Panel("p", "A chart", View(0, 1, -2, 3, width=100, height=50, pad=(4, 5, 6, 7)), ())
    assert _view(panel) == [0, 1, -2, 3, 100, 50, 4, 5, 6, 7]


def places(frame: dict[str, Any], panel: int = 0) -> np.ndarray[Any, Any]:
    """The source points as drawn, in SVG units."""
    d = re.findall(r'-source" class="group">.*?class="dot [ms] source" d="([^"]*)"', frame["panels"][panel]["svg"])[0]
    moves = np.array([[int(v) for v in point] for point in re.findall(r"[Mm](-?\d+) ?(-?\d+)", d)])
    moves[1:, 0] += 1  # each dot is one unit long
    return moves.cumsum(axis=0)


@pytest.mark.parametrize("name", ["noisy", "outliers"])
def test_motion_leads_from_the_old_drawing_to_the_new(name: str) -> None:
    """The points of the old drawing, turned by SVG's rotate(turn, about) and shifted, are those of the new."""
    plain = preset(WIDGET, name).plain()
    before, after = (Host().render("f", {**plain, "log": log}) for log in ([], [SOLVE]))
    (motion,) = after["motions"]
    assert abs(motion["turn"]) > 5
    assert all(abs(v) > 50 for v in motion["shift"])
    c, s = np.cos(np.radians(motion["turn"])), np.sin(np.radians(motion["turn"]))
    moved = (places(before) - motion["about"]) @ np.array([[c, -s], [s, c]]).T + motion["about"] + motion["shift"]
    np.testing.assert_allclose(moved, places(after), atol=3)


@pytest.mark.parametrize(("widget", "press"), [(ladder_map.WIDGET, "roll"), (three_residuals.WIDGET, "step")])
def test_every_panel_has_its_own_motion(widget: Widget, press: str) -> None:
    """Each motion leads from the old drawing of its panel to the new, and they differ between panels."""
    plain = preset(widget).plain()
    before, after = (Host().render("f", {**plain, "log": log}) for log in ([], [["press", press]]))
    moved = {motion["group"]: motion for motion in after["motions"]}
    names = {panel["name"] for panel in before["panels"] if f'id="f-{panel["name"]}-source"' in panel["svg"]}
    assert set(moved) == {f"f-{name}-source" for name in names}
    assert len({motion["turn"] for motion in moved.values()}) > 2
    for k, panel in enumerate(before["panels"]):
        if panel["name"] in names:
            motion = moved[f"f-{panel['name']}-source"]
            c, s = np.cos(np.radians(motion["turn"])), np.sin(np.radians(motion["turn"]))
            points = (places(before, k) - motion["about"]) @ np.array([[c, -s], [s, c]]).T
            np.testing.assert_allclose(points + motion["about"] + motion["shift"], places(after, k), atol=3)


def test_a_coarse_drawing_has_no_motion_yet() -> None:
    """The final poses are not known at the coarsest level; the next finer drawing has all eight motions."""
    host, plain = Host(), {**preset(ladder_map.WIDGET).plain(), "log": [["press", "roll"]]}
    assert [len(host.render("f", plain, level)["motions"]) for level in range(3)] == [0, 8, 8]


def test_descents_are_traced_where_they_have_just_begun_and_are_known() -> None:
    """All 49 descents need a finer map than the first; those that were already drawn are not in the group."""
    host, plain = Host(), preset(landscape.WIDGET).plain()
    click = ["click", "map", 1.0, 1.0]
    last = landscape.BANDS
    traces = {
        level: host.render("f", {**plain, "log": [click, ["press", "sow"]]}, level)["motions"] for level in (0, last)
    }
    assert traces == {0: [], last: [{"group": "f-map-descents", "trace": True}]}
    svg = host.render("f", {**plain, "log": [click, ["press", "sow"]]}, last)["panels"][0]["svg"]
    before, _, group = svg.partition('<g id="f-map-descents"')
    begins = {re.search(r"M[\d ]+", line)[0] for line in re.findall(r'class="line source" d="[^"]*"', group)}  # type: ignore[index]
    assert len(begins) >= landscape.SIDE**2
    assert before.count('class="line source"') == 1
    for log in ([click, ["press", "clear"]], [["press", "sow"], ["press", "sow"]], [["press", "resample"]]):
        assert host.render("f", {**plain, "log": log}, last)["motions"] == []


def test_motion_is_given_for_the_last_action_only() -> None:
    """A solve moves the points, also when the same record is drawn again; a drag after it has no motion."""
    host = Host()
    assert host.render("f", record())["motions"] == []
    (motion,) = host.render("f", record(SOLVE))["motions"]
    assert motion["group"] == "f-main-source"
    assert host.render("f", record(SOLVE))["motions"] == [motion]
    assert host.render("f", record(SOLVE, ["drag", "source", 1, 1]))["motions"] == []


SCORE = preset(ndt_score.WIDGET).plain()
FINEST = ndt_score.WIDGET.details - 1


@settings(max_examples=12, deadline=None)
@given(
    st.lists(
        st.tuples(
            st.sampled_from([0.0, 20.0]), st.sampled_from([0.1, 0.9]), st.sampled_from([*range(FINEST + 1), None])
        ),
        min_size=1,
        max_size=6,
    )
)
def test_record_and_detail_determine_the_frame(asked: list[tuple[float, float, int | None]]) -> None:
    """However coarse or fine the host has drawn before, a frame is at least as fine as requested and, byte for byte,
    what a fresh host draws at the level that the frame states."""
    host = Host()
    for rotation, x, detail in asked:
        controls = {**SCORE["controls"], "rotation": rotation}
        plain = {**SCORE, "controls": controls, "log": [["click", "map", x, 0.5]]}
        frame = host.render("f", plain, detail)
        assert frame["detail"] >= (FINEST if detail is None else detail)
        assert frame == Host().render("f", plain, frame["detail"])


def test_what_is_known_finely_is_not_drawn_coarsely_again() -> None:
    """After the finest drawing, a new climb on the same field comes at the finest level; a new field starts coarse."""
    host = Host()
    host.render("f", SCORE)
    assert host.render("f", {**SCORE, "log": [["click", "map", 0.3, 0.3]]}, 0)["detail"] == FINEST
    assert host.render("f", {**SCORE, "seed": 53}, 0)["detail"] == 0


def test_levels_differ_and_the_finest_is_the_default() -> None:
    """Each level draws the field finer than the one before; without a level, the finest is drawn."""
    host = Host()
    frames = [host.render("f", SCORE, level) for level in range(FINEST + 1)]
    assert len({frame["panels"][0]["svg"] for frame in frames}) == FINEST + 1
    assert Host().render("f", SCORE) == frames[-1]
    assert json.loads(Host().frame(json.dumps({"figure": "f", "record": SCORE, "detail": 1}))) == frames[1]


def test_every_figure_with_levels_draws_the_finest_by_itself() -> None:
    """`draw` without a level is what the build draws and the page ends with."""
    widgets = [widget for widget in WIDGETS.values() if widget.details > 1]
    levels = [list(inspect.signature(widget.draw).parameters.values())[1] for widget in widgets]
    assert [level.default for level in levels] == [widget.details - 1 for widget in widgets]


@pytest.mark.parametrize("detail", [-1, FINEST + 1, 0.0, "0", True])
def test_a_level_that_is_not_there_is_refused(detail: Any) -> None:
    with pytest.raises(ValueError, match=r"detail: .* is not a whole number from 0 to 4"):
        Host().render("f", SCORE, detail)


@pytest.mark.parametrize("name", WIDGETS)
def test_a_frame_leaves_nothing_to_the_cycle_collector(name: str) -> None:
    """Garbage cycles would make a page's memory grow, since the collector counts objects rather than bytes."""
    gc.freeze()  # objects from before this host need not be examined
    widget, host = WIDGETS[name], Host()
    kinds = [["drag", h] for h in widget.handles] + [["click", c] for c in widget.clicks]
    plains = [{**preset(widget).plain(), "log": [[*kinds[0], x, 1.0]] if kinds else []} for x in (0.5, 1.0, 1.5)]
    detail = 0 if widget.details > 1 else None
    try:
        host.render("f", plains[0], detail)
        gc.collect()
        gc.set_debug(gc.DEBUG_SAVEALL)
        for plain in plains[1:]:
            host.render("f", plain, detail)
        gc.collect()
        left = [obj for obj in gc.garbage if type(obj).__module__.partition(".")[0] in ("widgets", "solvers", "numpy")]
    finally:
        gc.set_debug(0)
        gc.garbage.clear()
        gc.unfreeze()
    assert left == []


def test_a_figure_without_levels_has_one() -> None:
    assert Host().render("fig-solve", record(), 0)["detail"] == 0
