import solvers


def register(source, target):
    return solvers.register(
        source, target, "ransac",
        inlier=0.2, confidence=0.99, most=1000, seed=0,
    ).matrix
