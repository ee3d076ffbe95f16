"""A facade with matches, some of them wrong."""

from solvers.scenes.facade import FACADE, FACADE_TRUTH, FRONT, MATCH_SCENES, PERIOD, facade_scene

__all__ = ["FACADE", "FACADE_TRUTH", "FRONT", "MATCH_SCENES", "PERIOD", "facade_scene"]
