"""Every registration method, one package per family; no family imports another."""

from solvers.core.registry import METHODS

__all__ = ["METHODS"]
