"""The gallery of the docs: the same tasks in several libraries, `python3 build.py bench --gallery PYTHON`.

Every snippet is a file in `gallery-code/`, named TASK-MODULE.py, and is printed on the page exactly as it is run: a
function `register` of arrays that returns a homogeneous matrix. PYTHON is an interpreter that has numpy and the
libraries; each run of a snippet has its own process. The results are stored in content/data/gallery.json, from which
the page's tables and code are written.
"""

from __future__ import annotations

import json
import os
import platform
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import date
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np

import solvers
from sitegen.bench.model import number
from sitegen.cache.files import write
from solvers import Pose
from solvers.match_scenes import facade_scene
from solvers.scenes import kabsch_scene, room, room_start
from solvers.walk_scenes import fish, fish_start

PAGE = "content/docs/gallery.md"
DATA = "content/data/gallery.json"
CODE = Path(__file__).with_name("gallery-code")
ROUNDS = 3
LIBRARIES = {
    "solvers": "solvers", "skimage": "scikit-image", "open3d": "Open3D", "small_gicp": "small_gicp", "pycpd": "pycpd",
}  # fmt: skip
"""Module name → library name; ours first."""
IN_SPACE = ("open3d", "small_gicp")
"""Modules that work in 3D only: planar points get z = 0."""
ONE_THREAD = {f"{name}_NUM_THREADS": "1" for name in ("OMP", "OPENBLAS", "MKL")}


@dataclass(frozen=True)
class Task:
    """A task for each library. clouds: arrays by name, in the order of `register`'s arguments; start: a pose, its last
    argument; truth: the pose to find; scale: whether the scale is free."""

    clouds: Mapping[str, Any]
    truth: Pose
    modules: tuple[str, ...]
    start: Pose | None = None
    scale: bool = False

    def given(self, module: str) -> dict[str, Any]:
        """The arrays in order, with z = 0 for a library that works in 3D only."""
        lifts = module in IN_SPACE
        arrays = {name: np.pad(a, ((0, 0), (0, 1))) if lifts else a for name, a in self.clouds.items()}
        if self.start is not None:
            arrays["start"] = lifted(self.start.matrix) if lifts else self.start.matrix
        return arrays


def tasks() -> dict[str, Task]:
    """The tasks by name, in the order of the page."""
    pairs, facade, scans, soft = kabsch_scene("noisy"), facade_scene(outliers=0.4), room("clean"), fish("noisy")
    noise = 0.12 * np.random.default_rng(40).standard_normal((1000, *pairs.source.shape))
    source, truth = fish_start().apply(soft.source), soft.truth.compose(fish_start().inverse())
    return {
        "pairs": Task(_clouds(pairs), pairs.truth, ("solvers", "skimage", "open3d")),
        "thousand": Task(
            {"source": pairs.source, "targets": pairs.truth.apply(pairs.source) + noise}, pairs.truth,
            ("solvers", "skimage"),
        ),
        "wrong": Task(_clouds(facade), facade.truth, ("solvers", "skimage", "open3d")),
        "scans": Task(
            _clouds(scans), scans.truth, ("solvers", "open3d", "small_gicp"), room_start(degrees=20.0, distance=0.8)
        ),
        "soft": Task({"source": source, "target": soft.target}, truth, ("solvers", "pycpd"), scale=True),
    }  # fmt: skip


def _clouds(scene: Any) -> dict[str, Any]:
    return {"source": scene.source, "target": scene.target}


def snippet(task: str, module: str) -> Path:
    """The file that is run and shown."""
    return CODE / f"{task}-{module}.py"


def lifted(matrix: Any) -> Any:
    """A homogeneous matrix of the plane as one in 3D that keeps z."""
    out = np.eye(4)
    rows = np.array([0, 1, 3])
    out[np.ix_(rows, rows)] = matrix
    return out


