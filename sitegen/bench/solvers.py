"""The solvers' speed: the race's benchmark natively and in a tab, and two of our methods against other libraries.

These peers are optional (`pip install --group peers`, from pyproject.toml): without them there is no comparison.
"""

from __future__ import annotations

import importlib
import json
import shutil
import sys
import tempfile
import time
import tracemalloc
from collections.abc import Callable
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np

from sitegen.bench.model import Bench, Row
from sitegen.bench.pages import browser_of
from sitegen.cache.files import cache_dir
from sitegen.external.fetch import gather
from sitegen.serve.static_files import serving

ROUNDS = 3
RACE = """
import json
from solvers.benchmark import benchmark
from solvers.race import Controls

def race():
    return {line.contestant.label: line.seconds for line in benchmark(Controls())}

race()
json.dumps([race() for _ in range(3)])
"""
TIMEOUT = 300_000
_RUN = """([message, timeout]) => new Promise((resolve, reject) => {
  const worker = new Worker('stock.mjs', { type: 'module' });
  setTimeout(() => reject(new Error('no answer')), timeout);
  worker.onerror = (event) => reject(new Error(event.message));
  worker.onmessage = ({ data }) => data.type === 'ready' ? resolve(data.answer) : reject(new Error(data.message));
  worker.postMessage(message);
})"""


def race(bench: Bench) -> list[Row]:
    """25 seeds, nine contestants, 'combo' at 45° and 1.43 u: in one worker of a tab without our page, and natively, in
    total and by contestant."""
    native, in_page = native_race(), tab_race(bench)
    notes = "warm, median of 3; combo at 45° and 1.43 u"
    return [
        Row("one worker of a tab, 25-seed benchmark", 1e3 * total(in_page), "ms", None, notes),
        Row("the same, natively", 1e3 * total(native), "ms", 1000, notes),
        *(
            Row(f"  {name}, in the tab", 1e3 * middle(in_page, name), "ms", None, f"natively {1e3 * seconds:.0f} ms")
            for name, seconds in ((name, middle(native, name)) for name in native[0])
        ),
    ]


Rounds = list[dict[str, float]]


def total(rounds: Rounds) -> float:
    """The median over the rounds of all contestants' total time."""
    return median(sum(times.values()) for times in rounds)


def middle(rounds: Rounds, name: str) -> float:
    """The median over the rounds of one contestant's time."""
    return median(times[name] for times in rounds)


def native_race() -> Rounds:
    """Seconds of each contestant in this process."""
    return asked(RACE)  # type: ignore[no-any-return]


def asked(code: str) -> Any:
    """The value of the last line of `code`, an expression that gives JSON, run in this process."""
    *statements, last = code.strip().split("\n")
    scope: dict[str, Any] = {}
    exec("\n".join([*statements, f"answer = {last}"]), scope)
    return json.loads(scope["answer"])


def tab_race(bench: Bench) -> Rounds:
    """Seconds of each contestant in a module worker of the bench's browser."""
    return in_tab(bench, RACE)  # type: ignore[no-any-return]


def in_tab(bench: Bench, code: str) -> Any:
    """The value of the last line of `code`, an expression that gives JSON, run in a worker of the bench's browser."""
    with tempfile.TemporaryDirectory(prefix="ladder-bench-") as temporary:
        root = Path(temporary)
        for path in gather(["numpy", "pyodide"], cache=cache_dir()).values():
            shutil.copyfile(path, root / path.name)
        (wheel,) = bench.site.glob("runtime/*/*.whl")
        shutil.copyfile(wheel, root / wheel.name)
        shutil.copyfile(Path(__file__).with_name("stock.mjs"), root / "stock.mjs")
        (root / "index.html").write_text("<!doctype html><title>race</title><link rel=icon href=data:,>", "utf-8")
        with serving(root) as server, browser_of(bench) as browser:
            page = browser.new_page()
            page.goto(server.origin + "/index.html")
            message = {"folder": server.origin + "/", "wheel": f"{server.origin}/{wheel.name}", "code": code}
            return json.loads(page.evaluate(_RUN, [message, TIMEOUT]))


def peers(bench: Bench) -> list[Row]:
    """Rigid CPD against pycpd at equal iterations, and its memory; 10⁵-point ICP against small_gicp on one thread."""
    return [*cpd_rows(), cpd_memory(), *icp_rows()]


