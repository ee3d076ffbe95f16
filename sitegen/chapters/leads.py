"""The leading part of a figure: the sentence before the bar in its caption, and what `panels=`, `controls=` … name."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace

from markdown_it.token import Token

from sitegen.figures.model import Figure
from sitegen.figures.wire import Plain
from sitegen.markup.directives import Attribute
from sitegen.problems import Place, Problems, hint
from widgets.engine.contract import Button, Lead, Widget
from widgets.engine.controls import specs

LEADING = ("panels", "readouts", "controls", "buttons")
BAR = " | "
NONE = "none"  # instead of names


def lead_of(
    widget: Widget, attributes: Iterable[Attribute], at: Callable[[int], Place], problems: Problems
) -> tuple[Lead | None, dict[str, tuple[Place, ...]]]:
    """The leading part: the widget's own choice, overridden by a directive's attributes; and the places of the names.

    Controls and buttons are checked here, panels and readouts once the figure is drawn (`check_drawn`).
    """
    available = {"controls": tuple(specs(widget.controls)), "buttons": tuple(b.name for b in widget.buttons)}
    lead, led = widget.lead, dict[str, tuple[Place, ...]]()
    for attribute in attributes:
        if (attribute.name, attribute.value) == ("panels", NONE):
            problems.add(at(attribute.value_start), "a figure must show at least one panel: name one, or omit panels=")
            continue
        names = () if attribute.value == NONE else tuple(attribute.value.split(","))
        led[attribute.name] = places_of(names, attribute, at)
        if attribute.name in available:
            check(attribute.name, names, available[attribute.name], led[attribute.name], problems)
        lead = replace(lead or Lead(), **{attribute.name: names})
    return lead, led


def places_of(names: Sequence[str], attribute: Attribute, at: Callable[[int], Place]) -> tuple[Place, ...]:
    """The places of the names that an attribute lists."""
    return tuple(at(attribute.text_start + sum(len(name) + 1 for name in names[:i])) for i in range(len(names)))


def check(kind: str, names: Sequence[str], present: Sequence[str], places: Sequence[Place], problems: Problems) -> None:
    """Report leading names that the figure does not have."""
    for name, place in zip(names, places, strict=True):
        if name not in present:
            problems.add(place, f"unknown {kind.removesuffix('s')} {name!r}{hint(name, present)}")


def check_drawn(figure: Figure, main: Button | None, frame: Plain, problems: Problems) -> None:
    """Report leading panels and readouts that the drawn figure does not have, and a main button that is disabled at
    first or waits behind *More*."""
    if main and {main.name, main.repeats} & {*frame["disabled"]}:
        message = f"main button {main.label!r} is disabled at first: use after= to open with its result"
        problems.add(figure.place, message)
    if main and figure.lead and figure.lead.buttons is not None and main.name not in figure.lead.buttons:
        problems.add(figure.place, f"main button {main.label!r} is hidden behind More: add it to buttons=")
    if figure.lead is None:
        return
    for kind, names in (("panels", figure.lead.panels or ()), ("readouts", figure.lead.readouts or ())):
        available = [item["name"] for item in frame[kind]]
        check(kind, names, available, figure.led.get(kind, [figure.place] * len(names)), problems)


def halves(tokens: Sequence[Token]) -> tuple[list[Token], list[Token]]:
    """A caption's tokens before and after its bar; without a bar, all come after it."""
    depth, tokens = 0, unwrapped(tokens)
    for i, token in enumerate(tokens):
        depth += token.nesting
        if depth == 0 and token.type == "text" and BAR in token.content:
            before, _, after = token.content.partition(BAR)
            parts = [replace(token, content=part) for part in (before, after)]
            return [*tokens[:i], parts[0]], [parts[1], *tokens[i + 1 :]]
    return [], tokens


def unwrapped(tokens: Sequence[Token]) -> list[Token]:
    """A caption's tokens with blanks for line breaks, so that a bar at the start or end of a line is one as well."""
    result: list[Token] = []
    for token in tokens:
        if token.type == "softbreak":
            token = Token("text", "", 0, level=token.level, content=" ")
        if result and token.type == result[-1].type == "text":
            token = replace(token, content=result.pop().content + token.content)
        result.append(token)
    return result
