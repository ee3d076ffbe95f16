"""With Python up: drag, keys, touch, controls, buttons; and the same bytes as the build's own drawing."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import Page, expect

from sitegen.bench.pages import until
from tests.browser import layout
from tests.browser.conftest import Reader
from tests.browser.figure import Figure, finger, tap_after_drag
from widgets.engine.contract import SEED, preset
from widgets.engine.host import Host
from widgets.engine.registry import WIDGETS


@pytest.fixture
def solve(reader: Callable[..., Reader]) -> Figure:
    return Figure(reader(reduced_motion="reduce").open("kabsch.html"), "fig-solve").live()


def records() -> list[dict[str, Any]]:
    """Every widget as it opens, the first run of its tape, and a drag, click or hover at each of its places.
    tests/pyodide/test_frames.py, where node draws with the same Python, adds the other presets, the rest of the tape
    and every control."""
    results = []
    for widget in WIDGETS.values():
        plain = preset(widget, "default").plain()
        results.append(plain)
        results += [{**plain, "seed": SEED + 13, "log": [["drag", h, 1.23, -0.57]]} for h in widget.handles]
        results += [{**plain, "log": [["click", c, 0.4, 0.3]]} for c in widget.clicks]
        results += [{**plain, "log": [["hover", c, 0.4, 0.3]]} for c in widget.hovers]
        for changes, presses in widget.tape[:1]:
            log = [["press", press] for press in presses]
            results.append({**preset(widget, "default", changes).plain(), "log": log})
    return results


def test_live_frames_are_the_build_s_byte_for_byte(reader: Callable[..., Reader]) -> None:
    """For these records of every widget, native and browser frames are equal byte for byte. Maps are drawn finely as
    they open, and otherwise at their first level."""
    page = reader().open("kabsch.html")
    Figure(page, "fig-solve").live()
    host = Host()
    for record in records():
        levels = WIDGETS[record["widget"]].details if record["log"] == [] else 1
        for level in range(levels):  # one after the other, as a page requests them: none takes long
            request = {"figure": "fig-x", "record": record, "detail": level}
            live = page.evaluate("request => Ladder.runtime.frame(request)", request)
        assert live == host.render("fig-x", record, level), record


def test_a_drag_moves_the_source_and_solve_finds_the_same_optimum(solve: Figure) -> None:
    """From two starts by drag, two Solves reach the same residual."""
    before = solve.readout("rms")
    solve.drag("source", 90, 60)
    moved = solve.changes("rms", before)
    solve.button("solve").click()
    first = solve.changes("rms", moved)
    solve.drag("turn", -120, 90)
    second = solve.changes("rms", first)
    solve.button("solve").click()
    assert solve.changes("rms", second) == first
    assert [entry[:2] for entry in solve.record()["log"]] == [
        ["drag", "source"],
        ["press", "solve"],
        ["drag", "turn"],
        ["press", "solve"],
    ]


def test_a_drag_keeps_its_offset_and_follows_the_pointer(solve: Figure) -> None:
    """Grabbed off centre, the handle moves by exactly as much as the pointer."""
    solve.seen()
    box = solve.handle("source").bounding_box()
    assert box
    page, x, y = solve.page, box["x"] + box["width"] * 0.7, box["y"] + box["height"] * 0.3
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x + 80, y - 30, steps=5)
    page.mouse.up()
    solve.settled()
    after = solve.handle("source").bounding_box()
    assert after
    assert abs(after["x"] - box["x"] - 80) < 1.5
    assert abs(after["y"] - box["y"] + 30) < 1.5


def test_keys_do_what_a_drag_does(solve: Figure) -> None:
    """Arrow keys move the focused handle; Shift moves it further; the page does not scroll; the focus stays."""
    handle = solve.seen().handle("source")
    top = solve.page.evaluate("scrollY")
    before = solve.frame()["handles"]
    handle.focus()
    solve.page.keyboard.press("ArrowRight")
    expect(handle).to_be_focused()
    solve.settled()
    near = solve.frame()["handles"]
    solve.page.keyboard.press("Shift+ArrowUp")
    solve.settled()
    far = solve.frame()["handles"]
    positions = (
        {h["name"]: h["world"] for h in before},
        {h["name"]: h["world"] for h in near},
        {h["name"]: h["world"] for h in far},
    )
    assert positions[1]["source"][0] > positions[0]["source"][0]
    assert positions[2]["source"][1] - positions[1]["source"][1] > positions[1]["source"][0] - positions[0]["source"][0]
    expect(handle).to_be_focused()
    assert solve.page.evaluate("scrollY") == top
    assert len(solve.record()["log"]) == 1


def test_a_new_draw_is_the_next_seed_s(solve: Figure) -> None:
    """Other clouds with the seed that the record names; pressing again goes to the next."""
    solve.set("noise", "0.3")
    solve.settled()
    seeds, pictures = [solve.record()["seed"]], {json.dumps(solve.frame()["panels"])}
    for _ in range(2):
        solve.button("new").click()
        solve.settled()
        seeds.append(solve.record()["seed"])
        pictures.add(json.dumps(solve.frame()["panels"]))
    assert seeds == [seeds[0], seeds[0] + 13, seeds[0] + 26]
    assert len(pictures) == 3


def test_escape_puts_a_drag_back(solve: Figure) -> None:
    """Escape while dragging restores the state from before."""
    before = solve.readout("rms")
    box = solve.seen().handle("source").bounding_box()
    assert box
    solve.page.mouse.move(box["x"] + 22, box["y"] + 22)
    solve.page.mouse.down()
    solve.page.mouse.move(box["x"] + 120, box["y"] + 80, steps=4)
    solve.changes("rms", before)
    solve.page.keyboard.press("Escape")
    solve.shows("rms", before)
    solve.page.mouse.up()
    assert solve.record()["log"] == []


def test_everything_by_keyboard_alone(solve: Figure) -> None:
    """Tab reaches handles, buttons and controls in this order; Enter solves; a slider responds to arrows."""
    page = solve.page
    solve.handle("source").focus()
    stops = []
    for _ in range(30):
        page.keyboard.press("Tab")
        stops.append(
            page.evaluate(
                "document.activeElement.dataset.handle || document.activeElement.name || "
                "document.activeElement.dataset.button || ''"
            )
        )
    assert stops.index("turn") < stops.index("solve") < stops.index("noise")
    before = solve.readout("rms")
    solve.button("solve").focus()
    page.keyboard.press("Enter")
    answer = solve.changes("rms", before)
    solve.control("noise").focus()
    for _ in range(6):
        page.keyboard.press("ArrowRight")
    solve.changes("rms", answer)


@pytest.mark.parametrize("width", [390, 1280])
def test_touch_drags_a_handle_and_scrolls_past_a_figure(reader: Callable[..., Reader], width: int) -> None:
    """A finger on a handle drags it; a finger on the drawing scrolls the page."""
    visitor = reader(width, 800, has_touch=True, reduced_motion="reduce")
    page = visitor.open("kabsch.html")
    solve = Figure(page, "fig-solve").live()
    assert page.evaluate("e => getComputedStyle(e).touchAction", solve.handle("source").element_handle()) == "none"
    assert (
        page.evaluate("e => getComputedStyle(e).touchAction", solve.root.locator("svg.panel").first.element_handle())
        != "none"
    )
    before = solve.readout("rms")
    drag_by_finger(page, solve, "source", 40, 30)
    moved = solve.changes("rms", before)
    tap_after_drag(solve.button("solve"))
    solve.changes("rms", moved)


def drag_by_finger(page: Page, figure: Figure, name: str, dx: float, dy: float) -> None:
    """Drag a handle, which must be large enough for a finger, by touch."""
    figure.handle(name).scroll_into_view_if_needed()
    box = figure.handle(name).bounding_box()
    assert box
    assert box["width"] >= 44
    assert box["height"] >= 44
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    finger(page, [(x + dx * i / 6, y + dy * i / 6) for i in range(7)])


Record = dict[str, Any]
PLACED = re.compile(
    r'<figure class="figure" id="([\w-]+)".*?<script type="application/json" class="figure-record">(.*?)</script>', re.S
)

# These slice spatial clouds, which a reader has to supply: see tests/browser/widgets/test_own_clouds.py.
SLICING = {("own-clouds", "height"), ("own-clouds", "thickness")}


def choices(spec: dict[str, Any], value: Any) -> list[Any]:
    """Other values of a control: the farther end of a slider, all other options of a choice."""
    if spec["kind"] == "slider":
        return [spec["high"] if value < spec["high"] else spec["low"]]
    return [o for o in spec["options"] if o != value] if spec["kind"] == "choice" else [not value]


def press(record: Record, button: str) -> Record:
    """The record after a press of a button; "run" repeats another button a few times."""
    (result,) = (b for b in WIDGETS[record["widget"]].buttons if b.name == button)
    presses = [["press", result.repeats]] * 4 if result.does == "run" else [["press", button]]
    return {**record, "log": [*record["log"], *presses]}


def settings(record: Record, controls: dict[str, Any], control: str) -> Iterator[Record]:
    """The figure as it opens; with each of its choices and toggles at another value; and in each preset, since some
    controls matter only under one choice of another, as a scan's number does with the drive."""
    yield record
    for name, spec in controls.items():
        for value in choices(spec, record["controls"][name]) if name != control and spec["kind"] != "slider" else []:
            yield moved(record, spec, name, value)
    widget = WIDGETS[record["widget"]]
    yield from (preset(widget, name).plain() for name in widget.presets)


