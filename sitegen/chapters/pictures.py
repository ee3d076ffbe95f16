"""A `::picture` line: a widget's drawing of a state, without its controls.

`::picture[Two steps on.]{icp start=midway press=step,step panels=main expect="rms < 0.5"}` names a widget, a record as
in `::figure` and `::try`, and the panels to show. `expect=` is checked against the readouts in that state.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

from sitegen.chapters.leads import check, places_of
from sitegen.chapters.placing import changed, widget_of
from sitegen.chapters.promises import Promise, expected, hold
from sitegen.chapters.render_context import RenderContext
from sitegen.chapters.surveyed import Still
from sitegen.figures.model import Figure
from sitegen.figures.wire import Plain
from sitegen.markup.directives import Directive
from sitegen.problems import Place, Problems
from widgets.engine.contract import Widget, preset

OWN = ("preset", "panels", "expect")


def still(
    directive: Directive, at: Callable[[int], Place], count: int, widgets: Mapping[str, Widget], problems: Problems
) -> Still | None:
    """The picture of a line, the `count`-th of its chapter; None, and a problem, if it names no valid widget."""
    parts = widget_of(directive, at, widgets, problems)
    if parts is None:
        return None
    widget, name, attributes = parts
    by_name = {a.name: a for a in attributes if a.name}
    own = {key: by_name.pop(key) for key in OWN if key in by_name}
    if "id" in by_name:
        problems.add(at(by_name.pop("id").start), "a picture takes no id: it has no number, and no line refers to it")
    base = preset(widget, name)
    record = changed(widget, base, by_name.values(), at, problems, OWN)
    panels = tuple(own["panels"].value.split(",")) if "panels" in own else ()
    led = {"panels": places_of(panels, own["panels"], at)} if panels else {}
    figure = Figure(f"picture-{count}", "", widget, base, at(directive.start), led=led)
    promise = None
    if "expect" in own:
        promise = Promise(figure, record.plain(), expected(own["expect"], at, problems))
    return Still(figure, record.plain(), panels, promise)


def drawn(picture: Still, context: RenderContext) -> tuple[Sequence[Plain], str] | None:
    """The picture's panels and description, with its expectations checked; None if it cannot be drawn."""
    if picture.promise is not None:
        hold(picture.promise, context.readouts, context.problems, idle=True)
    for frame in context.frames(picture.figure, [picture.record]):
        names = picture.panels or (frame["panels"][0]["name"],)
        available = [panel["name"] for panel in frame["panels"]]
        places = picture.figure.led.get("panels", [picture.figure.place])
        check("panels", names, available, places, context.problems)
        return [panel for panel in frame["panels"] if panel["name"] in names], frame["description"]
    return None
