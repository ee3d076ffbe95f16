"""The types of the modules, of the methods' functions, of `register` and of `METHODS`, written from the code.

By `python -m tests.solvers.stub`; a test holds this file to that.
"""

from collections.abc import ItemsView, Iterator, KeysView, Mapping, Sequence
from typing import Any, Generic, Literal, TypeVar, overload

import numpy as np
from numpy.typing import ArrayLike

from solvers import benchmark as benchmark
from solvers import bird_scene as bird_scene
from solvers import cloud_text as cloud_text
from solvers import collinear as collinear
from solvers import consensus as consensus
from solvers import drives as drives
from solvers import features as features
from solvers import g2o as g2o
from solvers import hall as hall
from solvers import landscape as landscape
from solvers import match_scenes as match_scenes
from solvers import methods as methods
from solvers import metrics as metrics
from solvers import mug_scene as mug_scene
from solvers import ndt_map as ndt_map
from solvers import ndt_score as ndt_score
from solvers import ndt_translation as ndt_translation
from solvers import odometry as odometry
from solvers import options as options
from solvers import posegraph as posegraph
from solvers import race as race
from solvers import robust as robust
from solvers import scans as scans
from solvers import scenes as scenes
from solvers import soft_shares as soft_shares
from solvers import stepper as stepper
from solvers import thinning as thinning
from solvers import uncertainty as uncertainty
from solvers import uncertainty_study as uncertainty_study
from solvers import verify as verify
from solvers import walk_scenes as walk_scenes
from solvers import walkthrough as walkthrough
from solvers import wall_scenes as wall_scenes
from solvers.core.arrays import FloatArray, IntArray
from solvers.core.method import Method
from solvers.core.pose import Pose
from solvers.core.registry import MethodName
from solvers.core.result import Result
from solvers.core.stepper import Callback
from solvers.geometry import downsample as downsample
from solvers.options import (
    BpOptions,
    BranchAndBoundOptions,
    CappedOptions,
    CongruentOptions,
    CorrelativeOptions,
    CpdOptions,
    D2dOptions,
    FastRobustOptions,
    FilterRegOptions,
    FlowOptions,
    GicpOptions,
    GmmRegOptions,
    GraduatedOptions,
    HypothesisOptions,
    IcpOptions,
    KissOptions,
    MmdOptions,
    NdtOptions,
    NoOptions,
    RansacOptions,
    SoftOptions,
    SurfaceOptions,
    TrimmedOptions,
)

__all__: list[str] = [
    "METHODS", "association_bp", "benchmark", "bird_scene", "branch_and_bound", "capped_icp", "cloud_text",
    "collinear", "consensus", "correlative", "cpd_rigid", "cpd_similarity", "d2d_ndt", "downsample", "drives",
    "fast_robust_icp", "features", "filterreg", "flow", "flow_from_source", "g2o", "generalized_icp", "gicp",
    "gmmreg", "gnc", "graduated_nonconvexity", "hall", "hypothesis_mixture", "icp", "kabsch",
    "kiss_threshold_icp", "landscape", "match_scenes", "methods", "metrics", "mmd", "mug_scene", "ndt",
    "ndt_d2d", "ndt_map", "ndt_score", "ndt_translation", "odometry", "options", "p2d_ndt", "point_to_plane",
    "point_to_point", "posegraph", "race", "ransac", "ransac_congruent", "ransac_unpaired", "register",
    "robust", "scans", "scenes", "similarity", "soft_annealed", "soft_shares", "stepper", "thinning", "tricp",
    "trimmed_icp", "umeyama", "uncertainty", "uncertainty_study", "verify", "walk_scenes", "walkthrough",
    "wall_scenes",
]

_O = TypeVar("_O")

def kabsch(
    source: ArrayLike | Sequence[ArrayLike], target: ArrayLike | Sequence[ArrayLike], *,
    start: Pose | ArrayLike | None = ..., pairs: ArrayLike | None = ...,
    weights: ArrayLike | Sequence[ArrayLike | None] | None = ...,
    seed: int | Sequence[int] | IntArray | np.random.Generator | None = ..., max_steps: int | None = ...,
    callback: Callback | None = ...,
) -> Result: ...

def similarity(
    source: ArrayLike | Sequence[ArrayLike], target: ArrayLike | Sequence[ArrayLike], *,
    start: Pose | ArrayLike | None = ..., pairs: ArrayLike | None = ...,
    weights: ArrayLike | Sequence[ArrayLike | None] | None = ...,
    seed: int | Sequence[int] | IntArray | np.random.Generator | None = ..., max_steps: int | None = ...,
    callback: Callback | None = ...,
) -> Result: ...

def ransac(
    source: ArrayLike | Sequence[ArrayLike], target: ArrayLike | Sequence[ArrayLike], *,
    inlier: float | None = ..., confidence: float = ..., most: int = ..., per_step: int = ...,
    separation: float = ..., start: Pose | ArrayLike | None = ..., pairs: ArrayLike | None = ...,
    seed: int | Sequence[int] | IntArray | np.random.Generator | None = ..., max_steps: int | None = ...,
    callback: Callback | None = ...,
) -> Result: ...

