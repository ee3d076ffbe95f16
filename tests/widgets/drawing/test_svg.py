"""The renderer: the markup of each mark, in bytes that do not depend on the processor."""

from __future__ import annotations

import re
from html.parser import HTMLParser
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from widgets.drawing.picture import (
    ROLES,
    Arrow,
    Ellipses,
    Group,
    Heat,
    Label,
    Mark,
    Panel,
    Path,
    Points,
    Ring,
    Role,
    Segments,
    Ticks,
    Tiles,
    View,
)
from widgets.drawing.svg import HEAT_LEVELS, WEIGHT_LEVELS, panel_svg, snap

VIEW = View(0.0, 10.0, 0.0, 10.0, width=100.0)  # 10 px per unit: world (x, y) is at SVG (100 x, 1000 - 100 y)


def svg(*marks: Mark, view: View = VIEW) -> str:
    return panel_svg(Panel("main", "A panel", view, marks, grid=False), "fig-main")


def body(*marks: Mark, view: View = VIEW) -> str:
    """The markup inside the svg element."""
    return re.sub(r"^<svg[^>]*>|</svg>$", "", svg(*marks, view=view))


@pytest.mark.parametrize(
    ("mark", "markup"),
    [
        (Points([[1, 2], [3, 4]], "source"), '<path class="dot m source" d="M100 800h1m199-200h1"/>'),
        (Points([1, 2], "target", "square", radius=2), '<path class="square s target" d="M100 800h1"/>'),
        (  # the smallest marks: to 0.2 px, and each place once
            Points([[1, 2], [1.004, 2], [1.03, 2]], "target", "square", radius=1),
            '<path class="square xs target" d="M100 800h1m3 0h1"/>',
        ),
        (Points([1, 2], "target", "square", radius=5), '<path class="square l target" d="M100 800h1"/>'),
        (
            Points([1, 2], "outlier", "cross", radius=6),
            '<path class="shape cross outlier" d="M100 800m-60-60l120 120m0-120l-120 120"/>',
        ),
        (
            Points([1, 2], "inlier", "diamond", radius=5),
            '<path class="shape diamond inlier" d="M100 800m0-50l50 50l-50 50l-50-50z"/>',
        ),
        (
            Points([1, 2], "truth", "ring", radius=5),
            '<path class="shape ring truth" d="M100 800m-50 0a50 50 0 1 0 100 0a50 50 0 1 0-100 0"/>',
        ),
        (Segments([0, 0], [10, 10], "pair"), '<path class="line pair" d="M0 1000l1000-1000"/>'),
        (Segments([0, 0], [10, 10], "weak", dashed=True), '<path class="line weak dashed" d="M0 1000l1000-1000"/>'),
        (Path([[0, 0], [1, 0], [1, 1]], "ghost"), '<path class="line ghost" d="M0 1000l100 0 0-100"/>'),
        (
            Path([[0, 0], [1, 0], [1, 1]], "truth", closed=True, filled=True, dashed=True, thick=True),
            '<path class="line truth filled dashed thick" d="M0 1000l100 0 0-100z"/>',
        ),
        (
            Path([[0, 0], [1, 0]], "by-nearest", dashed=True, dotted=True, weight=0.5),
            '<path class="line by-nearest dashed dotted w3" d="M0 1000l100 0"/>',
        ),
        (Path([[0, 0], [1, 0]], "ghost", weight=0.0), ""),
        (Path([1, 2], "ghost"), '<path class="line ghost" d="M100 800h1"/>'),
        (
            Ticks([[5, 5]], [[0, 1]], "normal", length=10),
            '<path class="line normal" d="M500 550v-100"/>',
        ),
        (
            Arrow([0, 0], [5, 0], "accent"),
            '<path class="line thick accent" d="M0 1000L390 1000"/>'
            '<path class="tip accent" d="M500 1000L390 1045 390 955z"/>',
        ),
        (
            Arrow([0, 0], [0.5, 0], "truth", head=7),  # shorter than its head, which then begins at the tail
            '<path class="line truth" d="M0 1000L0 1000"/><path class="tip truth" d="M50 1000L0 1029 0 971z"/>',
        ),
        (Arrow([1, 1], [1, 1], "accent"), ""),
        (
            Ring([5, 5], "truth", radius=9),
            '<path class="line ring truth" d="M500 500m-90 0a90 90 0 1 0 180 0a90 90 0 1 0-180 0"/>',
        ),
        (
            Ring([5, 5], "truth", reach=2, dashed=True),
            '<path class="line ring truth dashed" d="M500 500m-200 0a200 200 0 1 0 400 0a200 200 0 1 0-400 0"/>',
        ),
        (
            Label([1, 2], "q̄ < p & 'r'", "ink", "middle", dx=1, dy=-2),
            '<text class="label ink middle" x="110" y="780">q̄ &lt; p &amp; \'r\'</text>',
        ),
        (
            Group("source", (Points([1, 2], "source"),)),
            '<g id="fig-main-source" class="group"><path class="dot m source" d="M100 800h1"/></g>',
        ),
    ],
)
def test_a_mark_becomes_classes_and_integers(mark: Mark, markup: str) -> None:
    """Every mark becomes markup that the style sheet knows: classes and integers, never colours."""
    assert body(mark) == markup


