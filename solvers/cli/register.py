"""`register SOURCE TARGET`: two files, the pose between them, and the evidence for it."""

from __future__ import annotations

import argparse
import ast
import sys
from collections.abc import Sequence
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np

from solvers import METHODS, Pose, Result, Status, __version__, verify
from solvers.api import OTHER_NAMES, register
from solvers.cli import arrays
from solvers.cli.common import DRAWN, UNTRUSTED, Bar, Help, able_to_write, bytes_of, printed, program, whole
from solvers.cli.picture import before_after
from solvers.core import validate
from solvers.core.amounts import amount
from solvers.core.arrays import FloatArray
from solvers.core.method import Method
from solvers.core.registry import method_of
from solvers.geometry import downsample, nearest
from solvers.io import clouds

LONGEST = 1000  # characters of an option's value
BESIDE = ("--start", "--seed", "--max-steps")  # what every method takes besides its own options


def parser() -> argparse.ArgumentParser:
    """The command's arguments."""
    cli = argparse.ArgumentParser(
        prog=program("register"),
        description="Register two point clouds: find the pose that maps SOURCE to TARGET.",
        epilog=f"Methods: {', '.join(METHODS)}. Exit codes: 0; 2 if an argument or a file is wrong; 3 if the"
        " answer should not be trusted: the status is capped or degenerate, or no source point lies near the target."
        " Other commands, each with --help: 'benchmark', the race's table; 'drive', a drive's map;"
        " 'methods', all methods and their options. The word 'register' may be omitted.",
        formatter_class=Help,
    )
    kinds = "CSV, XYZ, PLY, PCD, NPY, NPZ, or - for standard input"
    cli.add_argument("source", type=Path, metavar="SOURCE", help=f"the cloud to move: {kinds}")
    cli.add_argument("target", type=Path, metavar="TARGET", help="the fixed cloud")
    cli.add_argument("--method", default="icp", help="one of the methods listed below (icp)")
    cli.add_argument(
        "--start",
        default="0,0,0",
        metavar="ANGLE,X,Y[,Z]",
        help="where the source begins: degrees about the origin (in space about z), then a shift in the files' unit;"
        " write --start=-30,0,0 where the first number is negative",
    )
    cli.add_argument(
        "--options", nargs="+", action="extend", default=[], metavar="NAME=VALUE",
        help="the method's options, such as gate=0.5 trim=0.2",
    )  # fmt: skip
    cli.add_argument("--max-steps", type=whole, help="step limit (the method's own)")
    cli.add_argument("--seed", type=whole, default=0, help="seed for random methods (0)")
    cli.add_argument("--points", type=whole, metavar="N", help="thin each cloud to at most N points first")
    cli.add_argument("--above", action="store_true", help="register 3-D clouds seen from above, by x and y")
    cli.add_argument("--reach", type=float, help="how near a target point explains a source point (3 target spacings)")
    cli.add_argument(
        "--out", type=Path, action="append", default=[], metavar="FILE",
        help="draw both clouds: a .svg or .png file, by matplotlib; may be given twice",
    )  # fmt: skip
    cli.add_argument("--json", action="store_true", help="print one JSON document instead of text")
    cli.add_argument("-V", "--version", action="version", version=f"registration-ladder {__version__}")
    return cli


def _points(path: Path, args: argparse.Namespace, method: Method[Any]) -> tuple[FloatArray, str]:
    """The points of a file and a line about them. Raises a ValueError that names the file."""
    try:
        cloud = arrays.read(bytes_of(path, clouds.MOST_BYTES))
    except OSError as error:
        raise ValueError(f"{path}: {error.strerror or error}") from None
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from None
    if method.paired and cloud.gaps:
        raise ValueError(
            f"{path}: {cloud.gaps} of its rows {'have' if cloud.gaps > 1 else 'has'} NaN or infinity, and"
            f" {method.name} takes row i of both files as partners; remove such rows from both"
        )
    points = np.ascontiguousarray(cloud.points[:, :2]) if args.above else cloud.points
    sample = points if args.points is None else downsample.thinned(points, validate.count(args.points, "--points", 1))
    thin = "" if len(sample) == len(points) else f", thinned to {len(sample)}"
    notices = "".join(f"; {notice}" for notice in cloud.notices)
    n, d = cloud.points.shape
    return sample, f"{path}: {amount(n, 'point')} in {d}-D{thin}, {cloud.format}{notices}"


