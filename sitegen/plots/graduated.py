"""Graduated non-convexity: the cost of a pair as μ grows, and how many wrong pairs it tolerates, beside RANSAC."""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from sitegen.plots._numbers import at
from sitegen.plots._rates import close, clouds, interval, wilson
from sitegen.plots._sizes import sizes
from solvers import Pose, register
from solvers.core.arrays import FloatArray
from solvers.methods.pairs.graduated import surrogate
from solvers.scenes.facade import FACADE, FACADE_TRUTH, facade_scene
from solvers.scenes.rooms import Scene
from solvers.studies.seeds import seeds

TITLE = "Graduated non-convexity: its surrogate, and success against the share of wrong pairs"
SIZES = sizes(360, 660)
SECONDS = 6

INLIER, SEPARATION = 0.25, 0.7
SHARES = (0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8)
ROWS = {"ransac": "RANSAC", "graduated": "graduated", "scattered": "graduated, wrong partners in all directions"}
BUDGET: dict[str, Any] = {"separation": SEPARATION, "most": 300, "per_step": 300, "max_steps": 400}
MUS = (0.01, 0.1, 1.0, float("inf"))
RUNS = 200
PARTS = tuple(itertools.product(ROWS, SHARES))


@dataclass(frozen=True)
class Result:
    """successes: by row, then by share of wrong pairs; out of `runs`."""

    runs: int
    rows: tuple[str, ...]
    shares: tuple[float, ...]
    successes: tuple[tuple[int, ...], ...]


def part(row: str, share: float) -> int:
    """The successes on the chapter's facade, where the corners hidden at its left have wrong partners; or, for
    'scattered', with each wrong partner at the same distance but in its own random direction."""
    scenes = [facade_scene(seed=seed, outliers=share) for seed in seeds(RUNS)]
    source, target = clouds(scenes)
    if row == "ransac":
        result = register(source, target, "ransac", seed=seeds(RUNS), inlier=INLIER, **BUDGET)
    else:
        partners = np.stack([_scattered(scene) for scene in scenes]) if row == "scattered" else target
        result = register(source, partners, "graduated-nonconvexity", inlier=INLIER)
    return close(result.pose, FACADE_TRUTH)


def whole(parts: Mapping[tuple[str, float], int]) -> Result:
    """Collect the successes of all parts."""
    return Result(RUNS, tuple(ROWS), SHARES, tuple(tuple(parts[row, share] for share in SHARES) for row in ROWS))


def _scattered(scene: Scene) -> FloatArray:
    """The target with every wrong partner turned about its right place by its own random angle."""
    home = FACADE_TRUTH.apply(FACADE)
    turn = Pose.from_angle(np.random.default_rng(scene.seed).uniform(-np.pi, np.pi, len(home)))
    way = (turn.R @ (scene.target - home)[..., None])[..., 0]
    return np.where(scene.target_outlier[:, None], home + way, scene.target)


def success(result: Result, row: str, share: float) -> float:
    """The percentage of the runs that ended within 5° and 0.2 u of the truth."""
    counts = result.successes[at(result.rows, row, "row")]
    return 100.0 * counts[at(result.shares, share, "share")] / result.runs


def runs(result: Result) -> int:
    """The number of draws behind each dot."""
    return result.runs


def words(result: Result) -> str:
    """The picture in words."""
    clauses = []
    for row, counts in zip(result.rows, result.successes, strict=True):
        clauses.append(f"{ROWS[row]}: {', '.join(f'{100 * k / result.runs:.0f} %' for k in counts)}")
    shares = ", ".join(f"{share:g}" for share in result.shares)
    return (
        "Two charts. First, what one pair costs by its residual over ε, for μ = 0.01, 0.1, 1 and infinity: a "
        "shallow, nearly straight line first, then ever closer to a square capped at 1. Second, the share "
        f"of {result.runs} draws that ended within 5° and 0.2 u of the truth, for wrong fractions of {shares}. "
        f"{'; '.join(clauses)}."
    )


def table(result: Result) -> tuple[list[str], list[list[str]]]:
    """Success with its interval, for each share of wrong pairs."""
    rows = []
    for i, share in enumerate(result.shares):
        rows.append([f"{share:g}", *(interval(counts[i], result.runs) for counts in result.successes)])
    return ["wrong fraction", *(ROWS[row] for row in result.rows)], rows


def draw(result: Result, figure: Any, narrow: bool) -> None:
    """Draw the surrogate's curves, and success over the share of wrong pairs."""
    from sitegen.figures.matplotlib_svg import COLOURS
    from sitegen.plots._look import axes_in, label, measured, titled

    wide = [(34, 62, 270, 246), (396, 62, 222, 246)]
    cost, rates = axes_in(figure, narrow, wide, [(34, 60, 244, 214), (46, 392, 206, 210)])

    titled(cost, "What a pair costs", "residual / ε", "in ε²")
    ratio = np.linspace(0.0, 2.2, 221)
    for mu in MUS:
        hard = np.isinf(mu)
        curve = np.minimum(np.square(ratio), 1.0) if hard else surrogate(ratio, np.array(mu))
        cost.plot(ratio, curve, color=COLOURS["accent" if hard else "ghost"], linewidth=2.25 if hard else 1.5)
        if not hard:
            label(cost, 2.2, curve[-1], f"μ = {mu:g}", "soft", dx=5, dy=-6 if mu == 1.0 else 0)
    label(cost, 2.2, 1.0, "μ → ∞", "accent", dx=5, dy=7)
    cost.set(xlim=(0.0, 2.2), ylim=(0.0, 1.15), xticks=[0.0, 0.5, 1.0, 1.5, 2.0], yticks=[0.0, 0.5, 1.0])

    titled(rates, "Draws that end near the truth", "wrong fraction", "share of all draws")
    names = {"ransac": ("RANSAC", 7), "graduated": ("graduated", 0), "scattered": ("graduated,\nscattered", -9)}
    for row, counts in zip(result.rows, result.successes, strict=True):
        low, high = zip(*(wilson(k, result.runs) for k in counts), strict=True)
        role = "ghost" if row == "ransac" else "accent" if row == "graduated" else "weak"
        y = [k / result.runs for k in counts]
        measured(rates, result.shares, y, low, high, role, joined=True)
        text, dy = names[row]
        label(rates, result.shares[-1], y[-1], text, "soft" if row == "ransac" else role, dx=9, dy=dy)
    rates.set(ylim=(0.0, 1.05), xlim=(0.05, 0.85), xticks=[0.2, 0.4, 0.6, 0.8])
    rates.set_yticks([0.0, 0.5, 1.0], ["0 %", "50 %", "100 %"])