def ransac_congruent(
    source: ArrayLike | Sequence[ArrayLike], target: ArrayLike | Sequence[ArrayLike], *,
    separation: float | None = ..., tolerance: float | None = ..., inlier: float | None = ...,
    per_step: int = ..., most: int = ..., screen: int = ..., patience: int = ...,
    start: Pose | ArrayLike | None = ...,
    seed: int | Sequence[int] | IntArray | np.random.Generator | None = ..., max_steps: int | None = ...,
    callback: Callback | None = ...,
) -> Result: ...

def graduated_nonconvexity(
    source: ArrayLike | Sequence[ArrayLike], target: ArrayLike | Sequence[ArrayLike], *,
    inlier: float | None = ..., factor: float = ..., start: Pose | ArrayLike | None = ...,
    pairs: ArrayLike | None = ..., weights: ArrayLike | Sequence[ArrayLike | None] | None = ...,
    seed: int | Sequence[int] | IntArray | np.random.Generator | None = ..., max_steps: int | None = ...,
    callback: Callback | None = ...,
) -> Result: ...

def icp(
    source: ArrayLike | Sequence[ArrayLike], target: ArrayLike | Sequence[ArrayLike], *, gate: float = ...,
    trim: float = ..., weight: Literal["none", "huber", "tukey", "welsch", "geman-mcclure"] = ...,
    tuning: float | None = ..., scale: float | None = ..., tolerance: float = ..., rms_tolerance: float = ...,
    max_distance: float = ..., start: Pose | ArrayLike | None = ...,
    weights: ArrayLike | Sequence[ArrayLike | None] | None = ...,
    seed: int | Sequence[int] | IntArray | np.random.Generator | None = ..., max_steps: int | None = ...,
    callback: Callback | None = ...,
) -> Result: ...

def trimmed_icp(
    source: ArrayLike | Sequence[ArrayLike], target: ArrayLike | Sequence[ArrayLike], *, keep: float = ...,
    weight: Literal["none", "huber", "tukey", "welsch", "geman-mcclure"] = ..., tuning: float | None = ...,
    scale: float | None = ..., tolerance: float = ..., rms_tolerance: float = ...,
    start: Pose | ArrayLike | None = ...,
    seed: int | Sequence[int] | IntArray | np.random.Generator | None = ..., max_steps: int | None = ...,
    callback: Callback | None = ...,
) -> Result: ...

def capped_icp(
    source: ArrayLike | Sequence[ArrayLike], target: ArrayLike | Sequence[ArrayLike], *,
    cap: float | None = ..., weight: Literal["none", "huber", "tukey", "welsch", "geman-mcclure"] = ...,
    tuning: float | None = ..., scale: float | None = ..., tolerance: float = ..., rms_tolerance: float = ...,
    max_distance: float | None = ..., start: Pose | ArrayLike | None = ...,
    weights: ArrayLike | Sequence[ArrayLike | None] | None = ...,
    seed: int | Sequence[int] | IntArray | np.random.Generator | None = ..., max_steps: int | None = ...,
    callback: Callback | None = ...,
) -> Result: ...

def kiss_threshold_icp(
    source: ArrayLike | Sequence[ArrayLike], target: ArrayLike | Sequence[ArrayLike], *,
    angle: float | None = ..., shift: float | None = ..., initial: float | None = ...,
    least: float | None = ..., tolerance: float = ..., start: Pose | ArrayLike | None = ...,
    weights: ArrayLike | Sequence[ArrayLike | None] | None = ...,
    seed: int | Sequence[int] | IntArray | np.random.Generator | None = ..., max_steps: int | None = ...,
    callback: Callback | None = ...,
) -> Result: ...

def fast_robust_icp(
    source: ArrayLike | Sequence[ArrayLike], target: ArrayLike | Sequence[ArrayLike], *,
    first: float | None = ..., last: float | None = ..., history: int = ..., forget: bool = ...,
    tolerance: float = ..., rough: float = ..., start: Pose | ArrayLike | None = ...,
    weights: ArrayLike | Sequence[ArrayLike | None] | None = ...,
    seed: int | Sequence[int] | IntArray | np.random.Generator | None = ..., max_steps: int | None = ...,
    callback: Callback | None = ...,
) -> Result: ...

def point_to_plane(
    source: ArrayLike | Sequence[ArrayLike], target: ArrayLike | Sequence[ArrayLike], *, gate: float = ...,
    trim: float = ..., weight: Literal["none", "huber", "tukey", "welsch", "geman-mcclure"] = ...,
    tuning: float | None = ..., scale: float | None = ..., neighbours: int = ..., roundness: float = ...,
    max_shift: float = ..., max_turn: float = ..., free_below: float = ..., tolerance: float = ...,
    rms_tolerance: float = ..., max_distance: float = ..., start: Pose | ArrayLike | None = ...,
    weights: ArrayLike | Sequence[ArrayLike | None] | None = ...,
    seed: int | Sequence[int] | IntArray | np.random.Generator | None = ..., max_steps: int | None = ...,
    callback: Callback | None = ...,
) -> Result: ...

