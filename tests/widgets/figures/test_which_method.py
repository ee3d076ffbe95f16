"""The advice names existing methods, is consistent, and holds against the truth: on 25 scenes for every answer."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from solvers import METHODS
from tests.widgets.states import readouts, state_after
from widgets.drawing.picture import Arrow, Label, Points, Ring, Segments
from widgets.drawing.picture import Path as Line
from widgets.engine.contract import Action
from widgets.figures.which_method.figure import DETAILS, RAILS, WIDGET, draw, known
from widgets.figures.which_method.figure import alone as others
from widgets.figures.which_method.rules import OTHERS, PATHS, QUESTIONS, RUNGS, TAKES, Answers, advise, every
from widgets.figures.which_method.trial import NOISE, TREES, grove, kept, run

# Where pairs are given, answers that then play no part are tried only once.
TRIED = [a for a in every() if a.pairs == "none" or a == Answers(a.pairs)]
Why = Callable[[str, Mapping[str, str]], None]


def label(answers: Answers) -> str:
    return "-".join(vars(answers).values())


def alone(name: str, answers: Answers) -> int:
    """On how many of the 25 scenes a rung by itself finds the truth."""
    return run((name,), answers).found


def unfit(answers: Answers) -> list[str]:
    """The crossed-out rungs that can be run; those that use pairs need some."""
    methods = () if answers.pairs != "none" else ("kabsch", "ransac")
    return [name for name in advise(answers).of("not") if name not in methods]


@pytest.mark.parametrize("answers", every(), ids=label)
def test_every_answer_gets_a_path_and_a_word_on_every_rung(answers: Answers) -> None:
    advice = advise(answers)
    assert advice.path[-1] == "judge"
    assert len(advice.path) == len(set(advice.path)) >= 2
    assert list(advice.why) == list(RUNGS)
    assert set(advice.of("take")) == set(advice.path)
    assert all(words for _, words in advice.why.values())
    assert advice.of("can", "not", "idle")


def test_every_method_that_is_named_exists() -> None:
    assert {rung.method for rung in RUNGS.values() if rung.method} <= set(METHODS)
    names = {name for _, path in PATHS for name in path} - {"refine"}
    assert names | {"icp", "gicp"} == set(TAKES)
    assert set(OTHERS) | set(TAKES) == set(RUNGS)
    for row in [*PATHS, *(row for rows in OTHERS.values() for row in rows)]:
        assert all(answer in QUESTIONS[question] for question, answer in row[0].items())


def test_every_row_of_the_tables_is_the_first_to_fit_somewhere() -> None:
    """No row is entirely covered by those above it."""
    for rows in (PATHS, *OTHERS.values()):
        fits = [{a for a in every() if all(getattr(a, q) == x for q, x in case.items())} for case, _ in rows]
        for k, fit in enumerate(fits):
            assert fit - set().union(*fits[:k]), rows[k]


@pytest.mark.native
def test_the_pages_table_gives_the_same_paths() -> None:
    """The start page's table for readers without scripts: each answer fits one row, and the row names its path."""
    page = (Path(__file__).resolve().parents[3] / "content" / "00-start.md").read_text("utf-8")
    lines = page.partition("| Pairs | Start | Overlap |")[2].partition("\n\n")[0].splitlines()[2:]
    rows = [[cell.strip() for cell in line.strip("|").split("|")] for line in lines]
    names = {"closed form": "kabsch", "vote": "ransac", "proposal": "propose", "soft weights": "soft"}
    for answers in every():
        choice = (answers.pairs, answers.start, answers.overlap, answers.surfaces)
        labels = [QUESTIONS[q][a].lower().removeprefix("about ") for q, a in zip(QUESTIONS, choice, strict=True)]
        fit = [row[4] for row in rows if all(_covers(cell, word) for cell, word in zip(row[:4], labels, strict=True))]
        assert len(fit) == 1, (answers, fit)
        take = fit[0]
        if "GICP on walls" in take:
            take = take.partition("GICP on walls")[0] + ("GICP" if answers.surfaces == "walls" else "ICP")
        words = re.findall(r"closed form|vote|proposal|search|soft weights|G?ICP", re.sub(r"\(:ref.*?\)", "", take))
        assert (*(names.get(word, word.lower()) for word in words), "judge") == advise(answers).path, answers


