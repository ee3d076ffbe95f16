"""Point-cloud registration in numpy: batched, dimension-generic, honest about what it cannot determine."""

from solvers.pose import Pose
from solvers.rigid import Fit, fit_planar, fit_rigid
from solvers.status import Status

__version__ = "0.1.0"
__all__ = ["Fit", "Pose", "Status", "fit_planar", "fit_rigid"]
