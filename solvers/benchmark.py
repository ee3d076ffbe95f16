"""The race's benchmark: success rates over seeds."""

from solvers.studies.benchmark import CLOSE_DEGREES, CLOSE_DISTANCE, Line, benchmark, entry, line, table

__all__ = ["CLOSE_DEGREES", "CLOSE_DISTANCE", "Line", "benchmark", "entry", "line", "table"]
