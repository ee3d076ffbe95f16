"""Plots, one module each, found by name: `::plot[Caption.]{trial-budget}` is trial_budget.py.

A module has `TITLE`, a frozen dataclass `Result` of plain data (numbers, texts, tuples of these), `compute() -> Result`
(solvers only, deterministic), `draw(result, figure, narrow)` (matplotlib; the figure already has its size),
`words(result) -> str`, and may have `table(result) -> (heads, rows)`, `SIZES`, and `READS`: files of the checkout that
its result depends on. Instead of `compute`, long plots have `PARTS`, `part(…)` and `whole(parts) -> Result`. Other
public functions take the result first and return numbers for the chapters:
`:value[plots.trial_budget.failed(0.5, 0.9)]{.1f}`.

These modules import matplotlib only inside `draw`: most builds find all drawings in the cache.
"""
