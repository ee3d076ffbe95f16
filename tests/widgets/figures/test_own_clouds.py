"""A reader's own clouds in native Python: loaded, thinned, sliced, run by every method in any unit, and exported."""

from __future__ import annotations

import contextlib
import io
import json
import re
from typing import Any

import numpy as np
import pytest

from solvers import METHODS, Pose
from solvers.geometry.downsample import thinned
from solvers.scenes.rooms import room
from tests.widgets.test_any_sequence import check_any_frame
from widgets.drawing.picture import Group, Label, Path, Points
from widgets.engine.contract import SEED, Action, parsed, preset
from widgets.engine.host import Host
from widgets.figures.own_clouds.figure import WIDGET, draw
from widgets.figures.own_clouds.marks import objective_chart, tick
from widgets.figures.own_clouds.methods import OWN
from widgets.parts.robot import ARROW

FAR = np.array([431_200.0, 5_481_900.0])  # a corner of a national grid


def text(points: np.ndarray) -> bytes:
    return "\n".join(",".join(repr(float(v)) for v in row) for row in points).encode()


def give(host: Host, name: str, data: bytes) -> dict[str, str]:
    return json.loads(host.give(json.dumps({"widget": "own-clouds", "name": name}), data))  # type: ignore[no-any-return]


def record(source: str = "", target: str = "", log: tuple[str, ...] = (), **controls: Any) -> dict[str, Any]:
    plain = preset(WIDGET, "default", {"clouds": "own", **controls}).plain()
    given = {side: key for side, key in (("source", source), ("target", target)) if key}
    return {**plain, "log": [["press", name] for name in log], "given": given}


def readouts(frame: dict[str, Any]) -> dict[str, str]:
    return {r["name"]: r["value"].replace("−", "-") for r in frame["readouts"]}


def pair(host: Host, scale: float = 1.0, corner: np.ndarray | float = 0.0) -> tuple[str, str, Pose]:
    """The keys of two files, a room and the same room turned by 8° about its middle, and the true pose."""
    scene = room("clean", seed=66)
    target = scale * scene.target + corner
    turn, middle = Pose.from_angle(np.radians(8.0)), target.mean(axis=0)
    truth = Pose(turn.R, middle - turn.R @ middle)
    source = truth.inverse().apply(scale * scene.source + corner)
    return give(host, "a.csv", text(source))["key"], give(host, "b.csv", text(target))["key"], truth


def test_every_method_that_finds_its_own_pairs_is_offered() -> None:
    assert set(OWN) == {name for name, method in METHODS.items() if not method.paired and 2 in (method.dims or (2,))}


@pytest.mark.parametrize("method", [name for name in OWN if not name.startswith("flow")])
def test_a_method_does_the_same_in_millimetres_and_on_a_national_grid(method: str) -> None:
    """In small units or at large coordinates, every method but the learned flows finds a turn of 8° to within 3° and
    explains more than 0.9 of the points."""
    host = Host()
    for scale, corner in ((0.001, 0.0), (100.0, FAR)):
        source, target, _ = pair(host, scale, corner)
        plain = record(source, target, ("ten",) * 21, **{"method": method, **OWN[method].brings()})
        frame = host.render("f", plain)
        report = json.loads(frame["files"]["pose.json"])
        assert report["status"] in ("converged", "stalled", "capped", "proved")
        assert abs(report["angle_degrees"] - 8.0) < 3.0, (scale, report["angle_degrees"])
        assert report["explained"] > 0.9


def test_the_learned_flows_run_a_step_on_few_points() -> None:
    host = Host()
    source, target, _ = pair(host)
    for method in ("flow", "flow-from-source"):
        texts = readouts(host.render("f", record(source, target, ("step",), method=method, points=100)))
        assert texts["stop"] == "running, step 1"
        assert [part.split(" of ")[1] for part in texts["points"].split(" and ")] == ["132", "160"]