def gicp(
    source: ArrayLike | Sequence[ArrayLike], target: ArrayLike | Sequence[ArrayLike], *, gate: float = ...,
    trim: float = ..., weight: Literal["none", "huber", "tukey", "welsch", "geman-mcclure"] = ...,
    tuning: float | None = ..., scale: float | None = ..., neighbours: int = ..., roundness: float = ...,
    max_shift: float = ..., max_turn: float = ..., free_below: float = ..., tolerance: float = ...,
    rms_tolerance: float = ..., tangent: float = ..., normal: float = ..., max_distance: float = ...,
    start: Pose | ArrayLike | None = ..., weights: ArrayLike | Sequence[ArrayLike | None] | None = ...,
    seed: int | Sequence[int] | IntArray | np.random.Generator | None = ..., max_steps: int | None = ...,
    callback: Callback | None = ...,
) -> Result: ...

def ndt(
    source: ArrayLike | Sequence[ArrayLike], target: ArrayLike | Sequence[ArrayLike], *,
    cells: float | Sequence[float] | FloatArray | None = ..., grids: int = ...,
    offset: Sequence[float] | FloatArray = ..., max_shift: float | None = ..., max_turn: float = ...,
    halvings: int = ..., tolerance: float = ..., outliers: float | None = ...,
    start: Pose | ArrayLike | None = ...,
    seed: int | Sequence[int] | IntArray | np.random.Generator | None = ..., max_steps: int | None = ...,
    callback: Callback | None = ...,
) -> Result: ...

def ndt_d2d(
    source: ArrayLike | Sequence[ArrayLike], target: ArrayLike | Sequence[ArrayLike], *,
    cells: float | Sequence[float] | FloatArray | None = ..., grids: int = ...,
    offset: Sequence[float] | FloatArray = ..., max_shift: float | None = ..., max_turn: float = ...,
    halvings: int = ..., tolerance: float = ..., outliers: float | None = ...,
    start: Pose | ArrayLike | None = ...,
    seed: int | Sequence[int] | IntArray | np.random.Generator | None = ..., max_steps: int | None = ...,
    callback: Callback | None = ...,
) -> Result: ...

def soft_annealed(
    source: ArrayLike | Sequence[ArrayLike], target: ArrayLike | Sequence[ArrayLike], *,
    first: float | None = ..., last: float | None = ..., shrink: float = ..., miss: float = ...,
    least_support: float = ..., tolerance: float = ..., start: Pose | ArrayLike | None = ...,
    seed: int | Sequence[int] | IntArray | np.random.Generator | None = ..., max_steps: int | None = ...,
    callback: Callback | None = ...,
) -> Result: ...

def cpd_rigid(
    source: ArrayLike | Sequence[ArrayLike], target: ArrayLike | Sequence[ArrayLike], *, clutter: float = ...,
    volume: float | None = ..., sigma: float | None = ..., tolerance: float = ...,
    start: Pose | ArrayLike | None = ...,
    seed: int | Sequence[int] | IntArray | np.random.Generator | None = ..., max_steps: int | None = ...,
    callback: Callback | None = ...,
) -> Result: ...

def cpd_similarity(
    source: ArrayLike | Sequence[ArrayLike], target: ArrayLike | Sequence[ArrayLike], *, clutter: float = ...,
    volume: float | None = ..., sigma: float | None = ..., tolerance: float = ...,
    start: Pose | ArrayLike | None = ...,
    seed: int | Sequence[int] | IntArray | np.random.Generator | None = ..., max_steps: int | None = ...,
    callback: Callback | None = ...,
) -> Result: ...

def filterreg(
    source: ArrayLike | Sequence[ArrayLike], target: ArrayLike | Sequence[ArrayLike], *,
    filter: Literal["exact", "grid", "lattice"] = ..., variance: Literal["estimated", "scheduled"] = ...,
    first: float | None = ..., last: float | None = ..., shrink: float = ..., clutter: float = ...,
    volume: float | None = ..., tolerance: float = ..., start: Pose | ArrayLike | None = ...,
    seed: int | Sequence[int] | IntArray | np.random.Generator | None = ..., max_steps: int | None = ...,
    callback: Callback | None = ...,
) -> Result: ...

def gmmreg(
    source: ArrayLike | Sequence[ArrayLike], target: ArrayLike | Sequence[ArrayLike], *,
    first: float | None = ..., last: float | None = ..., shrink: float = ..., coarse: float = ...,
    tolerance: float = ..., start: Pose | ArrayLike | None = ...,
    seed: int | Sequence[int] | IntArray | np.random.Generator | None = ..., max_steps: int | None = ...,
    callback: Callback | None = ...,
) -> Result: ...

