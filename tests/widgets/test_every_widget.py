"""Rules for every figure in every preset and recorded state, and for its descriptions: a reader who cannot see the
picture learns from them what is shown, and that it has changed."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from functools import cache
from html import unescape
from math import dist
from typing import Any

import pytest

from widgets.drawing.picture import ROLES, number
from widgets.drawing.svg import BARE
from widgets.engine.contract import preset
from widgets.engine.controls import specs
from widgets.engine.host import Host
from widgets.engine.registry import WIDGETS

pytestmark = pytest.mark.native  # the page's frames are the same bytes: tests/pyodide/test_frames.py

SHAPES = {"dot", "square", "cross", "ring", "diamond", "line", "dashed", "dotted", "area"}


def prefixes(presses: int) -> list[int]:
    """The numbers of presses to try: every prefix of a short series, the ends and some in between of a long run."""
    return list(range(presses + 1)) if presses < 10 else [0, 1, 7, presses // 2, presses]


def records(name: str) -> Iterator[dict[str, Any]]:
    """Records that a page's tape may hold, for every preset, each series also ending with another seed."""
    widget = WIDGETS[name]
    for start in widget.presets:
        for changes, presses in (({}, ()), *widget.tape):
            plain = preset(widget, start, changes).plain()
            logs = [[["press", press] for press in presses[:k]] for k in prefixes(len(presses))]
            yield from ({**plain, "log": log} for log in logs)
            yield {**plain, "seed": plain["seed"] + 13, "log": logs[-1]}


@cache
def tape_frames(name: str) -> list[tuple[dict[str, Any], dict[str, Any]]]:
    """Those records with their frames, all drawn in order by one host, so that each press costs one step. Equal
    settings from two presets are drawn once."""
    host = Host()
    unique: dict[str, dict[str, Any]] = {}
    for plain in records(name):
        unique.setdefault(json.dumps({**plain, "preset": ""}, sort_keys=True), plain)
    return [(plain, host.render("fig-x", plain)) for plain in unique.values()]


def ends(name: str) -> list[tuple[dict[str, Any], dict[str, Any]]]:
    """The first and last record of each series of presses."""
    results = tape_frames(name)
    logs = [len(plain["log"]) for plain, _ in results]
    return [pair for pair, k, after in zip(results, logs, [*logs[1:], 0], strict=True) if k == 0 or after <= k]


@pytest.mark.parametrize("name", WIDGETS)
def test_a_state_draws_reads_and_describes(name: str) -> None:
    """Panels, readouts as finite text, a description in sentences; prefixed ids; no colour or float in the SVG."""
    for plain, frame in tape_frames(name):
        check_frame(plain, frame)


def at(plain: dict[str, Any]) -> str:
    """A figure's state in words, for a message."""
    log = ", then ".join(" ".join(map(str, action)) for action in plain["log"]) or "nothing was done"
    return f"{plain['widget']}, preset {plain['preset']}, {plain['controls']}, seed {plain['seed']}, {log}"


