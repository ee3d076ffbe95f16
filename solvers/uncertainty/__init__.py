"""The uncertainty of a registered pose.

A pose is an estimate, and an estimate has a spread. There are four ways to compute it, and they answer different
questions:

- `covariance(result, "hessian")`: σ² (JᵀJ)⁻¹, from the pairs that the run ended with, assumed to be right.
- `covariance(result, "censi")`: the noise of the measured points carried through the
  minimum, in closed form (Censi 2007).
- `monte_carlo(source, target, …)`: registers redrawn scans and keeps all end poses.
- `from_starts(source, target, …)`: registers one pair of scans from several starts (Brossard, Bonnabel & Barrau 2020)
  and can add a closed form.

`Covariance` records the frame in which its small motion acts, names its directions, draws regions and poses through
the exponential map, and changes frames by the adjoint; `state_covariance` is the matrix that a Kalman filter takes.
Everything is in the plane. The package is loaded on first use.
"""

from solvers.uncertainty.chi_square import quantile
from solvers.uncertainty.closed_form import CENSI, HESSIAN, POINT, covariance
from solvers.uncertainty.ends import APART, Spread, from_starts, monte_carlo, spread_of
from solvers.uncertainty.matrices import from_matrix
from solvers.uncertainty.noise import range_bearing
from solvers.uncertainty.region import FRAMES, Covariance
from solvers.uncertainty.se2 import adjoint, exp, log
from solvers.uncertainty.state import state_covariance

__all__ = [
    "APART",
    "CENSI",
    "FRAMES",
    "HESSIAN",
    "POINT",
    "Covariance",
    "Spread",
    "adjoint",
    "covariance",
    "exp",
    "from_matrix",
    "from_starts",
    "log",
    "monte_carlo",
    "quantile",
    "range_bearing",
    "spread_of",
    "state_covariance",
]