def _covers(cell: str, answer: str) -> bool:
    """Whether a cell of the table covers an answer."""
    return cell in ("any", "either", "–") or answer in cell.split(" or ")


# Reasons against a rung, each with the answers for which it holds.
WORDS: dict[str, Callable[[Answers], bool]] = {
    "there are no pairs": lambda answers: answers.pairs == "none",
    "needs a start": lambda answers: answers.start == "none",
    "too far": lambda answers: answers.start == "rough",
    "there is a start": lambda answers: answers.start != "none",
    "half overlap": lambda answers: answers.overlap == "half",
    "without walls": lambda answers: answers.surfaces == "points",
    "on walls": lambda answers: answers.surfaces == "walls",
    "unused": lambda answers: answers.pairs != "none",
}


@pytest.mark.parametrize("answers", every(), ids=label)
def test_a_word_why_not_is_true_of_the_answers(answers: Answers) -> None:
    """No rung is rejected for lacking what the answers give it."""
    for name, (verdict, words) in advise(answers).why.items():
        assert all(true(answers) for part, true in WORDS.items() if part in words), (name, words)
        assert verdict == "take" or words not in TAKES.values(), name


def test_each_word_why_not_is_said_somewhere() -> None:
    """Otherwise the test above would look for words that are never used."""
    messages = {words for answers in every() for _, words in advise(answers).why.values()}
    assert not [part for part in WORDS if not any(part in words for words in messages)]


@pytest.mark.native
@pytest.mark.parametrize("answers", TRIED, ids=label)
def test_the_path_finds_the_truth_and_what_does_not_fit_misses_it(answers: Answers) -> None:
    """For each combination of answers, on 25 scenes with these properties: the path ends within 5° and 0.2 u of the
    truth on 23 or more; so does each rung that would do alone; a crossed-out rung, if it can be run, on 18 or fewer."""
    advice = advise(answers)
    assert run(advice.path, answers).found >= 23
    for name in advice.of("can"):
        if answers.pairs != "none" or name != "ransac":
            assert alone(name, answers) >= 23, name
    for name in unfit(answers):
        assert alone(name, answers) <= 18, name


@pytest.mark.native
@pytest.mark.parametrize("overlap", QUESTIONS["overlap"])
def test_what_is_not_needed_may_do_better(overlap: str) -> None:
    """From a rough start on scattered points the search is not needed; alone it succeeds on all 25 scenes, and the path
    on fewer."""
    points = Answers("none", "rough", overlap, "points")
    assert "search" in advise(points).of("idle")
    assert alone("search", points) == 25 > run(advise(points).path, points).found


@pytest.mark.native
@pytest.mark.parametrize("overlap", QUESTIONS["overlap"])
def test_a_surface_method_is_the_more_exact_on_walls_and_the_less_without(overlap: str) -> None:
    """From the close start the median rotation error of GICP is less than two thirds of ICP's on walls; among scattered
    points it is more than 1.5 times that of the path, which refines by ICP."""
    walls = Answers("none", "near", overlap, "walls")
    assert advise(walls).path == ("gicp", "judge")
    assert run(("gicp",), walls).turn < 0.67 * run(("icp",), walls).turn
    points = replace(walls, surfaces="points")
    path = advise(points).path
    assert path[-2] == "icp"
    assert run(("gicp",), points).turn > 1.5 * run(path, points).turn


