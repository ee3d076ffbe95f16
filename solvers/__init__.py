"""Point-cloud registration in numpy: batched, and honest about what a scene does not determine.

`register(source, target, method=…)` is the front door, `METHODS` names what it knows, `fit_rigid` and `fit_planar` are
the closed forms beneath. Points are rows; rotations are in radians; a pose takes source to target coordinates.
"""

from solvers.api import register
from solvers.methods import METHODS
from solvers.pose import Pose
from solvers.result import Result
from solvers.rigid import Fit, fit_planar, fit_rigid
from solvers.status import Status

__version__ = "0.1.0"
__all__ = ["METHODS", "Fit", "Pose", "Result", "Status", "fit_planar", "fit_rigid", "register"]