def mmd(
    source: ArrayLike | Sequence[ArrayLike], target: ArrayLike | Sequence[ArrayLike], *,
    lengths: float | Sequence[float] | FloatArray | None = ..., count: int | Sequence[int] | IntArray = ...,
    kernel: Literal["gaussian", "laplace", "cauchy"] = ..., redraw: bool = ..., damping: float = ...,
    tolerance: float = ..., coarse: float = ..., decrease: float = ..., start: Pose | ArrayLike | None = ...,
    seed: int | Sequence[int] | IntArray | np.random.Generator | None = ..., max_steps: int | None = ...,
    callback: Callback | None = ...,
) -> Result: ...

def branch_and_bound(
    source: ArrayLike | Sequence[ArrayLike], target: ArrayLike | Sequence[ArrayLike], *,
    cap: float | None = ..., gap: float | None = ..., turn: float = ..., shift: float | None = ...,
    boxes: int = ..., most: int = ..., max_distance: float | None = ..., start: Pose | ArrayLike | None = ...,
    seed: int | Sequence[int] | IntArray | np.random.Generator | None = ..., max_steps: int | None = ...,
    callback: Callback | None = ...,
) -> Result: ...

def correlative(
    source: ArrayLike | Sequence[ArrayLike], target: ArrayLike | Sequence[ArrayLike], *,
    cell: float | None = ..., blur: float = ..., angle: float | None = ..., shift: float | None = ...,
    turn: float | None = ..., apart: float = ..., per_step: int = ..., start: Pose | ArrayLike | None = ...,
    seed: int | Sequence[int] | IntArray | np.random.Generator | None = ..., max_steps: int | None = ...,
    callback: Callback | None = ...,
) -> Result: ...

def flow(
    source: ArrayLike | Sequence[ArrayLike], target: ArrayLike | Sequence[ArrayLike], *, steps: int = ...,
    samples: int = ..., project: bool = ..., start: Pose | ArrayLike | None = ...,
    seed: int | Sequence[int] | IntArray | np.random.Generator | None = ..., max_steps: int | None = ...,
    callback: Callback | None = ...,
) -> Result: ...

def flow_from_source(
    source: ArrayLike | Sequence[ArrayLike], target: ArrayLike | Sequence[ArrayLike], *, steps: int = ...,
    samples: int = ..., project: bool = ..., start: Pose | ArrayLike | None = ...,
    seed: int | Sequence[int] | IntArray | np.random.Generator | None = ..., max_steps: int | None = ...,
    callback: Callback | None = ...,
) -> Result: ...

def association_bp(
    source: ArrayLike | Sequence[ArrayLike], target: ArrayLike | Sequence[ArrayLike], *,
    first: float | None = ..., last: float | None = ..., shrink: float = ..., reach: float = ...,
    miss: float = ..., sweeps: int = ..., least_support: float = ..., tolerance: float = ...,
    start: Pose | ArrayLike | None = ...,
    seed: int | Sequence[int] | IntArray | np.random.Generator | None = ..., max_steps: int | None = ...,
    callback: Callback | None = ...,
) -> Result: ...

def hypothesis_mixture(
    source: ArrayLike | Sequence[ArrayLike], target: ArrayLike | Sequence[ArrayLike], *,
    first: float | None = ..., last: float | None = ..., shrink: float = ..., reach: float = ...,
    miss: float = ..., count: int = ..., draws: int = ..., least_support: float = ..., tolerance: float = ...,
    start: Pose | ArrayLike | None = ...,
    seed: int | Sequence[int] | IntArray | np.random.Generator | None = ..., max_steps: int | None = ...,
    callback: Callback | None = ...,
) -> Result: ...

umeyama = similarity
ransac_unpaired = ransac_congruent
gnc = graduated_nonconvexity
point_to_point = icp
tricp = trimmed_icp
generalized_icp = gicp
p2d_ndt = ndt
d2d_ndt = ndt_d2d

@overload
def register(
    source: ArrayLike | Sequence[ArrayLike], target: ArrayLike | Sequence[ArrayLike], method: Literal["kabsch"],
    *, options: NoOptions | None = ..., start: Pose | ArrayLike | None = ..., pairs: ArrayLike | None = ...,
    weights: ArrayLike | Sequence[ArrayLike | None] | None = ...,
    seed: int | Sequence[int] | IntArray | np.random.Generator | None = ..., max_steps: int | None = ...,
    callback: Callback | None = ...,
) -> Result: ...

@overload
def register(
    source: ArrayLike | Sequence[ArrayLike], target: ArrayLike | Sequence[ArrayLike],
    method: Literal["similarity", "umeyama"], *, options: NoOptions | None = ...,
    start: Pose | ArrayLike | None = ..., pairs: ArrayLike | None = ...,
    weights: ArrayLike | Sequence[ArrayLike | None] | None = ...,
    seed: int | Sequence[int] | IntArray | np.random.Generator | None = ..., max_steps: int | None = ...,
    callback: Callback | None = ...,
) -> Result: ...

