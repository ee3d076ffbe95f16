"""Where the NDT score jumps: along a line of translations through the truth, on one grid and on four."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from sitegen.plots._numbers import at
from sitegen.plots._sizes import sizes
from solvers.core.arrays import FloatArray
from solvers.methods.ndt.ndt_map import NdtMap, build
from solvers.methods.ndt.score import score_map
from solvers.scenes.walls import ndt_room

TITLE = "The NDT score along a line of translations, one grid and four"
SIZES = sizes(350, 640)

SEED, CELL, REACH, ZOOM = 40, 1.0, 1.2, 0.1
BESIDE = 1e-9  # u: the distance from a border at which the score is evaluated on either side
GRIDS = (1, 4)

Piece = tuple[tuple[float, ...], tuple[float, ...]]


@dataclass(frozen=True)
class Result:
    """By number of grids: `line` (x, score), the pieces between jumps near the truth (`zoom`), the number of jumps,
    their largest and mean size, and the highest score; scores are divided by the numbers of points and of grids."""

    line: tuple[Piece, ...]
    zoom: tuple[tuple[Piece, ...], ...]
    jumps: tuple[int, ...]
    largest: tuple[float, ...]
    mean: tuple[float, ...]
    highest: tuple[float, ...]


def compute() -> Result:
    """Move the scan, at the true rotation, along x; evaluate the score on both sides of each border that a point
    crosses."""
    scene = ndt_room(seed=SEED)
    line, zoom, jumps, largest, mean, highest = [], [], [], [], [], []
    for grids in GRIDS:
        cells = build(scene.target[None], CELL, grids=grids)
        x = np.linspace(-REACH, REACH, 241)
        line.append(_piece(x, _scores(cells, scene.source, x, grids)))
        borders = _borders(cells, scene.source, REACH)
        left, right = (_scores(cells, scene.source, borders + aside, grids) for aside in (-BESIDE, BESIDE))
        steps = right - left
        size = np.abs(steps[np.abs(steps) > 1e-6 / len(scene.source)])
        jumps.append(len(size))
        largest.append(round(float(size.max()), 8))
        mean.append(round(float(size.mean()), 8))
        highest.append(round(float(_scores(cells, scene.source, np.linspace(-REACH, REACH, 4801), grids).max()), 8))
        inner = borders[np.abs(borders) < ZOOM]
        ends = np.concatenate([[-ZOOM], inner, [ZOOM]])
        pieces = []
        for start, end in pairwise(ends):
            if end - start > 4 * BESIDE:
                x_between = np.linspace(start + BESIDE, end - BESIDE, 2 + int((end - start) / 0.004))
                pieces.append(_piece(x_between, _scores(cells, scene.source, x_between, grids)))
        zoom.append(tuple(pieces))
    return Result(tuple(line), tuple(zoom), tuple(jumps), tuple(largest), tuple(mean), tuple(highest))


def _scores(cells: NdtMap, points: FloatArray, x: FloatArray, grids: int) -> FloatArray:
    score: FloatArray = score_map(cells, points, x, np.zeros(1))[0] / (grids * len(points))
    return score


def _borders(cells: NdtMap, points: FloatArray, reach: float) -> FloatArray:
    """The translations along x at which a point reaches a border between cells of any grid."""
    size, parts = float(cells.size[0]), []
    for origin in cells.origin[0, :, 0]:
        first = np.ceil((points[:, 0] - reach - origin) / size)
        for k in range(int(2.0 * reach / size) + 2):
            parts.append(origin + (first + k) * size - points[:, 0])
    borders = np.sort(np.concatenate(parts))
    borders = borders[np.abs(borders) < reach]
    separate: FloatArray = borders[np.concatenate([[True], np.diff(borders) > 4.0 * BESIDE])]
    return separate


def _piece(x: FloatArray, y: FloatArray) -> Piece:
    return tuple(round(float(v), 5) for v in x), tuple(round(float(v), 5) for v in y)


def jumps(result: Result, grids: int) -> int:
    """How often the score jumps along the line, with this many grids."""
    return result.jumps[at(GRIDS, grids, "grids")]


def largest(result: Result, grids: int) -> float:
    """The largest jump, in percent of the highest score."""
    return 100.0 * result.largest[at(GRIDS, grids, "grids")] / result.highest[at(GRIDS, grids, "grids")]


def mean(result: Result, grids: int) -> float:
    """The mean jump, in percent of the highest score."""
    return 100.0 * result.mean[at(GRIDS, grids, "grids")] / result.highest[at(GRIDS, grids, "grids")]


def words(result: Result) -> str:
    """The picture in words."""
    clauses = [
        f"{jumps(result, grids)} jumps on {'one grid' if grids == 1 else 'four'}, on average "
        f"{mean(result, grids):.2f} % of the highest score and at most {largest(result, grids):.2f} %"
        for grids in GRIDS
    ]
    return (
        f"The score of one scan of the NDT room, per point, at the true rotation, moved along x by up to {REACH:g} u, "
        f"cells of {CELL:g} u; for four grids the mean of the four. Both curves rise to a peak near the truth, with "
        f"ragged flanks. Enlarged, within {ZOOM:g} u of the truth, both are pieces of smooth curves with jumps between "
        f"them: {'; '.join(clauses)}. Four grids jump more often and less far; neither score is continuous."
    )


def table(result: Result) -> tuple[list[str], list[list[str]]]:
    """The jumps."""
    rows = [
        [str(grids), str(jumps(result, grids)), f"{mean(result, grids):.3f} %", f"{largest(result, grids):.3f} %"]
        for grids in GRIDS
    ]
    return ["grids", "jumps", "mean size, of the highest score", "largest"], rows


def _at(pieces: tuple[Piece, ...], x: float) -> float:
    """The score at x."""
    return next(float(np.interp(x, *piece)) for piece in pieces if piece[0][0] <= x <= piece[0][-1])


def draw(result: Result, figure: Any, narrow: bool) -> None:
    """Draw the whole line, and its middle enlarged."""
    from sitegen.figures.matplotlib_svg import COLOURS
    from sitegen.plots._look import axes_in, label, titled

    wide = [(34, 62, 296, 236), (400, 62, 290, 236)]
    whole, close = axes_in(figure, narrow, wide, [(34, 60, 300, 200), (34, 374, 300, 206)])
    roles = dict(zip(GRIDS, ("ink", "accent"), strict=True))
    names = {1: "one grid", 4: "four grids"}

    titled(whole, "Along a line through the truth", "translation in x, u", "score per point and grid")
    titled(close, "Its middle, enlarged", "translation in x, u", "score per point and grid")
    for axes in (whole, close):
        axes.axvline(0.0, color=COLOURS["truth"], linewidth=3.0, alpha=0.4)
    for i, grids in enumerate(GRIDS):
        colour = COLOURS[roles[grids]]
        whole.plot(*result.line[i], color=colour, linewidth=1.5)
        for x, y in result.zoom[i]:
            close.plot(x, y, color=colour, linewidth=2.0, solid_capstyle="butt")
    label(close, 0.055, _at(result.zoom[0], 0.055), names[1], "ink", dx=10, dy=8)
    label(close, 0.045, _at(result.zoom[1], 0.045), names[4], "accent", dx=-9, ha="right")
    peak = max(result.highest)
    whole.set(xlim=(-REACH, REACH), ylim=(0.0, 1.06 * peak), yticks=[0.0, 0.1, 0.2, 0.3])
    whole.set_xticks([-1.0, -0.5, 0.0, 0.5, 1.0], ["−1", "−0.5", "0", "0.5", "1"])
    label(whole, 0.0, 0.04 * peak, "truth", "truth", dx=6)
    middle = [v for pieces in result.zoom for _, ys in pieces for v in ys]
    extent = max(middle) - min(middle)
    close.set(xlim=(-ZOOM, ZOOM), ylim=(min(middle) - 0.12 * extent, max(middle) + 0.12 * extent))
    close.set_yticks([v for v in (0.28, 0.3, 0.32, 0.34, 0.36) if min(middle) - 0.12 * extent <= v])
    close.set_xticks([-0.1, -0.05, 0.0, 0.05, 0.1], ["−0.1", "", "0", "", "0.1"])
