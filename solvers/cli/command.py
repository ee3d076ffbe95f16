"""`python -m solvers SOURCE TARGET` registers two files; `python -m solvers benchmark`
prints the race's table; `python -m solvers drive FILE` makes a map of a drive.
"""

from __future__ import annotations

import argparse
import ast
import io
import os
import sys
import textwrap
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from solvers import METHODS, Pose, Result, Status, register, verify
from solvers.cli.drive import drive
from solvers.cli.picture import before_after
from solvers.core import validate
from solvers.core.arrays import FloatArray
from solvers.geometry import downsample, nearest
from solvers.io import clouds
from solvers.scenes.rooms import ROOM_SETTINGS
from solvers.studies.benchmark import benchmark, table
from solvers.studies.race import CONTESTANTS, EXTRAS, MAX_STEPS, SEEDS, Controls, contestants

REACH = 3.0  # spacings of the target
MOST_SEEDS = 100_000
LONGEST = 1000  # characters of an option's value


class _Help(argparse.HelpFormatter):
    """argparse's own, which would break a method's name at its hyphens."""

    def _fill_text(self, text: str, width: int, indent: str) -> str:
        return textwrap.fill(text, width, initial_indent=indent, subsequent_indent=indent, break_on_hyphens=False)

    def _split_lines(self, text: str, width: int) -> list[str]:
        return textwrap.wrap(" ".join(text.split()), width, break_on_hyphens=False)


def _whole(text: str) -> int:
    """A whole number that 64 bits hold."""
    number = int(text)
    if not -(2**63) <= number < 2**63:
        raise argparse.ArgumentTypeError(f"a number of {len(text)} digits; expected 18 at most")
    return number


def _register_parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="python -m solvers",
        description="Register two point clouds: find the pose that takes SOURCE to TARGET.",
        epilog=f"Methods: {', '.join(METHODS)}. 'python -m solvers benchmark --help' tells of the race's table,"
        " 'python -m solvers drive --help' of a drive's map.",
        formatter_class=_Help,
    )
    parser.add_argument("source", type=Path, metavar="SOURCE", help="the cloud that is moved: CSV, XYZ, PLY or PCD")
    parser.add_argument("target", type=Path, metavar="TARGET", help="the cloud that stays")
    parser.add_argument("--method", default="icp", help="one of the methods named below (icp)")
    parser.add_argument(
        "--start",
        default="0,0,0",
        metavar="ANGLE,X,Y[,Z]",
        help="where the source begins: degrees about the origin (in space about z), then a shift in the files' unit;"
        " write --start=-30,0,0 where the first number is negative",
    )
    parser.add_argument(
        "--options", nargs="+", default=[], metavar="NAME=VALUE", help="the method's own, such as gate=0.5 trim=0.2"
    )
    parser.add_argument("--max-steps", type=_whole, help="cap on the steps (the method's own)")
    parser.add_argument("--seed", type=_whole, default=0, help="what random methods draw from (0)")
    parser.add_argument("--points", type=_whole, metavar="N", help="thin each cloud to at most N points first")
    parser.add_argument("--above", action="store_true", help="register clouds in space seen from above, by x and y")
    parser.add_argument("--reach", type=float, help="how near explains a source point (3 spacings of the target)")
    parser.add_argument("--out", type=Path, metavar="PICTURE.svg", help="draw both clouds, with matplotlib")
    return parser


def _opened(path: Path, given: argparse.Namespace) -> tuple[FloatArray, str]:
    """The points of a file and a line on them. Raises ValueError that names the file.
    """
    try:
        found = clouds.read(_bytes(path))
    except OSError as error:
        raise ValueError(f"{path}: {error.strerror or error}") from None
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from None
    points = np.ascontiguousarray(found.points[:, :2]) if given.above else found.points
    kept = points if given.points is None else downsample.thinned(points, validate.count(given.points, "--points", 1))
    thin = "" if len(kept) == len(points) else f", thinned to {len(kept)}"
    notices = "".join(f"; {notice}" for notice in found.notices)
    n, d = found.points.shape
    return kept, f"{path}: {n} point{'' if n == 1 else 's'} in {d}-D{thin}, {found.format}{notices}"


