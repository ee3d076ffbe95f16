"""The race's figure and benchmark: the solvers' own runs, stable panels, one start for all, the solvers' table."""

from __future__ import annotations

import json
import re
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from solvers.core.stepper import advance
from solvers.studies.benchmark import benchmark
from solvers.studies.race import CONTESTANTS, EXTRAS, SEEDS, Contestant, contestants, race_problem
from solvers.studies.race import Controls as Race
from widgets.drawing.picture import Label, Path, Points, Segments
from widgets.drawing.svg import panel_svg
from widgets.engine.contract import Action, preset
from widgets.engine.host import Host
from widgets.engine.jobs import Result, outcome, plain
from widgets.figures.race.benchmark import BENCHMARK, parts, result, work
from widgets.figures.race.field import ENTRIES, field
from widgets.figures.race.figure import WIDGET, Controls, State, act, draw, start
from widgets.figures.race.panels import CHART, HEIGHT, LINE, apart, course, picked

STEP, FINISH = Action("press", "step"), Action("press", "finish")


def after(steps: int, state: State) -> State:
    for _ in range(steps):
        state = act(state, STEP)
    return state


def test_a_reader_s_rest_begins_the_contestants_three_at_a_time(monkeypatch: pytest.MonkeyPatch) -> None:
    """The picture is the same at all levels; the first step begins the other contestants, to the same poses."""
    methods = list[str]()
    begin = Contestant.begin

    def count(self: Contestant, *arguments: Any) -> Any:
        methods.append(self.method)
        return begin(self, *arguments)

    def pose(state: State) -> list[Any]:
        return [run.pose.matrix.tolist() for run in state.runs]

    plain = act(start(Controls(), 40), STEP)
    monkeypatch.setattr(Contestant, "begin", count)
    state = start(Controls(), 40)
    pictures = list[Any]()
    for level in range(WIDGET.details):
        picture = draw(state, level)
        pictures.append([[panel_svg(panel, "f") for panel in picture.panels], picture.readouts, picture.description])
        assert methods == [c.method for c in CONTESTANTS[: 3 * level]]
        assert WIDGET.known(state) == level
        assert pictures[level] == pictures[0]
    assert pose(act(state, STEP)) == pose(plain)
    assert len(methods) == 9
    assert WIDGET.known(act(state, STEP)) == WIDGET.details - 1


@pytest.mark.parametrize("seed", [40, 53])
def test_every_run_is_the_solver_s_own(seed: int) -> None:
    """After twelve steps each contestant is where `solvers.stepper` takes it from the same clouds and start."""
    state = after(12, start(Controls(), seed))
    problem, _ = race_problem(Race(noise=0.11, outliers=0.2), [seed])
    for run, contestant in zip(state.runs, CONTESTANTS, strict=True):
        batch = contestant.begin(problem)
        for _ in range(12):
            batch = advance(batch)
        assert run.entry.contestant is contestant
        np.testing.assert_array_equal(run.pose.matrix, batch.pose().matrix[0])
        assert run.steps == batch.steps[0]
        assert int(run.status) == int(batch.state().status[0])


def test_a_finished_contestant_s_panel_is_the_same_object() -> None:
    """A stopped contestant is not drawn again while the others go on; stepping a finished race changes nothing."""
    state = after(11, start(Controls(), 40))
    second = act(state, STEP)
    assert any(run.done for run in state.runs)
    assert not all(run.done for run in state.runs)
    for a, b in zip(state.runs, second.runs, strict=True):
        assert (a.panel is b.panel) == a.done
    end = act(second, FINISH)
    result = act(end, STEP)
    assert end.done
    assert all(a.panel is b.panel for a, b in zip(end.runs, result.runs, strict=True))
    assert result.steps == end.steps


def test_to_the_end_is_all_its_steps() -> None:
    """The button takes as many steps as pressing Step until nothing moves, and the frames are byte-identical."""
    end = act(start(Controls(), 40), FINISH)
    plain = preset(WIDGET).plain()
    single = Host().render("f", {**plain, "log": [["press", "finish"]]})
    many = Host().render("f", {**plain, "log": [["press", "step"]] * end.steps})
    assert single == many
    assert {"step", "finish"} <= set(single["disabled"])
    assert max(run.steps for run in end.runs) == end.steps <= 70


def test_one_start_for_all() -> None:
    """Dragging the start moves all nine there, with no step taken; its handles are in all nine panels."""
    state = act(after(5, start(Controls(), 40)), Action("drag", "source", -1.0, 0.5))
    assert state.steps == 0
    for run in state.runs:
        np.testing.assert_allclose(run.pose.t, (-1.0, 0.5))
        assert run.batch is None
    for handle in draw(state).handles:
        assert {handle.panel, *handle.also} == {run.seat for run in state.runs}