def errors(matrix: Any, truth: Pose) -> tuple[float, float, float]:
    """The errors of answers: rotation in degrees, translation in u, scale as a fraction; medians over a batch.

    matrix: (..., 3, 3), or (..., 4, 4) of points with z = 0, where a tilt out of the plane counts as rotation.
    """
    matrices = np.asarray(matrix, dtype=float)
    d = matrices.shape[-1] - 1
    right = truth.matrix if d == 2 else lifted(truth.matrix)
    scale = np.abs(np.linalg.det(matrices[..., :d, :d])) ** (1.0 / d)
    off = matrices[..., :d, :d] / scale[..., None, None] @ right[:d, :d].T * truth.scale ** (-1.0)
    # From sine and cosine: the cosine alone loses half the digits of a small angle.
    sine = np.linalg.norm(off - off.swapaxes(-1, -2), axis=(-2, -1)) / np.sqrt(8.0)
    angle = np.degrees(np.arctan2(sine, (np.trace(off, axis1=-2, axis2=-1) - (d - 2)) / 2.0))
    shift = np.linalg.norm(matrices[..., :d, d] - right[:d, d], axis=-1)
    return float(np.median(angle)), float(np.median(shift)), float(np.median(np.abs(scale / truth.scale - 1.0)))


def gallery_command(root: Path, python: Path) -> int:
    """Run every snippet with `python`, store the results, write the page. The exit code is 1 if one fails, 2 if
    there is no such program.
    """
    if shutil.which(python.absolute()) is None:
        print(f"bench: --gallery: no program at {python}", file=sys.stderr)
        return 2
    try:
        data = measured(root, python.absolute())  # unresolved: an environment's link leads out of it
    except (subprocess.CalledProcessError, OSError) as error:
        print(f"bench: the gallery could not be measured: {error}", file=sys.stderr)
        return 1
    write(root / DATA, (json.dumps(data, indent=1, ensure_ascii=False) + "\n").encode())
    write(root / PAGE, written((root / PAGE).read_text("utf-8"), data).encode())
    return 0


def measured(root: Path, python: Path) -> dict[str, Any]:
    """The page's data: machine, versions, import times, and for each task each library's answer, errors and time.

    All snippets take turns, `ROUNDS` times, because the load varies; the time is the median call of the quickest turn.
    """
    turns: dict[tuple[str, str], list[dict[str, Any]]] = {}
    with tempfile.TemporaryDirectory(prefix="ladder-gallery-") as folder:
        for _ in range(ROUNDS):
            for name, task in tasks().items():
                for module in task.modules:
                    clouds = Path(folder) / f"{name}-{module}.npz"
                    np.savez(clouds, **task.given(module))
                    print(f"{name}, {module}", file=sys.stderr, flush=True)
                    answer = asked(root, python, "-m", "sitegen.bench.gallery_run", snippet(name, module), clouds)
                    turns.setdefault((name, module), []).append(answer)
    absent = {module: answers[0]["absent"] for (_, module), answers in turns.items() if "absent" in answers[0]}
    results = {
        name: {m: _line(turns[name, m], task.truth) for m in task.modules if m not in absent}
        for name, task in tasks().items()
    }
    importing = {m: _quickest_import(m, turns) for m in LIBRARIES if m not in absent}
    versions = asked(root, python, "-c", _VERSIONS, json.dumps([LIBRARIES[m] for m in importing if m != "solvers"]))
    return {
        "date": date.today().isoformat(),
        "system": platform.system(), "machine": platform.machine(), "cores": os.cpu_count() or 0,
        "versions": {"solvers": solvers.__version__, **versions}, "importing": importing, "absent": absent,
        "tasks": results,
    }  # fmt: skip


_VERSIONS = """
import json, platform, sys
from importlib.metadata import version
print(json.dumps({name: version(name) for name in [*json.loads(sys.argv[1]), "numpy"]} | {
    "Python": platform.python_version()}))
"""


def asked(root: Path, python: Path, *words: str | Path) -> Any:
    """The JSON printed by a process of `python`, run in the checkout on one thread. Raises CalledProcessError."""
    command = [str(python), *map(str, words)]
    environment = {**os.environ, **ONE_THREAD, "PYTHONPATH": str(root)}
    result = subprocess.run(command, cwd=root, env=environment, stdout=subprocess.PIPE, text=True, check=True)
    return json.loads(result.stdout.strip().splitlines()[-1])


