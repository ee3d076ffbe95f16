import solvers


def register(source, target, start):
    return solvers.register(
        source, target, "icp", start=start, gate=2.6,
        max_steps=20, tolerance=0.0, rms_tolerance=0.0,
    ).matrix
