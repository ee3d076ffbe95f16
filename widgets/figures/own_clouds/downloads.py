"""What a reader can download: the pose as JSON and CSV, and a script that finds it again from the same files."""

from __future__ import annotations

import json
from typing import Any

import numpy as np

from solvers import Pose
from widgets.drawing.picture import Array
from widgets.engine.script import called, literal, named
from widgets.figures.own_clouds.clouds import FARTHEST, Clouds, Raw
from widgets.figures.own_clouds.run import Run

# How the examples are made, for a script without files.
_EXAMPLES = {
    "room": ["from solvers.scenes import room"],
    "part": ["from solvers.scenes import room"],
    "hall": ["from solvers.hall import hall"],
    "drive": ["from solvers.drives import telecom_loop"],
}


def in_space(pose: Pose) -> Array:
    """The pose of the plane as a homogeneous matrix of space, (4, 4): a turn about z that keeps heights, or scales them
    if the pose has a scale."""
    matrix = np.eye(4)
    matrix[:2, :2] = float(pose.scale) * pose.R
    matrix[2, 2] = float(pose.scale)
    matrix[:2, 3] = pose.t
    return matrix


def _heading(pose: Pose) -> float:
    return float(np.degrees(np.arctan2(pose.R[1, 0], pose.R[0, 0])))


def steady(value: float) -> float:
    """The number to 13 digits: the last ones differ between processors, and files must not."""
    return float(f"{value:.13g}") + 0.0


def _steady_data(value: Any) -> Any:
    """Plain data with every float made `steady`."""
    if isinstance(value, dict):
        return {key: _steady_data(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [_steady_data(item) for item in value]
    return steady(value) if isinstance(value, float) else value


def pose_json(run: Run) -> str:
    """The pose as JSON, with what it was computed from."""
    raw, signs = run.clouds.raw, run.evidence
    document: dict[str, Any] = {
        "takes": "source to target: target = scale * R * source + translation",
        "angle_degrees": _heading(run.pose),
        "translation": run.pose.t.tolist(),
        "scale": float(run.pose.scale),
        "matrix_3x3": run.pose.matrix.tolist(),
        "matrix_4x4": in_space(run.pose).tolist(),
        "method": run.method,
        "options": run.options if run.clouds.whole else {},
        "start": {"angle_degrees": _heading(run.began), "translation": run.began.t.tolist()},
        "steps": run.steps,
        "status": run.status,
        "reason": run.reason,
        "source": {"file": raw.names[0], "points": len(run.clouds.source), "of": run.clouds.seen[0]},
        "target": {"file": raw.names[1], "points": len(run.clouds.target), "of": run.clouds.seen[1]},
        "slice": run.clouds.slice,
    }
    if signs is not None:
        document |= {
            "reach": run.reach,
            "residual_rms": float(signs.rms) if float(signs.share) > 0.0 else None,
            "explained": float(signs.share),
            "conditioning": float(signs.weakest),
        }
    return json.dumps(_steady_data(document), indent=2, ensure_ascii=False) + "\n"


def pose_csv(run: Run) -> str:
    """The 4 × 4 matrix as CSV."""
    return "".join(",".join(repr(steady(float(v))) for v in row) + "\n" for row in in_space(run.pose))


def script(run: Run, example: str, points: int, scans: tuple[int, int]) -> str:
    """A script that makes the same run from the same files, or from the example or the drawn points. scans: those of
    the drive, if that is the example."""
    c = run.clouds
    turn = steady(float(np.arctan2(run.began.R[1, 0], run.began.R[0, 0])))
    x, y = (steady(v) for v in run.began.t.tolist())
    start = f"Pose.from_angle({turn!r}, ({x!r}, {y!r}))"
    if not c.whole:
        head = ["import numpy as np", "from solvers import Pose"]
        return "\n".join([*head, "", f"pose = {start}  # two clouds are still missing", *_print_lines()]) + "\n"
    named_files = any(c.raw.names)
    lines = [
        *(["from pathlib import Path", ""] if named_files else []),
        "import numpy as np",
        "from solvers import Pose, register",
        *(["from solvers.cloud_text import read"] if named_files else []),
        *_EXAMPLES.get(example, []),
        f"from solvers.thinning import {'slab, ' if c.slice else ''}thinned",
        "from solvers.verify import evidence",
        "",
        *_input_lines(c.raw, example, run.seed, scans),
        *_projection("source", c.raw.source, c),
        *_projection("target", c.raw.target, c),
        f"source, target = thinned(source, {points}), thinned(target, {points})",
        "",
        f"start = {start}",
        *called(
            "result = register",
            *("source", "target", literal(run.method), "start=start", f"seed={run.seed}", f"max_steps={run.steps}"),
            *named(run.options),
        ),
        "pose = result.pose",
        f"signs = evidence(source, target, pose, reach={run.reach!r})",
        *_print_lines(),
        *(['print("rms", signs.rms)'] if run.evidence is not None and run.evidence.share else []),
        'print("explained", 100 * signs.share)',
        'print("conditioning", signs.weakest)',
    ]
    return "\n".join(lines) + "\n"


def _print_lines() -> list[str]:
    return [
        "",
        'print("rotation", np.degrees(np.arctan2(pose.R[1, 0], pose.R[0, 0])))',
        'print("x", pose.t[0])',
        'print("y", pose.t[1])',
    ]


def _input_lines(raw: Raw, example: str, seed: int, scans: tuple[int, int]) -> list[str]:
    """The lines that make the original `source` and `target`."""
    if example == "drive":
        calls = ", ".join(f"drive.points({k}, {FARTHEST!r})" for k in scans)
        return ["drive = telecom_loop()", f"source, target = {calls}"]
    if example == "hall":
        return [f"scans = hall({seed})", "source, target = scans.source, scans.target"]
    if example in _EXAMPLES:
        part = 0.6 if example == "part" else 1.0
        return [
            f'scene = room("noise", seed={seed}, overlap={part})',
            "source = Pose.from_angle(np.radians(-25.0), (-0.6, 0.5)).apply(scene.source)",
            "target = scene.target",
        ]
    return [*_cloud("source", raw.names[0], raw.source), *_cloud("target", raw.names[1], raw.target)]


def _cloud(variable: str, name: str, points: Array | None) -> list[str]:
    if name or points is None:
        return [f"{variable} = read(Path({name!r}).read_bytes()).points"]
    rows = [f"({x!r}, {y!r})" for x, y in points.tolist()]
    lines = [", ".join(rows[k : k + 3]) for k in range(0, len(rows), 3)]
    return [f"{variable} = np.array([", *(f"    {line}," for line in lines), "])"]


def _projection(variable: str, points: Array | None, clouds: Clouds) -> list[str]:
    """The lines that project a 3-D cloud onto the plane."""
    if points is None or points.shape[1] == 2:
        return []
    if clouds.slice is None:
        return [f"{variable} = {variable}[:, :2]"]
    low, high = clouds.slice
    return [f"{variable} = slab({variable}, {low!r}, {high!r})"]
