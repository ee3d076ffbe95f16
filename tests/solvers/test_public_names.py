"""What Python users import: every public module and its names, however the packages behind them are arranged."""

from __future__ import annotations

import inspect
import subprocess
import sys
from dataclasses import fields, is_dataclass
from importlib import import_module
from pathlib import Path

import pytest

import solvers
from solvers import METHODS, options

NAMES = {
    "api": "register",
    "benchmark": "CLOSE_DEGREES CLOSE_DISTANCE Line benchmark entry line table",
    "bird_scene": "AREA COUNTS FIELD MOST SHAPE TRUTH bird bird_start",
    "cloud_text": "CloudText MOST_BYTES MOST_POINTS read",
    "collinear": "poses_about_line",
    "drives": "Drive chained interlaced simulated_drive telecom_loop",
    "features": "BLOCK cos_sin exact_squared_mmd feature_sums mean_features mean_kernel unit_frequencies",
    "g2o": "MOST_BYTES GraphText read write",
    "hall": "FLOOR HEIGHT Hall hall",
    "landscape": "CappedField MmdField Path capped_field mmd_field",
    "match_scenes": "FACADE FACADE_TRUTH FRONT MATCH_SCENES PERIOD facade_scene",
    "methods": "METHODS",
    "metrics": "point_error residuals rms rre rte scale_error",
    "mug_scene": "AXIS GRIP HEIGHT PAIRS RADIUS TRUTH TUBE Mug mug mug_pairs mug_start",
    "ndt_map": (
        "FLOOR LARGEST_TABLE LEAST_POINTS LEAST_VARIANCE NO_CELLS NdtMap ONE_PLACE SHIFTS TOO_FEW TOO_SMALL build "
        "check_size default_size floored inverse"
    ),
    "ndt_score": "BLOCK Score evaluate score_map",
    "ndt_translation": "Climb climb",
    "options": (
        "BpOptions BranchAndBoundOptions CappedOptions CongruentOptions CorrelativeOptions CpdOptions D2dOptions "
        "FastRobustOptions FilterRegOptions FlowOptions GicpOptions GmmRegOptions GraduatedOptions HypothesisOptions "
        "IcpOptions KissOptions MmdOptions NdtOptions NoOptions RansacOptions SoftOptions SurfaceOptions TrimmedOptions"
    ),
    "posegraph": (
        "KERNELS THRESHOLD Edges GraphResult GraphRun advance begin chi_squared concatenated jacobians marginals "
        "optimise residuals stacked"
    ),
    "odometry": (
        "Chain LoopOptions MatchOptions Matches PREDICTIONS Scans candidates close edges_of keyframes match missed "
        "prepare read_drive scan_to_map scan_to_scan straightened verified"
    ),
    "race": "CONTESTANTS Contestant Controls EXTRAS MAX_STEPS SEEDS contestants race_problem",
    "consensus": "RANSAC RansacOptions RansacState capped_sum trials",
    "robust": "FLOOR KERNELS TUNING check_options least_scale loss mad_scale threshold weights",
    "scans": "PILLARS TwoScans WALLS ranges two_scans",
    "scenes": (
        "BIRD KABSCH_SCENES KABSCH_START KABSCH_TRUTH MAST ROOM ROOM_SETTINGS ROOM_START_DIRECTION Scene "
        "kabsch_scene room room_start"
    ),
    "soft_shares": "clutter_weight filterreg_shares gmmreg_overlaps",
    "stepper": "Batch Callback History Method NoOptions Problem S State T advance begin run",
    "thinning": "FINEST slab spacing thinned",
    "uncertainty": (
        "APART CENSI Covariance FRAMES HESSIAN POINT Spread adjoint covariance exp from_matrix from_starts log "
        "monte_carlo quantile range_bearing spread_of state_covariance"
    ),
    "uncertainty_study": (
        "CoverageLine ENDS GATE LEVEL METHODS NO_ECHO PLACES REACH Redrawn Runs SIDES STANDS WAYS coverage "
        "ends_of redrawn regions runs starts walls_of"
    ),
    "verify": "Evidence SPACINGS evidence halves usual_reach",
    "walk_scenes": "FISH FISH_SETTINGS POINTS SIDE SMALLER START_DEGREES START_SHIFT fish fish_start",
    "walkthrough": "AREA EVERY FOUR MOST begin_walk clutter scene_poses",
    "wall_scenes": "CORRIDOR HALL NDT_ROOM PILLAR WALL corridor hall ndt_room sampled single_wall",
}


def test_the_front_door() -> None:
    assert solvers.__all__ == ["METHODS", "Fit", "Pose", "Result", "Status", "fit_planar", "fit_rigid", "register"]


def test_the_options_of_every_method_are_public() -> None:
    assert {METHODS[name].options for name in METHODS} == {getattr(options, name) for name in options.__all__}


@pytest.mark.native
def test_every_public_module_comes_with_solvers_when_it_is_first_named() -> None:
    """It does so if `solvers` alone was imported; until then, only the modules that `register` needs are loaded."""
    packages = ("solvers.uncertainty", "solvers.posegraph", "solvers.odometry", "solvers.io", "solvers.studies")
    code = f"""
import sys
import solvers
assert not {packages!r} & sys.modules.keys()
listed = dir(solvers)
for name in {sorted(NAMES)!r}:
    assert name in listed, name
    assert getattr(solvers, name).__name__ == f"solvers.{{name}}", name
for name in listed:
    getattr(solvers, name)
assert dir(solvers).count("io") == ("solvers.io" in sys.modules)
"""
    subprocess.run([sys.executable, "-c", code], check=True, cwd=Path(solvers.__file__).parents[1])


@pytest.mark.parametrize("module", NAMES)
def test_what_was_importable_stays_importable(module: str) -> None:
    public = import_module(f"solvers.{module}")
    assert [name for name in NAMES[module].split() if not hasattr(public, name)] == []


@pytest.mark.parametrize("module", ["", *NAMES])
def test_no_public_record_shows_whole_arrays(module: str) -> None:
    public = vars(import_module(f"solvers.{module}".rstrip(".")))
    records = [value for value in public.values() if isinstance(value, type) and is_dataclass(value)]
    arrays = [kind for kind in records if any("Array" in str(f.type) for f in fields(kind))]
    # A dataclass's own repr is wrapped, for records that hold themselves. An option holds a few numbers.
    names = [kind.__name__ for kind in arrays if hasattr(kind.__repr__, "__wrapped__")]
    assert [name for name in names if not name.endswith("Options")] == []


@pytest.mark.parametrize("module", [name for name in NAMES if hasattr(import_module(f"solvers.{name}"), "__all__")])
def test_a_public_module_hands_on_all_and_only_what_it_lists(module: str) -> None:
    """Public names are the very objects of the defining module, and all that it lists, so that a name added there is
    public here as well."""
    public = import_module(f"solvers.{module}")
    assert sorted(public.__all__) == sorted(NAMES[module].split())
    for name in public.__all__:
        value = getattr(public, name)
        if inspect.isclass(value) or inspect.isfunction(value):
            assert value is getattr(import_module(value.__module__), name)