def test_ransac_alone_ignores_the_start() -> None:
    """From another start its first step leads to the same pose; no other contestant's does."""
    near, far = (after(1, start(Controls(turn=turn), 40)) for turn in (45.0, -100.0))
    names = [a.method for a, b in zip(near.runs, far.runs, strict=True) if np.allclose(a.pose.matrix, b.pose.matrix)]
    assert names == ["ransac-congruent"]


def test_captions_say_what_a_panel_is_not() -> None:
    """RANSAC ignores the start, soft targets are not CPD, hypotheses are not PMBM, BP is not a tracker; each caption
    also gives the errors and status."""
    state = act(start(Controls(), 40), FINISH)
    captions = {panel.name: panel.caption.split("\n") for panel in draw(state).panels if panel.caption}
    assert len(captions) == 9
    for run in state.runs:
        name, errors, status, note = captions[run.seat]
        assert name == run.entry.contestant.label
        assert errors == f"{run.rotation[-1]:.1f}° · {run.translation[-1]:.2f} u"
        assert status == f"{run.status.label} after {run.steps} steps"
        assert note == run.entry.note
    assert "ignores the start" in captions["ransac-congruent"][3]
    assert "not CPD" in captions["soft-annealed"][3]
    assert "not PMBM" in captions["ninth"][3]
    assert "not a tracker" in captions["association-bp"][3]


def test_lines_differ_without_colour() -> None:
    """No two of any nine that run together share both colour family and dash, and each is named in the chart."""
    for ninth in ("hypothesis-mixture", *(c.method for c in EXTRAS)):
        entries = field(ninth)
        assert len({(e.role, e.dashed, e.dotted) for e in entries}) == 9
        assert len({e.short for e in entries}) == 9
    assert set(ENTRIES) == {c.method for c in (*CONTESTANTS, *EXTRAS)}


@pytest.mark.parametrize("extra", EXTRAS, ids=[c.method for c in EXTRAS])
def test_an_extra_takes_the_last_panel(extra: Any) -> None:
    """It races with its own options, and the other eight are unchanged."""
    usual, variant = (after(3, start(Controls(ninth=name), 40)) for name in ("hypothesis-mixture", extra.method))
    assert [run.method for run in variant.runs] == [*(c.method for c in CONTESTANTS[:8]), extra.method]
    for a, b in zip(usual.runs[:8], variant.runs[:8], strict=True):
        np.testing.assert_array_equal(a.pose.matrix, b.pose.matrix)
    batch = extra.begin(race_problem(Race(noise=0.11, outliers=0.2), [40])[0])
    for _ in range(3):
        batch = advance(batch)
    np.testing.assert_array_equal(variant.runs[8].pose.matrix, batch.pose().matrix[0])


@pytest.mark.parametrize(
    ("name", "value"),
    [("setting", "clean"), ("turn", 90.0), ("offset", 0.5), ("noise", 0.02), ("outliers", 50.0), ("overlap", 60.0),
     ("density", 2.0), ("ninth", "gmmreg")],
)  # fmt: skip
def test_every_control_changes_the_race(name: str, value: Any) -> None:
    """With other clouds, another start or another contestant, the panels and description after three steps differ."""
    presses = [["press", "step"]] * 3
    usual = Host().render("f", {**preset(WIDGET).plain(), "log": presses})
    variant = Host().render("f", {**preset(WIDGET, "default", {name: value}).plain(), "log": presses})
    assert variant["panels"] != usual["panels"]
    assert variant["description"] != usual["description"]


# The chart


@settings(deadline=None, max_examples=50)
@given(st.lists(st.floats(-50, 400), min_size=9, max_size=9))
def test_names_keep_apart_and_in_order(heights: list[float]) -> None:
    """Names are at least one line apart, within the chart's window, and in the order of their lines."""
    spread = apart(heights)
    places = sorted(spread)
    assert min(b - a for a, b in pairwise(places)) >= LINE - 1e-9
    assert places[0] >= CHART.pad[1] - 1e-9
    assert places[-1] <= HEIGHT - CHART.pad[3] + 1e-9
    for i in range(9):
        for j in range(9):
            if heights[i] < heights[j] - 1e-3:
                assert spread[i] < spread[j]


