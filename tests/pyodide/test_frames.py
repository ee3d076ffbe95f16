"""Every figure natively and in the page's Python: the same bytes at its controls' extremes and for all actions."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from sitegen.cache import pool
from tests.pyodide.frames import main
from tests.pyodide.inside import run_python_in_shipped_runtime
from tests.widgets.chosen import figures
from widgets.engine.contract import SEED, Widget, preset
from widgets.engine.controls import Spec, Value, specs
from widgets.engine.registry import WIDGETS

NUMBER = r"-?\d+(?:\.\d+)?(?:e[+-]?\d+)?"
FRAMES = Path(__file__).with_name("frames.py")


def ends(spec: Spec) -> tuple[Value, ...]:
    """A slider's two ends, all options of a choice, or both states of a toggle."""
    if spec.kind == "slider":
        return spec.low, spec.high
    return tuple(spec.options) if spec.kind == "choice" else (False, True)


def requests(widget: Widget) -> Iterator[dict[str, Any]]:
    """For every preset: each button, handle, pick and hover. For the first preset: what the tape records, if it shows
    anything new. For each control: each of its extremes, after one press."""
    presses = [["press", b.name] for b in widget.buttons if b.does == "press"]
    spots = [
        *(["drag", handle, 1.23, -0.57] for handle in widget.handles),
        *(["click", panel, 0.4, 0.3] for panel in widget.clicks),
        *(["hover", panel, 0.4, 0.3] for panel in widget.hovers),
    ]
    for name in widget.presets:
        plain = preset(widget, name).plain()
        yield ask(plain, None)
        yield ask({**plain, "seed": SEED + 13, "log": [*spots, *presses[:1]]}, None)
        if name == next(iter(widget.presets)):  # while the figure still knows what its first frame took
            yield from (ask(record, None) for record in tape_records(widget))
        for entry in (*presses, *spots):
            yield ask({**plain, "log": [entry]}, 0)
    for control, spec in specs(widget.controls).items():
        for end in ends(spec):
            yield ask({**preset(widget, "default", {control: end}).plain(), "log": presses[:1]}, 0)


def tape_records(widget: Widget) -> Iterator[dict[str, Any]]:
    """The states that the tape records of the first preset, but only those in which some control has a new value or the
    number of presses is new."""
    settings: set[str] = set()
    for changes, presses in widget.tape:
        plain = preset(widget, next(iter(widget.presets)), changes).plain()
        facts = {json.dumps(item) for item in (*plain["controls"].items(), presses)}
        if not facts <= settings:
            yield {**plain, "log": [["press", press] for press in presses]}
        settings |= facts


def ask(record: Mapping[str, Any], detail: int | None) -> dict[str, Any]:
    return {"figure": "fig-x", "record": record, "detail": detail}


def walk() -> Iterator[dict[str, Any]]:
    """Every stage of the walkthrough, one after the other through two iterations, in each of its presets."""
    widget = WIDGETS["four"]
    for name in widget.presets:
        yield from (ask({**preset(widget, name).plain(), "log": [["press", "next"]] * k}, 0) for k in range(2, 11))


@pytest.fixture(scope="module")
def answers(request: pytest.FixtureRequest) -> tuple[list[dict[str, Any]], dict[str, Any], dict[str, Any]]:
    """The requests for the selected figures, and the answers natively and in the page's Python. Both come from
    processes that have not drawn anything yet, since states already known are drawn in finer detail than requested."""
    names = figures(request)
    questions = [q for name in names for q in requests(WIDGETS[name])] + [*(walk() if "four" in names else ())]
    unique = list({json.dumps(q, sort_keys=True): q for q in questions}.values())
    rest = [item for item in request.session.items if item.path == request.path and not hasattr(item, "callspec")]
    arguments = {"frames": unique, "jobs": bool(rest)}
    with pool.working([(main, (json.dumps(arguments),))]) as natively:
        page = run_python_in_shipped_runtime(FRAMES.read_text("utf-8"), arguments)
        ((_, native),) = natively
    return unique, json.loads(native), page


@pytest.mark.parametrize("name", WIDGETS)
def test_frames_are_the_same_bytes_in_the_page(
    answers: tuple[list[dict[str, Any]], dict[str, Any], dict[str, Any]], name: str
) -> None:
    questions, native, page = answers
    mine = [i for i, question in enumerate(questions) if question["record"]["widget"] == name]
    assert len(mine) > len(WIDGETS[name].presets)
    differences = [questions[i] for i in mine if differ(native["frames"][i], page["frames"][i])]
    assert not differences


def differ(a: str, b: str) -> bool:
    """Whether two frames differ: in a byte, or by more than 1e-9 (relative or absolute) in a number in their files."""
    frames = [json.loads(text) for text in (a, b)]
    texts = [json.dumps(frame.pop("files", {})) for frame in frames]
    words = [re.sub(NUMBER, "#", text) for text in texts]
    ours, theirs = ([float(number) for number in re.findall(NUMBER, text)] for text in texts)
    return frames[0] != frames[1] or words[0] != words[1] or not np.allclose(ours, theirs, rtol=1e-9, atol=1e-9)


def test_jobs_find_the_same_in_the_page(
    answers: tuple[list[dict[str, Any]], dict[str, Any], dict[str, Any]],
) -> None:
    """The race's table at its first settings: every number is the same as printed, and to 1e-9 relative as computed."""
    _, native, page = answers
    assert native["jobs"].keys() == page["jobs"].keys() == {"race benchmark"}
    for name, result in native["jobs"].items():
        for mine, theirs in zip(result["rows"], page["jobs"][name]["rows"], strict=True):
            assert (mine["name"], mine["texts"]) == (theirs["name"], theirs["texts"])
            assert mine["values"][:-1] == pytest.approx(theirs["values"][:-1], rel=1e-9)
            assert mine["values"][-1] is theirs["values"][-1] is None, "how long it took is of the machine"