@pytest.mark.parametrize(
    "mark",
    [
        Points(np.zeros((0, 2)), "source"),
        Points(np.zeros((0, 2)), "source", weight=[]),
        Segments(np.zeros((0, 2)), np.zeros((0, 2)), "pair"),
        Path(np.zeros((0, 2)), "ghost"),
        Ticks(np.zeros((0, 2)), np.zeros((0, 2)), "normal"),
        Ellipses(np.zeros((0, 2)), np.zeros((0, 2, 2)), "target"),
    ],
)
def test_nothing_draws_nothing(mark: Mark) -> None:
    assert body(mark) == ""


def test_panel_is_one_labelled_image() -> None:
    """The svg element carries the view box and an escaped name."""
    text = panel_svg(Panel("main", 'x < "y" & z', View(0, 4, 0, 3, width=320), ()), "f")
    assert text.startswith('<svg class="panel" viewBox="0 0 3200 2400" role="img" ')
    assert ' aria-label="x &lt; &quot;y&quot; &amp; z" ' in text


def test_a_ring_s_reach_is_in_world_units() -> None:
    """On a panel twice as wide it doubles; a radius in px does not."""
    wide = View(0.0, 10.0, 0.0, 10.0, width=200.0)
    assert "a400 400 " in body(Ring([5, 5], "truth", reach=2), view=wide)
    assert "a90 90 " in body(Ring([5, 5], "truth", radius=9), view=wide)


def test_points_of_different_weight_share_a_path_by_level() -> None:
    """Opacity has six levels, faint ones drawn first; a weight that rounds to zero is not drawn."""
    text = body(Points([[i, 0] for i in range(5)], "source", weight=[1.0, 0.5, 0.5, 0.01, 0.0]))
    assert text == (
        '<path class="dot m source w3" d="M100 1000h1m99 0h1"/><path class="dot m source w6" d="M0 1000h1"/>'
    )


@settings(deadline=None)
@given(st.lists(st.floats(0, 1), min_size=1, max_size=40))
def test_every_weight_has_one_of_six_levels(weights: list[float]) -> None:
    text = body(Segments([[0, 0]] * len(weights), [[1, 1]] * len(weights), "pair", weight=weights))
    levels = [int(level) for level in re.findall(r"w(\d+)", text)]
    assert levels == sorted(set(levels))
    assert set(levels) <= set(range(1, WEIGHT_LEVELS + 1))
    visible = sum(w * WEIGHT_LEVELS >= 0.5 + 1e-5 for w in weights)
    assert visible <= len(re.findall(r"[Mm]-?\d", text)) <= sum(w * WEIGHT_LEVELS >= 0.5 - 1e-5 for w in weights)


# Bytes


def test_no_negative_zero_and_ties_up() -> None:
    assert snap([-0.0, 0.05, -0.05, 0.15, -0.15]) == [0, 1, 0, 2, -1]


