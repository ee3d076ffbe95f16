"""MMD-Reg: a step is the damped least-squares step of the state that it starts from, capped, with λ as the state has
it."""

import numpy as np
import pytest

from solvers import METHODS, Pose
from solvers.core.method import Problem
from solvers.core.stepper import advance, begin
from solvers.methods.mmd.mmd import MmdOptions
from solvers.scenes.rooms import room, room_start

FLOOR = 1e-9  # the least λ


@pytest.mark.parametrize(
    ("damping", "length", "turn", "offset", "is_capped"),
    [(1e-3, 0.8, 50.0, 1.5, False), (3.0, 4.0, 50.0, 1.5, False), (1e-3, 4.0, 20.0, 3.0, True)],
)
def test_a_step_solves_the_damped_equations(damping, length, turn, offset, is_capped):
    """−(JᵀJ + λ μ I)⁻¹ Jᵀr, μ the largest eigenvalue of JᵀJ, in units of ℓ and of ℓ over the RMS radius; λ is eight
    times as large after each try that did not lower the objective, then a fifth of what succeeded."""
    s = room("combo")
    start = room_start(turn, offset)
    weights, seed = np.ones((1, len(s.source))), np.zeros(1, dtype=np.int64)
    problem = Problem(s.source[None], s.target[None], weights, Pose(start.R[None], start.t[None]), seed)
    batch = begin(METHODS["mmd"], problem, MmdOptions(lengths=(length,), damping=damping))
    radius = np.sqrt(np.square(s.source - s.source.mean(axis=0)).sum(axis=1).mean())
    caps = []
    for _ in range(12):
        before, batch = batch.state(), advance(batch)
        after = batch.state()
        if batch.done or after.damping[0] == FLOOR:
            break
        factor = after.damping[0] / 0.2 / before.damping[0]
        failed = round(np.log(factor) / np.log(8.0))
        assert factor == pytest.approx(8.0**failed)
        J, r = before.jacobian[0], before.residual[0]
        A = J.T @ J
        step = -np.linalg.solve(A + 8.0**failed * before.damping[0] * np.linalg.eigvalsh(A)[-1] * np.eye(3), J.T @ r)
        size = np.linalg.norm(step)
        cap = 1.0 / max(1.0, size, abs(step[2]) * length / radius)
        shift, turn = cap * step[:2] * length, cap * step[2] * length / radius
        first, last = before.pose[0], after.pose[0]
        middle = s.source.mean(axis=0, keepdims=True)
        np.testing.assert_allclose(last.apply(middle) - first.apply(middle), [shift], atol=1e-9)
        assert last.angle - first.angle == pytest.approx(turn, abs=1e-9)
        assert after.change[0] == pytest.approx(cap * size * length / radius)
        assert after.objective[0] < before.objective[0]
        caps.append(cap)
    assert len(caps) > 3
    assert (min(caps) < 1.0) == is_capped
