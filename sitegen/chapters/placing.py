"""A `::figure` line: the widget and the state that it places, and its faults."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

from sitegen.chapters.drags import drags
from sitegen.chapters.leads import LEADING, lead_of
from sitegen.figures.model import Figure, distinct, ways
from sitegen.figures.widget_faults import module_file
from sitegen.markup.directives import Attribute, Directive, DirectiveError, attributes
from sitegen.problems import Place, Problems, hint
from widgets.engine.contract import MAX_LOG, Record, Widget, parsed, preset
from widgets.engine.controls import specs, validated, values

ID = re.compile(r"(?=.*[A-Za-z0-9])[A-Za-z0-9-]+")  # not hyphens alone


def listed(directive: Directive, at: Callable[[int], Place], problems: Problems) -> list[Attribute] | None:
    """The directive's attributes; None, and a problem, if they are malformed. A duplicate is also a problem."""
    try:
        attrs = attributes(directive)
    except DirectiveError as error:
        problems.add(at(error.offset), str(error))
        return None
    names: set[str] = set()
    for attribute in attrs:
        if attribute.name and attribute.name in names:
            problems.add(at(attribute.start), f"duplicate attribute {attribute.name!r}")
        names.add(attribute.name)
    return attrs


def bare(attrs: Iterable[Attribute], most: int, at: Callable[[int], Place], problems: Problems) -> list[Attribute]:
    """The attributes without a name; each beyond the allowed `most` is a problem."""
    words = [a for a in attrs if not a.name]
    for extra in words[most:]:
        problems.add(at(extra.start), f"expected name=value, got {extra.value!r}")
    return words


def widget_of(
    directive: Directive, at: Callable[[int], Place], widgets: Mapping[str, Widget], problems: Problems
) -> tuple[Widget, str, list[Attribute]] | None:
    """The widget that a line names first, its preset, and all its attributes; None, and a problem, if any of them is
    missing or invalid."""
    attrs = listed(directive, at, problems)
    if attrs is None:
        return None
    words = bare(attrs, 1, at, problems)
    if not words:
        problems.add(
            at(directive.attributes_start), f"missing widget for the {directive.name}, as in {{kabsch preset=default}}"
        )
        return None
    first = words[0]
    if first.value not in widgets:
        suggestion = hint(first.value, widgets)
        problems.lacks(module_file(first.value), at(first.start), f"unknown widget {first.value!r}{suggestion}")
        return None
    widget, choice = widgets[first.value], next((a for a in attrs if a.name == "preset"), None)
    name = choice.value if choice else "default"
    if name not in widget.presets:
        problems.add(
            at(choice.value_start if choice else first.start),
            f"{widget.name} has no preset {name!r}{hint(name, widget.presets)}",
        )
        return None
    return widget, name, attrs


def placed(
    directive: Directive, at: Callable[[int], Place], number: str, widgets: Mapping[str, Widget], problems: Problems
) -> Figure | None:
    """The figure that a `::figure` line places, with its widget's tape; None, and a problem, without a valid widget."""
    parts = widget_of(directive, at, widgets, problems)
    if parts is None:
        return None
    widget, name, attrs = parts
    by_name = {a.name: a for a in attrs if a.name and a.name != "preset"}
    figure_id = by_name.pop("id", None)
    if figure_id and not ID.fullmatch(figure_id.value):
        problems.add(at(figure_id.value_start), f"invalid id {figure_id.value!r}: use letters, digits and hyphens")
    after = by_name.pop("after", None)
    leading = [by_name.pop(part) for part in LEADING if part in by_name]
    lead, led = lead_of(widget, leading, at, problems)
    base = preset(widget, name)
    record = changed(widget, base, by_name.values(), at, problems, ("preset", "id", "after", *LEADING))
    own = record.plain()
    final = None
    if after is not None:
        final = parsed(widget, {**own, "log": [*own["log"], *presses(widget, after, at, problems)]})
    tape = [
        parsed(widget, {**own, "controls": merged(widget, record, changes), "log": [["press", b] for b in log]})
        for changes, log in widget.tape
    ]
    led_to = [state for start in (record, *([final] if final else []), *tape) for state in ways(start)]
    return Figure(
        figure_id.value if figure_id else widget.name,
        number,
        widget,
        record,
        at(directive.start),
        distinct([own, *led_to]),  # its own state comes first, even if presses lead to it
        lead,
        final.plain() if final else None,
        led,
    )