def check_frame(plain: dict[str, Any], frame: dict[str, Any]) -> None:
    widget, case = WIDGETS[plain["widget"]], at(plain)
    assert frame["panels"], f"{case}: a Picture has at least one Panel"
    names = [panel["name"] for panel in frame["panels"]]
    assert len(set(names)) == len(names), f"{case}: give each Panel a name of its own, not {names}"
    for panel in frame["panels"]:
        svg = panel["svg"]
        assert re.match('<svg class="panel(?: padded)?" viewBox="0 0 ', svg)
        assert "<path" in svg, f"{case}: the panel {panel['name']} shows no mark; draw something in every state"
        assert all(i.startswith(f"fig-x-{panel['name']}-") for i in re.findall(r' id="([^"]*)"', svg))
        marks = re.sub(r'>[^<]*</text>|aria-label="[^"]*"|textLength="[\d.]+em"', "", svg.replace(BARE, "", 1))
        wrong = re.search(r"style=|fill=|stroke=|nan|inf|\d\.\d", marks, re.IGNORECASE)
        assert not wrong, f"{case}: the panel {panel['name']} has {wrong[0]!r} in its markup; marks hold finite numbers"
    assert frame["readouts"], f"{case}: a Picture has at least one Readout"
    for readout in frame["readouts"]:
        text = f"{case}: {readout['name']} shows {readout['value']!r}"
        assert readout["value"].strip(), f'{text}; where there is no value yet, show "–"'
        assert not re.search(r"nan|inf|e-\d|-", readout["value"]), f"{text}; write numbers by picture.number"
        assert readout["role"] == "" or readout["role"] in ROLES, f"{text}; its role is none of {', '.join(ROLES)}"
    message = frame["description"]
    sentences = re.fullmatch(r"[A-Z0-9].{60,}\.", message)
    assert sentences, f"{case}: describe what is seen in whole sentences, 60 characters or more, not {message!r}"
    wrong = re.search(r"\bnan\b|\binf\b|  ", message + frame["note"])
    assert not wrong, f"{case}: {wrong[0]!r} in the description or the note: {message!r}, {frame['note']!r}"
    words = unescape(json.dumps({key: part for key, part in frame.items() if key != "python"}, ensure_ascii=False))
    straight = re.search(r".{0,30}(?:[a-zA-Z]'|'[a-zA-Z]).{0,30}", words)
    assert not straight, f"{case}: write an apostrophe as ’, quotes as ‘…’, in {straight[0]!r}"
    buttons = {button.name for button in widget.buttons}
    assert set(frame["disabled"]) <= buttons, f"{case}: disabled names {frame['disabled']}; the buttons are {buttons}"
    assert frame["controls"] == plain["controls"]
    for motion in frame["motions"]:
        group, markup = motion["group"], "".join(panel["svg"] for panel in frame["panels"])
        missing = f"{case}: motion names {group}, and draw puts no Group of that name into that panel"
        assert f'id="{group}"' in markup, missing


@pytest.mark.parametrize("name", WIDGETS)
def test_readout_names_and_panels_stay(name: str) -> None:
    """A page lays out readouts and panels once, so every state has the same names, labels and views."""
    frames = [frame for _, frame in tape_frames(name)]
    layouts = {
        json.dumps([[(r["name"], r["label"]) for r in f["readouts"]], [(p["name"], p["view"]) for p in f["panels"]]])
        for f in frames
    }
    assert len(layouts) == 1, (
        f"{name}: give every state the same readouts (names, labels) and the same panels, each with one view; "
        f"of the tape's states there are these: {sorted(layouts)}"
    )


@pytest.mark.parametrize("name", WIDGETS)
def test_keys_are_drags(name: str) -> None:
    """Each arrow key of each handle is a drag that the record accepts and that takes the handle to the key's place."""
    host = Host()
    moves = [pair for pair in ends(name) if pair[0]["log"]]
    for plain, frame in [*(pair for pair in ends(name) if not pair[0]["log"]), *moves[:1], *moves[-1:]]:
        check_keys(host, plain, frame)


def check_keys(host: Host, plain: dict[str, Any], frame: dict[str, Any]) -> None:
    widget, case = WIDGETS[plain["widget"]], at(plain)
    names = {handle["name"] for handle in frame["handles"] if "sets" not in handle}
    assert names <= set(widget.handles), f"{case}: draw has the handles {names}, WIDGET.handles names {widget.handles}"
    for handle in frame["handles"]:
        grip, arrows = f"{case}: the handle {handle['name']}", [f"Arrow{w}" for w in ("Left", "Right", "Up", "Down")]
        keys = {*arrows, *(f"Shift+{arrow}" for arrow in arrows)}
        assert set(handle["keys"]) == keys, f"{grip} has other keys; make them by move_keys, turn_keys or slide_keys"
        assert handle["panel"] in {panel["name"] for panel in frame["panels"]}, f"{grip} is in no panel of the picture"
        assert 0 <= handle["left"] <= 100, f"{grip} lies outside its panel's window; limit where it can be put"
        assert 0 <= handle["top"] <= 100, f"{grip} lies outside its panel's window; limit where it can be put"
        for key, point in handle["keys"].items():
            after = host.render("f", put(plain, handle, point))
            (result,) = (h for h in after["handles"] if h["name"] == handle["name"])
            stays = result["world"] == handle["world"] and result["value"] == handle["value"]
            at_end = "sets" in handle and point == handle["world"] and point[0] in handle["slider"][:2]
            assert not stays or at_end, f"{grip} does not move by {key}; act takes a drag to {point} for nothing"
            if handle["kind"] != "turn":
                landed = dist(result["world"], point) < 2e-4
                assert landed, f"{grip} goes to {result['world']} by {key}, which names {point}; act puts it elsewhere"