@settings(deadline=None)
@given(
    st.lists(st.tuples(st.integers(-4000, 8000), st.integers(-4000, 8000)), min_size=1, max_size=20),
    st.integers(0, 2**32 - 1),
)
def test_rounding_error_does_not_reach_the_bytes(halves: list[tuple[int, int]], seed: int) -> None:
    """Points on exact rounding ties, and 1e-14 to either side, give the same markup."""
    rng = np.random.default_rng(seed)
    exact = np.array(halves) / 20 / VIEW.scale  # multiples of half a tenth of a px

    def drawing() -> str:
        xy = exact + rng.uniform(-1e-14, 1e-14, exact.shape)
        covariance = np.array([[1.0, 0.2], [0.2, 0.5]]) + rng.uniform(-1e-14, 1e-14)
        marks: list[Mark] = [Points(xy, "source"), Segments(xy, xy[::-1], "pair"), Path(xy, "ghost")]
        return body(*marks, Ellipses(xy, [covariance] * len(xy), "target"), Ring(xy[0], "truth"), Label(xy[0], "a"))

    assert drawing() == drawing()


def test_far_away_is_clamped_and_nan_is_refused() -> None:
    """Coordinates far off screen are clamped to plain integers; NaN is an error rather than a corner of the panel."""
    text = body(Points([[1e300, -np.inf], [0, 0]], "source"), Path([[-1e200, 0], [5, 1e9]], "ghost"))
    assert "e" not in re.sub(r"[a-z]+=|class|path|source|ghost|line", "", text)
    assert all(abs(int(v)) <= 20_000_001 for v in re.findall(r"-?\d+", text))
    with pytest.raises(ValueError, match="not a number"):
        svg(Points([[np.nan, 0]], "source"))


# Ellipses


def rims(text: str) -> list[list[list[int]]]:
    """The points of each ellipse in a path: four cubic curves, their points relative to where each curve begins."""
    shapes = []
    for ellipse in re.findall(r"M[^z]*z", text):
        begin, *rest = np.array([int(v) for v in re.findall(r"-?\d+", ellipse)]).reshape(-1, 2)
        points = [begin]
        for curve in np.reshape(rest, (4, 3, 2)):
            points.extend(points[-1] + curve)
        shapes.append(np.array(points).tolist())
    return shapes


@settings(deadline=None)
@given(st.floats(-3, 3), st.floats(0.05, 4), st.floats(0.05, 4), st.floats(0.5, 3))
def test_ellipse_passes_through_its_standard_deviations(turn: float, a: float, b: float, sigmas: float) -> None:
    """Every on-curve point lies at Mahalanobis distance `sigmas`, and the curve between stays within 0.1 % of it."""
    view = View(-20, 20, -20, 20, width=4000)
    R = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
    covariance = R @ np.diag([a * a, b * b]) @ R.T
    text = body(Ellipses([[1.0, -2.0]], covariance, "target", sigmas=sigmas), view=view)
    numbers = np.array(rims(text)[0], dtype=float)
    world = np.stack([numbers[:, 0] / 1000 - 20, 20 - numbers[:, 1] / 1000], axis=1) - [1.0, -2.0]
    quarters = [world[i : i + 4] for i in range(0, 12, 3)]
    mid = np.array([(q[0] + 3 * q[1] + 3 * q[2] + q[3]) / 8 for q in quarters])
    at = np.concatenate([world[:-1:3], mid])
    distance = np.sqrt(np.einsum("ni,ij,nj->n", at, np.linalg.inv(covariance), at))
    np.testing.assert_allclose(distance, sigmas, rtol=1e-3, atol=0.03)


def test_flat_ellipses_are_drawn() -> None:
    """A covariance without width, or without extent, gives a line or a point rather than an error."""
    text = body(Ellipses([[5, 5], [5, 5]], [[[4, 0], [0, 0]], [[0, 0], [0, 0]]], "target"))
    first, second = rims(text)
    assert {y for _, y in first} == {500}
    assert {value for point in second for value in point} == {500}


def test_an_ellipse_may_be_filled_and_dashed() -> None:
    marks = Ellipses([5, 5], np.eye(2), "target", filled=True), Ellipses([5, 5], np.eye(2), "truth", dashed=True)
    assert re.findall('class="(.*?)"', body(*marks)) == ["line target filled", "line truth dashed"]


# Heat


