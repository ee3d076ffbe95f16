"""Every method, a room a family; none imports another family's."""

from solvers.core.registry import METHODS

__all__ = ["METHODS"]
