"""Point-cloud registration in numpy: batched, and honest about its limits.

`register(source, target, method=…)` is the entry point, `METHODS` lists the methods,
and `fit_rigid` and `fit_planar` are the closed forms underneath. Each method is also a
function with its options in its signature: `solvers.icp(source, target, gate=0.5)`.
Points are rows; rotations are in radians; a pose maps source to target coordinates.
Lengths are in the unit of the clouds, called world units (u).

Examples
--------
>>> import solvers
>>> corners = [[0.0, 0.0], [2.0, 0.0], [2.0, 1.0]]
>>> moved = [[1.0, 1.0], [1.0, 3.0], [0.0, 3.0]]
>>> solvers.register(corners, moved, "kabsch").pose
Pose(angle=90°, t=(1, 1), scale=1)
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from solvers.core.pose import Pose
from solvers.core.result import Result
from solvers.core.status import Status
from solvers.geometry.rigid import Fit, fit_planar, fit_rigid

__version__ = "0.1.0"
__all__ = ["METHODS", "Fit", "Pose", "Result", "Status", "fit_planar", "fit_rigid", "register"]

if TYPE_CHECKING:
    # Types of the modules, and of `register` and `METHODS` for each method's name. To Pyright, which editors run, what
    # is not in `__all__` is not exported.
    import solvers._functions as _typed
    from solvers._functions import *  # noqa: F403

    __all__ += _typed.__all__
else:
    from solvers.api import register
    from solvers.core.registry import METHODS

_MODULES = {
    **{name: name for name in (
        "benchmark", "bird_scene", "cloud_text", "collinear", "consensus", "drives", "features", "g2o", "hall",
        "landscape", "match_scenes", "methods", "metrics", "mug_scene", "ndt_map", "ndt_score", "ndt_translation",
        "odometry", "options", "posegraph", "race", "robust", "scans", "scenes", "soft_shares", "stepper", "thinning",
        "uncertainty", "uncertainty_study", "verify", "walk_scenes", "walkthrough", "wall_scenes",
    )},
    "downsample": "geometry.downsample",
}  # fmt: skip


def __getattr__(name: str) -> Any:
    """Import modules and make the methods' functions on first access, so that a page pays only for what it shows."""
    if name in _MODULES:
        return import_module(f"solvers.{_MODULES[name]}")
    functions = _functions()
    if name in functions.NAMES or name in functions.ALSO:
        return functions.function(name)
    raise AttributeError(f"module 'solvers' has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted({*globals(), *_MODULES, *_functions().NAMES})


def _functions() -> Any:
    return import_module("solvers.per_method")
