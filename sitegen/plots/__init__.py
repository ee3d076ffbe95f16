"""Regression figures, one module each, found by name: `::plot[Caption.]{trial-budget}` is trial_budget.py.

A module has `TITLE`, a frozen dataclass `Result` of plain data (numbers, texts, tuples of these), `compute() -> Result`
(solvers only, always the same), `draw(result, figure, narrow)` (matplotlib; the figure has its size already),
`words(result) -> str`, and may have `table(result) -> (heads, rows)`, `SIZES`, and `READS`: files of the checkout that
its result depends on. Its other public functions take the result first and give the numbers that chapters ask for:
`:value[plots.trial_budget.failed(0.5, 0.9)]{.1f}`.

matplotlib is never imported by these modules at once: most builds find all drawings in the cache.
"""
