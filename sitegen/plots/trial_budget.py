"""RANSAC's trial budget: the number of trials by the formula, and how often runs of that length failed."""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from sitegen.plots._numbers import at
from sitegen.plots._rates import close, clouds, percent, wilson
from sitegen.plots._sizes import sizes
from solvers import register
from solvers.methods.pairs.consensus import trials
from solvers.scenes.facade import FACADE_TRUTH, facade_scene
from solvers.studies.seeds import seeds

TITLE = "Trial budget against inlier fraction, and measured failures at the budget"
SIZES = sizes(360, 640)
SECONDS = 9

PAIRS, NOISE, INLIER, SEPARATION = 40, 0.06, 0.25, 0.7
CONFIDENCES = (0.9, 0.99, 0.999)
SHARES = (0.3, 0.5, 0.7, 0.9)
RUNS = 2000
LEAST = 2e-4  # the floor of the second chart's log scale: less than one run
PARTS = tuple(itertools.product(CONFIDENCES, SHARES))


@dataclass(frozen=True)
class Result:
    """budgets, failures: by confidence, then by share; failures out of `runs`."""

    runs: int
    confidences: tuple[float, ...]
    shares: tuple[float, ...]
    budgets: tuple[tuple[int, ...], ...]
    failures: tuple[tuple[int, ...], ...]


def part(confidence: float, share: float) -> int:
    """The failures of runs of exactly N trials, with N from the true share of right pairs; the runs' own estimates
    never stop them early."""
    most = int(trials(share, confidence, 2))
    source, target = clouds(
        [facade_scene(seed=seed, noise=NOISE, outliers=round(1.0 - share, 6)) for seed in seeds(RUNS)]
    )
    result = register(
        source, target, "ransac", seed=seeds(RUNS), inlier=INLIER, separation=SEPARATION, most=most,
        confidence=1.0 - 1e-12, max_steps=most + 50,
    )  # fmt: skip
    return RUNS - close(result.pose, FACADE_TRUTH)


def whole(parts: Mapping[tuple[float, float], int]) -> Result:
    """Collect the budgets, and the failures of all parts."""
    budgets = tuple(tuple(int(trials(share, p, 2)) for share in SHARES) for p in CONFIDENCES)
    failures = tuple(tuple(parts[p, share] for share in SHARES) for p in CONFIDENCES)
    return Result(RUNS, CONFIDENCES, SHARES, budgets, failures)


def budget(result: Result, share: float, confidence: float) -> int:
    """N for a share of right pairs and a confidence shown in the picture."""
    return result.budgets[at(result.confidences, confidence, "confidence")][at(result.shares, share, "share")]


def failed(result: Result, share: float, confidence: float) -> float:
    """The failures at that budget, in percent of the runs."""
    row = result.failures[at(result.confidences, confidence, "confidence")]
    return 100.0 * row[at(result.shares, share, "share")] / result.runs


def missed(result: Result, share: float, confidence: float) -> float:
    """The probability in percent that independent draws, as the formula assumes, fail at that budget."""
    return 100.0 * (1.0 - share**2) ** budget(result, share, confidence)


def runs(result: Result) -> int:
    """The number of runs behind each dot."""
    return result.runs


def words(result: Result) -> str:
    """The picture in words."""
    half = result.shares.index(0.5)
    asks = ", ".join(f"{row[half]} at p = {p:g}" for p, row in zip(result.confidences, result.budgets, strict=True))
    largest = ", ".join(f"{row[0]} at p = {p:g}" for p, row in zip(result.confidences, result.budgets, strict=True))
    clauses = []
    for p, row in zip(result.confidences, result.failures, strict=True):
        rates = [k / result.runs for k in row]
        clauses.append(f"{percent(min(rates))} to {percent(max(rates))} where {percent(1.0 - p)} are promised")
    return (
        f"Two charts over the inlier fraction w. First, the number of trials N for samples of two pairs, log scale: it "
        f"falls steeply with w. With half of the pairs right the formula asks for {asks}; with three in ten right, "
        f"for {largest}. Second, the share of {result.runs} runs of exactly N trials that ended more than 5° or 0.2 u "
        f"from the truth ({PAIRS} pairs, noise of {NOISE} u, ε = {INLIER} u), for w from {result.shares[0]} to "
        f"{result.shares[-1]}: {'; '.join(clauses)}."
    )


def table(result: Result) -> tuple[list[str], list[list[str]]]:
    """N and failures for each w."""
    heads = ["w", *(f"{column}, p = {p:g}" for p in result.confidences for column in ("N", "failed"))]
    rows = []
    for i, share in enumerate(result.shares):
        cells = [f"{share:.1f}"]
        for budgets, failures in zip(result.budgets, result.failures, strict=True):
            low, high = wilson(failures[i], result.runs)
            interval = f"{100 * low:.2f} to {100 * high:.2f} %"
            cells += [str(budgets[i]), f"{100 * failures[i] / result.runs:.2f} % ({interval})"]
        rows.append(cells)
    return heads, rows


def draw(result: Result, figure: Any, narrow: bool) -> None:
    """Draw the formula's curves, and failures against the promised rates."""
    from sitegen.figures.matplotlib_svg import COLOURS
    from sitegen.plots._look import axes_in, label, measured, titled

    wide = [(34, 62, 290, 246), (416, 62, 244, 246)]
    formula, failures = axes_in(figure, narrow, wide, [(34, 60, 290, 210), (46, 384, 236, 204)])

    titled(formula, "Trials that the formula asks for", "inlier fraction w", "N before it is rounded up, log scale")
    share = np.linspace(0.2, 0.995, 160)
    for p in result.confidences:
        budgets = np.log1p(-p) / np.log1p(-(share**2))
        visible = budgets >= 1.0
        formula.plot(share[visible], budgets[visible], color=COLOURS["accent"])
        label(formula, share[0], budgets[0], f"p = {p:g}", "accent", dx=-5, ha="right")
    formula.set(yscale="log", ylim=(0.8, 300), xlim=(0.0, 1.0), xticks=[0.0, 0.2, 0.4, 0.6, 0.8, 1.0])
    formula.set_yticks([1, 10, 100], ["1", "10", "100"])

    titled(failures, "Runs of N trials that failed", "inlier fraction w", "share of runs, log scale")
    failures.grid(False)
    for p, row, aside in zip(result.confidences, result.failures, (-0.014, 0.0, 0.014), strict=True):
        failures.axhline(1.0 - p, color=COLOURS["guide"], linewidth=1.25, dashes=(4, 3))
        low, high = zip(*(wilson(k, result.runs) for k in row), strict=True)
        x = [share + aside for share in result.shares]
        y = [max(k / result.runs, LEAST) for k in row]
        measured(failures, x, y, np.maximum(low, LEAST), high, "accent")
        label(failures, 0.94, 1.0 - p, f"p = {p:g}", "soft", dx=5)
    failures.set(yscale="log", ylim=(LEAST, 0.2), xlim=(0.26, 0.94), xticks=[0.3, 0.5, 0.7, 0.9])
    failures.set_yticks([LEAST, 1e-3, 1e-2, 0.1], ["none", "0.1 %", "1 %", "10 %"])
