"""The race's benchmark: rates of success over seeds."""

from solvers.studies.benchmark import CLOSE_DEGREES, CLOSE_DISTANCE, Line, benchmark, entry, line, table

__all__ = ["CLOSE_DEGREES", "CLOSE_DISTANCE", "Line", "benchmark", "entry", "line", "table"]
