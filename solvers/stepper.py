"""Solvers step by step: problems, batches, methods and their histories."""

from solvers.core.method import Method, NoOptions, Problem, S, State
from solvers.core.stepper import Batch, Callback, History, T, advance, begin, run

__all__ = [
    "Batch",
    "Callback",
    "History",
    "Method",
    "NoOptions",
    "Problem",
    "S",
    "State",
    "T",
    "advance",
    "begin",
    "run",
]