def put(plain: dict[str, Any], handle: dict[str, Any], point: list[float]) -> dict[str, Any]:
    """The record after a handle is put at a place, as `put` in templates/assets/js/base/record.js makes it."""
    if "sets" in handle:
        return {**plain, "controls": {**plain["controls"], handle["sets"]: point[0]}}
    return {**plain, "log": [*plain["log"], ["drag", handle["name"], *point]]}


@pytest.mark.parametrize("name", WIDGETS)
def test_two_handles_do_not_cover_each_other(name: str) -> None:
    """At 358 px wide, the centres of two 44 px touch targets are at least 40 px apart."""
    for plain, frame in tape_frames(name):
        views = {panel["name"]: panel["view"] for panel in frame["panels"]}
        for i, a in enumerate(frame["handles"]):
            for b in frame["handles"][:i]:
                if a["panel"] == b["panel"]:
                    x0, x1, *_ = views[a["panel"]]
                    px = dist(a["world"], b["world"]) * 358 / (x1 - x0)
                    message = f"{at(plain)}: {a['name']} and {b['name']} are {px:.0f} px apart on a phone"
                    assert px >= 40, f"{message}; keep them 40 px apart, as Placing's `least` does"


@pytest.mark.parametrize("name", [name for name in WIDGETS if any(b.does == "reseed" for b in WIDGETS[name].buttons)])
def test_another_seed_is_another_draw(name: str) -> None:
    """If a figure has a button for a new draw, the next seed changes the picture of some preset."""
    widget, host = WIDGETS[name], Host()
    plains = [preset(widget, start).plain() for start in widget.presets]
    pairs = [[host.render("f", {**plain, "seed": plain["seed"] + k})["panels"] for k in (0, 13)] for plain in plains]
    differ = any(a != b for a, b in pairs)
    assert differ, f"{name}: a button draws anew, and no preset's picture depends on the seed; take the button away"


@pytest.mark.parametrize("name", WIDGETS)
def test_legend_names_only_what_is_drawn(name: str) -> None:
    """Each key of the legend appears in at least one recorded state."""
    svg = "".join(p["svg"] for _, frame in tape_frames(name) for p in frame["panels"])
    classes = {word for group in re.findall(r'class="([^"]*)"', svg) for word in group.split()}
    for key in WIDGETS[name].legend:
        assert key.shape in SHAPES, f"{name}: the legend's {key.label!r} has the shape {key.shape}; there are {SHAPES}"
        assert key.role in classes, f"{name}: no state of the tape draws {key.role!r}, the legend's {key.label!r}"


@pytest.mark.parametrize("name", WIDGETS)
def test_options_bring_values_that_are_accepted(name: str) -> None:
    """An option sets only controls of the same figure, within their ranges."""
    widget = WIDGETS[name]
    for control, spec in specs(widget.controls).items():
        assert set(spec.sets) <= set(spec.options)
        for option, brought in spec.sets.items():
            plain = preset(widget, "default", {control: option}).plain()
            assert {key: plain["controls"][key] for key in brought} == dict(brought)
            assert preset(widget, "default", plain["controls"]).plain() == plain


@pytest.mark.parametrize("name", WIDGETS)
def test_a_slider_can_be_put_back(name: str) -> None:
    """Its upper end, and what it is by default, in a preset, by an option and on the tape, are whole numbers of steps
    from its lower end: a reader who has moved it finds them again."""
    widget, by_name = WIDGETS[name], specs(WIDGETS[name].controls)
    set_by = [*(spec.sets[option] for spec in by_name.values() for option in spec.sets), *(c for c, _ in widget.tape)]
    set_by += [preset(widget, start).plain()["controls"] for start in widget.presets]
    for control, spec in by_name.items():
        if spec.kind == "slider":
            for value in (spec.high, *(brought[control] for brought in set_by if control in brought)):
                steps = (float(value) - spec.low) / spec.step
                on = spec.low <= float(value) <= spec.high and abs(steps - round(steps)) < 1e-6
                assert on, f"{name}: {control} is set to {value}, which no step of {spec.step} from {spec.low} reaches"