def moved(record: Record, spec: dict[str, Any], control: str, value: Any) -> Record:
    """The record with the control at a value, and with the values that this option sets."""
    return {**record, "controls": {**record["controls"], control: value, **spec.get("sets", {}).get(value, {})}}


def pairs(plain: Record, variant: Record, primary: str) -> Iterator[tuple[Record, Record]]:
    """Both as they open and, since some controls only take effect then, after the figure's main action and at the end
    of its tape's longest run."""
    yield plain, variant
    if primary:
        yield press(plain, primary), press(variant, primary)
    longest = max((presses for _, presses in WIDGETS[plain["widget"]].tape), key=len, default=())
    log = [["press", press] for press in longest]
    yield {**plain, "log": log}, {**variant, "log": log}


def test_every_control_changes_what_is_drawn(reader: Callable[..., Reader], site: Path, pages: list[str]) -> None:
    """In every figure of every page, each control at another value gives another picture. The frames drawn here are
    those of the page's Python, byte for byte, as tested above; and one control of each kind is moved in the page."""
    visitor, host = reader(reduced_motion="reduce"), Host()
    samples: dict[str, tuple[str, str, str]] = {}
    cached: dict[str, list[Any]] = {}  # drawings by record: each state is compared with many others

    def panels(record: Record) -> list[Any]:
        key = json.dumps(record)
        if key not in cached:
            cached[key] = [panel["svg"] for panel in host.render("fig-x", record, 0)["panels"]]
        return cached[key]

    for name in pages:
        figures = PLACED.findall((site / name).read_text("utf-8"))
        assert len(figures) == layout.count_figures(site, name), name
        for figure_id, text in figures:
            report = json.loads(text)
            record, controls = report["record"], report["spec"]["controls"]
            primary = next((b.name for b in WIDGETS[record["widget"]].buttons if b.primary), "")
            for control, spec in controls.items():
                if (record["widget"], control) in SLICING:
                    continue
                samples.setdefault(spec["kind"], (name, figure_id, control))
                drawings = (
                    [panels(r) for r in pair]
                    for within in settings(record, controls, control)
                    for value in choices(spec, record["controls"][control])
                    for pair in pairs(within, moved(within, spec, control, value), primary)
                )
                assert any(before != after for before, after in drawings), f"{name}#{figure_id}: {control}"
    assert set(samples) == {"slider", "choice", "toggle"}
    for name, figure_id, control in samples.values():
        figure = Figure(visitor.open(name), figure_id).live()
        before = figure.settled().frame()["panels"]
        spec = figure.page.evaluate("name => Ladder.figures.get(name).spec.controls", figure_id)[control]
        value = choices(spec, figure.record()["controls"][control])[0]
        figure.set(control, value if isinstance(value, bool) else str(value))
        assert figure.settled().record()["controls"][control] == value
        if figure.frame()["panels"] == before:
            figure.root.locator(".buttons .primary").click()
            figure.settled()
        assert figure.frame()["panels"] != before, f"{name}#{figure_id}: {control}"
        figure.page.close()


