"""How often 95 % regions contain the truth: three places, three residuals, three ways to a covariance."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from sitegen.plots._rates import interval, wilson
from sitegen.plots._sizes import sizes
from solvers.studies.coverage import LEVEL, coverage
from solvers.studies.redrawn import PLACES
from solvers.uncertainty.closed_form import CENSI

TITLE = "The share of redrawn scans whose 95 % region contains the truth"
SIZES = sizes(360, 630)
SECONDS = 20

DRAWS = 1000
CARRIED = 100  # draws; each takes seven registrations
SHOWN = ("hessian", "censi", "sampled")
NAMES = {"hessian": "Hessian", "censi": "Censi", "sampled": "Redrawn scans"}
LOOKS = {"hessian": ("accent", "o"), "censi": ("inlier", "D"), "sampled": ("source", "s")}
RESIDUALS = {"point-to-plane": "point to plane", "icp": "point to point", "gicp": "GICP"}
PARTS = (
    *((method, place, "redrawn") for method in RESIDUALS for place in PLACES),
    *((method, "room", "carried") for method in RESIDUALS if method in CENSI),
)


@dataclass(frozen=True)
class Result:
    """covered: counts by residual, then place, then way, None if a residual has no such way; out of `draws`. widest:
    the regions' median largest σ, in u. carried: counts by residual in the room, with the start's spread carried
    through; out of `carried_draws`."""

    draws: int
    residuals: tuple[str, ...]
    places: tuple[str, ...]
    ways: tuple[str, ...]
    covered: tuple[tuple[tuple[int | None, ...], ...], ...]
    widest: tuple[tuple[tuple[float | None, ...], ...], ...]
    carried_draws: int
    carried: tuple[int | None, ...]


def part(method: str, place: str, kind: str) -> dict[str, tuple[int, float]]:
    """How many regions contain the truth, and their median largest σ, by the way to the covariance; each draw has its
    own start, 3° and 0.15 u about the truth. kind: "carried" carries that start's spread through."""
    ways = ("starts",) if kind == "carried" else tuple(way for way in SHOWN if way != "censi" or method in CENSI)
    lines = coverage(place, method, ways, count=CARRIED if kind == "carried" else DRAWS)
    return {line.way: (line.covered, line.widest) for line in lines}


def whole(parts: Mapping[tuple[str, str, str], Mapping[str, tuple[int, float]]]) -> Result:
    """Collect the counts and spreads of all parts."""
    rows = [[parts[method, place, "redrawn"] for place in PLACES] for method in RESIDUALS]
    covered = tuple(tuple(tuple(ways[w][0] if w in ways else None for w in SHOWN) for ways in row) for row in rows)
    widest = tuple(tuple(tuple(ways[w][1] if w in ways else None for w in SHOWN) for ways in row) for row in rows)
    carried = [parts[method, "room", "carried"]["starts"][0] if method in CENSI else None for method in RESIDUALS]
    return Result(DRAWS, tuple(RESIDUALS), PLACES, SHOWN, covered, widest, CARRIED, tuple(carried))


def held(result: Result, residual: str, place: str, way: str) -> float:
    """The number of draws whose region contains the truth. Raises ValueError if the residual has no such way."""
    return float(_entry(result, result.covered, residual, place, way))


def widest(result: Result, residual: str, place: str, way: str) -> float:
    """The median of the regions' largest standard deviation, in u. Raises ValueError like `held`."""
    return float(_entry(result, result.widest, residual, place, way))


def carried(result: Result, residual: str) -> float:
    """The number of draws in the room whose region contains the truth if the start's spread is carried through."""
    count = result.carried[result.residuals.index(residual)]
    if count is None:
        raise ValueError(f"the start is not carried through for {residual}")
    return float(count)


def carried_draws(result: Result) -> int:
    """The number of draws behind each count of `carried`."""
    return result.carried_draws


def draws(result: Result) -> int:
    """The number of draws behind each count."""
    return result.draws


