"""The types of the methods' functions, written from `solvers.per_method`.

By `python -c "from tests.solvers.test_per_method import write; write()"`; a test holds this file to that.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from solvers.core.arrays import IntArray
from solvers.core.pose import Pose
from solvers.core.result import Result
from solvers.core.stepper import Callback

def kabsch(
    source: ArrayLike | Sequence[ArrayLike],
    target: ArrayLike | Sequence[ArrayLike],
    *,
    start: Pose | ArrayLike | None = ...,
    pairs: ArrayLike | None = ...,
    weights: ArrayLike | Sequence[ArrayLike | None] | None = ...,
    seed: int | Sequence[int] | IntArray | np.random.Generator | None = ...,
    max_steps: int | None = ...,
    callback: Callback | None = ...,
) -> Result: ...

def similarity(
    source: ArrayLike | Sequence[ArrayLike],
    target: ArrayLike | Sequence[ArrayLike],
    *,
    start: Pose | ArrayLike | None = ...,
    pairs: ArrayLike | None = ...,
    weights: ArrayLike | Sequence[ArrayLike | None] | None = ...,
    seed: int | Sequence[int] | IntArray | np.random.Generator | None = ...,
    max_steps: int | None = ...,
    callback: Callback | None = ...,
) -> Result: ...

def ransac(
    source: ArrayLike | Sequence[ArrayLike],
    target: ArrayLike | Sequence[ArrayLike],
    *,
    inlier: float | None = ...,
    confidence: float = ...,
    most: int = ...,
    per_step: int = ...,
    separation: float = ...,
    start: Pose | ArrayLike | None = ...,
    pairs: ArrayLike | None = ...,
    seed: int | Sequence[int] | IntArray | np.random.Generator | None = ...,
    max_steps: int | None = ...,
    callback: Callback | None = ...,
) -> Result: ...

def ransac_congruent(
    source: ArrayLike | Sequence[ArrayLike],
    target: ArrayLike | Sequence[ArrayLike],
    *,
    separation: float | None = ...,
    tolerance: float | None = ...,
    inlier: float | None = ...,
    per_step: int = ...,
    most: int = ...,
    screen: int = ...,
    patience: int = ...,
    start: Pose | ArrayLike | None = ...,
    seed: int | Sequence[int] | IntArray | np.random.Generator | None = ...,
    max_steps: int | None = ...,
    callback: Callback | None = ...,
) -> Result: ...

def graduated_nonconvexity(
    source: ArrayLike | Sequence[ArrayLike],
    target: ArrayLike | Sequence[ArrayLike],
    *,
    inlier: float | None = ...,
    factor: float = ...,
    start: Pose | ArrayLike | None = ...,
    pairs: ArrayLike | None = ...,
    weights: ArrayLike | Sequence[ArrayLike | None] | None = ...,
    seed: int | Sequence[int] | IntArray | np.random.Generator | None = ...,
    max_steps: int | None = ...,
    callback: Callback | None = ...,
) -> Result: ...

def icp(
    source: ArrayLike | Sequence[ArrayLike],
    target: ArrayLike | Sequence[ArrayLike],
    *,
    gate: float = ...,
    trim: float = ...,
    weight: str = ...,
    tuning: float | None = ...,
    scale: float | None = ...,
    tolerance: float = ...,
    rms_tolerance: float = ...,
    start: Pose | ArrayLike | None = ...,
    weights: ArrayLike | Sequence[ArrayLike | None] | None = ...,
    seed: int | Sequence[int] | IntArray | np.random.Generator | None = ...,
    max_steps: int | None = ...,
    callback: Callback | None = ...,
) -> Result: ...

def trimmed_icp(
    source: ArrayLike | Sequence[ArrayLike],
    target: ArrayLike | Sequence[ArrayLike],
    *,
    keep: float = ...,
    weight: str = ...,
    tuning: float | None = ...,
    scale: float | None = ...,
    tolerance: float = ...,
    rms_tolerance: float = ...,
    start: Pose | ArrayLike | None = ...,
    seed: int | Sequence[int] | IntArray | np.random.Generator | None = ...,
    max_steps: int | None = ...,
    callback: Callback | None = ...,
) -> Result: ...

def capped_icp(
    source: ArrayLike | Sequence[ArrayLike],
    target: ArrayLike | Sequence[ArrayLike],
    *,
    cap: float | None = ...,
    weight: str = ...,
    tuning: float | None = ...,
    scale: float | None = ...,
    tolerance: float = ...,
    rms_tolerance: float = ...,
    start: Pose | ArrayLike | None = ...,
    weights: ArrayLike | Sequence[ArrayLike | None] | None = ...,
    seed: int | Sequence[int] | IntArray | np.random.Generator | None = ...,
    max_steps: int | None = ...,
    callback: Callback | None = ...,
) -> Result: ...

def kiss_threshold_icp(
    source: ArrayLike | Sequence[ArrayLike],
    target: ArrayLike | Sequence[ArrayLike],
    *,
    angle: float | None = ...,
    shift: float | None = ...,
    initial: float | None = ...,
    least: float | None = ...,
    tolerance: float = ...,
    start: Pose | ArrayLike | None = ...,
    weights: ArrayLike | Sequence[ArrayLike | None] | None = ...,
    seed: int | Sequence[int] | IntArray | np.random.Generator | None = ...,
    max_steps: int | None = ...,
    callback: Callback | None = ...,
) -> Result: ...

def fast_robust_icp(
    source: ArrayLike | Sequence[ArrayLike],
    target: ArrayLike | Sequence[ArrayLike],
    *,
    first: float | None = ...,
    last: float | None = ...,
    history: int = ...,
    forget: bool = ...,
    tolerance: float = ...,
    rough: float = ...,
    start: Pose | ArrayLike | None = ...,
    weights: ArrayLike | Sequence[ArrayLike | None] | None = ...,
    seed: int | Sequence[int] | IntArray | np.random.Generator | None = ...,
    max_steps: int | None = ...,
    callback: Callback | None = ...,
) -> Result: ...

def point_to_plane(
    source: ArrayLike | Sequence[ArrayLike],
    target: ArrayLike | Sequence[ArrayLike],
    *,
    gate: float = ...,
    trim: float = ...,
    weight: str = ...,
    tuning: float | None = ...,
    scale: float | None = ...,
    neighbours: int = ...,
    roundness: float = ...,
    max_shift: float = ...,
    max_turn: float = ...,
    free_below: float = ...,
    tolerance: float = ...,
    rms_tolerance: float = ...,
    start: Pose | ArrayLike | None = ...,
    weights: ArrayLike | Sequence[ArrayLike | None] | None = ...,
    seed: int | Sequence[int] | IntArray | np.random.Generator | None = ...,
    max_steps: int | None = ...,
    callback: Callback | None = ...,
) -> Result: ...

def gicp(
    source: ArrayLike | Sequence[ArrayLike],
    target: ArrayLike | Sequence[ArrayLike],
    *,
    gate: float = ...,
    trim: float = ...,
    weight: str = ...,
    tuning: float | None = ...,
    scale: float | None = ...,
    neighbours: int = ...,
    roundness: float = ...,
    max_shift: float = ...,
    max_turn: float = ...,
    free_below: float = ...,
    tolerance: float = ...,
    rms_tolerance: float = ...,
    tangent: float = ...,
    normal: float = ...,
    start: Pose | ArrayLike | None = ...,
    weights: ArrayLike | Sequence[ArrayLike | None] | None = ...,
    seed: int | Sequence[int] | IntArray | np.random.Generator | None = ...,
    max_steps: int | None = ...,
    callback: Callback | None = ...,
) -> Result: ...

def ndt(
    source: ArrayLike | Sequence[ArrayLike],
    target: ArrayLike | Sequence[ArrayLike],
    *,
    cells: float | Sequence[float] | None = ...,
    grids: int = ...,
    offset: Sequence[float] = ...,
    max_shift: float | None = ...,
    max_turn: float = ...,
    halvings: int = ...,
    tolerance: float = ...,
    outliers: float | None = ...,
    start: Pose | ArrayLike | None = ...,
    seed: int | Sequence[int] | IntArray | np.random.Generator | None = ...,
    max_steps: int | None = ...,
    callback: Callback | None = ...,
) -> Result: ...

def ndt_d2d(
    source: ArrayLike | Sequence[ArrayLike],
    target: ArrayLike | Sequence[ArrayLike],
    *,
    cells: float | Sequence[float] | None = ...,
    grids: int = ...,
    offset: Sequence[float] = ...,
    max_shift: float | None = ...,
    max_turn: float = ...,
    halvings: int = ...,
    tolerance: float = ...,
    outliers: float | None = ...,
    start: Pose | ArrayLike | None = ...,
    seed: int | Sequence[int] | IntArray | np.random.Generator | None = ...,
    max_steps: int | None = ...,
    callback: Callback | None = ...,
) -> Result: ...

def soft_annealed(
    source: ArrayLike | Sequence[ArrayLike],
    target: ArrayLike | Sequence[ArrayLike],
    *,
    first: float | None = ...,
    last: float | None = ...,
    shrink: float = ...,
    miss: float = ...,
    least_support: float = ...,
    tolerance: float = ...,
    start: Pose | ArrayLike | None = ...,
    seed: int | Sequence[int] | IntArray | np.random.Generator | None = ...,
    max_steps: int | None = ...,
    callback: Callback | None = ...,
) -> Result: ...

def cpd_rigid(
    source: ArrayLike | Sequence[ArrayLike],
    target: ArrayLike | Sequence[ArrayLike],
    *,
    clutter: float = ...,
    volume: float | None = ...,
    sigma: float | None = ...,
    tolerance: float = ...,
    start: Pose | ArrayLike | None = ...,
    seed: int | Sequence[int] | IntArray | np.random.Generator | None = ...,
    max_steps: int | None = ...,
    callback: Callback | None = ...,
) -> Result: ...

def cpd_similarity(
    source: ArrayLike | Sequence[ArrayLike],
    target: ArrayLike | Sequence[ArrayLike],
    *,
    clutter: float = ...,
    volume: float | None = ...,
    sigma: float | None = ...,
    tolerance: float = ...,
    start: Pose | ArrayLike | None = ...,
    seed: int | Sequence[int] | IntArray | np.random.Generator | None = ...,
    max_steps: int | None = ...,
    callback: Callback | None = ...,
) -> Result: ...

def filterreg(
    source: ArrayLike | Sequence[ArrayLike],
    target: ArrayLike | Sequence[ArrayLike],
    *,
    filter: str = ...,
    variance: str = ...,
    first: float | None = ...,
    last: float | None = ...,
    shrink: float = ...,
    clutter: float = ...,
    volume: float | None = ...,
    tolerance: float = ...,
    start: Pose | ArrayLike | None = ...,
    seed: int | Sequence[int] | IntArray | np.random.Generator | None = ...,
    max_steps: int | None = ...,
    callback: Callback | None = ...,
) -> Result: ...

def gmmreg(
    source: ArrayLike | Sequence[ArrayLike],
    target: ArrayLike | Sequence[ArrayLike],
    *,
    first: float | None = ...,
    last: float | None = ...,
    shrink: float = ...,
    coarse: float = ...,
    tolerance: float = ...,
    start: Pose | ArrayLike | None = ...,
    seed: int | Sequence[int] | IntArray | np.random.Generator | None = ...,
    max_steps: int | None = ...,
    callback: Callback | None = ...,
) -> Result: ...

def mmd(
    source: ArrayLike | Sequence[ArrayLike],
    target: ArrayLike | Sequence[ArrayLike],
    *,
    lengths: tuple[float, ...] | None = ...,
    count: int | tuple[int, ...] = ...,
    kernel: str = ...,
    redraw: bool = ...,
    damping: float = ...,
    tolerance: float = ...,
    coarse: float = ...,
    decrease: float = ...,
    start: Pose | ArrayLike | None = ...,
    seed: int | Sequence[int] | IntArray | np.random.Generator | None = ...,
    max_steps: int | None = ...,
    callback: Callback | None = ...,
) -> Result: ...

def branch_and_bound(
    source: ArrayLike | Sequence[ArrayLike],
    target: ArrayLike | Sequence[ArrayLike],
    *,
    cap: float | None = ...,
    gap: float | None = ...,
    turn: float = ...,
    shift: float | None = ...,
    boxes: int = ...,
    most: int = ...,
    start: Pose | ArrayLike | None = ...,
    seed: int | Sequence[int] | IntArray | np.random.Generator | None = ...,
    max_steps: int | None = ...,
    callback: Callback | None = ...,
) -> Result: ...

def correlative(
    source: ArrayLike | Sequence[ArrayLike],
    target: ArrayLike | Sequence[ArrayLike],
    *,
    cell: float | None = ...,
    blur: float = ...,
    angle: float | None = ...,
    shift: float | None = ...,
    turn: float | None = ...,
    apart: float = ...,
    per_step: int = ...,
    start: Pose | ArrayLike | None = ...,
    seed: int | Sequence[int] | IntArray | np.random.Generator | None = ...,
    max_steps: int | None = ...,
    callback: Callback | None = ...,
) -> Result: ...

def flow(
    source: ArrayLike | Sequence[ArrayLike],
    target: ArrayLike | Sequence[ArrayLike],
    *,
    steps: int = ...,
    samples: int = ...,
    project: bool = ...,
    start: Pose | ArrayLike | None = ...,
    seed: int | Sequence[int] | IntArray | np.random.Generator | None = ...,
    max_steps: int | None = ...,
    callback: Callback | None = ...,
) -> Result: ...

def flow_from_source(
    source: ArrayLike | Sequence[ArrayLike],
    target: ArrayLike | Sequence[ArrayLike],
    *,
    steps: int = ...,
    samples: int = ...,
    project: bool = ...,
    start: Pose | ArrayLike | None = ...,
    seed: int | Sequence[int] | IntArray | np.random.Generator | None = ...,
    max_steps: int | None = ...,
    callback: Callback | None = ...,
) -> Result: ...

def association_bp(
    source: ArrayLike | Sequence[ArrayLike],
    target: ArrayLike | Sequence[ArrayLike],
    *,
    first: float | None = ...,
    last: float | None = ...,
    shrink: float = ...,
    reach: float = ...,
    miss: float = ...,
    sweeps: int = ...,
    least_support: float = ...,
    tolerance: float = ...,
    start: Pose | ArrayLike | None = ...,
    seed: int | Sequence[int] | IntArray | np.random.Generator | None = ...,
    max_steps: int | None = ...,
    callback: Callback | None = ...,
) -> Result: ...

def hypothesis_mixture(
    source: ArrayLike | Sequence[ArrayLike],
    target: ArrayLike | Sequence[ArrayLike],
    *,
    first: float | None = ...,
    last: float | None = ...,
    shrink: float = ...,
    reach: float = ...,
    miss: float = ...,
    count: int = ...,
    draws: int = ...,
    least_support: float = ...,
    tolerance: float = ...,
    start: Pose | ArrayLike | None = ...,
    seed: int | Sequence[int] | IntArray | np.random.Generator | None = ...,
    max_steps: int | None = ...,
    callback: Callback | None = ...,
) -> Result: ...
