"""`python -m solvers drive FILE`: a drive's poses from its scans, its loops, and the map."""

from __future__ import annotations

import argparse
import contextlib
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from solvers.cli.common import DRAWN, UNTRUSTED, Bar, able_to_write, bytes_of, printed, program, whole
from solvers.cli.picture import drive_maps
from solvers.core import validate
from solvers.core.arrays import BoolArray, FloatArray, IntArray
from solvers.core.edges import Edges
from solvers.core.pose import Pose
from solvers.io import g2o
from solvers.odometry import (
    Chain,
    LoopOptions,
    Matches,
    MatchOptions,
    Scans,
    candidates,
    close,
    edges_of,
    missed,
    prepare,
    read_drive,
    scan_to_map,
    scan_to_scan,
    verified,
)
from solvers.odometry.reading import MOST_BYTES
from solvers.posegraph import KERNELS
from solvers.scenes.drive import Drive, chained, telecom_loop

INCLUDED = "telecom-loop"
LASER = ("view", "turns", "hertz", "ahead")
KINDS = (*DRAWN, ".g2o", ".csv")
NEAR = 1.0
"""Metres: if no echo of a drive is as far, its file probably has metres where centimetres are expected."""


def parser() -> argparse.ArgumentParser:
    """The command's arguments."""
    cli = argparse.ArgumentParser(
        prog=program("drive"),
        description="Compute a robot's poses from its laser scans: match each scan to the one before or to a map"
        " of the last ones, find places seen again, and make everything agree in a pose graph.",
        epilog="Exit codes: 0; 2 if an argument or the file is wrong; 3 if the poses should not be trusted: a scan was"
        " not matched, or the pose graph did not come to rest.",
    )
    cli.add_argument(
        "file", metavar="FILE", help="CSV with columns seconds,dx_m,dy_m,dphi_rad,r0,…, or a CARMEN log with FLASER"
        " or ROBOTLASER1 lines; - is standard input, 'telecom-loop' the drive included in the package"
    )  # fmt: skip
    cli.add_argument("--to", choices=("scan", "map"), default="scan", help="what each scan is matched to (scan)")
    cli.add_argument("--gate", type=float, default=0.5, help="largest pair distance, metres (0.5)")
    cli.add_argument("--farthest", type=float, default=30.0, help="ignore echoes beyond this, metres (30)")
    cli.add_argument("--radius", type=float, default=3.0, help="largest gap to a loop in the chain, metres (3)")
    cli.add_argument("--kernel", choices=KERNELS, default="cauchy", help="kernel for loops that disagree (cauchy)")
    cli.add_argument("--no-loops", action="store_true", help="do not close loops")
    cli.add_argument(
        "--view", type=float, help="angle from the first beam to the last, degrees (180; of a CARMEN log with 180 or"
        " 360 beams 179 or 179.5, from 90 to the right; ROBOTLASER1 lines say it themselves)"
    )  # fmt: skip
    cli.add_argument("--turns", type=whole, default=0, help="mirror turns that make a scan; 0: beams sent at once (0)")
    cli.add_argument("--hertz", type=float, default=75.0, help="mirror turns a second (75)")
    cli.add_argument("--ahead", type=float, default=0.0, help="laser position ahead of the robot's origin, metres (0)")
    cli.add_argument(
        "--out", type=Path, action="append", default=[], metavar="FILE",
        help="map.svg or map.png, drawn by matplotlib; graph.g2o; poses.csv, its seconds since the first scan;"
        " repeatable"
    )  # fmt: skip
    cli.add_argument("--json", action="store_true", help="print one JSON document instead of text")
    return cli


def drive(arguments: Sequence[str]) -> int:
    """Run the command and return its exit code. Raises ValueError if an argument or the file is wrong."""
    args = parser().parse_args(arguments)
    with contextlib.redirect_stdout(None if args.json else sys.stdout):
        code, report = _run(args)
    if args.json:
        printed(report)
    return code


def _run(args: argparse.Namespace) -> tuple[int, dict[str, Any]]:
    """The exit code, and a report by name, whose lines are printed on the way; angles in degrees."""
    for path in args.out:
        able_to_write(path, KINDS)
    matching, loop_options = MatchOptions(gate=args.gate), LoopOptions(radius=args.radius)
    validate.number(args.farthest, "--farthest", 0.1)
    validate.count(args.turns, "--turns")
    recording = _included_drive(args) if args.file == INCLUDED else _drive_of(Path(args.file), args)
    report = _recording(args.file, recording)
    scans, wheels = prepare(recording, args.farthest), chained(recording.motion)
    chain, unmatched = _matched(recording, scans, args.to, matching)
    print(f"end       odometry {_pose_text(wheels[-1])}\n          matched  {_pose_text(chain.poses[-1])}")
    report |= {
        "length": _length(chain.poses), "not_matched": unmatched, "end_by_odometry": _by_name(wheels[-1]),
        "end_matched": _by_name(chain.poses[-1]),
    }  # fmt: skip
    loops = _loops(scans, chain, loop_options, matching, args.no_loops)
    loop_count, poses, settled = int(loops.believed.sum()), chain.poses, True
    report["candidates"] = len(loops.believed)
    ways = {"By odometry": wheels, "By matched scans": chain.poses}
    if loop_count:
        poses, settled, report["graph"] = _closed(chain, loops, args.kernel)
        ways = {"Before: by odometry": wheels, "After: loops closed": poses}
    for path in args.out:
        _write(path, _file(path, poses, lambda: edges_of(chain, loops)[0], scans, recording.seconds, ways))
    report |= {"loops": loop_count, "end": _by_name(poses[-1]), "written": [str(path) for path in args.out]}
    return 0 if settled and not len(unmatched) else UNTRUSTED, report


