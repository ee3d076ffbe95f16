import numpy as np
from pycpd import RigidRegistration


def register(source, target):
    cpd = RigidRegistration(
        X=target, Y=source, w=0.1, max_iterations=50, tolerance=0.0
    )
    cpd.register()
    matrix = np.eye(3)
    matrix[:2, :2] = cpd.s * cpd.R.T  # pycpd turns rows: y R
    matrix[:2, 2] = cpd.t
    return matrix
