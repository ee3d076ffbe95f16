"""Plots: drawn in the page, found by name, computed once, and reported if placed wrongly."""

from __future__ import annotations

import gzip
import re
import subprocess
import sys
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest

from sitegen.cache import pool
from sitegen.cache.files import cache_dir
from sitegen.chapters.values import CallError, of_plot, read_call
from sitegen.check.rules import html_errors
from sitegen.figures.gallery import Gallery, Placed
from sitegen.figures.matplotlib_svg import COLOURS, clean, draw
from sitegen.plots import basins, coverage, icp_reach, sweep_table, trial_budget
from sitegen.plots._rates import wilson
from sitegen.plots.registry import all_plots, longest_first, make_ahead, runs
from sitegen.problems import Place
from sitegen.progress import quiet
from solvers.studies.redrawn import PLACES
from tests.sitegen.conftest import TOY_PLOT, Counted, Project

PLACED = """\
See :ref[fig:dots].

::plot[The *dots*.]{toy-plot id=dots}

:value[plots.toy_plot.highest(times=2)]{.1f}
"""
LIMIT = 25_000


def page_of(project: Project, body: str = PLACED) -> str:
    project.chapter(body)
    project.write("content/00-start.md", "---\ntitle: Start\nrung: '0'\nsummary: S\n---\n\nText.\n")
    project.build()
    return project.page("second.html")


def test_a_plot_stands_in_the_page(project: Project) -> None:
    """Both drawings, numbered with the figures, with words and table, and nothing that the policy blocks."""
    page = page_of(project)
    assert page.count('class="plot-svg"') == 2
    assert '<a class="ref" href="#fig-dots">Figure 1.1</a>' in page
    assert "3 dots &amp; &lt;words&gt;." in page
    assert "wide &amp; &lt;large&gt;" in page
    assert "<td>3.5</td>" in page
    assert '<span class="computed">7.0</span>' in page
    assert " style=" not in page
    assert html_errors(page) == []
    ids = re.findall(r' id="([^"]+)"', page)
    assert len(ids) == len(set(ids))


def test_figures_and_plots_are_numbered_together(project: Project) -> None:
    page = page_of(project, "::plot[One.]{toy-plot}\n\n::figure[Two.]{toy}\n\n::plot[Three.]{toy-plot id=three}\n")
    numbers = re.findall(r'<span class="figure-number"><a href="#(fig-[\w-]+)">Figure (?:\d\.)?(\d)</a>', page)
    assert numbers == [("fig-toy-plot", "1"), ("fig-toy", "2"), ("fig-three", "3")]


@pytest.mark.parametrize(
    ("body", "messages"),
    [
        ("::plot[C]{toy-plt}\n", ["7:11: unknown plot 'toy-plt'; did you mean 'toy-plot'?"]),
        ("::plot[C]{}\n", ["7:11: missing plot name, as in {trial-budget id=budget}"]),
        ("::plot[]{toy-plot}\n", ["7:1: ::plot has no text"]),
        ("::plot[C]{toy-plot idd=a}\n", ["7:20: unknown plot attribute 'idd'; did you mean 'id'?"]),
        ("::plot[C]{toy-plot id=a_b}\n", ["7:23: invalid id 'a_b': use letters, digits and hyphens"]),
        ("::plot[C]{toy-plot id=-}\n", ["7:23: invalid id '-': use letters, digits and hyphens"]),
        ("::figure[C]{toy id=-}\n", ["7:20: invalid id '-': use letters, digits and hyphens"]),
        ("::figure[C]{toy id=ä}\n", ["7:20: invalid id 'ä': use letters, digits and hyphens"]),
        (
            "::plot[C]{toy-plot id=a}\n\n::figure[C]{toy id=a}\n",
            ["9:1: duplicate figure 'a' in this chapter (first on line 7)"],
        ),
        ("::plot[C]{toy-plot id=dots}\n\n:ref[fig:dot]\n", ["9:6: unknown figure 'dot'; did you mean 'dots'?"]),
        (":value[plots.toy_plt.highest()]\n", ["7:14: unknown plot 'toy_plt'; did you mean 'toy_plot'?"]),
        (
            ":value[plots.toy_plot.higest()]\n",
            ["7:23: plots.toy_plot has no number 'higest'; did you mean 'highest'?"],
        ),
        (
            ":value[plots.toy_plot.highest.more()]\n",
            ["7:23: plots.toy_plot has no number 'highest.more'; did you mean 'highest'?"],
        ),
        (":value[plots.toy_plot()]\n", ["7:14: plots.toy_plot has no number ''; known: highest"]),
    ],
)
def test_what_is_placed_wrongly_is_told_with_its_place(second: Any, body: str, messages: list[str]) -> None:
    assert second(body) == messages