def _bytes(path: Path) -> bytes:
    """What a file holds; of one that is too large, or has no end, nothing is kept.
    Raises ValueError with its size.
    """
    size, most = path.stat().st_size, clouds.MOST_BYTES
    if size > most:
        raise ValueError(f"{size / 1e6:.1f} MB are more than the {most / 1e6:.0f} MB that are read")
    with path.open("rb") as file:
        return file.read(most + 1)


def _start(text: str, d: int) -> Pose:
    """The pose that --start names, in d dimensions."""
    try:
        angle, *shift = (float(part) for part in text.split(","))
    except ValueError:
        raise ValueError(f"--start: {text!r} is not ANGLE,X,Y: numbers separated by commas") from None
    if len(shift) not in (2, d) or not np.isfinite([angle, *shift]).all():
        raise ValueError(f"--start: {text!r} has {len(shift)} shifts; expected {' or '.join(sorted({'2', str(d)}))}")
    turn, moved = np.eye(d), np.zeros(d)
    turn[:2, :2] = Pose.from_angle(np.radians(angle)).R
    moved[: len(shift)] = shift
    return Pose(turn, moved)


def _option(text: str) -> tuple[str, Any]:
    name, equals, value = text.partition("=")
    if not equals or not name.isidentifier():
        raise ValueError(f"--options: {text!r} is not NAME=VALUE")
    if value in ("inf", "np.inf"):
        return name, np.inf
    if len(value) > LONGEST:
        raise ValueError(f"--options: {name}: {len(value)} characters; expected {LONGEST} at most")
    try:
        read = ast.literal_eval(value)
    except (RecursionError, MemoryError):
        raise ValueError(f"--options: {name}: brackets are nested too deeply") from None
    except (ValueError, SyntaxError):
        read = value
    if _too_large(read):
        raise ValueError(f"--options: {name}: {len(value)} digits; expected a number below 1e308")
    return name, read


def _too_large(value: Any) -> bool:
    """Whether a number, or one of several, is larger than any float."""
    if isinstance(value, (list, tuple, set)):
        return any(map(_too_large, value))
    return isinstance(value, int) and abs(value) > sys.float_info.max


def _signs(source: FloatArray, target: FloatArray, pose: Pose, reach: float) -> tuple[float, float]:
    """The fraction of moved source points with a target point within reach, and the RMS
    of their distances to it.
    """
    _, squares = nearest.build(target[None]).nearest(pose.apply(source)[None])
    near = nearest.within(squares, reach)
    return float(near.mean()), float(np.sqrt(squares[near].mean())) if near.any() else float("nan")


def _report(result: Result, source: FloatArray, target: FloatArray, reach: float) -> str:
    """What there is to say of a result, in lines."""
    pose, (share, rms) = result.pose, _signs(source, target, result.pose, reach)
    shift = ", ".join(f"{v:.6g}" for v in pose.t)
    axis = " about its axis" if pose.dim == 3 else ""
    rows = [" ".join(f"{v:>13.6g}" for v in row) for row in pose.matrix]
    within = f"{100 * share:.1f} % of the source within {reach:.4g} u of the target"
    lines = [
        f"pose      rotation {np.degrees(pose.angle):.4f} deg{axis}, translation ({shift}) u,"
        f" scale {float(pose.scale):.6g}",
        *(f"{'matrix' if k == 0 else '':<10}{row}" for k, row in enumerate(rows)),
        f"residual  RMS {rms:.4g} u over the {within}" if share else f"residual  none: {within}",
        f"overlap   {share:.4f}, if the pose is right",
    ]
    if pose.dim == 2:
        weakest = float(verify.evidence(source, target, pose, reach).weakest)
        lines.append(f"condition {weakest:.4f}, smallest over largest eigenvalue; near 0 a motion is free")
    if result.gap is not None:
        lines.append(f"proof     objective {result.objective:.6g}, of no other pose below {result.lower:.6g}")
    status, reason = Status(int(result.status)).label, f": {result.reason}" if result.reason else ""
    return "\n".join([*lines, f"status    {status} after {result.steps} steps{reason}"])