def _line(turns: Sequence[Mapping[str, Any]], truth: Pose) -> dict[str, Any]:
    """One library's line of a task. A batch's answers are too many to store."""
    matrix = turns[0]["matrix"]
    rotation, translation, scale = errors(matrix, truth)
    line = {"rotation": rotation, "translation": translation, "scale": scale}
    if np.ndim(matrix) == 2:
        line["matrix"] = matrix
    quickest = min(turns, key=lambda turn: median(turn["seconds"]))
    return {**line, "seconds": median(quickest["seconds"]), "calls": len(quickest["seconds"])}


def _quickest_import(module: str, turns: Mapping[tuple[str, str], Sequence[Mapping[str, Any]]]) -> float:
    """Seconds of the quickest import among a module's snippets."""
    return min(float(turn["importing"]) for (_, m), answers in turns.items() if m == module for turn in answers)


def written(page: str, data: Mapping[str, Any]) -> str:
    """The page with the data's code and tables between its marks. Raises ValueError if a part has none."""
    for name, text in parts(data).items():
        begin, end = marks(name)
        head, begins, body = page.partition(begin)
        _, ends, tail = body.partition(end)
        if not begins or not ends:
            raise ValueError(f"{PAGE}: missing marks for {name}: {begin} … {end}")
        page = f"{head}{begin}\n\n{text}\n\n{end}{tail}"
    return page


def marks(name: str) -> tuple[str, str]:
    """The two lines of the page around a part: link definitions that nothing uses."""
    return f"[//]: # (what `build.py bench --gallery` writes of {name} begins)", f"[//]: # ({name} ends)"


def parts(data: Mapping[str, Any]) -> dict[str, str]:
    """The parts of the page by the names of their marks: each task's table and code, and the libraries."""
    return {
        **{name: f"{_table(task, data['tasks'][name])}\n\n{_code(name, data)}" for name, task in tasks().items()},
        "libraries": _libraries(data),
    }


def _code(name: str, data: Mapping[str, Any]) -> str:
    """Each snippet that was run, under its library's name. The fences say `py`: tests would run `python`."""
    return "\n\n".join(
        f"**{LIBRARIES[module]}**\n\n```py\n{snippet(name, module).read_text('utf-8')}```"
        for module in data["tasks"][name]
    )


def _table(task: Task, lines: Mapping[str, Mapping[str, Any]]) -> str:
    ours = lines["solvers"]["seconds"]
    rows = []
    for module, line in lines.items():
        off = [f"{line['rotation']:.4f}°", f"{line['translation']:.5f} u"]
        off += [f"{100.0 * line['scale']:.3f} %"] if task.scale else []
        time = [f"{number(1e3 * line['seconds'])} ms", f"{number(line['seconds'] / ours)}"]
        rows.append([LIBRARIES[module], *off, *time])
    scale = ["scale off"] if task.scale else []
    return _markdown(["library", "rotation off", "translation off", *scale, "one call", "times ours"], rows)


def _libraries(data: Mapping[str, Any]) -> str:
    versions = data["versions"]
    rows = [
        [LIBRARIES[m], versions[LIBRARIES[m]], f"{number(1e3 * seconds)} ms"]
        for m, seconds in data["importing"].items()
    ]
    table = _markdown(["library", "version", "import, after numpy"], rows)
    conditions = (
        f"{data['cores']} cores, {data['system']} on {data['machine']}, Python {versions['Python']}, numpy "
        f"{versions['numpy']}"
    )
    absent = "".join(f" {LIBRARIES[m]} was not available: {reason}." for m, reason in data["absent"].items())
    return f"{table}\n\nMeasured on {data['date']}: {conditions}.{absent}"


def _markdown(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    return "\n".join(f"| {' | '.join(row)} |" for row in [head, ["---"] * len(head), *rows])