def test_a_plot_that_fails_names_itself_and_its_place(project: Project) -> None:
    def fails(result: Counted, figure: Any, narrow: bool) -> None:
        figure.subplots().plot([0, 1], [0, 1], color="#123456")

    project.plots = {"toy-plot": replace(TOY_PLOT, draw=fails, look="another")}
    project.chapter(PLACED)
    (problem, *_) = [p for p in project.problems() if "plot" in p]
    assert "01-second.md:9:1: the plot cannot be drawn: ValueError: unknown colour #123456" in problem


def test_what_is_known_is_not_computed_again(tmp_path: Path) -> None:
    """Computed and drawn once per state of the code; a new drawing does not cause a new computation."""
    counts = {"compute": 0, "draw": 0}

    def compute() -> Counted:
        counts["compute"] += 1
        return Counted(((0.5, 0.1 + 0.2), (2.0, 1.0)))

    def draw(result: Counted, figure: Any, narrow: bool) -> None:
        counts["draw"] += 1
        assert result == Counted(((0.5, 0.1 + 0.2), (2.0, 1.0)))

    plot = replace(TOY_PLOT, compute=compute, draw=draw)
    for variant, expected in (
        (plot, {"compute": 1, "draw": 2}),
        (plot, {"compute": 1, "draw": 2}),
        (replace(plot, look="other"), {"compute": 1, "draw": 4}),
        (replace(plot, code="other"), {"compute": 2, "draw": 4}),
    ):
        Gallery({"toy-plot": variant}, tmp_path).drawn(Placed("p", "1", variant, Place("x")))
        assert counts == expected


def test_editing_the_drawing_leaves_what_is_computed() -> None:
    """The key of a result depends on what compute() uses, and on nothing else in the module."""
    source = "N = 3\ndef compute():\n    return help(N)\n\ndef help(n):\n    return n\n\ndef draw():\n    pass\n"
    assert runs(source) == runs(source.replace("pass", "return 1").replace("def draw", "# a comment\ndef draw"))
    for old, new in (("N = 3", "N = 4"), ("return n\n", "return -n\n"), ("help(N)", "help(N + 1)")):
        assert runs(source) != runs(source.replace(old, new))


def test_a_drawing_is_the_same_twice_and_small() -> None:
    first, second = (
        draw(lambda figure: TOY_PLOT.draw(TOY_PLOT.compute(), figure, False), (300, 200), "p") for _ in range(2)
    )
    assert first == second
    assert "202" not in re.sub(r'="[^"]*"', "", first)  # no date
    assert len(first) < 6000


def test_only_what_can_stand_in_a_page_is_let_through() -> None:
    head = '<svg xmlns="http://www.w3.org/2000/svg" xmlns:xlink="http://www.w3.org/1999/xlink">'
    style = f"fill: {COLOURS['source']}; stroke: none"
    path = f'<g id="a"><path id="b" d="M 1.00001 2 \nL 3 4.06 \nz\n" style="{style}"/></g>'
    path += '<path d="M 0 0 \nL 9 9 \nz" style="fill: none"/>'  # invisible
    assert clean(f"{head}{path}</svg>", (10, 20), "p") == (
        '<svg class="plot-svg" viewBox="0 0 10 20" width="10" height="20">'
        '<path class="f-source" d="M1 2l2 2.1z" stroke="none"/></svg>'
    )
    for bad in ('<image href="data:,"/>', '<path d="M 0 0" style="fill: #123456"/>', '<path style="filter: x"/>'):
        with pytest.raises(ValueError, match=r"unsupported element|unknown colour|unsupported style"):
            clean(f"{head}{bad}</svg>", (1, 1), "p")


def test_matplotlib_waits_until_something_is_drawn() -> None:
    """Importing all plots and reading kept results does not import matplotlib."""
    code = (
        "import sys; from sitegen.pipeline import build; from sitegen.plots import registry; registry.all_plots(); "
        "assert 'matplotlib' not in sys.modules"
    )
    subprocess.run([sys.executable, "-c", code], check=True, cwd=Path(__file__).resolve().parents[3])


@pytest.mark.parametrize(
    ("hits", "of", "low", "high"), [(0, 10, 0.0, 0.2775), (5, 10, 0.2366, 0.7634), (10, 10, 0.7225, 1.0)]
)
def test_wilsons_interval(hits: int, of: int, low: float, high: float) -> None:
    """Compared with the published 95 % intervals."""
    assert wilson(hits, of) == pytest.approx((low, high), abs=1e-4)