def _register(arguments: Sequence[str]) -> None:
    given = _register_parser().parse_args(arguments)
    (source, about_source), (target, about_target) = (_opened(path, given) for path in (given.source, given.target))
    if source.shape[1] != target.shape[1]:
        raise ValueError("one file holds points of the plane, the other points in space; --above registers x and y")
    method = METHODS[validate.one_of(given.method, METHODS, "--method")]
    d = source.shape[1]
    if method.dims is not None and d not in method.dims:
        dims = " or ".join(map(str, method.dims))
        hint = "; --above registers x and y" if d == 3 else ""
        raise ValueError(f"--method: {method.name} works in {dims} dimensions, the points have {d}{hint}")
    reach = given.reach
    if reach is None:
        reach = REACH * downsample.spacing(target) or 1.0
    validate.number(reach, "--reach", 1e-100, 1e100)
    start = _start(given.start, d)
    options = dict(_option(text) for text in given.options)
    result = register(source, target, method.name, start=start, seed=given.seed, max_steps=given.max_steps, **options)
    print(f"source    {about_source}\ntarget    {about_target}\nmethod    {method.name}: {method.summary}")
    print(_report(result, source, target, reach))
    if given.out is not None:
        title = f"{given.source.name} registered to {given.target.name} by {method.name}"
        try:
            given.out.write_text(before_after(source, target, start, result.pose, title), "utf-8", newline="\n")
        except OSError as error:
            raise ValueError(f"--out: {given.out}: {error.strerror or error}") from None
        print(f"picture   {given.out}")


def _benchmark_parser() -> argparse.ArgumentParser:
    bench = argparse.ArgumentParser(
        prog="python -m solvers benchmark",
        description="Run the race on many seeds and print the table."
        " Without options: all six settings from 45°, then 'combo' from 15°.",
        formatter_class=_Help,
    )
    bench.add_argument("--setting", choices=(*ROOM_SETTINGS, "all"), help="of the room; 'all' is all six")
    bench.add_argument("--degrees", type=float, default=45.0, help="starting rotation (45)")
    bench.add_argument("--distance", type=float, default=1.43, help="starting translation in u (1.43)")
    bench.add_argument("--noise", type=float, help="σ in u (the setting's own)")
    bench.add_argument("--outliers", type=float, help="replaced fraction of each cloud (the setting's own)")
    bench.add_argument("--overlap", type=float, default=1.0, help="fraction of the room that the target sees (1)")
    bench.add_argument("--density", type=float, default=1.0, help="the source's sampling density against the usual (1)")
    bench.add_argument("--seeds", type=_whole, default=len(SEEDS), help="how many of the seeds 40 + 13k (25)")
    bench.add_argument("--max-steps", type=_whole, default=MAX_STEPS, help="cap on the steps (70)")
    names = ", ".join(c.method for c in (*CONTESTANTS, *EXTRAS))
    bench.add_argument("--only", nargs="+", metavar="METHOD", help=f"of {names}")
    return bench


def _benchmark(arguments: Sequence[str]) -> None:
    given = _benchmark_parser().parse_args(arguments)
    settings = ROOM_SETTINGS if given.setting in (None, "all") else (given.setting,)
    cases = [(name, given.degrees) for name in settings]
    if given.setting is None and given.degrees == 45.0:
        cases.append(("combo", 15.0))
    racing = contestants(given.only)
    if given.seeds > MOST_SEEDS:
        raise ValueError(f"--seeds: {given.seeds} are more than the {MOST_SEEDS} that are run")
    for name, degrees in cases:
        controls = Controls(degrees, given.distance, name, given.noise, given.outliers, given.overlap, given.density)
        lines = benchmark(
            controls, seeds=[40 + 13 * k for k in range(given.seeds)], contestants=racing, max_steps=given.max_steps
        )
        print(f"{name}, start {degrees:g}° and {given.distance:g} u, {given.seeds} seeds")
        print(table(lines) + "\n", flush=True)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line; the exit code: 0, 2 where an argument or a file is wrong,
    or 1 where nobody reads on.
    """
    given = list(sys.argv[1:] if arguments is None else arguments)
    if isinstance(sys.stdout, io.TextIOWrapper):
        sys.stdout.reconfigure(errors="replace")  # a console without σ prints the rest all the same
    try:
        if given[:1] == ["benchmark"]:
            _benchmark(given[1:])
        elif given[:1] == ["drive"]:
            drive(given[1:])
        else:
            _register(given)
        sys.stdout.flush()
    except BrokenPipeError:  # as `| head` does once it has its lines; what is left goes nowhere, and without a word
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 1
    except ValueError as error:
        print(f"solvers: {error}", file=sys.stderr)
        return 2
    return 0