def _recording(file: str, recording: Drive) -> dict[str, Any]:
    """Print and return the facts of a recording."""
    n, k = recording.ranges.shape
    echoes = recording.ranges[np.isfinite(recording.ranges)]
    farthest = float(echoes.max(initial=0.0))
    summary = f"{100.0 * (1.0 - echoes.size / (n * k)):.1f} % without echo, the farthest echo at {farthest:.2f} m"
    if 0.0 < farthest < NEAR:
        summary += "; a CSV's ranges are centimetres, not metres"
    view = float(np.degrees(np.ptp(recording.bearings)))  # not in the file, but assumed or given
    print(f"drive     {file}: {n} scans of {k} beams over {view:.6g} deg, {summary}")
    return {"drive": file, "scans": n, "beams": k, "view_degrees": view, "farthest": farthest}


def _matched(recording: Drive, scans: Scans, to: str, matching: MatchOptions) -> tuple[Chain, IntArray]:
    """The chain of matched scans, and which of them found no match."""
    matcher = scan_to_scan if to == "scan" else scan_to_map
    with Bar("matching") as bar:
        chain = matcher(scans, recording.motion, matching, progress=bar)
    unmatched, steps = np.flatnonzero(~chain.believed), len(scans) - 1
    before = "scan before" if to == "scan" else "map"
    print(f"chain     {_length(chain.poses):.2f} m; {steps - len(unmatched)} of {steps} scans matched to the {before}")
    if len(unmatched):
        print(f"          predicted only: {', '.join(map(str, unmatched[:20]))}{' …' if len(unmatched) > 20 else ''}")
    return chain, unmatched


def _loops(scans: Scans, chain: Chain, loop_options: LoopOptions, matching: MatchOptions, none: bool) -> Matches:
    """The places seen again, those believed and those not. none: do not look for any."""
    later, earlier = candidates(chain.poses, loop_options)
    if none:
        later, earlier = later[:0], earlier[:0]
    with Bar("closing loops") as bar:
        loops = verified(scans, chain.poses, later, earlier, loop_options, matching, bar)
    if not none:
        print(f"loops     {int(loops.believed.sum())} of {len(later)} candidates accepted")
    return loops


def _closed(chain: Chain, loops: Matches, kernel: str) -> tuple[Pose, bool, dict[str, Any]]:
    """The poses of the pose graph, whether it came to rest, and a report on it."""
    with Bar("graph") as bar:
        result = close(chain, loops, kernel=kernel, progress=bar)
    before, after = (_gap_text(missed(p, loops), loops.believed) for p in (chain.poses, result.poses))
    rejected = int((result.weights[len(chain.believed) - 1 :] < 0.1).sum())
    print(f"loop gap  {before} before the graph, {after} after")
    outcome = f"{result.status} after {result.steps} steps, chi2 {result.total:.4g}"
    print(f"graph     {outcome}, {rejected} loops rejected")
    print(f"          closed   {_pose_text(result.poses[-1])}")
    report = {"status": result.status.label, "steps": result.steps, "chi2": result.total, "let_go": rejected}
    return result.poses, bool(result.status), report


def _write(path: Path, data: bytes) -> None:
    try:
        path.write_bytes(data)
    except OSError as error:
        raise ValueError(f"--out: {path}: {error.strerror or error}") from None
    print(f"written   {path}")


def _length(poses: Pose) -> float:
    return float(np.linalg.norm(np.diff(poses.t, axis=0), axis=1).sum())


def _included_drive(args: argparse.Namespace) -> Drive:
    """The included drive. Raises ValueError if an option describes the laser, which the recording itself does."""
    usual = parser()
    for name in LASER:
        if getattr(args, name) != usual.get_default(name):
            raise ValueError(f"--{name}: describes the laser of a file; {INCLUDED} has its own")
    return telecom_loop()


def _drive_of(path: Path, args: argparse.Namespace) -> Drive:
    try:
        data = bytes_of(path, MOST_BYTES)
        return read_drive(data, view=args.view, ahead=args.ahead, turns=args.turns, hertz=args.hertz)
    except OSError as error:
        raise ValueError(f"{path}: {error.strerror or error}") from None
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from None


def _by_name(pose: Pose) -> dict[str, Any]:
    return {"translation": pose.t, "angle_degrees": np.degrees(pose.angle)}


def _pose_text(pose: Pose) -> str:
    x, y = pose.t
    return f"({x:.3f}, {y:.3f}) m, {np.degrees(pose.angle):.2f} deg"


def _gap_text(gaps: tuple[FloatArray, FloatArray], loops: BoolArray) -> str:
    shift, turn = (np.median(part[loops]) for part in gaps)
    return f"{shift:.3f} m and {np.degrees(turn):.2f} deg (median)"


def _file(
    path: Path, poses: Pose, edges: Callable[[], Edges], scans: Scans, seconds: FloatArray, ways: dict[str, Pose]
) -> bytes:
    kind = path.suffix.lower()
    if kind == ".g2o":
        return g2o.write(poses, edges(), fixed=[0])
    if kind == ".csv":
        rows = np.column_stack([seconds, poses.t, poses.angle]).tolist()
        text = "seconds,x_m,y_m,phi_rad\n" + "".join(",".join(f"{v:.6f}" for v in row) + "\n" for row in rows)
        return text.encode()
    maps = {
        name: (np.concatenate([trajectory[k].apply(scans.cloud(k)) for k in range(len(scans))]), trajectory.t)
        for name, trajectory in ways.items()
    }
    return drive_maps(maps, kind[1:])
