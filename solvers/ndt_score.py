"""NDT's score of a pose, with gradient and Hessian."""

from solvers.methods.ndt.score import BLOCK, Score, evaluate, score_map

__all__ = ["BLOCK", "Score", "evaluate", "score_map"]