def test_solve_is_animated_unless_reduced_motion_is_asked(reader: Callable[..., Reader]) -> None:
    """Solve moves the group through intermediate poses; with reduced motion it jumps."""
    watch = """name => { window.seen = 0; new MutationObserver(list => { window.seen += list.length; })
        .observe(document.getElementById(name), {subtree: true, attributes: true, attributeFilter: ['transform']}); }"""
    counts = {}
    for motion in ("no-preference", "reduce"):
        page = reader(reduced_motion=motion).open("kabsch.html")
        solve = Figure(page, "fig-solve").live()
        page.evaluate(watch, "fig-solve")
        before = solve.readout("rms")
        solve.button("solve").click()
        solve.changes("rms", before)
        solve.settled()
        counts[motion] = page.evaluate("seen")
    assert counts["no-preference"] > 2, "more than the first pose and the last"
    assert counts["reduce"] == 0


def test_all_eight_scans_turn_to_where_their_runs_end(reader: Callable[..., Reader]) -> None:
    """Their ends are known in the second drawing after the press, not the first."""
    page = reader().open("index.html")
    figure = Figure(page, "fig-map").live()
    page.evaluate("""name => {
      window.seen = new Set();
      new MutationObserver(list => list.forEach(({ target }) => window.seen.add(target.id)))
        .observe(document.getElementById(name), {subtree: true, attributes: true, attributeFilter: ['transform']});
    }""", figure.name)
    figure.button("roll").click()
    figure.changes("arrive", "–")
    until(page, "window.seen.size >= 8")
    assert page.evaluate("[...window.seen].every(id => id.endsWith('-source'))")
    figure.settled()
    page.evaluate("window.seen.clear()")
    for turn in ("-40", "100"):  # another start is not animated, although its ends also come with a finer drawing
        figure.set("turn", turn)
        until(page, "!Ladder.figures.get('fig-map').busy && Ladder.figures.get('fig-map').frame.detail === 2")
    assert page.evaluate("window.seen.size") == 0


def test_the_figure_that_was_touched_is_answered_first(reader: Callable[..., Reader]) -> None:
    """Whatever else on the page waits for Python."""
    page = reader(reduced_motion="reduce").open("kabsch.html")
    names = [figure.get_attribute("id") or "" for figure in page.locator("figure.figure").all()[:3]]
    touched = Figure(page, names[-1]).live().settled()
    touched.root.locator("figcaption").click(position={"x": 5, "y": 5})
    order = page.evaluate(
        """names => {
          const { figures, runtime } = Ladder, order = [];
          const ask = figure => runtime.frame({ figure, record: figures.get(figure).record });
          return Promise.all(names.map(name => ask(name).then(() => order.push(name)))).then(() => order);
        }""",
        names,
    )
    assert order.index(touched.name) < order.index(names[1])