def test_given_clouds_are_thinned_sliced_and_told() -> None:
    """Clouds are thinned to the requested number of points exactly as `thinned` does, and sliced by their common
    height; an empty slice says so."""
    host, random = Host(), np.random.default_rng(3)
    low, high = random.uniform([0, 0, 0], [6, 4, 1], (900, 3)), random.uniform([0, 0, 1], [6, 4, 3], (700, 3))
    report = give(host, "low.csv", text(low))
    assert report["words"] == "900 points in 3-D, text separated by commas."
    target = give(host, "high.csv", text(high))["key"]
    frame = host.render("f", record(report["key"], target, points=300))
    n, m = (len(thinned(p[:, :2], 300)) for p in (low, high))
    assert readouts(frame)["points"] == f"{n} of 900 and {m} of 700"
    assert frame["note"] == f"Thinned: source {n} of 900, target {m} of 700 points."
    inside = [int(((p[:, 2] >= 0.6) & (p[:, 2] <= 1.8)).sum()) for p in (low, high)]
    words = readouts(host.render("f", record(report["key"], target, points=1000, height=40, thickness=40)))["points"]
    counts = [int(part.split(" of ")[-1]) for part in words.split(" and ")]
    assert counts == pytest.approx(inside, abs=3)
    frame = host.render("f", record(report["key"], target, height=90, thickness=10))
    assert frame["note"] == "No source point lies in this slice. Move or thicken it."
    assert "step" in frame["disabled"]


def test_a_slice_without_points_does_not_ask_for_the_file() -> None:
    host = Host()
    solid = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 9.0], [1.0, 1.0, 9.0]])
    source = give(host, "solid.csv", text(solid))["key"]
    note = host.render("f", record(source, thickness=2.0, height=50.0))["note"]
    assert note == "No source point lies in this slice. Move or thicken it."


def test_points_are_called_faint_only_if_some_are() -> None:
    for presses, words in ((0, "; the others are faint."), (3, "0.430 u.")):
        log = [["press", "ten"]] * presses
        frame = Host().render("f", {**preset(WIDGET).plain(), "log": log})
        assert words in frame["description"], frame["description"]


def test_one_cloud_or_none_is_a_state_too() -> None:
    """A link whose files are missing asks for them, and shows its state once they are given."""
    host = Host()
    assert host.render("f", record())["note"] == "Choose or draw a source and a target first."
    second = Host()
    source, target, _ = pair(second)
    plain = record(source, target, ("ten",), method="gicp")
    assert host.render("f", plain)["note"] == "Choose or draw a source and a target first."
    assert pair(host)[:2] == (source, target)
    assert host.render("f", plain) == second.render("f", plain)
    host.forget(source)
    assert host.render("f", plain)["note"] == "Choose or draw a source first."


def test_no_value_has_no_unit() -> None:
    frame = Host().render("f", record())
    assert [(r["value"], r["unit"]) for r in frame["readouts"] if r["name"] == "explained"] == [("–", "")]


@pytest.mark.parametrize("value", [0.0, 3.02e-4, 0.002, 9.9994, 73.276, 374.879, 5210.44, 99999.6, 1.23e7])
def test_the_numbers_beside_the_chart_fit_its_padding(value: float) -> None:
    """At most six characters plus a sign, with enough digits to tell a value from one half as large again."""
    assert len(tick(value)) <= 6
    assert len(tick(-value)) <= 7
    assert tick(value) != tick(1.5 * value) or value == 0.0


def test_two_scans_of_the_drive_are_registered_by_their_numbers() -> None:
    """Started from the wheels, scan 100 ends on scan 96 where the drive's graph has it; started as it lies, elsewhere;
    a scan on itself has no error. Other clouds have no such reference."""
    host = Host()

    def end(log: tuple[str, ...] = ("ten",) * 3, **controls: Any) -> dict[str, str]:
        plain = preset(WIDGET, "drive", controls).plain()
        return readouts(host.render("f", {**plain, "log": [["press", name] for name in log]}))

    first, result, failure = end(()), end(), end(start="as")
    assert first["points"] == "329 and 336"
    assert float(first["rotation_graph"]) > 4.5
    assert float(result["translation_graph"]) < 0.02
    assert float(result["rotation_graph"]) < 0.1
    assert float(failure["translation_graph"]) > 1.5
    assert float(end((), scan=7, onto=7)["translation_graph"]) == 0.0
    assert readouts(host.render("f", preset(WIDGET).plain()))["translation_graph"] == "–"


