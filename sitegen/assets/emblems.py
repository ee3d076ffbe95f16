"""A rung's emblem: the ring of its dial, shown beside its name in the ladder and on the picture of a shared link."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from typing import Any

import numpy as np

from solvers import Pose
from widgets.drawing.picture import Array
from widgets.engine.contract import SEED
from widgets.parts import dial_marks as marks
from widgets.parts.dial import COARSE, RUNGS, Dial, headings, made
from widgets.parts.ring import place

NAMES: Sequence[str] = tuple(RUNGS)
NOISE = 0.02  # u, the chapters' dials at the start
TURN = Pose.from_angle(np.radians(100.0))
BOX = 24  # units, the width of an icon's box
CIRCLE = np.linspace(0.0, 2.0 * np.pi, 91)


@cache
def dial(name: str) -> Dial:
    """The dial in the state in which its chapter shows it first."""
    return made(name, SEED, NOISE, RUNGS[name].length or 1.0)


def profile(name: str) -> Array:
    """The ring's outer line, (60, 2) u from the centre, with the truth at the top; a flat one is the inner circle."""
    return place(headings()[::COARSE], marks.heights(dial(name), full=False))


@cache
def path(name: str) -> str:
    """The ring as a path for an icon of 24 units, to be filled by the even-odd rule; y points down."""
    scale = BOX / 2 / (marks.OUTER + 0.1)
    inner = marks.INNER * scale
    outer = (profile(name) * (scale, -scale) + BOX / 2).round(1)
    if RUNGS[name].flat:  # nothing to fill, so only a line
        return _circle(inner + 0.4) + _circle(inner - 0.4)
    return "M" + "L".join(f"{x:g} {y:g}" for x, y in outer.tolist()) + "z" + _circle(inner - 0.4)


def _circle(radius: float) -> str:
    r = round(radius, 1)
    return f"M{BOX / 2 - r:g} {BOX // 2}a{r:g} {r:g} 0 1 0 {2 * r:g} 0a{r:g} {r:g} 0 1 0 {-2 * r:g} 0z"


def draw(axes: Any, theme: dict[str, str], name: str, middle: Array, scale: float) -> None:
    """Draw the dial on matplotlib axes whose y points down: ring, room, the robot's turned scan, its ball. scale: px
    per world unit."""
    rung = dial(name)

    def px(points: Any) -> Any:
        return middle + np.asarray(points) * (scale, -scale)

    ring, circle = profile(name), place(CIRCLE, marks.INNER)
    from_top = np.roll(ring, len(ring) // 2, axis=0)  # the seam is where the ring is thinnest
    band = px(np.concatenate([from_top, from_top[:1], circle[::-1]]))
    axes.fill(*band.T, color=theme["accent"], alpha=0.16, lw=0)
    for line in (np.concatenate([ring, ring[:1]]), circle):
        axes.plot(*px(line).T, color=theme["accent"], lw=2.0)
    axes.plot(*px(place(np.zeros(2), np.array([marks.INNER - 0.35, marks.OUTER + 0.1]))).T, color=theme["truth"])
    for curve in rung.clouds.scene.outline:
        axes.plot(*px(curve).T, color=theme["truth"], alpha=0.5, lw=5.0, solid_joinstyle="round")
        axes.plot(*px(TURN.apply(curve)).T, color=theme["source"], lw=1.8)
    axes.scatter(*px(rung.clouds.target).T, s=22.0, marker="s", color=theme["target"], lw=0, zorder=3)
    axes.scatter(*px(TURN.apply(rung.clouds.source)).T, s=26.0, color=theme["source"], lw=0, zorder=4)
    ball = px(marks.at(rung, False, np.array([TURN.angle])))
    axes.scatter(*ball.T, s=300.0, color=theme["source"], lw=0, zorder=5)
