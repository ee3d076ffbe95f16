from solvers import fit_rigid


def register(source, target):
    return fit_rigid(source, target).pose.matrix