def _entry(result: Result, of: Any, residual: str, place: str, way: str) -> Any:
    entry = of[result.residuals.index(residual)][result.places.index(place)][result.ways.index(way)]
    if entry is None:
        raise ValueError(f"{way} is not counted for {residual}")
    return entry


def _ways(result: Result, residual: str) -> list[str]:
    """The ways that are counted for a residual."""
    row = result.covered[result.residuals.index(residual)][0]
    return [way for way, count in zip(result.ways, row, strict=True) if count is not None]


def words(result: Result) -> str:
    """The picture in words."""
    clauses = []
    for residual in result.residuals:
        parts = []
        for place in result.places:
            counts = [f"{NAMES[way]} {held(result, residual, place, way):.0f}" for way in _ways(result, residual)]
            parts.append(f"{place}: {', '.join(counts)}")
        clauses.append(f"{_title(residual)}, {'; '.join(parts)}.")
    return (
        f"Three charts of how many of {result.draws:,} redrawn pairs of scans have the truth in their 95 % region, in "
        f"a room, a corridor and a hall; 950 would be right. {' '.join(clauses)}"
    )


def _title(residual: str) -> str:
    name = RESIDUALS[residual]
    return name[0].upper() + name[1:]


def table(result: Result) -> tuple[list[str], list[list[str]]]:
    """Counts with intervals, and the regions' largest σ."""
    rows = []
    for residual in result.residuals:
        for place in result.places:
            cells = [f"{RESIDUALS[residual]}, {place}"]
            for way in result.ways:
                if way not in _ways(result, residual):
                    cells.append("–")
                    continue
                share = interval(int(held(result, residual, place, way)), result.draws)
                cells.append(f"{share}; σ {widest(result, residual, place, way):.3f} u")
            rows.append(cells)
    return ["residual, place", *(NAMES[way] for way in result.ways)], rows


def draw(result: Result, figure: Any, narrow: bool) -> None:
    """Draw dots with their intervals beside the line at 95 %."""
    from sitegen.figures.matplotlib_svg import COLOURS
    from sitegen.plots._look import axes_in, measured

    wide = [(44 + 232 * k, 44, 184, 236) for k in range(3)]
    small = [(44, 44 + 200 * k, 280, 120) for k in range(3)]
    for i, (axes, residual) in enumerate(zip(axes_in(figure, narrow, wide, small), result.residuals, strict=True)):
        axes.set_title(_title(residual), fontweight="bold", pad=12)
        axes.axhline(LEVEL, color=COLOURS["guide"], linewidth=1.25, dashes=(4, 3))
        axes.grid(axis="y")
        axes.spines["left"].set_visible(False)
        for way in _ways(result, residual):
            hits = [int(held(result, residual, place, way)) for place in result.places]
            low, high = zip(*(wilson(n, result.draws) for n in hits), strict=True)
            x = [j + 0.18 * (result.ways.index(way) - 1) for j in range(len(hits))]
            role, mark = LOOKS[way]
            measured(axes, x, [n / result.draws for n in hits], low, high, role, mark=mark)
        axes.set(xlim=(-0.5, 2.5), ylim=(0.0, 1.0))
        axes.set_xticks(range(len(result.places)), result.places)
        axes.set_yticks([0.0, 0.5, LEVEL], ["0 %", "50 %", "95 %"])
        if i == len(result.residuals) - 1:
            _legend(axes, narrow)


def _legend(axes: Any, narrow: bool) -> None:
    """Draw the ways' marks and names below the last chart, each in its colour."""
    from sitegen.figures.matplotlib_svg import COLOURS
    from sitegen.plots._look import label

    height = -0.36 if narrow else -0.24
    for k, way in enumerate(SHOWN):
        x = (-0.45, 0.5, 1.2)[k] if narrow else (-3.2, -2.15, -1.35)[k]
        role, mark = LOOKS[way]
        axes.plot(x, height, mark, color=COLOURS[role], markersize=5.5, markeredgewidth=0.0, clip_on=False)
        label(axes, x, height, NAMES[way], role, dx=9)
