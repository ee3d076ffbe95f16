"""`register` with every method: whatever the clouds, a valid answer, or `degenerate` with a reason."""

from __future__ import annotations

import itertools
import warnings
from functools import partial

import numpy as np
import pytest

from solvers import METHODS, Status, register
from tests.hostile.clouds import Array, pairs
from tests.hostile.tally import Tally

pytestmark = pytest.mark.hostile


def test_any_clouds_through_every_method(tally: Tally, calls: int) -> None:
    for k, (source, target) in enumerate(itertools.islice(pairs(14), -(-calls // len(METHODS)))):
        for name in METHODS:
            tally.tries(f"pair {k}, {name}", partial(outcome, source, target, name, k))
    tally.closes()


def outcome(source: Array, target: Array, name: str, seed: int) -> str:
    """The outcome of one call. A numpy warning counts as an error, and so does a ValueError: clouds are never
    refused."""
    method = METHODS[name]
    if method.dims is not None and source.shape[1] not in method.dims:
        source, target = source[:, :2], target[:, :2]
    if method.paired:
        n = min(len(source), len(target))
        source, target = source[:n], target[:n]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        try:
            result = register(source, target, name, seed=seed)
        except ValueError as error:
            raise AssertionError("these are clouds") from error
    pose = result.pose
    assert np.isfinite(pose.matrix).all()
    assert abs(np.linalg.det(pose.R) - 1.0) < 1e-9
    assert not np.isnan(result.objective)
    assert result.steps <= method.max_steps
    assert result.status != Status.RUNNING
    if result.status == Status.DEGENERATE:
        assert result.reason
        return "degenerate"
    return "ok"
