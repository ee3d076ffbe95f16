"""Read and write pose graphs in the g2o format."""

from solvers.io.g2o import MOST_BYTES, GraphText, read, write

__all__ = ["MOST_BYTES", "GraphText", "read", "write"]
