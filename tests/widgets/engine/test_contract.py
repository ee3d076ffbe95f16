"""Records: whatever anyone may have written is accepted, or refused with a reason, never half understood."""

from __future__ import annotations

import json
import re
from dataclasses import fields, replace
from itertools import combinations
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from widgets.engine.contract import MAX_LOG, SEED, Action, parsed, preset
from widgets.engine.host import Host
from widgets.engine.registry import WIDGETS
from widgets.figures.kabsch import WIDGET

PLAIN = preset(WIDGET, "noisy").plain()
LOG = [["press", "solve"], ["drag", "source", 1.25, -0.5], ["drag", "turn", 0, 1]]


def test_a_preset_is_its_defaults_and_changes() -> None:
    """Every control value is written out, so that a later change of a default changes no old link."""
    record = preset(WIDGET, "noisy", {"noise": 0.3})
    assert record.plain() == {
        "widget": "kabsch",
        "preset": "noisy",
        "controls": {"scene": "noisy", "noise": 0.3, "wrong": 0.0, "correct": True},
        "seed": SEED,
        "log": [],
    }


def test_plain_and_back() -> None:
    """A record survives a round trip through JSON."""
    record = parsed(WIDGET, {**PLAIN, "seed": 53, "log": LOG})
    assert record.log == (Action("press", "solve"), Action("drag", "source", 1.25, -0.5), Action("drag", "turn", 0, 1))
    assert parsed(WIDGET, json.loads(json.dumps(record.plain()))) == record


def test_the_longest_log_is_accepted() -> None:
    assert len(parsed(WIDGET, {**PLAIN, "log": [["press", "solve"]] * MAX_LOG}).log) == MAX_LOG


def test_what_is_not_said_is_the_preset() -> None:
    assert parsed(WIDGET, {"widget": "kabsch"}) == preset(WIDGET)
    assert parsed(WIDGET, {"preset": "outliers"}).controls.wrong == 3


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"preset": "nosiy"}, "kabsch: no preset 'nosiy'; did you mean 'noisy'?"),
        ({"preset": ["noisy"]}, "no preset"),
        ({"controls": {"scene": "outlier"}}, "did you mean 'outliers'?"),
        ({"controls": [1]}, "controls: not a mapping"),
        ({"seed": -1}, "seed: -1 is not a whole number"),
        ({"seed": 2**31}, "seed"),
        ({"seed": 40.0}, "seed: 40.0 is not a whole number"),
        ({"seed": True}, "seed: True"),
        ({"seed": "9" * 5000}, "…"),
        ({"log": {}}, "log: not a list"),
        ({"log": [["press", "solve"]] * (MAX_LOG + 1)}, f"at most {MAX_LOG}"),
        ({"log": ["press"]}, "log: 'press' is not an action"),
        ({"log": [["press"]]}, "is not an action"),
        ({"log": [[["press"], "solve"]]}, "is not an action"),
        ({"log": [["pres", "solve"]]}, "no kind of action 'pres'; did you mean 'press'?"),
        ({"log": [["press", "sovle"]]}, "kabsch has nothing to press called 'sovle'; did you mean 'solve'?"),
        ({"log": [["press", "reset"]]}, "nothing to press called 'reset'"),
        ({"log": [["press", "solve", 1, 2]]}, "presses a button at a place"),
        ({"log": [["drag", "source"]]}, "does not give a place"),
        ({"log": [["drag", "source", 1]]}, "does not give a place"),
        ({"log": [["drag", "source", 1, "2"]]}, "does not give a place"),
        ({"log": [["drag", "source", 1, float("nan")]]}, "does not give a place"),
        ({"log": [["drag", "source", 1, 10**400]]}, "does not give a place"),
        ({"log": [["drag", "source", 1, 1e6]]}, "does not give a place"),
        ({"log": [["drag", "source", True, 0]]}, "does not give a place"),
        ({"log": [["click", "main", 0, 0]]}, "nothing to click called 'main'"),
    ],
)
def test_refusals_say_what_is_wrong(change: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=re.escape(message)) as caught:
        parsed(WIDGET, {**PLAIN, **change})
    assert len(str(caught.value)) < 300


JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=8),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=8), inner, max_size=4),
    max_leaves=12,
)
LIKELY = st.sampled_from(["press", "drag", "click", "solve", "source", "turn", "main", 0, 1.5, -3, True, None])
ENTRY = st.lists(LIKELY | JSON, max_size=5)


