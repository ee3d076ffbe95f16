from solvers import fit_rigid


def register(source, targets):
    return fit_rigid(source, targets).pose.matrix