@overload
def register(
    source: ArrayLike | Sequence[ArrayLike], target: ArrayLike | Sequence[ArrayLike], method: Literal["ransac"],
    *, options: RansacOptions | None = ..., inlier: float | None = ..., confidence: float = ...,
    most: int = ..., per_step: int = ..., separation: float = ..., start: Pose | ArrayLike | None = ...,
    pairs: ArrayLike | None = ..., seed: int | Sequence[int] | IntArray | np.random.Generator | None = ...,
    max_steps: int | None = ..., callback: Callback | None = ...,
) -> Result: ...

@overload
def register(
    source: ArrayLike | Sequence[ArrayLike], target: ArrayLike | Sequence[ArrayLike],
    method: Literal["ransac-congruent", "ransac-unpaired"], *, options: CongruentOptions | None = ...,
    separation: float | None = ..., tolerance: float | None = ..., inlier: float | None = ...,
    per_step: int = ..., most: int = ..., screen: int = ..., patience: int = ...,
    start: Pose | ArrayLike | None = ...,
    seed: int | Sequence[int] | IntArray | np.random.Generator | None = ..., max_steps: int | None = ...,
    callback: Callback | None = ...,
) -> Result: ...

@overload
def register(
    source: ArrayLike | Sequence[ArrayLike], target: ArrayLike | Sequence[ArrayLike],
    method: Literal["graduated-nonconvexity", "gnc"], *, options: GraduatedOptions | None = ...,
    inlier: float | None = ..., factor: float = ..., start: Pose | ArrayLike | None = ...,
    pairs: ArrayLike | None = ..., weights: ArrayLike | Sequence[ArrayLike | None] | None = ...,
    seed: int | Sequence[int] | IntArray | np.random.Generator | None = ..., max_steps: int | None = ...,
    callback: Callback | None = ...,
) -> Result: ...

@overload
def register(
    source: ArrayLike | Sequence[ArrayLike], target: ArrayLike | Sequence[ArrayLike],
    method: Literal["icp", "point-to-point"] = ..., *, options: IcpOptions | None = ..., gate: float = ...,
    trim: float = ..., weight: Literal["none", "huber", "tukey", "welsch", "geman-mcclure"] = ...,
    tuning: float | None = ..., scale: float | None = ..., tolerance: float = ..., rms_tolerance: float = ...,
    max_distance: float = ..., start: Pose | ArrayLike | None = ...,
    weights: ArrayLike | Sequence[ArrayLike | None] | None = ...,
    seed: int | Sequence[int] | IntArray | np.random.Generator | None = ..., max_steps: int | None = ...,
    callback: Callback | None = ...,
) -> Result: ...

@overload
def register(
    source: ArrayLike | Sequence[ArrayLike], target: ArrayLike | Sequence[ArrayLike],
    method: Literal["trimmed-icp", "tricp"], *, options: TrimmedOptions | None = ..., keep: float = ...,
    weight: Literal["none", "huber", "tukey", "welsch", "geman-mcclure"] = ..., tuning: float | None = ...,
    scale: float | None = ..., tolerance: float = ..., rms_tolerance: float = ...,
    start: Pose | ArrayLike | None = ...,
    seed: int | Sequence[int] | IntArray | np.random.Generator | None = ..., max_steps: int | None = ...,
    callback: Callback | None = ...,
) -> Result: ...

@overload
def register(
    source: ArrayLike | Sequence[ArrayLike], target: ArrayLike | Sequence[ArrayLike],
    method: Literal["capped-icp"], *, options: CappedOptions | None = ..., cap: float | None = ...,
    weight: Literal["none", "huber", "tukey", "welsch", "geman-mcclure"] = ..., tuning: float | None = ...,
    scale: float | None = ..., tolerance: float = ..., rms_tolerance: float = ...,
    max_distance: float | None = ..., start: Pose | ArrayLike | None = ...,
    weights: ArrayLike | Sequence[ArrayLike | None] | None = ...,
    seed: int | Sequence[int] | IntArray | np.random.Generator | None = ..., max_steps: int | None = ...,
    callback: Callback | None = ...,
) -> Result: ...

@overload
def register(
    source: ArrayLike | Sequence[ArrayLike], target: ArrayLike | Sequence[ArrayLike],
    method: Literal["kiss-threshold-icp"], *, options: KissOptions | None = ..., angle: float | None = ...,
    shift: float | None = ..., initial: float | None = ..., least: float | None = ..., tolerance: float = ...,
    start: Pose | ArrayLike | None = ..., weights: ArrayLike | Sequence[ArrayLike | None] | None = ...,
    seed: int | Sequence[int] | IntArray | np.random.Generator | None = ..., max_steps: int | None = ...,
    callback: Callback | None = ...,
) -> Result: ...

@overload
def register(
    source: ArrayLike | Sequence[ArrayLike], target: ArrayLike | Sequence[ArrayLike],
    method: Literal["fast-robust-icp"], *, options: FastRobustOptions | None = ..., first: float | None = ...,
    last: float | None = ..., history: int = ..., forget: bool = ..., tolerance: float = ...,
    rough: float = ..., start: Pose | ArrayLike | None = ...,
    weights: ArrayLike | Sequence[ArrayLike | None] | None = ...,
    seed: int | Sequence[int] | IntArray | np.random.Generator | None = ..., max_steps: int | None = ...,
    callback: Callback | None = ...,
) -> Result: ...