@pytest.mark.parametrize("method", OWN)
def test_a_method_begins_on_real_scans_with_what_it_brings(method: str) -> None:
    """Scan 200 is dense: no cell or width that follows from its spacing may be too small for the room around it."""
    controls = {"scan": 200.0, "onto": 40.0, "method": method, **OWN[method].brings()}
    plain = {**preset(WIDGET, "drive", controls).plain(), "log": [["press", "step"]]}
    frame = Host().render("f", plain)
    assert "degenerate" not in readouts(frame)["stop"], frame["note"]


def test_choosing_real_scans_brings_their_start_and_their_method() -> None:
    """Settings that a link omits are those with which the chain of the drive's scans is made."""
    brought = preset(WIDGET, "default", {"clouds": "drive"}).plain()["controls"]
    assert (brought["start"], brought["method"], brought["length"]) == ("wheels", "point-to-plane", 4.0)
    assert preset(WIDGET, "default", {"clouds": "drive", "start": "as"}).plain()["controls"]["start"] == "as"


def test_what_cannot_be_read_is_refused() -> None:
    host = Host()
    with pytest.raises(ValueError, match=r"^line 2: 'x' is not a number"):
        give(host, "a.csv", b"1,2\n3,x\n")
    with pytest.raises(ValueError, match="no widget that takes anything"):
        host.give(json.dumps({"widget": "icp", "name": "a"}), b"1,2")
    for given in ("key", {"source": 3}, {"other": "0" * 32}):
        with pytest.raises(ValueError, match="given"):
            parsed(WIDGET, {**record(), "given": given})


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (b"1e100,0\n2,3\n", "a coordinate is 1e+100; expected none beyond 1e+15. Write it in a larger unit"),
        (b"0,0\n0,-2e15\n", "a coordinate is 2e+15; expected none beyond 1e+15. Write it in a larger unit"),
        (b"0,0\n0,2e-10\n", "the cloud is 2e-10 wide; expected at least 1e-09. Write it in a smaller unit"),
        (b"0,0,0\n1e-300,0,0\n", "the cloud is 1e-300 wide; expected at least 1e-09. Write it in a smaller unit"),
    ],
)
def test_a_unit_that_the_figure_cannot_show_is_refused(data: bytes, message: str) -> None:
    with pytest.raises(ValueError, match=f"^{re.escape(message)}$"):
        give(Host(), "a.csv", data)


PLACES = {
    "one point": [[0.3, 0.2]],
    "one place, far away": [[1e15, -1e15]] * 5,
    "one place but for rounding": [[5e6, 5e6], [5e6 + 2e-9, 5e6], [5e6, 5e6 - 2e-9], [5e6, 5e6]],
    "twins": [[0.0, 0.0], [1e-120, 0.0], [1.0, 0.0], [1.0, 1e-120], [0.0, 1e-120], [1e-120, 1e-120]],
    "a line": [[k / 7, k / 7] for k in range(9)],
    "the largest and the least": [[1e15, 0.0], [-1e15, 0.0], [0.0, 1e-300], [0.0, 0.0]],
    "a slice without width": [[1e-200, 0.0, 0.0], [0.0, 1e-200, 2.0], [0.0, 0.0, 1.0]],
}


@pytest.mark.parametrize("length", [0.5, 40.0])
@pytest.mark.parametrize("method", OWN)
def test_whatever_the_clouds_the_figure_draws(method: str, length: float) -> None:
    """Points, coincident points and lines, close together and far apart, at either end of the length slider: each gives
    a run and a status."""
    host = Host()
    keys = [give(host, name, text(np.array(points)))["key"] for name, points in PLACES.items()]
    for source, target in [*zip(keys, keys, strict=True), *zip(keys, [*keys[1:], keys[0]], strict=True)]:
        plain = record(source, target, ("step", "step"), method=method, length=length)
        frame = host.render("fig-x", plain)
        check_any_frame(plain, frame)
        assert readouts(frame)["stop"] != "not begun"


