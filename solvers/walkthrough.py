"""Four kinds of state on one scene, stage by stage."""

from solvers.studies.walkthrough import AREA, EVERY, FOUR, MOST, begin_walk, clutter, scene_poses

__all__ = ["AREA", "EVERY", "FOUR", "MOST", "begin_walk", "clutter", "scene_poses"]