@pytest.mark.parametrize("name", sorted(all_plots()))
def test_every_plot_of_the_site(name: str) -> None:
    """From its kept result: words that end in a full stop, a table without gaps, small and legible drawings."""
    plot = all_plots()[name]
    gallery = Gallery({name: plot}, cache_dir())
    drawing = gallery.drawn(Placed(name, "1", plot, Place("x")))
    assert drawing.words.endswith(".")
    assert set(drawing.svgs) == {"wide", "narrow"}
    assert len(gzip.compress("".join(drawing.svgs.values()).encode(), 9)) < LIMIT
    for svg in drawing.svgs.values():
        assert "style=" not in svg
        sizes = [float(size) for size in re.findall(r'font-size="([\d.]+)"', svg)]
        assert sizes
        assert min(sizes) >= 11.0
    assert plot.sizes["narrow"][0] <= 350
    assert plot.sizes["wide"][0] <= 720
    if drawing.table:
        heads, rows = drawing.table
        assert all(len(row) == len(heads) for row in rows)


def result(name: str) -> Any:
    """The result of one of the site's plots, from the cache if it is there."""
    return Gallery(all_plots(), cache_dir()).result(all_plots()[name])


def test_failures_at_the_budget_stay_within_the_promise() -> None:
    """Runs of N trials that know the true share fail no more often than the confidence allows, at every share."""
    outcome = result("trial-budget")
    for p, failures in zip(outcome.confidences, outcome.failures, strict=True):
        assert max(failures) <= (1.0 - p) * outcome.runs
    missed, failed = (of(outcome, 0.5, 0.9) for of in (trial_budget.missed, trial_budget.failed))
    assert 10.0 - missed > missed - failed > 0.0, "most of the margin is rounding"


def test_graduated_weights_give_out_first_where_wrong_partners_lean() -> None:
    """Never right more often than RANSAC, and with wrong partners all round at least as often as with leaning ones."""
    outcome = result("graduated")
    ransac, leaning, scattered = outcome.successes
    assert all(a >= b >= c for a, b, c in zip(ransac, scattered, leaning, strict=True))
    assert min(ransac) > 0.95 * outcome.runs > 2 * leaning[-1]


def test_the_reach_of_icp_depends_on_setting_and_side() -> None:
    """Plateaus end at other angles in other settings; with junk, some starts succeed where no clean one does."""
    outcome = result("icp-reach")
    ends = {s: (icp_reach.sure(outcome, s, -1), icp_reach.sure(outcome, s, 1)) for s in outcome.settings}
    assert len(set(ends.values())) == len(ends)
    assert ends["clean"][0] != -ends["clean"][1]
    assert icp_reach.success(outcome, "outliers", -50) > icp_reach.success(outcome, "clean", -50) == 0.0


def test_weights_help_from_near_and_not_from_midway() -> None:
    """For every residual, unweighted fits succeed less often than every weighted kind from near, and at least as often
    from midway."""
    outcome = result("residual-weights")
    near, midway = outcome.successes
    assert all(row[0] < min(row[1:]) for row in near)
    assert all(row[0] >= max(row[1:]) for row in midway)
    assert wilson(midway[0][0], outcome.runs)[0] < wilson(midway[0][1], outcome.runs)[1], "so this shows no harm"


def test_point_pairs_crab_and_planes_do_not() -> None:
    """Point pairs never overtake the mean that the long wall allows, and stop short; planes arrive in two steps."""
    outcome = result("crab-walk")
    point, plane = outcome.gaps
    bounds = [0.6 * (1.0 - outcome.facing) ** step for step in range(len(point))]
    assert all(a >= b - 1e-9 for a, b in zip(point, bounds, strict=True))
    assert point[-1] == point[-2] > 0.15
    assert abs(plane[2]) < 0.01
    assert [corners[0][2][0] for corners in outcome.corners] == pytest.approx([7.4, 7.4])


def test_four_grids_jump_more_often_and_less_far() -> None:
    outcome = result("score-continuity")
    assert outcome.jumps[1] > outcome.jumps[0] > 100
    assert outcome.mean[1] < outcome.mean[0]
    assert outcome.largest[1] < outcome.largest[0]


def test_coarse_to_fine_reaches_farther_and_not_everywhere() -> None:
    outcome = result("coarse-to-fine")
    for coarse, fine in (outcome.by_angle, outcome.by_offset):
        assert all(a <= b for a, b in zip(coarse, fine, strict=True))
        assert sum(coarse) < sum(fine)
        assert fine[-1] == 0
    # Away from the truth, by angle either way and by offset, the single cell size drops to zero first.
    middle = outcome.angles.index(0)
    ways = [*(tuple(row[middle::way] for row in outcome.by_angle) for way in (1, -1)), outcome.by_offset]
    assert all(coarse.index(0) < fine.index(0) for coarse, fine in ways)


