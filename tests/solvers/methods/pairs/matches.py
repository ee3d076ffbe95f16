"""Pairs of which some have a random partner, for the methods that must find out which."""

import numpy as np


def matches(rng, truth, wrong, n=40, noise=0.06):
    """n pairs, the first `wrong` of which have a random partner."""
    d = truth.dim
    source = rng.uniform(-3.0, 3.0, (n, d))
    target = truth.apply(source) + noise * rng.standard_normal((n, d))
    target[:wrong] = rng.uniform(-4.0, 4.0, (wrong, d))
    return source, target


def many(rng, random_pose, wrong, count=20, d=2, **options):
    """`count` such clouds, batched, and their true poses."""
    truth = random_pose(rng, d, (count,))
    pairs = [matches(rng, truth[i], wrong, **options) for i in range(count)]
    return np.stack([p for p, _ in pairs]), np.stack([q for _, q in pairs]), truth
