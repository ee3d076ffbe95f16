"""What holds for every figure, in every preset and every state that its tape records."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from functools import cache
from math import dist
from typing import Any

import pytest

from widgets.contract import preset
from widgets.controls import specs
from widgets.host import Host
from widgets.picture import ROLES
from widgets.registry import WIDGETS

SHAPES = {"dot", "square", "cross", "ring", "diamond", "line", "dashed", "area"}


def prefixes(presses: int) -> list[int]:
    """How many of a row of presses to try: all prefixes of a short one, the ends and the middle of a long run."""
    return list(range(presses + 1)) if presses < 10 else [0, 1, 7, presses // 2, presses]


def records(name: str) -> Iterator[dict[str, Any]]:
    """Records that a page's tape may hold, for every preset, and another draw of each last one."""
    widget = WIDGETS[name]
    for start in widget.presets:
        for changes, presses in (({}, ()), *widget.tape):
            plain = preset(widget, start, changes).plain()
            logs = [[["press", press] for press in presses[:k]] for k in prefixes(len(presses))]
            yield from ({**plain, "log": log} for log in logs)
            yield {**plain, "seed": plain["seed"] + 13, "log": logs[-1]}


@cache
def taped(name: str) -> list[tuple[dict[str, Any], dict[str, Any]]]:
    """Those records, each once, with the frames that one host draws of them, in order: a step costs a step."""
    host = Host()
    unique = {json.dumps(plain, sort_keys=True): plain for plain in records(name)}
    return [(plain, host.render("fig-x", plain)) for plain in unique.values()]


def ends(name: str) -> list[tuple[dict[str, Any], dict[str, Any]]]:
    """Of those the first and the last of each run of presses."""
    found = taped(name)
    logs = [len(plain["log"]) for plain, _ in found]
    return [pair for pair, k, after in zip(found, logs, [*logs[1:], 0], strict=True) if k == 0 or after <= k]


@pytest.mark.parametrize("name", WIDGETS)
def test_a_state_draws_reads_and_describes(name: str) -> None:
    """Panels, readouts as finite text, a description in sentences; prefixed ids; no colour or float in the SVG."""
    for plain, frame in taped(name):
        check_frame(plain, frame)


def check_frame(plain: dict[str, Any], frame: dict[str, Any]) -> None:
    widget = WIDGETS[plain["widget"]]
    assert frame["panels"]
    names = [panel["name"] for panel in frame["panels"]]
    assert len(set(names)) == len(names)
    for panel in frame["panels"]:
        svg = panel["svg"]
        assert svg.startswith('<svg class="plot" viewBox="0 0 ')
        assert "<path" in svg
        assert all(i.startswith(f"fig-x-{panel['name']}-") for i in re.findall(r' id="([^"]*)"', svg))
        assert not re.search(
            r"style=|fill=|stroke=|nan|inf|\d\.\d", re.sub(r'>[^<]*</text>|aria-label="[^"]*"', "", svg), re.IGNORECASE
        )
    assert frame["readouts"]
    for readout in frame["readouts"]:
        assert readout["value"].strip()
        assert not re.search(r"nan|inf|e-\d|-", readout["value"])
        assert readout["role"] == "" or readout["role"] in ROLES
    assert re.fullmatch(r"[A-Z0-9].{60,}\.", frame["description"])
    assert not re.search(r"\bnan\b|\binf\b|  ", frame["description"] + frame["note"])
    assert set(frame["disabled"]) <= {button.name for button in widget.buttons}
    assert frame["controls"] == plain["controls"]
    if frame["motion"]:
        assert f'id="{frame["motion"]["group"]}"' in "".join(panel["svg"] for panel in frame["panels"])


@pytest.mark.parametrize("name", WIDGETS)
def test_readout_names_and_panels_stay(name: str) -> None:
    """A page lays out readouts and panels once: the same names, labels and views in every state."""
    frames = [frame for _, frame in taped(name)]
    layouts = {
        json.dumps([[(r["name"], r["label"]) for r in f["readouts"]], [(p["name"], p["view"]) for p in f["panels"]]])
        for f in frames
    }
    assert len(layouts) == 1


