"""The map of the ladder: each small picture is computed by the rule that it names."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import pytest

from widgets.engine.contract import preset
from widgets.engine.host import Host
from widgets.figures.ladder_map import CELL, COUNT, LEAST, SHIFT, WIDGET, WRONG, Controls, feature_means, start, weights

TURNS = [-180.0, -40.0, -10.0, 0.0, 90.0]


def panels(turn: float) -> dict[str, str]:
    frame = Host().render("f", preset(WIDGET, "default", {"turn": turn}).plain())
    return {panel["name"]: panel["svg"] for panel in frame["panels"]}


def ends(svg: str, classes: str) -> np.ndarray[Any, Any]:
    """World coordinates (n, 4) of the segments drawn with these classes."""
    d = "".join(re.findall(rf'class="{classes}" d="([^"]*)"', svg))
    found = np.array([[int(v) for v in m] for m in re.findall(r"M(-?\d+) (-?\d+)L(-?\d+) (-?\d+)", d)]) / 500.0
    return np.stack([found[:, 0] - 3, 2.5 - found[:, 1], found[:, 2] - 3, 2.5 - found[:, 3]], axis=1)


@pytest.mark.parametrize("turn", TURNS)
def test_known_pairs_know(turn: float) -> None:
    """Rung 1 joins partner to partner at every turn; on rung 2 ten of the partners are others."""
    state, drawn = start(Controls(turn), 40), panels(turn)
    pairs = ends(drawn["pairs"], "line ink w4")
    np.testing.assert_allclose(pairs, np.hstack([state.moved, state.target]), atol=2e-3)
    assert len(ends(drawn["corrupted"], "line ink w4")) == COUNT - WRONG
    false = ends(drawn["corrupted"], "line outlier dashed")
    np.testing.assert_allclose(false, np.hstack([state.moved, state.target[state.proposed]])[state.wrong], atol=2e-3)
    assert (state.proposed != np.arange(COUNT)).sum() == WRONG


@pytest.mark.parametrize("turn", TURNS)
def test_nearest_is_nearest(turn: float) -> None:
    """No target point is nearer than the one that rung 3 draws a line to; rung 3½'s line is no longer."""
    state, drawn = start(Controls(turn), 40), panels(turn)
    lines = ends(drawn["nearest"], "line ink w4")
    length = np.linalg.norm(lines[:, 2:] - lines[:, :2], axis=1)
    np.testing.assert_allclose(length, np.sqrt(state.squares.min(axis=1)), atol=4e-3)
    feet = ends(drawn["surface"], "line ink w4")
    assert (np.linalg.norm(feet[:, 2:] - feet[:, :2], axis=1) <= length + 4e-3).all()


@pytest.mark.parametrize("turn", TURNS)
def test_soft_weights_are_shares(turn: float) -> None:
    """Every source point spends one unit of weight, most of it on what is nearest."""
    state = start(Controls(turn), 40)
    w = weights(state)
    np.testing.assert_allclose(w.sum(axis=1), 1.0)
    np.testing.assert_array_equal(w.argmax(axis=1), state.squares.argmin(axis=1))


def test_cells_with_few_points_have_no_gaussian() -> None:
    """One ellipse for each cell with three target points or more, and the source points elsewhere are grey."""
    state, drawn = start(Controls(), 40), panels(-10.0)["cells"]
    cells, counts = np.unique(np.floor(state.target / CELL), axis=0, return_counts=True)
    (d,) = re.findall(r'class="line target filled" d="([^"]*)"', drawn)
    assert d.count("M") == (counts >= LEAST).sum()
    full = {tuple(cell) for cell in cells[counts >= LEAST]}
    (grey,) = re.findall(r'class="dot s ghost" d="([^"]*)"', drawn)
    assert grey.count("h1") == sum(tuple(cell) not in full for cell in np.floor(state.moved / CELL))


def test_equal_clouds_have_equal_means_of_the_wave() -> None:
    """The two hands of the dial meet when the clouds do; apart, the readout says by how much."""
    state = start(Controls(0.0), 40)
    back = state.moved - SHIFT
    np.testing.assert_allclose(back, state.bird, atol=1e-12)
    here, there = feature_means(state, state.frequency)
    assert np.hypot(*here) <= 1
    phase = (state.target @ state.frequency)[:, None]
    np.testing.assert_allclose(there, np.hstack([np.cos(phase), np.sin(phase)]).mean(axis=0))
    frame = Host().render("f", preset(WIDGET, "default", {"turn": 0}).plain())
    shown = {r["name"]: r["value"] for r in frame["readouts"]}
    over = [np.abs(np.exp(1j * (state.moved @ w)).mean() - np.exp(1j * (state.target @ w)).mean()) for w in state.waves]
    assert float(shown["mean_gap"]) == pytest.approx(np.sqrt(np.mean(np.square(over))), abs=0.0051)


@pytest.mark.parametrize("seed", [40 + 13 * k for k in range(10)])
def test_only_rung_one_does_not_care(seed: int) -> None:
    """Without a turn four in five nearest points are the true partner; the farther the turn the fewer, and from 40°
    none. Soft weights fall, and the waves' means part and stay apart."""

    def found(turn: float) -> tuple[int, float, float]:
        plain = preset(WIDGET, "default", {"turn": turn}).plain()
        said = {r["name"]: r["value"] for r in Host().render("f", {**plain, "seed": seed})["readouts"]}
        return int(said["right_nearest"]), float(said["right_soft"]), float(said["mean_gap"])

    right, soft, gap = zip(*map(found, (0.0, -10.0, -20.0, -40.0, -60.0, -90.0, 180.0)), strict=True)
    assert right[0] > 0.8 * COUNT
    assert right[0] > right[1] > right[2] > right[3] == right[4] == right[5] == right[6] == 0
    assert list(soft) == sorted(soft, reverse=True)
    assert gap[0] < gap[1] < gap[2] < gap[3]
    assert min(gap[3:]) > 2.5 * gap[0]