def test_rows_in_another_order_have_another_fingerprint() -> None:
    """This also holds when rows are swapped at any distance."""
    host, rows = Host(), [f"{k:06.3f},{2 * k:06.3f}" for k in range(130)]
    keys = {give(host, "a", "\n".join(rows).encode())["key"]}
    for k in range(1, 130):
        order = [rows[k], *rows[1:k], rows[0], *rows[k + 1 :]]
        keys.add(give(host, "a", "\n".join(order).encode())["key"])
    assert len(keys) == 130
    assert give(host, "b", "\n".join(rows).encode())["key"] not in keys


@pytest.mark.native
def test_the_script_of_drawn_clouds_stands_alone() -> None:
    """It contains its points and prints what the figure shows, whatever start the handles give."""
    host = Host()
    points = np.round(room("clean", seed=40).source, 4)
    source = give(host, "", b"x,y\n" + text(points))["key"]
    target = give(host, "", b"x,y\n" + text(points + np.array([0.5, 0.25])))["key"]
    plain = record(source, target, method="point-to-plane")
    plain["log"] = [["drag", "turn", 2.0, 0.3], ["drag", "source", 0.4, 0.1], ["press", "ten"]]
    frame = host.render("f", plain)
    assert "Path" not in frame["python"]
    out = io.StringIO()
    with contextlib.redirect_stdout(out):
        exec(compile(frame["python"], "script", "exec"), {})
    output = dict(line.split(" ", 1) for line in out.getvalue().splitlines())
    texts = readouts(frame)
    for name in ("rotation", "x", "y", "explained", "conditioning"):
        decimals = len(texts[name].partition(".")[2])
        assert float(output[name]) == pytest.approx(float(texts[name]), abs=0.51 * 10**-decimals)


def test_why_a_run_stopped_is_in_the_clouds_unit() -> None:
    """The solver's own words have the gate to six digits, in u."""
    plain = preset(WIDGET, "drive", {"scan": 192, "onto": 42}).plain()
    frame = Host().render("f", {**plain, "log": [["press", "step"]]})
    assert re.search(r"within the gate of 0\.\d{3,4} m\.", frame["note"])


def test_scans_of_the_drive_are_in_metres() -> None:
    """Their unit is known; that of other clouds is not, and is written u."""
    for name, unit in (("drive", "m"), ("default", "u")):
        frame = Host().render("f", preset(WIDGET, name).plain())
        assert re.search(rf">\d+ {unit}</text>", frame["panels"][0]["svg"])
        assert {r["unit"] for r in frame["readouts"] if r["name"] in ("x", "y", "rms")} <= {unit, ""}
        assert frame["handles"][0]["value"].endswith(f" {unit}")
        (length,) = (r["value"] for r in frame["readouts"] if r["name"] == "length")
        assert re.fullmatch(rf"gate (open|[\d.]+ {unit})", length)


STEP, TEN = Action("press", "step"), Action("press", "ten")


def state_after(*actions: Action, name: str = "default") -> Any:
    state = WIDGET.start(preset(WIDGET, name).controls, SEED, {})  # type: ignore[call-arg]
    for action in actions:
        state = WIDGET.act(state, action)
    return state


