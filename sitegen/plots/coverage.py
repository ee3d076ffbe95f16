"""How often 95 % regions hold the truth: three places, two residuals, three ways to a covariance."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from sitegen.plots._rates import interval, wilson
from sitegen.plots._sizes import sizes
from solvers.studies.coverage import LEVEL, METHODS, coverage
from solvers.studies.redrawn import PLACES

TITLE = "The share of redrawn scans whose 95 % region contains the truth"
SIZES = sizes(360, 430)
SECONDS = 12

DRAWS = 1000
SHOWN = ("hessian", "censi", "sampled")
NAMES = {"hessian": "Hessian", "censi": "Censi", "sampled": "Redrawn scans"}
ROLES = {"hessian": "accent", "censi": "inlier", "sampled": "source"}
RESIDUALS = {"point-to-plane": "point to plane", "icp": "point to point"}


@dataclass(frozen=True)
class Result:
    """covered: by residual, then place, then way; of `draws`. widest: the regions' median largest σ, in u."""

    draws: int
    residuals: tuple[str, ...]
    places: tuple[str, ...]
    ways: tuple[str, ...]
    covered: tuple[tuple[tuple[int, ...], ...], ...]
    widest: tuple[tuple[tuple[float, ...], ...], ...]


def compute() -> Result:
    """Each draw from a start of its own, 3° and 0.15 u about the truth."""
    residuals = tuple(reversed(METHODS))
    lines = [[coverage(place, method, SHOWN, count=DRAWS) for place in PLACES] for method in residuals]
    return Result(
        DRAWS, residuals, PLACES, SHOWN,
        tuple(tuple(tuple(line.covered for line in three) for three in row) for row in lines),
        tuple(tuple(tuple(line.widest for line in three) for three in row) for row in lines),
    )  # fmt: skip


def held(result: Result, residual: str, place: str, way: str) -> float:
    """The draws whose region holds the truth."""
    return float(_entry(result, result.covered, residual, place, way))


def widest(result: Result, residual: str, place: str, way: str) -> float:
    """The median of the regions' largest standard deviation, in u."""
    return float(_entry(result, result.widest, residual, place, way))


def draws(result: Result) -> int:
    """How many each count is of."""
    return result.draws


def _entry(result: Result, of: Any, residual: str, place: str, way: str) -> Any:
    return of[result.residuals.index(residual)][result.places.index(place)][result.ways.index(way)]


def words(result: Result) -> str:
    """The picture in words."""
    said = []
    for residual in result.residuals:
        parts = []
        for place in result.places:
            counts = [f"{NAMES[way]} {held(result, residual, place, way):.0f}" for way in result.ways]
            parts.append(f"{place}: {', '.join(counts)}")
        said.append(f"{RESIDUALS[residual].capitalize()}, {'; '.join(parts)}.")
    return (
        f"Two charts of how many of {result.draws} redrawn pairs of scans have the truth in their 95 % region, in a "
        f"room, a corridor and a hall; 950 would be right. {' '.join(said)}"
    )


def table(result: Result) -> tuple[list[str], list[list[str]]]:
    """Counts with intervals, and the regions' largest σ."""
    rows = []
    for residual in result.residuals:
        for place in result.places:
            cells = [f"{RESIDUALS[residual]}, {place}"]
            for way in result.ways:
                share = interval(int(held(result, residual, place, way)), result.draws)
                cells.append(f"{share}; σ {widest(result, residual, place, way):.3f} u")
            rows.append(cells)
    return ["residual, place", *(NAMES[way] for way in result.ways)], rows


def draw(result: Result, figure: Any, narrow: bool) -> None:
    """Dots with their intervals beside the line of 95 %."""
    from sitegen.figures.matplotlib_svg import COLOURS
    from sitegen.plots._look import axes_in, label, measured

    wide = [(44, 44, 290, 236), (400, 44, 290, 236)]
    small = [(44, 44, 280, 120), (44, 244, 280, 120)]
    for i, (axes, residual) in enumerate(zip(axes_in(figure, narrow, wide, small), result.residuals, strict=True)):
        axes.set_title(RESIDUALS[residual].capitalize(), fontweight="bold", pad=12)
        axes.axhline(LEVEL, color=COLOURS["guide"], linewidth=1.25, dashes=(4, 3))
        axes.grid(axis="y")
        axes.spines["left"].set_visible(False)
        for k, way in enumerate(result.ways):
            hits = [int(held(result, residual, place, way)) for place in result.places]
            low, high = zip(*(wilson(n, result.draws) for n in hits), strict=True)
            x = [j + 0.18 * (k - 1) for j in range(len(hits))]
            measured(axes, x, [n / result.draws for n in hits], low, high, ROLES[way])
        axes.set(xlim=(-0.5, 2.5), ylim=(0.0, 1.0))
        axes.set_xticks(range(len(result.places)), result.places)
        axes.set_yticks([0.0, 0.5, LEVEL], ["0 %", "50 %", "95 %"])
        if i == len(result.residuals) - 1:
            _named(axes, label, narrow)


def _named(axes: Any, label: Any, narrow: bool) -> None:
    """The ways' names under the last chart, each in its colour."""
    height = -0.36 if narrow else -0.24
    for k, way in enumerate(SHOWN):
        x = (-0.45, 0.5, 1.2)[k] if narrow else (-1.6, -0.6, 0.15)[k]
        label(axes, x, height, NAMES[way], ROLES[way])