@overload
def register(
    source: ArrayLike | Sequence[ArrayLike], target: ArrayLike | Sequence[ArrayLike],
    method: Literal["point-to-plane"], *, options: SurfaceOptions | None = ..., gate: float = ...,
    trim: float = ..., weight: Literal["none", "huber", "tukey", "welsch", "geman-mcclure"] = ...,
    tuning: float | None = ..., scale: float | None = ..., neighbours: int = ..., roundness: float = ...,
    max_shift: float = ..., max_turn: float = ..., free_below: float = ..., tolerance: float = ...,
    rms_tolerance: float = ..., max_distance: float = ..., start: Pose | ArrayLike | None = ...,
    weights: ArrayLike | Sequence[ArrayLike | None] | None = ...,
    seed: int | Sequence[int] | IntArray | np.random.Generator | None = ..., max_steps: int | None = ...,
    callback: Callback | None = ...,
) -> Result: ...

@overload
def register(
    source: ArrayLike | Sequence[ArrayLike], target: ArrayLike | Sequence[ArrayLike],
    method: Literal["gicp", "generalized-icp"], *, options: GicpOptions | None = ..., gate: float = ...,
    trim: float = ..., weight: Literal["none", "huber", "tukey", "welsch", "geman-mcclure"] = ...,
    tuning: float | None = ..., scale: float | None = ..., neighbours: int = ..., roundness: float = ...,
    max_shift: float = ..., max_turn: float = ..., free_below: float = ..., tolerance: float = ...,
    rms_tolerance: float = ..., tangent: float = ..., normal: float = ..., max_distance: float = ...,
    start: Pose | ArrayLike | None = ..., weights: ArrayLike | Sequence[ArrayLike | None] | None = ...,
    seed: int | Sequence[int] | IntArray | np.random.Generator | None = ..., max_steps: int | None = ...,
    callback: Callback | None = ...,
) -> Result: ...

@overload
def register(
    source: ArrayLike | Sequence[ArrayLike], target: ArrayLike | Sequence[ArrayLike],
    method: Literal["ndt", "p2d-ndt"], *, options: NdtOptions | None = ...,
    cells: float | Sequence[float] | FloatArray | None = ..., grids: int = ...,
    offset: Sequence[float] | FloatArray = ..., max_shift: float | None = ..., max_turn: float = ...,
    halvings: int = ..., tolerance: float = ..., outliers: float | None = ...,
    start: Pose | ArrayLike | None = ...,
    seed: int | Sequence[int] | IntArray | np.random.Generator | None = ..., max_steps: int | None = ...,
    callback: Callback | None = ...,
) -> Result: ...

@overload
def register(
    source: ArrayLike | Sequence[ArrayLike], target: ArrayLike | Sequence[ArrayLike],
    method: Literal["ndt-d2d", "d2d-ndt"], *, options: D2dOptions | None = ...,
    cells: float | Sequence[float] | FloatArray | None = ..., grids: int = ...,
    offset: Sequence[float] | FloatArray = ..., max_shift: float | None = ..., max_turn: float = ...,
    halvings: int = ..., tolerance: float = ..., outliers: float | None = ...,
    start: Pose | ArrayLike | None = ...,
    seed: int | Sequence[int] | IntArray | np.random.Generator | None = ..., max_steps: int | None = ...,
    callback: Callback | None = ...,
) -> Result: ...

@overload
def register(
    source: ArrayLike | Sequence[ArrayLike], target: ArrayLike | Sequence[ArrayLike],
    method: Literal["soft-annealed"], *, options: SoftOptions | None = ..., first: float | None = ...,
    last: float | None = ..., shrink: float = ..., miss: float = ..., least_support: float = ...,
    tolerance: float = ..., start: Pose | ArrayLike | None = ...,
    seed: int | Sequence[int] | IntArray | np.random.Generator | None = ..., max_steps: int | None = ...,
    callback: Callback | None = ...,
) -> Result: ...

@overload
def register(
    source: ArrayLike | Sequence[ArrayLike], target: ArrayLike | Sequence[ArrayLike],
    method: Literal["cpd-rigid"], *, options: CpdOptions | None = ..., clutter: float = ...,
    volume: float | None = ..., sigma: float | None = ..., tolerance: float = ...,
    start: Pose | ArrayLike | None = ...,
    seed: int | Sequence[int] | IntArray | np.random.Generator | None = ..., max_steps: int | None = ...,
    callback: Callback | None = ...,
) -> Result: ...

@overload
def register(
    source: ArrayLike | Sequence[ArrayLike], target: ArrayLike | Sequence[ArrayLike],
    method: Literal["cpd-similarity"], *, options: CpdOptions | None = ..., clutter: float = ...,
    volume: float | None = ..., sigma: float | None = ..., tolerance: float = ...,
    start: Pose | ArrayLike | None = ...,
    seed: int | Sequence[int] | IntArray | np.random.Generator | None = ..., max_steps: int | None = ...,
    callback: Callback | None = ...,
) -> Result: ...

