"""The held-out study of the learned flows: how often they are right on scenes like the training's, and on others."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import Any

from sitegen.plots._numbers import at
from sitegen.plots._rates import interval, wilson
from sitegen.plots._sizes import sizes
from sitegen.plots.registry import ROOT

TITLE = "The held-out study: scenes on which the learned flows find the rotation to 5°"
READS = ("solvers/methods/flow/trained/log.json",)
SIZES = sizes(330, 470)

SHOWN = {"flow": ("accent", "D"), "flow-from-source": ("weak", "o")}  # the flow as in four_reach.py


@dataclass(frozen=True)
class Result:
    """By variant, then by kind of scene: turned counts rotation errors below 5°, placed those that are also placed to
    0.1 radii, out of `count`; degrees: the median rotation error."""

    count: int
    variants: tuple[str, ...]
    kinds: tuple[str, ...]
    turned: tuple[tuple[int, ...], ...]
    placed: tuple[tuple[int, ...], ...]
    degrees: tuple[tuple[float, ...], ...]


def compute() -> Result:
    """Read the training's log."""
    path = ROOT / "solvers" / "methods" / "flow" / "trained" / "log.json"
    if not path.is_file():
        raise ValueError(f"missing {path.relative_to(ROOT)}: run `python3 build.py train`")
    lines = json.loads(path.read_text("utf-8"))["held_out"]
    kinds = tuple(dict.fromkeys(line["kind"] for line in lines))
    variants = tuple(dict.fromkeys(line["variant"] for line in lines))
    by_key = {(line["variant"], line["kind"]): line for line in lines}

    def all_of(name: str) -> tuple[tuple[Any, ...], ...]:
        return tuple(tuple(by_key[variant, kind][name] for kind in kinds) for variant in variants)

    return Result(lines[0]["count"], variants, kinds, all_of("turned"), all_of("placed"), all_of("degrees"))


def success(result: Result, variant: str, kind: str) -> float:
    """The percentage of the scenes with a rotation error below 5°."""
    return 100.0 * _row(result, result.turned, variant)[at(result.kinds, kind, "kind")] / result.count


def near(result: Result, variant: str, kind: str) -> float:
    """The percentage of the scenes that are also placed to 0.1 radii."""
    return 100.0 * _row(result, result.placed, variant)[at(result.kinds, kind, "kind")] / result.count


def scenes(result: Result) -> int:
    """The number of scenes of each kind."""
    return result.count


def _row(result: Result, values: tuple[tuple[int, ...], ...], variant: str) -> tuple[int, ...]:
    return values[at(result.variants, variant, "variant")]


def words(result: Result) -> str:
    """The picture in words."""
    clauses = []
    for i, kind in enumerate(result.kinds):
        rates = (f"{variant} {100 * _row(result, result.turned, variant)[i] / result.count:.0f} %" for variant in SHOWN)
        clauses.append(f"{kind}: {', '.join(rates)}")
    return (
        f"A row for each kind of held-out scene with the share of {result.count} scenes on which a learned flow found "
        f"the rotation to 5°, for the flow from noise and for the flow from the source, with intervals. "
        f"{'; '.join(clauses)}."
    )


def table(result: Result) -> tuple[list[str], list[list[str]]]:
    """For each kind and variant: both counts with their intervals, and the median error."""
    rows = []
    for i, kind in enumerate(result.kinds):
        for j, variant in enumerate(result.variants):
            counts = (interval(values[j][i], result.count) for values in (result.turned, result.placed))
            rows.append([f"{kind}, {variant}", *counts, f"{result.degrees[j][i]:.1f}°"])
    return ["scenes, variant", "rotation < 5°", "and shift < 0.1 radii", "median rotation error"], rows


def draw(result: Result, figure: Any, narrow: bool) -> None:
    """Draw a row for each kind with both flows in it, distinguished by colour and marker."""
    from sitegen.figures.matplotlib_svg import COLOURS
    from sitegen.plots._look import axes_in, label

    (axes,) = axes_in(figure, narrow, [(190, 20, 500, 220)], [(18, 30, 296, 340)])
    rows = range(len(result.kinds))
    handles = []
    for (variant, (role, mark)), shift in zip(SHOWN.items(), (-0.13, 0.13), strict=True):
        counts = _row(result, result.turned, variant)
        low, high = zip(*(wilson(k, result.count) for k in counts), strict=True)
        y = [row + shift for row in rows]
        axes.hlines(y, low, high, color=COLOURS[role], linewidth=1.5, capstyle="butt")
        (dots,) = axes.plot(
            [k / result.count for k in counts], y, mark, color=COLOURS[role], markersize=5.5, markeredgewidth=0.0,
            label=variant, clip_on=False, zorder=3,
        )  # fmt: skip
        handles.append(dots)
    axes.grid(axis="x")
    axes.spines["left"].set_visible(False)
    axes.set(xlim=(0.0, 1.0), ylim=(len(result.kinds) - 0.5, -0.5), xlabel="rotation found to 5°")
    axes.set_xticks([0.0, 0.25, 0.5, 0.75, 1.0], ["0 %", "25 %", "50 %", "75 %", "100 %"])
    axes.set_yticks([])
    for row, kind in enumerate(result.kinds):
        if narrow:
            label(axes, 0.0, row, kind, "ink", dy=18)
        else:
            label(axes, 0.0, row, kind, "ink", dx=-14, ha="right")
    figure.legend(handles=handles, loc="lower center", ncols=2, frameon=False, columnspacing=1.6, handletextpad=0.3)
