"""A pose's covariance as filters take it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from solvers.core import validate
from solvers.core.arrays import FloatArray
from solvers.core.kinds import of_kind
from solvers.uncertainty.region import Covariance


def state_covariance(spread: Covariance, reach: float | None = None) -> FloatArray:
    """The covariance of a pose's own numbers, (x, y, angle), `pose.t` and `pose.angle`.

    A Kalman filter takes it as the noise of a measured pose, if the filter's state has
    these three and their errors are added to them. (ROS's PoseWithCovariance has rows
    for z, roll and pitch between y and the angle.)

    Parameters
    ----------
    spread : Covariance
        The spread, in either frame.
    reach : float, optional
        The deviation to assume for a free direction, world units: far more than the
        filter's own uncertainty.

    Returns
    -------
    ndarray of shape (..., 3, 3)
        u², u·rad and rad², to first order.

    Raises
    ------
    ValueError
        If `spread` is not a Covariance, or a direction is free and no reach is given.

    Examples
    --------
    Of a pose turned by 90°, x of the source is y of the target.

    >>> import numpy as np
    >>> from solvers import Pose
    >>> from solvers.uncertainty import from_matrix, state_covariance
    >>> spread = from_matrix(np.diag([0.05, 0.2, 0.1]) ** 2, Pose.from_angle(np.pi / 2, (3.0, 0.0)), frame="source")
    >>> np.sqrt(state_covariance(spread).diagonal()).round(6)
    array([0.1 , 0.2 , 0.05])
    """
    source = of_kind(spread, Covariance, "spread").to("source")
    if reach is not None:
        validate.number(reach, "reach", 0.0)
    if source.free.any():
        if reach is None:
            raise ValueError("reach: a direction has no finite spread; say how far to take it")
        source = replace(source, deviations=np.where(source.free, reach, source.deviations))
    matrix = source.matrix[..., [1, 2, 0], :][..., [1, 2, 0]]
    turn = np.zeros_like(matrix)
    turn[..., :2, :2], turn[..., 2, 2] = spread.mean.R, 1.0
    return turn @ matrix @ turn.swapaxes(-1, -2)
