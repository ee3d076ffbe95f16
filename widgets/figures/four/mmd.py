"""The walkthrough's third panel: one step of an MMD-Reg-inspired method in four stages, with its 96 feature means."""

from __future__ import annotations

from typing import Any

import numpy as np

from solvers.core.arrays import IntArray
from widgets.drawing.picture import Array, Label, Mark, Path, Points, Role, Segments, degrees, number, small
from widgets.figures.four.run import VIEW, Look, Shown, carried, cloud, held, where
from widgets.parts.feature_marks import crests

NAME = "MMD-Reg-inspired"
STAGES = ("encode", "average", "compare", "optimise")
LEFT, RIGHT = -2.3, 4.1  # u: x of the first and of the last bar
TALL = 1.15  # u: the height of the bar for a mean of length 1
ROW = 1.3  # u: distance of the two rows of bars from the middle
BESIDE, SMALL = -3.45, 0.26  # u: x of a cloud beside its bars; its scale there


def shown(look: Look) -> Shown:
    """The marks and the words of the current stage."""
    return (_encode, _average, _compare, _optimise, held)[look.walk.stage - 1](look)


def kept(look: Look) -> str:
    """How many numbers represent each cloud."""
    return f"2 × {len(look.before.fixed_mean[0])}"


def _encode(look: Look) -> Shown:
    state, scene = look.before, look.walk.scene
    frequency = state.frequencies[0, _slowest(look)[0]] / float(state.length[0])
    bright = [0.55 + 0.45 * np.cos(points @ frequency) for points in (scene.target, look.moved)]
    target = Points(scene.target, "target", "square", radius=2.5, weight=bright[0])
    marks = (crests(VIEW, frequency), *where(scene), target, cloud(look.moved, bright[1]))
    count = state.frequencies.shape[1]
    words = (
        f"ℓ = {number(float(state.length[0]), 1)} u: {count} waves, {2 * count} numbers per point."
        " Drawn: the longest wave’s crests."
    )
    return Shown(marks, words)


def _average(look: Look) -> Shown:
    state = look.before
    rows: tuple[tuple[Role, str, Array, float], ...] = (
        ("target", "fixed", state.fixed_mean[0], ROW),
        ("source", "moving", state.moving_mean[0], -ROW),
    )
    marks: list[Mark] = [*_names(), _small_copy(look, "target", ROW), _small_copy(look, "source", -ROW)]
    for role, name, mean, base in rows:
        marks += [*_bars(look, mean, base, role), Label([BESIDE, base], name, role, "middle", dy=60)]
    words = f"{len(state.fixed_mean[0])} means of each cloud, long waves first: all that is kept of it."
    return Shown(tuple(marks), words, grid=False)


def _compare(look: Look) -> Shown:
    residual = look.before.residual[0]
    clouds = (_small_copy(look, "target", 0.0), _small_copy(look, "source", 0.0))
    marks = (*_names(), *clouds, *_bars(look, residual, 0.0, "accent"))
    words = f"The {len(residual)} differences; their squares add up to {_squares(look.before)}, an estimate of MMD²."
    return Shown(marks, words, grid=False)


def _optimise(look: Look) -> Shown:
    before, after = look.before, look.after
    turn = float(after.pose[0].angle - before.pose[0].angle)
    words = f"A damped step of {degrees(turn, 1)}°: the sum is {_squares(after)}"
    if after.stage[0] != before.stage[0]:
        words += f" at ℓ = {number(float(after.length[0]), 1)} u, which comes next."
    else:
        words += f", was {_squares(before)}."
    return Shown(carried(look), words)


def _slowest(look: Look) -> IntArray:
    """The order of the waves by wavelength, the longest first."""
    return np.argsort(np.round(np.hypot(*look.before.frequencies[0].T), 9), kind="stable")


def _bars(look: Look, entries: Array, base: float, role: Role) -> tuple[Mark, ...]:
    """A bar for every entry, cosines then sines, upwards if positive."""
    order, count = _slowest(look), len(entries) // 2
    x = np.linspace(LEFT, RIGHT, len(entries) + 1)
    x = np.delete(x, count)  # a gap between cosines and sines
    height = TALL * np.sqrt(count) * np.concatenate([entries[:count][order], entries[count:][order]])
    foot = np.stack([x, np.full(len(x), base)], axis=1)
    return (
        Path([[LEFT - 0.1, base], [RIGHT + 0.1, base]], "guide"),
        Segments(foot, foot + np.stack([np.zeros(len(x)), height], axis=1), role),
    )


def _small_copy(look: Look, role: Role, y: float) -> Points:
    """A small copy of a cloud, as in the stage before: the bars beside it were computed from it."""
    points = look.walk.scene.target if role == "target" else look.moved
    return Points(SMALL * points + [BESIDE, y], role, "square" if role == "target" else "dot", radius=1.2)


def _names() -> tuple[Mark, ...]:
    y, quarter = VIEW.y0 + 0.2, 0.25 * (RIGHT - LEFT)
    return (
        Label([LEFT + quarter, y], "48 cosines", "guide", "middle"),
        Label([RIGHT - quarter, y], "48 sines", "guide", "middle"),
    )


def _squares(state: Any) -> str:
    return small(float(state.objective[0]))
