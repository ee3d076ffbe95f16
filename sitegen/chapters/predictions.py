"""A `::predict` line: the question that a figure asks before it runs, and the answers that the run confirms.

`::predict[Does it find the room? | It does. | It does not.]{solve press=finish expect="rms < 0.1 | rms > 0.1"}` has an
expectation for each answer; `panels=icp,gicp says=right` has a panel for each, which is right if it shows that word in
the end; `within=0.5` has the reader place a ghost of the source where the run will stop, right within that many u.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace

from markdown_it.token import Token
from markupsafe import Markup

from sitegen.chapters.leads import BAR, check, unwrapped
from sitegen.chapters.placing import changed
from sitegen.chapters.promises import Expectation, expected, holds
from sitegen.chapters.render_context import RenderContext
from sitegen.chapters.rendered import Question
from sitegen.chapters.surveyed import Prediction
from sitegen.figures.model import Figure
from sitegen.markup.directives import Attribute, Directive
from sitegen.problems import Place, Problems
from widgets.engine.contract import Record

OWN = ("expect", "panels", "says", "within")
GHOST = "main", "source"  # the panel and the group that the ghost copies
WRITTEN = 'a prediction needs expect="rms < 0.1 | rms > 0.1", panels=icp,gicp says=right, or within=0.5'


def prediction(
    figure: Figure,
    directive: Directive,
    tokens: Sequence[Token],
    attributes: Iterable[Attribute],
    at: Callable[[int], Place],
    problems: Problems,
) -> tuple[Prediction, Record] | None:
    """A directive's question about a figure, and the record that decides it; None, and a problem, if nothing does."""
    by_name = {a.name: a for a in attributes if a.name}
    own = {name: by_name.pop(name) for name in OWN if name in by_name}
    record = changed(figure.widget, figure.record, by_name.values(), at, problems, OWN)
    question, *answers = parts(tokens)
    result = Prediction(figure, record.plain(), at(directive.start), question, answers)
    kinds = {frozenset(["expect"]), frozenset(["panels", "says"]), frozenset(["within"])}
    if frozenset(own) not in kinds:
        problems.add(at(directive.start), WRITTEN)
        return None
    if "expect" in own:
        result = replace(result, expected=_expectation_groups(own["expect"], at, problems))
        if len(result.expected) != len(answers) or len(answers) < 2:
            counts = f"answers: {len(answers)}, expectations: {len(result.expected)}"
            problems.add(at(own["expect"].start), f"{counts}; give at least two, and one for each")
            return None
    elif answers:
        problems.add(at(directive.text_start), "answers after a | need expect=: panels= and within= have their own")
        return None
    elif "panels" in own:
        names = tuple(own["panels"].value.split(","))
        result = replace(result, panels=names, says=own["says"].value)
    else:
        distance = own["within"].plain
        if isinstance(distance, (bool, str)) or not distance > 0:
            message = f"within: expected a positive distance in u, got {own['within'].value!r}"
            problems.add(at(own["within"].value_start), message)
            return None
        result = replace(result, within=float(distance))
    return result, record


def _expectation_groups(
    attribute: Attribute, at: Callable[[int], Place], problems: Problems
) -> tuple[tuple[Expectation, ...], ...]:
    """The expectations for each answer."""
    start, groups = attribute.text_start, []
    for piece in attribute.value.split("|"):
        part = replace(attribute, value=piece, value_start=start, quoted=False)
        groups.append(expected(part, at, problems))
        start += len(piece) + 1
    return tuple(groups)


def parts(tokens: Sequence[Token]) -> list[list[Token]]:
    """Inline tokens, split at the bars outside of emphasis and the like."""
    result: list[list[Token]] = [[]]
    depth = 0
    for token in unwrapped(tokens):
        depth += token.nesting
        pieces = token.content.split(BAR) if depth == 0 and token.type == "text" else [token.content]
        result[-1].append(replace(token, content=pieces[0]))
        result += [[replace(token, content=piece)] for piece in pieces[1:]]
    return result


def judged(
    prediction: Prediction | None, context: RenderContext, inline: Callable[[Sequence[Token]], str]
) -> Question | None:
    """The question for the page; None if there is none. It is a problem if all answers are right, or none."""
    if prediction is None:
        return None
    figure, problems = prediction.figure, context.problems
    if prediction.within:
        if not _has_ghost(prediction, context):
            return None
        return Question(Markup(inline(prediction.question)), (), prediction.record, prediction.within)
    answers = _panels(prediction, context) if prediction.panels else _expectations(prediction, context, inline)
    rights = [right for _, right in answers]
    if answers and (all(rights) or not any(rights)):
        quantity = "every" if all(rights) else "no"
        problems.add(prediction.place, f"this run of figure {figure.id!r} makes {quantity} answer right")
    return Question(Markup(inline(prediction.question)), answers, prediction.record, 0.0) if answers else None


def _expectations(
    prediction: Prediction, context: RenderContext, inline: Callable[[Sequence[Token]], str]
) -> list[tuple[Markup, bool]]:
    figure, record = prediction.figure, prediction.record
    return [
        (Markup(inline(tokens)), holds(figure, record, expectations, context.readouts, context.problems))
        for tokens, expectations in zip(prediction.answers, prediction.expected, strict=True)
    ]


def _panels(prediction: Prediction, context: RenderContext) -> list[tuple[Markup, bool]]:
    """The first line of each panel's caption, and whether the panel shows the word."""
    for frame in context.frames(prediction.figure, [prediction.record]):
        panels = {panel["name"]: panel for panel in frame["panels"]}
        names = prediction.panels
        check("panels", names, tuple(panels), [prediction.place] * len(names), context.problems)
        return [
            (Markup.escape(panels[name]["caption"].split("\n")[0]), f">{prediction.says}</text>" in panels[name]["svg"])
            for name in names
            if name in panels
        ]
    return []


def _has_ghost(prediction: Prediction, context: RenderContext) -> bool:
    """Whether there is a source to place a ghost of; if not, report it."""
    panel, group = GHOST
    for frame in context.frames(prediction.figure, [prediction.record]):
        svg = next((p["svg"] for p in frame["panels"] if p["name"] == panel), "")
        if f'id="{prediction.figure.dom_id}-{panel}-{group}"' in svg:
            return True
        widget = prediction.figure.widget.name
        context.problems.add(prediction.place, f"{widget} draws no group {group!r} in panel {panel!r}")
    return False