@pytest.mark.native
def test_a_start_decides_over_local_methods(why: Why) -> None:
    """In the noisy room with junk, ICP succeeds on all 25 scenes from 10° and 0.3 u, and NDT on 24 or more; from 45°
    and 1.43 u ICP on nine or fewer and NDT on five or fewer; from 150° neither on any."""
    starts = {"10°": "near", "45°": "rough", "150°": "none"}
    icp, ndt = ([alone(name, Answers("none", s, "most", "walls")) for s in starts.values()] for name in ("icp", "ndt"))
    why("the start", {start: f"ICP {a}, NDT {b} of 25" for start, a, b in zip(starts, icp, ndt, strict=True)})
    assert icp[0] == 25
    assert ndt[0] >= 24
    assert icp[1] <= 9
    assert ndt[1] <= 5
    assert icp[2] == ndt[2] == 0


@pytest.mark.native
def test_half_an_overlap_misleads_what_compares_everything(why: Why) -> None:
    """From the rough start soft weights and MMD succeed on all 25 rooms if the target sees the whole room; if it sees
    60 % of it, soft weights on at most 18 and MMD on at most ten."""
    overlaps = {"all of it": "most", "60 %": "half"}
    soft, mmd = ([alone(n, Answers("none", "rough", o, "walls")) for o in overlaps.values()] for n in ("soft", "mmd"))
    outcomes = {part: f"soft weights {a}, MMD {b} of 25" for part, a, b in zip(overlaps, soft, mmd, strict=True)}
    why("how much of the room the target sees", outcomes)
    assert (soft[0], mmd[0]) == (25, 25)
    assert soft[1] <= 18
    assert mmd[1] <= 10


@pytest.mark.native
def test_wrong_pairs_decide_between_the_closed_form_and_a_vote(why: Why) -> None:
    """With 13 right pairs and some noise the closed form finds all 25 poses; with four of the 13 wrong it finds none,
    and the vote finds all."""
    right, corrupted = Answers("right"), Answers("some")
    counts = {"none": alone("kabsch", right), "four of 13": alone("kabsch", corrupted)}
    why("the wrong pairs, for the closed form", {kind: f"{count} of 25" for kind, count in counts.items()})
    assert counts == {"none": 25, "four of 13": 0}
    assert alone("ransac", corrupted) == 25


def test_a_grove_is_seen_by_the_target_as_far_as_it_is_told() -> None:
    """The source has every trunk and the target only those at the left, each with its own noise."""
    for overlap, count in ((1.0, 54), (0.6, 32)):
        source, target = grove(40, overlap)
        assert kept(overlap) == count
        assert source.shape == (TREES, 2)
        assert target.shape == (count, 2)
        nearest = np.hypot(*(source[:, None] - target).transpose(2, 0, 1)).min(axis=0)
        assert np.median(nearest) < 3 * NOISE
        assert target[:, 0].max() < np.sort(source[:, 0])[count] + 8 * NOISE
    np.testing.assert_array_equal(grove(53, 1.0)[0], grove(53, 0.6)[0])


GIVEN = {"pairs": "none", "start": "rough", "overlap": "most", "surfaces": "walls"}