def test_a_click_follows_the_nearest_line_or_name() -> None:
    """A click on a line, or on its name, follows that contestant and fades the others; a second click releases it."""
    state = act(start(Controls(), 40), FINISH)
    for run in state.runs:
        line = course(run)
        assert picked(state.runs, *line[-1]) == run.method
    names = {
        m[2]: (int(m[0]) / 10, int(m[1]) / 10)
        for m in re.findall(r'<text class="label by-[a-z]+ start" x="(\d+)" y="(\d+)">([^<]*)', chart_svg(state))
    }
    assert len(names) == 9
    for run in state.runs:
        x, y = names[run.entry.short]
        world = CHART.x0 + (x - CHART.pad[0]) / CHART.scale
        high = CHART.y1 - (y - 4 - CHART.pad[1]) / (HEIGHT - CHART.pad[1] - CHART.pad[3]) * (CHART.y1 - CHART.y0)
        click = Action("click", "errors", world, high)
        result = act(state, click)
        assert result.followed == run.method
        assert chart_svg(result).count(" w2") >= 8
        assert act(result, click).followed == ""


def chart_svg(state: State) -> str:
    from widgets.drawing.svg import panel_svg

    return panel_svg(draw(state).panels[-1], "f")


def test_the_chart_is_each_run_s_error_after_each_step() -> None:
    """By powers of ten, with a dot where a run has stopped and a dashed line at the limit; each name has its line."""
    state = after(20, start(Controls(), 40))
    marks = draw(state).panels[-1].marks
    lines = [m for m in marks if isinstance(m, Path) and m.role != "guide"]
    dots = [np.reshape(m.xy, 2) for m in marks if isinstance(m, Points)]
    assert len(lines) == 9
    for run, line in zip(state.runs, lines, strict=True):
        xy = np.asarray(line.xy)
        np.testing.assert_array_equal(xy[:, 0], np.arange(run.steps + 1))
        np.testing.assert_allclose(10.0 ** xy[:, 1], np.clip(run.rotation, 0.01, 180.0))
        assert (line.role, line.dashed, line.dotted) == (run.entry.role, run.entry.dashed, run.entry.dotted)
        (name,) = (m for m in marks if isinstance(m, Label) and m.text == run.entry.short)
        assert name.role == run.entry.role
    ends = [course(run)[-1] for run in state.runs if run.done]
    assert ends
    np.testing.assert_allclose(dots, ends)
    (limit,) = (m for m in marks if isinstance(m, Segments) and m.role == "truth")
    np.testing.assert_allclose(10.0 ** np.stack([limit.a, limit.b])[:, 1], 5.0)


def test_a_stopped_run_is_framed_by_whether_it_is_right() -> None:
    """Solid and "right" within both limits of the truth, else dashed and "wrong"; the readouts and the note count."""
    state = after(20, start(Controls(), 40))
    rotation, close = sorted(run.rotation[-1] for run in state.runs), 0
    for run, panel in zip(state.runs, draw(state).panels, strict=False):
        is_right = run.rotation[-1] < 5.0 and run.translation[-1] < 0.2
        close += is_right
        frames = [m for m in panel.marks if isinstance(m, Path) and m.closed]
        words = [m.text for m in panel.marks if isinstance(m, Label)]
        assert (len(frames), words) == ((1, ["right" if is_right else "wrong"]) if run.done else (0, []))
        assert all(m.dashed != is_right and m.role == ("truth" if is_right else "outlier") for m in frames)
        (cloud,) = (m for m in panel.marks if isinstance(m, Points) and m.role == "source")
        np.testing.assert_allclose(cloud.xy, run.pose.apply(state.scene.source))
    text = {readout.name: readout.value for readout in draw(state).readouts}
    assert text["steps"] == str(max(run.steps for run in state.runs)) == "20"
    assert text["turned"] == str(sum(turn < 5.0 for turn in rotation))
    assert text["close"] == str(close)
    assert (text["median"], text["largest"]) == (f"{np.median(rotation):.1f}", f"{rotation[-1]:.1f}")
    assert text["running"] == str(sum(not run.done for run in state.runs))
    assert draw(state).note == ""
    end = act(state, FINISH)
    assert f"All have stopped, {sum(run.close for run in end.runs)} of 9 within" in draw(end).note


# Hostile readers


ACTION = st.one_of(
    st.just(["press", "step"]),
    st.just(["press", "finish"]),
    st.tuples(st.just("drag"), st.sampled_from(["source", "turn"]), st.floats(-1e5, 1e5), st.floats(-1e5, 1e5)).map(
        list
    ),
    st.tuples(st.just("click"), st.just("errors"), st.floats(-1e5, 1e5), st.floats(-1e5, 1e5)).map(list),
)