@pytest.mark.parametrize("name", WIDGETS)
def test_what_moves_is_drawn_as_the_source(name: str) -> None:
    """The group that an animation moves holds the source's points, and nothing with the target's role."""
    for _, frame in ends(name):
        for panel in frame["panels"]:
            for group in re.findall(rf'<g id="fig-x-{panel["name"]}-source" class="group">(.*?)</g>', panel["svg"]):
                points = re.search(r'class="dot [sml] source\b', group)
                assert points, f"{name}: put the source's Points, as dots, into the Group 'source': it is what moves"
                foreign = re.search(r'class="[^"]*\btarget\b', group)
                assert not foreign, f"{name}: take what has the role target out of the Group 'source': it stays"


@pytest.mark.parametrize("name", WIDGETS)
def test_the_words_follow_the_state(name: str) -> None:
    """Every description is whole sentences with numbers; after the tape's presses it differs from the first."""
    first: dict[str, str] = {}
    for plain, frame in tape_frames(name):
        words = frame["description"]
        whole = re.fullmatch(r"[A-Z0-9].*\d.*\.", words, re.DOTALL)
        assert whole, f"{at(plain)}: a description is whole sentences with a number in them, not {words!r}"
        slip = re.search(r"[^.] None\b|\b1 points?\b give\b|\d%|\.\.|\{|\}", words)
        assert not slip, f"{at(plain)}: {slip[0]!r} in the description: {words!r}"
        key = repr((plain["preset"], plain["controls"], plain["seed"]))
        if not plain["log"]:
            first[key] = words
        elif key in first:
            assert words != first[key], f"{at(plain)}: the description is as before; tell what the presses changed"


@pytest.mark.parametrize("name", [name for name in WIDGETS if "noise" in specs(WIDGETS[name].controls)])
def test_the_words_tell_the_settings(name: str) -> None:
    """The noise and the fraction of outliers are stated as they are set, in the description or a caption."""
    host, by_name = Host(), specs(WIDGETS[name].controls)
    for control in ("noise", "outliers"):
        if control not in by_name or (name == "ransac" and control == "outliers"):  # a share that is stated as a count
            continue
        spec = by_name[control]
        for part in (0.4, 0.8):
            value = round(spec.low + spec.step * round(part * (spec.high - spec.low) / spec.step), spec.decimals)
            frame = host.render("fig-x", preset(WIDGETS[name], "default", {control: value}).plain())
            words = " ".join([frame["description"], *(panel["caption"] for panel in frame["panels"])])
            text = f"{number(value, spec.decimals)} {'u' if control == 'noise' else '%'}"
            match = re.search(rf"(?<![\d.]){re.escape(text)}(?!\d)", words)
            assert match, f"{name}: {control} is {value}; say {text!r} in the description or a caption, not {words!r}"


@pytest.mark.parametrize("name", WIDGETS)
def test_options_begin_with_a_capital(name: str) -> None:
    """Or with a symbol, or they read on: "σ is" estimated."""
    for spec in specs(WIDGETS[name].controls).values():
        low = [text for text in spec.options.values() if text[0].islower() and text[0].isascii()]
        assert not low or spec.label.endswith(" is"), f"{name}, {spec.label}: begin {low} with a capital"


@pytest.mark.parametrize("name", WIDGETS)
def test_every_panel_and_handle_has_a_name_of_its_own(name: str) -> None:
    """No two pictures of a figure and no two handles of a panel share a label; pictures' labels have several words."""
    for _, frame in tape_frames(name):
        labels = [re.search(r'aria-label="([^"]*)"', panel["svg"]).group(1) for panel in frame["panels"]]  # type: ignore[union-attr]
        assert len(set(labels)) == len(labels), f"{name}: give each Panel a label of its own, not {labels}"
        worded = all(len(label.split()) > 1 for label in labels)
        assert worded, f"{name}: label each Panel by two words or more, not {labels}"
        handles = [(handle["panel"], handle["label"]) for handle in frame["handles"]]
        assert len(set(handles)) == len(handles), f"{name}: give each Handle of a panel its own label, not {handles}"
        for handle in frame["handles"]:
            least, most, value = handle["slider"]
            assert least <= value <= most, f"{name}: the handle {handle['name']} is at {value}, beyond {least} … {most}"
            assert handle["value"].strip(), f"{name}: the handle {handle['name']} has no value in words"