def test_heat_runs_merge_and_nan_is_empty() -> None:
    """Neighbours of the same level in a row become one rectangle; row 0 is at the bottom."""
    values = [[0.0, 0.0, 1.0, 1.0], [np.nan, 0.0, np.nan, np.nan]]
    text = body(Heat(values, (0, 4, 0, 2), 0.0, 1.0), view=View(0, 4, 0, 2, width=40))
    assert text == (
        '<g class="heat"><path class="h0" d="M0 200h200v-100h-200zm100-100h100v-100h-100z"/>'
        '<path class="h23" d="M200 200h200v-100h-200z"/></g>'
    )


@settings(deadline=None)
@given(st.lists(st.floats(-2, 3), min_size=6, max_size=6))
def test_heat_levels_follow_the_values(values: list[float]) -> None:
    """A cell's level is how many of 24 equal steps its value has reached, limited to the first and the last."""
    grid = np.array(values).reshape(2, 3)
    text = body(Heat(grid, (0, 3, 0, 2), 0.0, 1.0), view=View(0, 3, 0, 2, width=3))
    result = np.full((2, 3), -1)
    for level, d in re.findall(r'class="h(\d+)" d="([^"]*)"', text):
        p = q = 0
        for numbers in re.findall(r"[Mm](-?\d+) ?(-?\d+)h(\d+)v-(\d+)h", d):
            dx, dy, w, h = (int(v) // 10 for v in numbers)
            p, q = x, y = p + dx, q + dy
            assert (result[2 - y : 2 - y + h, x : x + w] == -1).all(), "no tile is drawn twice"
            result[2 - y : 2 - y + h, x : x + w] = int(level)
    expected = np.clip(np.floor(grid * HEAT_LEVELS + 1e-6), 0, HEAT_LEVELS - 1)
    np.testing.assert_array_equal(result, expected)


def test_equal_runs_of_rows_that_follow_each_other_are_one_rectangle() -> None:
    """Three equal rows are one rectangle; a different row ends it, and the same run further up starts a new one."""
    low, high = [0.0, 0.0, 1.0], [1.0, 1.0, 1.0]
    text = body(Heat([low, low, high, low], (0, 3, 0, 4), 0.0, 1.0), view=View(0, 3, 0, 4, width=30))
    assert text == (
        '<g class="heat"><path class="h0" d="M0 400h200v-200h-200zm0-300h200v-100h-200z"/>'
        '<path class="h23" d="M0 200h300v-100h-300zm200 200h100v-200h-100zm0-300h100v-100h-100z"/></g>'
    )


def test_a_value_on_the_edge_of_a_level_has_reached_it_whatever_rounding_says() -> None:
    """One half as two processors compute it is a single level."""
    view = View(0, 2, 0, 1, width=20)
    assert body(Heat([[0.5, 0.5 - 1e-14]], (0, 2, 0, 1), 0.0, 1.0), view=view).count("<path") == 1


def test_flat_heat_is_the_lowest_level() -> None:
    assert re.findall(r"h\d+", body(Heat([[3.0, np.nan]], (0, 2, 0, 1), 3.0, 3.0)).split("d=")[0]) == ["h0"]


# Tiles


def test_tiles_are_areas_of_their_roles_and_a_negative_kind_is_empty() -> None:
    """One path per role, in the order of the roles; the truth and the merely shifted end are not hatched."""
    kinds = [[0, 0, 1], [0, 0, -1]]
    text = body(Tiles(kinds, (0, 3, 0, 2), ("truth", "end-shifted")), view=View(0, 3, 0, 2, width=30))
    assert text == (
        '<g class="heat"><path class="tile truth" d="M0 200h200v-200h-200z"/>'
        '<path class="tile end-shifted" d="M200 200h100v-100h-100z"/></g>'
    )


def test_hatching_ends_where_its_area_does() -> None:
    """A diagonal through two tiles is one line from corner to corner; a separate part of the area has its own line."""
    view = View(0, 3, 0, 3, width=30)

    def hatch(kinds: list[list[int]], role: Role) -> str:
        return "".join(
            re.findall(r'class="hatch [\w-]+" d="([^"]*)"', body(Tiles(kinds, (0, 3, 0, 3), (role,)), view=view))
        )

    lone = [[0, -1, -1], [-1, 0, -1], [-1, -1, -1]]
    assert hatch(lone, "end-turned") == "M0 300l200-200"
    assert hatch([[0, -1, -1], [-1, -1, -1], [-1, -1, 0]], "end-turned") == "M0 300l100-100m100-100l100-100"
    assert hatch([[-1, -1, 0], [-1, 0, -1], [-1, -1, -1]], "end-quarter") == "M300 300l-200-200"
    assert hatch([[0, -1, -1]] * 3, "end-none") == "M0 300v-300"
    pattern = hatch([[0] * 3] * 3, "end-half")
    assert pattern.lower().count("m") == 6  # every second diagonal of three by three tiles, in both directions


# The grid


@pytest.mark.parametrize(
    ("view", "columns"),
    [(View(-6, 6, -4, 4, width=640), 13), (View(-60, 60, -40, 40, width=640), 25), (View(0, 1, 0, 1, width=20), 1)],
)
def test_grid_lines_are_at_whole_units_and_not_crowded(view: View, columns: int) -> None:
    """At every unit if that leaves 24 px between lines, else at every 2nd, 5th or 10th."""
    text = panel_svg(Panel("main", "", view, ()), "f")
    xs = [int(x) for x in re.findall(r"M(\d+) 0V", text)]
    assert len(xs) == columns
    assert all(b - a >= 240 for a, b in pairwise(xs))


# Well-formed whatever is drawn


class _Strict(HTMLParser):
    """Every opened tag is closed in order; no style, no script, no event attribute."""

    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, Any]]) -> None:
        assert tag in {"svg", "g", "text"}
        bare = {"fill", "stroke", "stroke-width", "stroke-linecap", "font-size"} if tag == "svg" else set()
        names = {"class", "viewbox", "role", "aria-label", "focusable", "id", "x", "y", *bare}
        assert {name for name, _ in attrs} <= names
        self.open.append(tag)

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, Any]]) -> None:
        assert tag == "path"
        assert {name for name, _ in attrs} == {"class", "d"}

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag


@settings(deadline=None)
@given(st.text(max_size=40), st.sampled_from(ROLES), st.lists(st.tuples(st.floats(-1e6, 1e6), st.floats(-1e6, 1e6))))
def test_markup_is_well_formed(text: str, role: Any, xy: list[tuple[float, float]]) -> None:
    """Any text and any finite place give markup that closes every tag it opens and has no attributes but classes."""
    points = np.array(xy, dtype=float).reshape(-1, 2)
    marks = (Label([1, 1], text, role), Group("g", (Points(points, role), Path(points, role))))
    reader = _Strict()
    reader.feed(panel_svg(Panel("main", text, VIEW, marks), "f"))
    reader.close()
    assert not reader.open


@given(st.lists(st.tuples(*[st.floats(0, 10) | st.sampled_from([2.0, 5.0])] * 4), min_size=1, max_size=12))
def test_lines_lie_where_their_ends_are(ends: list[tuple[float, float, float, float]]) -> None:
    """Relative coordinates, read back as absolute ones, are exactly the snapped ends, however many lines there are. A
    move is written only where a line does not begin at the end of the one before."""
    a, b = np.array(ends)[:, :2], np.array(ends)[:, 2:]
    (d,) = re.findall(r' d="([^"]*)"', body(Segments(a, b, "pair")))
    at, lines, moves = np.zeros(2, dtype=int), [], 0
    for command, numbers in re.findall(r"([Mmhvl])([-\d ]+)", d):
        values = [int(number) for number in re.findall(r"-?\d+", numbers)]
        step = {"h": [*values, 0], "v": [0, *values]}.get(command, values)
        to = np.array(step) if command == "M" else at + step
        if command in "Mm":
            moves += 1
        else:
            lines.append((at.tolist(), to.tolist()))
        at = to
    view = View(0, 10, 0, 10, width=100)
    expected = [(snap(begin), snap(end)) for begin, end in zip(view.px(a), view.px(b), strict=True)]
    assert lines == expected
    assert moves == 1 + sum(begin != end for (_, end), (begin, _) in pairwise(expected))