@overload
def register(
    source: ArrayLike | Sequence[ArrayLike], target: ArrayLike | Sequence[ArrayLike],
    method: Literal["filterreg"], *, options: FilterRegOptions | None = ...,
    filter: Literal["exact", "grid", "lattice"] = ..., variance: Literal["estimated", "scheduled"] = ...,
    first: float | None = ..., last: float | None = ..., shrink: float = ..., clutter: float = ...,
    volume: float | None = ..., tolerance: float = ..., start: Pose | ArrayLike | None = ...,
    seed: int | Sequence[int] | IntArray | np.random.Generator | None = ..., max_steps: int | None = ...,
    callback: Callback | None = ...,
) -> Result: ...

@overload
def register(
    source: ArrayLike | Sequence[ArrayLike], target: ArrayLike | Sequence[ArrayLike], method: Literal["gmmreg"],
    *, options: GmmRegOptions | None = ..., first: float | None = ..., last: float | None = ...,
    shrink: float = ..., coarse: float = ..., tolerance: float = ..., start: Pose | ArrayLike | None = ...,
    seed: int | Sequence[int] | IntArray | np.random.Generator | None = ..., max_steps: int | None = ...,
    callback: Callback | None = ...,
) -> Result: ...

@overload
def register(
    source: ArrayLike | Sequence[ArrayLike], target: ArrayLike | Sequence[ArrayLike], method: Literal["mmd"], *,
    options: MmdOptions | None = ..., lengths: float | Sequence[float] | FloatArray | None = ...,
    count: int | Sequence[int] | IntArray = ..., kernel: Literal["gaussian", "laplace", "cauchy"] = ...,
    redraw: bool = ..., damping: float = ..., tolerance: float = ..., coarse: float = ...,
    decrease: float = ..., start: Pose | ArrayLike | None = ...,
    seed: int | Sequence[int] | IntArray | np.random.Generator | None = ..., max_steps: int | None = ...,
    callback: Callback | None = ...,
) -> Result: ...

@overload
def register(
    source: ArrayLike | Sequence[ArrayLike], target: ArrayLike | Sequence[ArrayLike],
    method: Literal["branch-and-bound"], *, options: BranchAndBoundOptions | None = ...,
    cap: float | None = ..., gap: float | None = ..., turn: float = ..., shift: float | None = ...,
    boxes: int = ..., most: int = ..., max_distance: float | None = ..., start: Pose | ArrayLike | None = ...,
    seed: int | Sequence[int] | IntArray | np.random.Generator | None = ..., max_steps: int | None = ...,
    callback: Callback | None = ...,
) -> Result: ...

@overload
def register(
    source: ArrayLike | Sequence[ArrayLike], target: ArrayLike | Sequence[ArrayLike],
    method: Literal["correlative"], *, options: CorrelativeOptions | None = ..., cell: float | None = ...,
    blur: float = ..., angle: float | None = ..., shift: float | None = ..., turn: float | None = ...,
    apart: float = ..., per_step: int = ..., start: Pose | ArrayLike | None = ...,
    seed: int | Sequence[int] | IntArray | np.random.Generator | None = ..., max_steps: int | None = ...,
    callback: Callback | None = ...,
) -> Result: ...

@overload
def register(
    source: ArrayLike | Sequence[ArrayLike], target: ArrayLike | Sequence[ArrayLike], method: Literal["flow"],
    *, options: FlowOptions | None = ..., steps: int = ..., samples: int = ..., project: bool = ...,
    start: Pose | ArrayLike | None = ...,
    seed: int | Sequence[int] | IntArray | np.random.Generator | None = ..., max_steps: int | None = ...,
    callback: Callback | None = ...,
) -> Result: ...

@overload
def register(
    source: ArrayLike | Sequence[ArrayLike], target: ArrayLike | Sequence[ArrayLike],
    method: Literal["flow-from-source"], *, options: FlowOptions | None = ..., steps: int = ...,
    samples: int = ..., project: bool = ..., start: Pose | ArrayLike | None = ...,
    seed: int | Sequence[int] | IntArray | np.random.Generator | None = ..., max_steps: int | None = ...,
    callback: Callback | None = ...,
) -> Result: ...

@overload
def register(
    source: ArrayLike | Sequence[ArrayLike], target: ArrayLike | Sequence[ArrayLike],
    method: Literal["association-bp"], *, options: BpOptions | None = ..., first: float | None = ...,
    last: float | None = ..., shrink: float = ..., reach: float = ..., miss: float = ..., sweeps: int = ...,
    least_support: float = ..., tolerance: float = ..., start: Pose | ArrayLike | None = ...,
    seed: int | Sequence[int] | IntArray | np.random.Generator | None = ..., max_steps: int | None = ...,
    callback: Callback | None = ...,
) -> Result: ...