@pytest.mark.parametrize("name", WIDGETS)
def test_keys_are_drags(name: str) -> None:
    """Each arrow key of each handle is a drag that the record accepts and that takes the handle where the key says."""
    host = Host()
    done = [pair for pair in ends(name) if pair[0]["log"]]
    for plain, frame in [*(pair for pair in ends(name) if not pair[0]["log"]), *done[:1], *done[-1:]]:
        check_keys(host, plain, frame)


def check_keys(host: Host, plain: dict[str, Any], frame: dict[str, Any]) -> None:
    widget = WIDGETS[plain["widget"]]
    assert {handle["name"] for handle in frame["handles"]} <= set(widget.handles)
    for handle in frame["handles"]:
        assert set(handle["keys"]) == {f"{s}Arrow{w}" for s in ("", "Shift+") for w in ("Left", "Right", "Up", "Down")}
        assert handle["panel"] in {panel["name"] for panel in frame["panels"]}
        assert 0 <= handle["left"] <= 100
        assert 0 <= handle["top"] <= 100
        for key, place in handle["keys"].items():
            after = host.render("f", {**plain, "log": [*plain["log"], ["drag", handle["name"], *place]]})
            (there,) = (h for h in after["handles"] if h["name"] == handle["name"])
            assert there["world"] != handle["world"] or there["value"] != handle["value"], key
            if handle["kind"] == "move":
                assert dist(there["world"], place) < 2e-4, key


@pytest.mark.parametrize("name", WIDGETS)
def test_two_handles_do_not_cover_each_other(name: str) -> None:
    """At 358 px wide, two touch targets of 44 px have their centres at least 40 px apart."""
    for _, frame in taped(name):
        views = {panel["name"]: panel["view"] for panel in frame["panels"]}
        for i, one in enumerate(frame["handles"]):
            for other in frame["handles"][:i]:
                if one["panel"] == other["panel"]:
                    x0, x1, *_ = views[one["panel"]]
                    assert dist(one["world"], other["world"]) * 358 / (x1 - x0) >= 40


@pytest.mark.parametrize("name", [name for name in WIDGETS if any(b.does == "reseed" for b in WIDGETS[name].buttons)])
def test_another_seed_is_another_draw(name: str) -> None:
    """Where a button draws anew, some preset's picture is another one on the next seed."""
    widget, host = WIDGETS[name], Host()
    plains = [preset(widget, start).plain() for start in widget.presets]
    drawn = [[host.render("f", {**plain, "seed": plain["seed"] + k})["panels"] for k in (0, 13)] for plain in plains]
    assert any(one != other for one, other in drawn)


@pytest.mark.parametrize("name", WIDGETS)
def test_legend_names_only_what_is_drawn(name: str) -> None:
    """Each key of the legend appears in at least one recorded state."""
    drawn = "".join(p["svg"] for _, frame in taped(name) for p in frame["panels"])
    classes = {word for group in re.findall(r'class="([^"]*)"', drawn) for word in group.split()}
    for key in WIDGETS[name].legend:
        assert key.shape in SHAPES
        assert key.role in classes, key.label


@pytest.mark.parametrize("name", WIDGETS)
def test_options_bring_values_that_are_accepted(name: str) -> None:
    """What an option sets are controls of the same figure within their ranges."""
    widget = WIDGETS[name]
    for control, spec in specs(widget.controls).items():
        assert set(spec.sets) <= set(spec.options)
        for option, brought in spec.sets.items():
            plain = preset(widget, "default", {control: option}).plain()
            assert {key: plain["controls"][key] for key in brought} == dict(brought)
            assert preset(widget, "default", plain["controls"]).plain() == plain


@pytest.mark.parametrize("name", WIDGETS)
def test_what_moves_is_drawn_as_the_source(name: str) -> None:
    """The group that an animation carries holds the source's points, and nothing in the target's colour."""
    for _, frame in ends(name):
        for panel in frame["panels"]:
            for group in re.findall(rf'<g id="fig-x-{panel["name"]}-source" class="group">(.*?)</g>', panel["svg"]):
                assert re.search(r'class="dot [sml] source\b', group)
                assert not re.search(r'class="[^"]*\btarget\b', group)