def test_the_basins_are_as_the_chapter_says() -> None:
    """In both settings RANSAC's map is one colour, and MMD-Reg's basin is the widest of the others."""
    outcome = result("basins")
    for setting in outcome.settings:
        flat = outcome.successes[outcome.methods.index("ransac-congruent")][outcome.settings.index(setting)]
        assert len({count for row in flat for count in row}) == 1
        shares = {m: basins.share(outcome, m, setting) for m in outcome.methods if m != "ransac-congruent"}
        assert max(shares, key=lambda m: shares[m]) == "mmd"
    table = result("sweep-table")
    assert sweep_table.rotation(table, "mmd", "clean") > 2.0 * sweep_table.rotation(table, "icp", "clean")
    assert sweep_table.success(table, "ndt", "combo") > sweep_table.success(table, "ndt", "clean")


def test_what_is_made_ahead_is_what_the_build_would_make(tmp_path: Path) -> None:
    """Computed and drawn in other processes, then in this one: the same files, and nothing is left to make."""
    plots = [Placed(name, "1", all_plots()[name], Place("x")) for name in ("sweep-table", "basins")]
    ahead, alone = Gallery(all_plots(), tmp_path / "one"), Gallery(all_plots(), tmp_path / "two")
    assert all(map(ahead.lacks, plots))
    pool.make("plots", [(make_ahead, (p.plot.name, p.id, tmp_path / "one")) for p in plots], quiet)
    assert not any(map(ahead.lacks, plots))
    before = {path.name: path.stat().st_mtime_ns for path in (tmp_path / "one").rglob("*") if path.is_file()}
    for p in plots:
        assert ahead.drawn(p) == alone.drawn(p)
    assert {path.name: path.stat().st_mtime_ns for path in (tmp_path / "one").rglob("*") if path.is_file()} == before
    assert len(before) == 4


def test_the_longest_plots_are_begun_first() -> None:
    """By the seconds stated in their modules; the others keep the order of the site."""
    plots = [Placed(name, "1", plot, Place("x")) for name, plot in all_plots().items()]
    order = [p.plot for p in longest_first(plots)]
    assert order[0].name == "four-reach"
    assert all(a.seconds >= b.seconds for a, b in pairwise(order))
    quick = [name for name, plot in all_plots().items() if not plot.seconds]
    assert [plot.name for plot in order if not plot.seconds] == quick


def test_what_fails_ahead_is_left_to_the_build(tmp_path: Path) -> None:
    """An unknown plot does not affect the other pieces."""
    plot = Placed("basins", "1", all_plots()["basins"], Place("x"))
    pieces = [(make_ahead, (name, "basins", tmp_path)) for name in ("no-such-plot", "basins")]
    pool.make("plots", pieces, quiet)
    assert not Gallery(all_plots(), tmp_path).lacks(plot)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        ("plots.trial_budget.failed(0.4, 0.9)", "share: expected one of 0.3, 0.5, 0.7, 0.9; got 0.4"),
        ("plots.sweep_table.success('icpp', 'clean')", "method: unknown 'icpp'; did you mean 'icp'?"),
        ("plots.success_curves.success('icp', 'noise', 0.4)", "value: expected one of 0, 0.02, "),
    ],
)
def test_numbers_that_a_plot_does_not_have_are_told(call: str, message: str) -> None:
    gallery = Gallery(all_plots(), cache_dir())
    with pytest.raises(CallError, match=re.escape(message)):
        of_plot(read_call(call), gallery)


@pytest.mark.parametrize("narrow", [False, True])
def test_the_ways_to_a_covariance_have_marks_of_their_own(narrow: bool) -> None:
    """In the charts as under them: colour alone tells nothing to who cannot see it."""
    from matplotlib.figure import Figure

    rows = [(5, 5, 5), (5, 5, 5), (5, None, 5)]
    counts, spread = (tuple((row,) * 3 for row in rows) for _ in range(2))
    places, ways = PLACES, coverage.SHOWN
    result = coverage.Result(10, tuple(coverage.RESIDUALS), places, ways, counts, spread, 10, (1, 1, None))
    roles = {"hessian": "accent", "censi": "inlier", "sampled": "source"}.items()
    figure = Figure(figsize=(7, 5))
    coverage.draw(result, figure, narrow)
    lines = [line for axes in figure.axes for line in axes.lines if line.get_marker() != "None"]
    marks = {way: {line.get_marker() for line in lines if line.get_color() == COLOURS[role]} for way, role in roles}
    assert sorted(map(len, marks.values())) == [1, 1, 1]
    assert len(set.union(*marks.values())) == 3
    assert len(lines) == 8 + 3