@overload
def register(
    source: ArrayLike | Sequence[ArrayLike], target: ArrayLike | Sequence[ArrayLike],
    method: Literal["hypothesis-mixture"], *, options: HypothesisOptions | None = ...,
    first: float | None = ..., last: float | None = ..., shrink: float = ..., reach: float = ...,
    miss: float = ..., count: int = ..., draws: int = ..., least_support: float = ..., tolerance: float = ...,
    start: Pose | ArrayLike | None = ...,
    seed: int | Sequence[int] | IntArray | np.random.Generator | None = ..., max_steps: int | None = ...,
    callback: Callback | None = ...,
) -> Result: ...

@overload
def register(
    source: ArrayLike | Sequence[ArrayLike], target: ArrayLike | Sequence[ArrayLike], method: Method[Any], *,
    options: Any = ..., start: Pose | ArrayLike | None = ..., pairs: ArrayLike | None = ...,
    weights: ArrayLike | Sequence[ArrayLike | None] | None = ...,
    seed: int | Sequence[int] | IntArray | np.random.Generator | None = ..., max_steps: int | None = ...,
    callback: Callback | None = ..., **keywords: Any,
) -> Result: ...

class _Listed(Method[Any], Generic[_O]):
    options: type[_O]

class _Methods(Mapping[str, _Listed[Any]]):
    @overload
    def __getitem__(self, name: Literal["kabsch"], /) -> _Listed[NoOptions]: ...
    @overload
    def __getitem__(self, name: Literal["similarity", "umeyama"], /) -> _Listed[NoOptions]: ...
    @overload
    def __getitem__(self, name: Literal["ransac"], /) -> _Listed[RansacOptions]: ...
    @overload
    def __getitem__(self, name: Literal["ransac-congruent", "ransac-unpaired"], /) -> _Listed[CongruentOptions]: ...
    @overload
    def __getitem__(self, name: Literal["graduated-nonconvexity", "gnc"], /) -> _Listed[GraduatedOptions]: ...
    @overload
    def __getitem__(self, name: Literal["icp", "point-to-point"], /) -> _Listed[IcpOptions]: ...
    @overload
    def __getitem__(self, name: Literal["trimmed-icp", "tricp"], /) -> _Listed[TrimmedOptions]: ...
    @overload
    def __getitem__(self, name: Literal["capped-icp"], /) -> _Listed[CappedOptions]: ...
    @overload
    def __getitem__(self, name: Literal["kiss-threshold-icp"], /) -> _Listed[KissOptions]: ...
    @overload
    def __getitem__(self, name: Literal["fast-robust-icp"], /) -> _Listed[FastRobustOptions]: ...
    @overload
    def __getitem__(self, name: Literal["point-to-plane"], /) -> _Listed[SurfaceOptions]: ...
    @overload
    def __getitem__(self, name: Literal["gicp", "generalized-icp"], /) -> _Listed[GicpOptions]: ...
    @overload
    def __getitem__(self, name: Literal["ndt", "p2d-ndt"], /) -> _Listed[NdtOptions]: ...
    @overload
    def __getitem__(self, name: Literal["ndt-d2d", "d2d-ndt"], /) -> _Listed[D2dOptions]: ...
    @overload
    def __getitem__(self, name: Literal["soft-annealed"], /) -> _Listed[SoftOptions]: ...
    @overload
    def __getitem__(self, name: Literal["cpd-rigid"], /) -> _Listed[CpdOptions]: ...
    @overload
    def __getitem__(self, name: Literal["cpd-similarity"], /) -> _Listed[CpdOptions]: ...
    @overload
    def __getitem__(self, name: Literal["filterreg"], /) -> _Listed[FilterRegOptions]: ...
    @overload
    def __getitem__(self, name: Literal["gmmreg"], /) -> _Listed[GmmRegOptions]: ...
    @overload
    def __getitem__(self, name: Literal["mmd"], /) -> _Listed[MmdOptions]: ...
    @overload
    def __getitem__(self, name: Literal["branch-and-bound"], /) -> _Listed[BranchAndBoundOptions]: ...
    @overload
    def __getitem__(self, name: Literal["correlative"], /) -> _Listed[CorrelativeOptions]: ...
    @overload
    def __getitem__(self, name: Literal["flow"], /) -> _Listed[FlowOptions]: ...
    @overload
    def __getitem__(self, name: Literal["flow-from-source"], /) -> _Listed[FlowOptions]: ...
    @overload
    def __getitem__(self, name: Literal["association-bp"], /) -> _Listed[BpOptions]: ...
    @overload
    def __getitem__(self, name: Literal["hypothesis-mixture"], /) -> _Listed[HypothesisOptions]: ...
    @overload
    def __getitem__(self, name: str, /) -> _Listed[Any]: ...
    def __iter__(self) -> Iterator[MethodName]: ...
    def keys(self) -> KeysView[MethodName]: ...
    def items(self) -> ItemsView[MethodName, _Listed[Any]]: ...
    def __len__(self) -> int: ...

METHODS: _Methods