def _start(text: str, d: int) -> Pose:
    """The pose that --start gives, in d dimensions."""
    try:
        angle, *shift = (float(part) for part in text.split(","))
    except ValueError:
        raise ValueError(f"--start: {text!r} is not ANGLE,X,Y: numbers separated by commas") from None
    if not np.isfinite([angle, *shift]).all():
        raise ValueError(f"--start: {text!r} is not finite")
    if len(shift) not in (2, d):
        count = f"{len(shift) or 'no'} shift{'' if len(shift) < 2 else 's'}"
        raise ValueError(f"--start: {text!r} has {count}; expected {' or '.join(sorted({'2', str(d)}))}")
    rotation, translation = np.eye(d), np.zeros(d)
    rotation[:2, :2] = Pose.from_angle(np.radians(angle)).R
    translation[: len(shift)] = shift
    return Pose(rotation, translation)


def _option(text: str) -> tuple[str, Any]:
    name, equals, value = text.partition("=")
    if not equals or not name.isidentifier():
        raise ValueError(f"--options: {text!r} is not NAME=VALUE")
    if value in ("inf", "np.inf"):
        return name, np.inf
    if len(value) > LONGEST:
        raise ValueError(f"--options: {name}: {len(value)} characters; expected {LONGEST} at most")
    try:
        literal = ast.literal_eval(value)
    except (RecursionError, MemoryError):
        raise ValueError(f"--options: {name}: brackets are nested too deeply") from None
    except (ValueError, SyntaxError, TypeError):  # TypeError: a list, which cannot be hashed, in a set
        literal = value
    if _too_large(literal):
        raise ValueError(f"--options: {name}: {len(value)} digits; expected a number below 1e308")
    return name, literal


def _options(texts: Sequence[str], method: Method[Any]) -> Any:
    """The method's options as one object. Raises ValueError for what the method itself does not take."""
    own = {option.name: option.name for option in fields(method.options)}
    own |= {alias: name for name, alias in OTHER_NAMES.items() if name in own}
    values: dict[str, Any] = {}
    for name, value in map(_option, texts):
        if name not in own:
            near = validate.nearest(name, [*own, *BESIDE])
            choices = ", ".join(option.name for option in fields(method.options)) or "none"
            raise ValueError(f"--options: {name}: no option of method {method.name!r}{near}; it has: {choices}")
        if own[name] in values:
            raise ValueError(f"--options: {own[name]} is given twice")
        values[own[name]] = value
    return method.options(**values)


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


def _told(result: Result, source: FloatArray, target: FloatArray, reach_option: float | None) -> dict[str, Any]:
    """The facts of a result by name, among them the reach in use; lengths in the files' unit."""
    reach = float(verify.usual_reach(target)) if reach_option is None else reach_option
    pose, (share, rms) = result.pose, _signs(source, target, result.pose, reach)
    planar = pose.dim == 2
    return {
        "status": Status(int(result.status)).label,
        "reason": result.reason,
        "converged": result.converged,
        "steps": result.steps,
        "angle_degrees": np.degrees(pose.angle),
        "translation": pose.t,
        "scale": pose.scale,
        "matrix": pose.matrix,
        "objective": result.objective,
        "lower": result.lower,
        "reach": reach,
        "overlap": share,
        "residual_rms": rms,
        "conditioning": verify.evidence(source, target, pose, reach_option).weakest if planar else None,
    }


