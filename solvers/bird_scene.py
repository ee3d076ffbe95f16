"""The bird: a curve with few symmetries."""

from solvers.scenes.bird import AREA, COUNTS, FIELD, MOST, SHAPE, TRUTH, bird, bird_start

__all__ = ["AREA", "COUNTS", "FIELD", "MOST", "SHAPE", "TRUTH", "bird", "bird_start"]
