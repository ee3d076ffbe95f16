import solvers


def register(source, target):
    return solvers.register(
        source, target, "cpd-similarity",
        clutter=0.1, volume=len(target), max_steps=50, tolerance=0.0,
    ).matrix
