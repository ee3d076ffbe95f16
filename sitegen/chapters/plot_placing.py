"""A `::plot` line: the plot that it places, and its faults."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from sitegen.chapters.placing import ID, bare, listed
from sitegen.figures.gallery import Placed, Plot
from sitegen.markup.directives import Directive
from sitegen.problems import Place, Problems, hint


def placed(
    directive: Directive, at: Callable[[int], Place], number: str, plots: Mapping[str, Plot], problems: Problems
) -> Placed | None:
    """The plot that a `::plot` line places; None, and a problem, if there is none of that name."""
    attributes = listed(directive, at, problems)
    if attributes is None:
        return None
    words = bare(attributes, 1, at, problems)
    if not words:
        problems.add(at(directive.attributes_start), "missing plot name, as in {trial-budget id=budget}")
        return None
    plot = plots.get(words[0].value)
    if plot is None:
        problems.add(at(words[0].start), f"unknown plot {words[0].value!r}{hint(words[0].value, plots)}")
        return None
    plot_id = plot.name
    for attribute in (a for a in attributes if a.name):
        if attribute.name != "id":
            problems.add(
                at(attribute.start), f"unknown plot attribute {attribute.name!r}{hint(attribute.name, ['id'])}"
            )
        elif not ID.fullmatch(attribute.value):
            problems.add(at(attribute.value_start), f"invalid id {attribute.value!r}: use letters, digits and hyphens")
        else:
            plot_id = attribute.value
    return Placed(plot_id, number, plot, at(directive.start))