@pytest.mark.parametrize("name", ["default", "drive"])
def test_the_source_is_drawn_where_the_pose_puts_it(name: str) -> None:
    """Faint where no target point explains it; where it began stays as a shadow once a step has been taken."""
    for actions in ((), (STEP, STEP)):
        state = state_after(*actions, name=name)
        run, marks, clouds = state.run, draw(state).panels[0].marks, state.run.clouds
        (group,) = (mark for mark in marks if isinstance(mark, Group))
        (dots,) = (mark for mark in group.marks if isinstance(mark, Points))
        np.testing.assert_allclose(dots.xy, clouds.fit.put(run.pose.apply(clouds.source)))
        near = np.linalg.norm(run.pose.apply(clouds.source)[:, None] - clouds.target, axis=2).min(axis=1)
        assert not (near <= run.reach).all()
        assert ((np.asarray(dots.weight) == 1.0) == (near <= run.reach)).all()
        robots = [np.mean(m.xy, axis=0) for m in (*marks, *group.marks) if isinstance(m, Path) and m.closed]
        places = [np.zeros(2), run.pose.t] if name == "drive" else []
        outline = 0.22 * ARROW.mean(axis=0)
        for robot, at, turn in zip(robots, places, (np.eye(2), run.pose.R), strict=False):
            np.testing.assert_allclose(robot, clouds.fit.put(at[None])[0] + turn @ outline, atol=1e-9)
        assert len(robots) == len(places)
        shadows = [mark for mark in marks if isinstance(mark, Points) and mark.role == "ghost"]
        assert len(shadows) == bool(actions)
        for shadow in shadows:
            np.testing.assert_allclose(shadow.xy, clouds.fit.put(run.began.apply(clouds.source)))
        text = readouts(Host().render("f", {**preset(WIDGET, name).plain(), "log": [a.plain() for a in actions]}))
        assert float(text["explained"]) == pytest.approx(100 * (near <= run.reach).mean(), abs=0.05)
        assert float(text["rms"]) == pytest.approx(np.sqrt((near[near <= run.reach] ** 2).mean()), abs=6e-4)


def test_the_objectives_chart_runs_from_its_lowest_to_its_highest_value() -> None:
    """Named at the ends of its axis, which has one end where all values are equal."""
    run = state_after(TEN).run
    panel, values = objective_chart(run), np.array(run.objective)
    (line,) = (np.asarray(mark.xy) for mark in panel.marks if isinstance(mark, Path) and mark.role == "accent")
    np.testing.assert_allclose(line[:, 0], np.arange(len(values)) / (len(values) - 1))
    np.testing.assert_allclose(line[:, 1], (values - values.min()) / np.ptp(values))
    words = {mark.text for mark in panel.marks if isinstance(mark, Label)}
    assert {tick(float(values.min())), tick(float(values.max())), str(len(values) - 1)} <= words
    cloud = text(room("clean", seed=40).source)
    host = Host()
    plain = record(give(host, "a", cloud)["key"], give(host, "b", cloud)["key"], ("step",), start="as")
    svg = host.render("f", plain)["panels"][1]["svg"]
    assert len(re.findall(r">0</text>|>0\.000</text>", svg)) >= 2
    assert ">1</text>" in svg


def test_a_run_that_lacks_a_cloud_has_not_begun() -> None:
    host = Host()
    source, target, _ = pair(host)
    assert readouts(host.render("f", record(source)))["stop"] == "not begun"
    assert readouts(host.render("f", record(source, target)))["stop"] == "at the start"
    assert readouts(host.render("f", record(source, target, ("step",))))["stop"].endswith(", step 1")


def test_a_slice_tells_its_heights() -> None:
    """The middle fifth of what both clouds share, in their unit; planar clouds have none."""
    host, random = Host(), np.random.default_rng(3)
    solids = [random.uniform([0, 0, 0], [6, 4, 3], (900, 3)) for _ in range(2)]
    keys = [give(host, name, text(solid))["key"] for name, solid in zip("ab", solids, strict=True)]
    words = host.render("f", record(*keys, height=50, thickness=20))["description"]
    found = re.search(r"It shows heights from ([\d.]+) to ([\d.]+) u\.", words)
    assert found
    assert [float(v) for v in found.groups()] == pytest.approx([1.2, 1.8], abs=0.02)
    assert "heights" not in Host().render("f", preset(WIDGET).plain())["description"]


def test_a_method_without_a_length_says_so() -> None:
    for method, own in OWN.items():
        value = readouts(Host().render("f", preset(WIDGET, "default", {"method": method}).plain()))["length"]
        assert (value == "none: it finds its own") == (not own.length)
        assert value.startswith(own.length or "none")


def test_the_kiss_threshold_is_three_times_the_length_in_use() -> None:
    """From no motion, where nothing but that first σ is known."""
    controls = preset(WIDGET, "default", {"method": "kiss-threshold-icp"}).controls
    run = WIDGET.act(WIDGET.start(controls, SEED, {}), STEP).run  # type: ignore[call-arg]
    assert OWN[run.method].length == "first σ"
    assert run.batch.state().reach[0] == pytest.approx(3.0 * run.length)