def cpd_rows() -> list[Row]:
    """The time of our rigid CPD as a share of pycpd's for the same number of iterations, at two sizes."""
    from solvers import register

    pycpd = optional("pycpd")
    rows = []
    for n in (100, 1000):
        rng = np.random.default_rng(40)
        target = rng.normal(size=(n, 2))
        # With some noise: on an exact copy σ falls to zero, and a step of exactly zero ends our run early.
        source = target @ _turn(0.3).T + 0.1 + 0.05 * rng.normal(size=target.shape)
        steps: list[int] = []

        def mine(s: Any = source, t: Any = target, steps: list[int] = steps) -> None:
            steps.append(int(register(s, t, method="cpd-rigid", max_steps=30, tolerance=0.0).steps))

        ours = fastest(mine)
        label, note = f"rigid CPD, {n} × {n}, equal iterations", f"ours {1e3 * ours:.1f} ms, {steps[-1]} iterations"
        if pycpd is None:
            rows.append(Row(label, 1e3 * ours, "ms", None, "pycpd is not installed: no comparison"))
            continue

        def theirs(s: Any = source, t: Any = target, k: int = steps[-1]) -> None:
            # Its rigid form also fits a scale, like the paper's; that cannot be turned off.
            pycpd.RigidRegistration(X=t, Y=s, max_iterations=k, tolerance=0.0, w=0.1).register()

        limit = 0.25 if n == 100 else 0.125
        rows.append(Row(f"{label}, share of pycpd's time", ours / fastest(theirs), "", limit, note))
    return rows


def cpd_memory() -> Row:
    """The peak memory of a run of rigid CPD, without its clouds."""
    from solvers import register

    n = 1000
    target = np.random.default_rng(40).normal(size=(n, 2))
    source = target @ _turn(0.3).T + 0.1
    tracemalloc.start()
    try:
        register(source, target, method="cpd-rigid", max_steps=3, tolerance=0.0)
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    note = f"the matrix of shares alone would be {8 * n * n / 1e6:.0f} MB"
    return Row(f"rigid CPD, {n} × {n}, memory", peak / 1e6, "MB", None, note)


def icp_rows() -> list[Row]:
    """ICP on 10⁵ points in 3D, from the same start until each library stops, in multiples of small_gicp's time."""
    from solvers import Pose, register

    small = optional("small_gicp")
    rng = np.random.default_rng(40)
    plane = rng.uniform(-5.0, 5.0, (100_000, 2))
    height = 0.6 * np.sin(plane[:, 0]) * np.cos(0.8 * plane[:, 1])
    target = np.column_stack([plane, height])
    turn = np.eye(3)
    turn[:2, :2] = _turn(0.03)
    source = target[rng.permutation(len(target))] @ turn.T + [0.05, -0.04, 0.03] + 0.005 * rng.normal(size=target.shape)
    steps: list[int] = []

    def ours() -> None:
        start = Pose.identity(3)
        result = register(source, target, method="icp", start=start, gate=1.0, tolerance=1e-4, rms_tolerance=0.0)
        steps.append(int(result.steps))

    mine = fastest(ours)
    label, note = "ICP, 10⁵ points, nearest neighbours", f"ours {mine:.2f} s, {steps[-1]} steps"
    if small is None:
        return [Row(label, mine, "s", None, f"{note}; small_gicp is not installed: no comparison")]
    iterations: list[int] = []

    def theirs() -> None:
        cloud, moving = small.PointCloud(target), small.PointCloud(source)
        tree = small.KdTree(cloud, num_threads=1)
        alignment = small.align(
            cloud, moving, tree, registration_type="ICP", max_correspondence_distance=1.0, num_threads=1,
            max_iterations=steps[-1],
        )  # fmt: skip
        iterations.append(int(alignment.iterations))

    theirs_seconds = fastest(theirs)
    note += f"; small_gicp {theirs_seconds:.2f} s, {iterations[-1]} iterations; both with their trees"
    return [Row(f"{label}, times small_gicp's", mine / theirs_seconds, "", 1.8, note)]


def _turn(angle: float) -> Any:
    return np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])


def optional(name: str) -> Any | None:
    """The module; None, and a message, if it is not installed."""
    try:
        return importlib.import_module(name)
    except ImportError:
        print(f"bench: {name} is not installed: run `pip install --group peers`", file=sys.stderr)
        return None


def fastest(work: Callable[[], Any]) -> float:
    """Seconds of the fastest of several runs, after a warm-up run."""
    times = []
    for _ in range(ROUNDS + 1):
        began = time.perf_counter()
        work()
        times.append(time.perf_counter() - began)
    return min(times[1:])
