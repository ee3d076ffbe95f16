"""matplotlib's drawings, written compactly: with relative coordinates, every point stays in its place."""

from __future__ import annotations

import re

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from matplotlib.figure import Figure
from matplotlib.patches import Circle

from sitegen.figures.matplotlib_svg import COLOURS, clean, draw

HEAD = '<svg xmlns="http://www.w3.org/2000/svg">'
COUNT = {"M": 1, "L": 1, "C": 3, "Q": 2, "z": 0}

Command = tuple[str, list[tuple[float, float]]]
numbers = st.floats(-900, 900) | st.sampled_from([0.0, 12.5, -0.04, 0.05, 300.0])
points = st.tuples(numbers, numbers)
commands = st.sampled_from("LLLCQzM").flatmap(
    lambda name: st.tuples(st.just(name), st.lists(points, min_size=COUNT[name], max_size=COUNT[name]))
)
paths = st.builds(lambda first, rest: [("M", [first]), *rest], points, st.lists(commands, min_size=1, max_size=30))


def short(path: list[Command]) -> str:
    """The path as `clean` returns it."""
    text = " \n".join(f"{name} {' '.join(f'{x!r} {y!r}' for x, y in places)}" for name, places in path)
    mark = f'<path d="{text}" style="stroke: {COLOURS["source"]}"/>'
    return re.findall(r' d="([^"]*)"', clean(f"{HEAD}{mark}</svg>", (10, 10), "p"))[0]


def read(path: str) -> list[Command]:
    """Read a path of relative commands, as SVG defines them, into absolute ones in tenths of a px."""
    absolute: list[Command] = []
    begin = at = np.zeros(2)
    for name, text in re.findall(r"([a-zA-Z])([^a-zA-Z]*)", path):
        values = [float(number) for number in re.findall(r"-?(?:\d*\.\d+|\d+)", text)]
        steps = {"h": [*values, 0.0], "v": [0.0, *values]}.get(name, values)
        places = np.reshape(steps, (-1, 2)) + (at if name.islower() else 0.0)
        at = begin if name == "z" else places[-1]
        if name in "mM":
            begin = at
        kind = {"h": "L", "v": "L", "z": "z"}.get(name, name.upper())
        absolute.append((kind, [(round(10 * x), round(10 * y)) for x, y in places.tolist()]))
    return absolute


@given(paths)
def test_every_point_is_where_it_was_to_a_tenth(path: list[Command]) -> None:
    """After a close, the pen is at the subpath's start; no point is off by over half a tenth, however long the path."""
    assert read(short(path)) == [(name, [(round(10 * x), round(10 * y)) for x, y in places]) for name, places in path]


def test_it_is_short() -> None:
    """Zeros before a point, and spaces before a sign, are omitted; a line along an axis has a single number."""
    square = [("M", [(10.0, 0.04)]), ("L", [(10.5, 0.0)]), ("L", [(10.5, -20.31)]), ("L", [(10.0, -20.2)]), ("z", [])]
    assert short(square) == "M10 0h.5v-20.3l-.5 .1z"


def test_a_circle_is_one_still() -> None:
    """Drawn by matplotlib itself: the ends of all its curves lie on the circle."""

    def fill(figure: Figure) -> None:
        axes = figure.add_axes((0, 0, 1, 1))
        axes.set_axis_off()
        axes.set(xlim=(0, 200), ylim=(0, 200))
        axes.add_patch(Circle((100, 100), 60, facecolor=COLOURS["source"], edgecolor="none"))

    (path,) = re.findall(r'<path class="f-source" d="([^"]*)"', draw(fill, (200, 200), "p"))
    ends = np.array([places[-1] for _, places in read(path) if places]) / 10
    assert len(ends) == 9
    np.testing.assert_allclose(np.hypot(*(ends - 100).T), 60, atol=0.1)