def _lines(report: dict[str, Any], result: Result) -> str:
    """The same facts as lines of text."""
    pose, share = result.pose, report["overlap"]
    # Far from the origin, as in a national grid, six digits of a matrix only resolve metres.
    far = max(np.abs(pose.t).max(), np.abs(result.states[0].problem.source).max()) >= 1e4
    digits = 15 if far else 6
    shift = ", ".join(f"{v + 0.0:.{digits}g}" for v in pose.t)  # + 0.0: no -0
    axis = " about its axis" if pose.dim == 3 else ""
    rows = [" ".join(f"{v + 0.0:>{digits + 7}.{digits}g}" for v in row) for row in pose.matrix]
    within = f"{100 * share:.1f} % of the source within {report['reach']:.4g} u of the target"
    lines = [
        f"pose      rotation {report['angle_degrees']:.4f} deg{axis}, translation ({shift}) u,"
        f" scale {float(pose.scale):.6g}",
        *(f"{'matrix' if k == 0 else '':<10}{row}" for k, row in enumerate(rows)),
        f"residual  RMS {report['residual_rms']:.4g} u over the {within}" if share else f"residual  none: {within}",
        f"overlap   {share:.4f}, if the pose is right",
    ]
    if report["conditioning"] is not None:
        weakest = float(report["conditioning"])
        lines.append(f"weakest   {weakest:.4f}, smallest over largest eigenvalue; near 0 a motion is free")
    if result.gap is not None:
        lines.append(f"proof     objective {result.objective:.6g}, no pose searched has one below {result.lower:.6g}")
    reason = f": {result.reason}" if result.reason else ""
    return "\n".join([*lines, f"status    {report['status']} after {amount(int(result.steps), 'step')}{reason}"])


def register_files(arguments: Sequence[str]) -> int:
    """Run the command and return its exit code. Raises ValueError if an argument or a file is wrong."""
    args = parser().parse_args(arguments)
    for path in args.out:
        able_to_write(path, DRAWN)
    if str(args.source) == str(args.target) == "-":
        raise ValueError("SOURCE, TARGET: standard input holds one cloud; give - for one and a file for the other")
    method = method_of(args.method, "--method")
    if method.paired and args.points is not None:
        raise ValueError(
            f"--points: {method.name} takes row i of both files as partners, which thinning each file would tear apart"
        )
    (source, about_source), (target, about_target) = (
        _points(path, args, method) for path in (args.source, args.target)
    )
    if source.shape[1] != target.shape[1]:
        raise ValueError(
            f"{args.source} has {source.shape[1]}-D points, {args.target} {target.shape[1]}-D points;"
            " --above registers x and y"
        )
    d = source.shape[1]
    if method.dims is not None and d not in method.dims:
        dims = " or ".join(map(str, method.dims))
        hint = "; --above registers x and y" if d == 3 else ""
        raise ValueError(f"--method: {method.name} works in {dims} dimensions, the points have {d}{hint}")
    if args.reach is not None:
        validate.number(args.reach, "--reach", 1e-100, 1e100)
    start = _start(args.start, d)
    options = _options(args.options, method)
    if method.paired and len(source) != len(target):
        raise ValueError(
            f"--method: {method.name} takes row i of both files as partners, but they give {len(source)} and"
            f" {len(target)} points; a method such as icp finds the partners itself"
        )
    limit = method.max_steps if args.max_steps is None else args.max_steps
    with Bar(method.name) as bar:
        result = register(
            source, target, method.name, options=options, start=start, seed=args.seed, max_steps=args.max_steps,
            callback=lambda k, state: bar(k, limit),
        )  # fmt: skip
    report = _told(result, source, target, args.reach)
    if args.json:
        about = {"source": about_source, "target": about_target, "method": method.name}
        printed({**about, **report, "written": [str(path) for path in args.out]})
    else:
        print(f"source    {about_source}\ntarget    {about_target}\nmethod    {method.name}: {method.summary}")
        if method.paired:
            print("pairs     row i of the source with row i of the target")
        print(_lines(report, result))
    title = f"{args.source.name} registered to {args.target.name} by {method.name}"
    for path in args.out:
        image = before_after(source, target, start, result.pose, title, path.suffix.lower()[1:])
        try:
            path.write_bytes(image)
        except OSError as error:
            raise ValueError(f"--out: {path}: {error.strerror or error}") from None
        if not args.json:
            print(f"picture   {path}")
    return 0 if result.status and report["overlap"] > 0.0 else UNTRUSTED