def id_of(directive: Directive) -> str:
    """The id that a `::figure` or `::plot` line sets, even in a malformed one: `id=`, or else the first word."""
    match = re.search(r"\bid\s*=\s*([\w-]+)", directive.attributes) or re.match(r"\s*([\w-]+)", directive.attributes)
    return match[1] if match else ""


def merged(widget: Widget, base: Record, changes: Mapping[str, Any]) -> dict[str, Any]:
    """The base's control values, updated with what newly chosen options set, and then with `changes`."""
    control_specs = specs(widget.controls)
    effects = {k: v for name, value in changes.items() for k, v in control_specs[name].sets.get(str(value), {}).items()}
    return {**values(base.controls), **effects, **changes}


def presses(
    widget: Widget, attribute: Attribute, at: Callable[[int], Place], problems: Problems
) -> list[list[str | float]]:
    """The log entries of `press=a,b*3`; faults go to `problems`."""
    buttons = {b.name for b in widget.buttons if b.does == "press"}
    offset, log = attribute.text_start, list[list[str | float]]()
    for piece in attribute.value.split(","):
        name, star, times = piece.partition("*")
        if name not in buttons:
            problems.add(at(offset), f"{widget.name} has no button {name!r} to press{hint(name, buttons)}")
        elif star and not (times.isascii() and times.isdigit() and 0 < int(times[:9]) <= MAX_LOG):
            problems.add(at(offset), f"{piece!r}: expected a repeat count from 1 to {MAX_LOG}")
        else:
            log += [["press", name]] * (int(times) if star else 1)
        offset += len(piece) + 1
    return log


def changed(
    widget: Widget,
    base: Record,
    attrs: Iterable[Attribute],
    at: Callable[[int], Place],
    problems: Problems,
    extra: Sequence[str] = (),
) -> Record:
    """A record changed by attributes: control values, `seed=`, and `press=a,b*3` and `drag="source 1.2 -0.5"` for the
    log, in the order written; faults go to `problems`.

    extra: other names to suggest for a misspelt attribute.
    """
    control_specs = specs(widget.controls)
    controls: dict[str, Any] = {}
    seed, log = base.seed, []
    for attribute in attrs:
        place = at(attribute.value_start)
        if attribute.name == "seed":
            if (
                isinstance(attribute.plain, bool)
                or not isinstance(attribute.plain, int)
                or not 0 <= attribute.plain < 2**31
            ):
                problems.add(place, f"seed: expected a whole number, got {attribute.value!r}")
            else:
                seed = attribute.plain
        elif attribute.name == "press":
            log += presses(widget, attribute, at, problems)
        elif attribute.name == "drag":
            log += drags(widget, attribute, at, problems)
        elif attribute.name not in control_specs:
            suggestion = hint(attribute.name, [*control_specs, "seed", "press", "drag", *extra])
            if attribute.name in ("preset", "id"):
                suggestion = ": set it on the ::figure line; only controls, seed, press and drag go here"
            problems.add(at(attribute.start), f"{widget.name} has no control {attribute.name!r}{suggestion}")
        else:
            value = attribute.value if control_specs[attribute.name].kind == "choice" else attribute.plain
            try:
                validated(widget.controls, {attribute.name: value})
                controls[attribute.name] = value
            except ValueError as error:
                problems.add(place, str(error))
    if len(log) > MAX_LOG:
        problems.add(at(0), f"too many actions: a log holds at most {MAX_LOG}")
        log = []
    return parsed(widget, {**base.plain(), "controls": merged(widget, base, controls), "seed": seed, "log": log})
