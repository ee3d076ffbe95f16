"""Point-cloud registration in numpy: batched, and honest about its limits.

`register(source, target, method=…)` is the front door, `METHODS` names what it knows,
`fit_rigid` and `fit_planar` are the closed forms beneath. Points are rows; rotations
are in radians; a pose takes source to target coordinates. Lengths are in the unit of
the clouds, called world units (u).

Examples
--------
>>> import solvers
>>> corners = [[0.0, 0.0], [2.0, 0.0], [2.0, 1.0]]
>>> moved = [[1.0, 1.0], [1.0, 3.0], [0.0, 3.0]]
>>> solvers.register(corners, moved, "kabsch").pose
Pose(angle=90°, t=(1, 1), scale=1)
"""

from solvers.api import register
from solvers.core.pose import Pose
from solvers.core.registry import METHODS
from solvers.core.result import Result
from solvers.core.status import Status
from solvers.geometry.rigid import Fit, fit_planar, fit_rigid

__version__ = "0.1.0"
__all__ = ["METHODS", "Fit", "Pose", "Result", "Status", "fit_planar", "fit_rigid", "register"]