def test_the_ladder_has_a_sign_for_each_verdict_and_lights_the_path_in_order() -> None:
    """Between the rails: a thick bar in the path, a ring where a rung would do alone, a cross where it does not fit, a
    dashed bar where it is not needed. Numbered stages climb from row to row, joined by a line and an arrow each."""
    state = state_after(WIDGET, **GIVEN)
    marks, advice = draw(state).panels[0].marks, state.advice
    straight = [m for m in marks if isinstance(m, Line) and not m.closed]
    bars = [m for m in straight if np.ptp(np.asarray(m.xy)[:, 1]) == 0.0]
    heights = dict(zip(RUNGS, (float(np.asarray(bar.xy)[0, 1]) for bar in bars), strict=True))
    assert len(set(np.round(np.diff(list(heights.values())), 9))) == 1
    signs = {float(np.reshape(m.xy, 2)[1]): m.shape for m in marks if isinstance(m, Points)}
    for bar, (name, (verdict, words)) in zip(bars, advice.why.items(), strict=True):
        assert bar.thick == (verdict == "take")
        assert bar.dashed == (verdict in ("idle", "not"))
        assert signs.get(heights[name]) == {"can": "ring", "not": "cross"}.get(verdict)
        texts = {m.text for m in marks if isinstance(m, Label) and np.reshape(m.xy, 2)[1] == heights[name]}
        assert {RUNGS[name].number, RUNGS[name].says, words} <= texts
    rings = [np.reshape(m.xy, 2) for m in marks if isinstance(m, Ring)]
    assert [ring[1] for ring in rings] == [heights[name] for name in advice.path]
    numbers = [m.text for m in marks if isinstance(m, Label) and m.role == "accent" and m.anchor == "middle"]
    assert numbers == [str(k + 1) for k in range(len(rings))]
    lines = [np.reshape([m.a, m.b], (2, 2)) for m in marks if isinstance(m, Segments)]
    arrows = [m for m in marks if isinstance(m, Arrow)]
    assert len(lines) == len(arrows) == len(rings) - 1
    for line, arrow, first, second in zip(lines, arrows, rings[:-1], rings[1:], strict=True):
        assert line[0, 0] == line[1, 0] == first[0]
        assert abs(line[0, 1] - first[1]) < abs(second[1] - first[1])
        assert (line[0, 1] - first[1]) * (second[1] - first[1]) > 0.0
        np.testing.assert_allclose(arrow.a, line[1])
        assert np.asarray(arrow.b)[1] == second[1]
        assert first[0] < np.asarray(arrow.b)[0] < second[0]
    bands = [np.asarray(m.xy) for m in marks if isinstance(m, Line) and m.closed]
    assert [band[:, 1].mean() for band in bands] == [heights[name] for name in advice.path]
    rails = [np.asarray(m.xy) for m in marks if isinstance(m, Line) and m.role == "ghost" and m.thick]
    assert [rail[0, 0] for rail in rails] == list(RAILS)
    assert all(np.ptp(rail[:, 1]) > np.ptp(list(heights.values())) for rail in rails)


@pytest.mark.native
def test_once_tried_each_rung_has_its_count_and_the_readouts_are_of_the_path() -> None:
    """They come one after another; what has not been run yet is an ellipsis."""
    state = state_after(WIDGET, Action("press", "try"), **GIVEN)
    assert draw(state).disabled == {"try"}
    paths = [state.advice.path, *others(state.advice, state.answers)]
    found = {("judge" if k == 0 else path[0]): run(path, state.answers) for k, path in enumerate(paths)}
    for detail in (0, 1, len(paths) - 1, DETAILS - 1):
        picture = draw(state, detail)
        expected = [str(each.found) if k < detail else "…" for k, each in enumerate(found.values())]
        counts = [m for m in picture.panels[0].marks if isinstance(m, Label) and np.reshape(m.xy, 2)[0] > 600.0]
        rows = sorted(counts[:-1], key=lambda label: -list(found).index(_rung(label, picture.panels[0].marks)))
        assert [label.text for label in rows][::-1] == expected
        text = readouts(picture)
        assert text["found"] == expected[0]
        assert text["rotation_error"] == (f"{found['judge'].turn:.2f}" if detail else "…")
        unfit_counts = [run_.found for name, run_ in found.items() if name in state.advice.of("not")]
        assert text["unfit"] == (str(max(unfit_counts)) if detail >= len(paths) else "…")
    assert known(state) == DETAILS - 1
    assert f"the path ends at the truth {found['judge'].found} times" in draw(state).description
    assert readouts(draw(state_after(WIDGET, **GIVEN)))["found"] == "–"


def _rung(label: Label, marks: tuple[object, ...]) -> str:
    """The rung in whose row a label is."""
    y = np.reshape(label.xy, 2)[1]
    words = {m.text for m in marks if isinstance(m, Label) and np.reshape(m.xy, 2)[1] == y}
    (name,) = (name for name, rung in RUNGS.items() if rung.says in words)
    return name