@settings(deadline=None, max_examples=12)
@given(
    st.lists(ACTION, max_size=4),
    st.fixed_dictionaries(
        {
            "outliers": st.sampled_from([0.0, 60.0]),
            "overlap": st.sampled_from([30.0, 100.0]),
            "density": st.sampled_from([0.5, 2.0]),
            "noise": st.sampled_from([0.0, 0.3]),
            "ninth": st.sampled_from([c.method for c in EXTRAS]),
        }
    ),
)
def test_whatever_is_done_is_drawn(log: list[Any], controls: dict[str, Any]) -> None:
    """Any settings and actions give a frame without NaN and with numbers in every caption."""
    frame = Host().render("f", {**preset(WIDGET, "default", controls).plain(), "log": log})
    text = json.dumps(frame)
    assert not re.search(r"\bnan\b|\binf\b|NaN|Infinity", text)
    assert all(re.search(r"\d° · \d", panel["caption"]) for panel in frame["panels"][:9])


# The benchmark


def run_of(controls: Controls) -> dict[str, Any]:
    """The outcomes, the last contestant's first, as a second worker brings them."""
    return {part: outcome(BENCHMARK, controls, 40, part) for part in reversed(parts(controls))}


@pytest.fixture(scope="module")
def run() -> dict[str, Any]:
    return run_of(Controls())


def test_the_table_is_the_solvers_benchmark(run: dict[str, Any]) -> None:
    """Contestant by contestant, the same medians and counts as `solvers.benchmark` at the same settings."""
    expected = benchmark(Race(noise=0.11, outliers=0.2))
    for row, line in zip(result(Controls(), run).rows, expected, strict=True):
        assert row.label == line.contestant.label
        assert row.values[:5] == (line.median_rre, line.median_rte, line.turned, line.close, line.median_steps)
        assert row.values[5] is not None
        assert row.values[5] > 0


def test_the_benchmark_tells_how_far_it_is() -> None:
    """The fraction done of each contestant grows from zero to one."""
    for part in ("icp", "hypothesis-mixture"):
        fractions = [progress.fraction for progress in work(Controls(), 40, part)]
        assert fractions == sorted(fractions)
        assert fractions[0] == 0
        assert fractions[-1] == 1
        assert len(fractions) > 10


def test_outcomes_come_in_any_order_and_cross_to_the_page_unchanged(run: dict[str, Any]) -> None:
    """Any outcomes make a table with their rows in the contestants' order; by way of JavaScript, which writes 29.0 as
    29, they make the very same result."""

    def made(outcomes: dict[str, Any]) -> Result:
        return result(Controls(), outcomes)

    names = parts(Controls())
    some = {part: run[part] for part in ("ndt", "icp", "mmd")}
    assert [row.name for row in made(some).rows] == [name for name in names if name in some]
    assert [row.name for row in made(run).rows] == list(names)

    def crossed(text: str) -> float:
        return int(float(text)) if float(text).is_integer() else float(text)

    back = json.loads(json.dumps(run), parse_float=crossed)
    assert str(back["icp"]["values"]) != str(run["icp"]["values"])
    assert plain(made(run), "f") == plain(made(back), "f")


def test_every_seed_is_a_dot(run: dict[str, Any]) -> None:
    """Each strip has 25 dots, and a bar at the median."""
    for panel in result(Controls(), run).panels:
        svg = panel_svg(panel, "f")
        strips = re.findall(r'class="dot s by-[a-z]+ w4" d="([^"]*)"', svg)
        assert [d.count("h1") for d in strips] == [len(SEEDS)] * 9
        assert svg.count('class="line ink thick"') == 9


@pytest.mark.native
@pytest.mark.parametrize("ninth", ["hypothesis-mixture", "kiss-threshold-icp"])
def test_the_python_that_is_offered_finds_the_same(ninth: str, capsys: pytest.CaptureFixture[str]) -> None:
    """The script runs with the solvers alone and prints the table's numbers."""
    controls = Controls(setting="clean", noise=0.02, outliers=0.0, turn=20.0, ninth=ninth)
    table = result(controls, run_of(controls))
    exec(compile(table.python, "snippet", "exec"), {})
    output = capsys.readouterr().out.splitlines()[1:10]
    for row, line in zip(table.rows, output, strict=True):
        assert line.startswith(row.label)
        assert f"{row.values[0]:.2f}°" in line
        assert contestants([row.name])[0].label == row.label


def test_nothing_runs_before_the_first_step() -> None:
    """The readout of running contestants shows a dash before the first step and nine after it."""
    state = start(Controls(), 40)
    running = [
        next(readout.value for readout in draw(s).readouts if readout.name == "running")
        for s in (state, after(1, state))
    ]
    assert running == ["–", "9"]