@settings(max_examples=300, deadline=None)
@given(
    st.fixed_dictionaries(
        {},
        optional={
            "widget": st.just("kabsch") | JSON,
            "preset": st.sampled_from(["default", "noisy"]) | JSON,
            "controls": st.dictionaries(st.sampled_from(["scene", "noise", "correct"]) | st.text(max_size=5), JSON),
            "seed": st.integers(0, 99) | JSON,
            "log": st.lists(ENTRY | JSON, max_size=4) | JSON,
        },
    )
    | JSON
)
def test_any_json_is_a_frame_or_a_reason(record: Any) -> None:
    """No record, however hostile, raises anything but ValueError; an accepted one is drawn."""
    try:
        answer = Host().render("f", record)["panels"][0]["svg"]
    except ValueError as error:
        answer = str(error)
    assert answer.startswith("<svg") or 0 < len(answer) < 400


def nest(levels: int) -> list[Any]:
    deep: list[Any] = []
    for _ in range(levels):
        deep = [deep]
    return deep


DEEP = nest(100_000)
BAD = st.just(DEEP) | st.just({"x": DEEP}) | st.sampled_from(["\ud800", "a" * 10_000, 10**400, -(2**63), ()]) | JSON


@pytest.mark.native  # this deep, the page's Python overflows its stack and ends; the page checks links first
@settings(max_examples=150, deadline=None, derandomize=True)
@given(st.sampled_from(sorted(WIDGETS)), st.sampled_from(sorted(PLAIN)), BAD, st.data())
def test_what_is_wrong_anywhere_in_a_record_is_a_short_reason(
    name: str, place: str, bad: Any, data: st.DataObject
) -> None:
    """In every figure: an invalid field, control, log entry or part of one, however deep or long."""
    widget = WIDGETS[name]
    plain = preset(widget).plain()
    if place == "controls" and data.draw(st.booleans()):
        names = sorted(plain["controls"])
        plain["controls"] = {**plain["controls"], data.draw(st.sampled_from([*names, "\udfff", "x" * 999])): bad}
    elif place == "log" and data.draw(st.booleans()):
        entry: list[Any] = ["drag", "source", 0.5, 0.5][: data.draw(st.integers(1, 4))]
        entry[data.draw(st.integers(0, len(entry) - 1))] = bad
        plain["log"] = [entry]
    else:
        plain[place] = bad
    try:
        text = Host().render("f", plain)["description"]
    except ValueError as error:
        text = str(error)
    assert 0 < len(text.encode("utf-8")) < 3000


@pytest.mark.native  # as above
@pytest.mark.parametrize("ask", ["frame", "job"])
@pytest.mark.parametrize(
    "request_",
    ["1", "null", "[]", "{}", '"x"', '{"figure": 1, "record": {}}', '{"figure": "f"}', "[" * 100_000, '{"figure": '],
)
def test_a_request_that_is_none_is_a_reason(ask: str, request_: str) -> None:
    with pytest.raises(ValueError, match=r".") as caught:
        getattr(Host(), ask)(request_)
    assert len(str(caught.value)) < 300


def test_a_zero_has_no_sign() -> None:
    """Negative zero equals zero, but would turn half a turn elsewhere; a record knows only one of them."""
    record = parsed(WIDGET, {**PLAIN, "controls": {"noise": -0.0}, "log": [["drag", "turn", -3.0, -0.0]]})
    assert "-0.0" not in json.dumps(record.plain())
    host = Host()
    frames = [host.render("f", {**PLAIN, "log": [["drag", "turn", -3.0, y]]}) for y in (0.0, -0.0)]
    assert frames[0] == frames[1] == Host().render("f", {**PLAIN, "log": [["drag", "turn", -3.0, -0.0]]})


def test_names_are_what_the_registry_says() -> None:
    """Each widget is registered under its name. Its buttons, handles, jobs and presets share no name, no control is
    named like a button, and no two presets have the same settings."""
    for name, widget in WIDGETS.items():
        assert widget.name == name
        assert "default" in widget.presets
        buttons = [button.name for button in widget.buttons]
        names = [*buttons, *widget.handles, *(job.name for job in widget.jobs), *widget.presets]
        assert sorted(names) == sorted(set(names)), name
        assert not {field.name for field in fields(widget.controls)} & {*buttons}, name
        settings_ = [preset(widget, key).controls for key in widget.presets]
        assert not any(a == b for a, b in combinations(settings_, 2)), name
        assert sum(button.primary for button in widget.buttons) <= 1
        for button in widget.buttons:
            presses = {b.name for b in widget.buttons if b.does == "press"}
            assert (button.does == "run") == bool(button.repeats)
            assert not button.repeats or button.repeats in presses


def test_records_compare_by_value() -> None:
    assert parsed(WIDGET, PLAIN) == preset(WIDGET, "noisy")
    assert replace(parsed(WIDGET, PLAIN), seed=41) != preset(WIDGET, "noisy")
