"""The sweep: every seed once, the same results however it is run, resumable, with verified files."""

from __future__ import annotations

import json
import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from distributed import LocalCluster

from sitegen.cache.code_hash import closure, code_text, imports, reached
from sitegen.experiments import sweep, sweep_verify
from sitegen.experiments.sweep_plan import (
    SWEEPS,
    Sweep,
    bits,
    bootstrap,
    code_of,
    flags,
    keep_bits,
    keep_row,
    racing,
    units,
)
from sitegen.experiments.sweep_unit import Unit, close, run_unit
from sitegen.progress import quiet
from solvers.studies.benchmark import benchmark
from solvers.studies.race import SEEDS, Controls, contestants
from solvers.studies.seeds import seeds

ROOT = Path(__file__).resolve().parents[3]
SMALL = Sweep(
    "small",
    {"clean": {"setting": "clean"}, "near": {"setting": "combo", "degrees": 15, "distance": 0.5}},
    seeds(8),
    4,
    keep_row,
    {"setting": ("clean", "near")},
)


@pytest.fixture
def home(tmp_path: Path) -> Path:
    """A checkout with the solvers but no results."""
    (tmp_path / "solvers").symlink_to(ROOT / "solvers", target_is_directory=True)
    return tmp_path


def swept(home: Path, methods: list[str], plan: Sweep = SMALL) -> dict[str, Any]:
    sweep.run(home, plan, methods, home / "cache", quiet, 1)
    result: dict[str, Any] = json.loads((home / "content/data/sweep/small.json").read_text("utf-8"))
    return result


def test_a_unit_is_the_benchmark() -> None:
    """25 seeds of one setting end as in the race's benchmark, to the stored digits."""
    result = run_unit(Unit("gicp", ({"setting": "clean"},), SEEDS))
    (row,) = benchmark(Controls(setting="clean"), seeds=SEEDS, contestants=contestants(["gicp"]))
    assert result["rre"] == [float(e) for e in np.round(row.rre, 4)]
    assert result["steps"] == row.steps.tolist()
    assert sum(close(result)) == row.close


def test_cells_of_different_sizes_and_starts_stand_in_one_unit() -> None:
    """Clouds of another density, or with another start, each end as in a run of their own."""
    points = ({"setting": "clean"}, {"setting": "clean", "degrees": 15}, {"setting": "clean", "density": 0.5})
    whole = run_unit(Unit("icp", points, (40, 53, 66)))
    alone = [run_unit(Unit("icp", (point,), (40, 53, 66))) for point in points]
    assert whole["rre"] == pytest.approx([e for cell in alone for e in cell["rre"]], abs=1e-4)
    assert len(whole["steps"]) == 9


def test_every_seed_of_every_cell_is_run_once() -> None:
    for plan in SWEEPS:
        runs = [(name, seed) for names, unit in units(plan, racing()[0]) for name in names for seed in unit.seeds]
        assert len(runs) == len(set(runs)) == len(plan.cells) * len(plan.seeds)
        for controls in plan.cells.values():
            Controls(**controls)


def test_a_sweep_goes_on_where_it_was(home: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Finished units are not run again; another contestant joins the file; changed code is run anew."""
    runs: list[Unit] = []

    def count(unit: Unit) -> dict[str, list[float]]:
        runs.append(unit)
        if len(runs) == 2:
            raise KeyboardInterrupt
        return run_unit(unit)

    monkeypatch.setattr(sweep, "run_unit", count)
    with pytest.raises(KeyboardInterrupt):
        swept(home, ["icp"])
    assert len(runs) == 2
    first = swept(home, ["icp"])
    assert len(runs) == 2 + 1
    second = swept(home, ["gicp", "icp"])
    assert len(runs) == 3 + 2
    assert list(second["contestants"]) == ["icp", "gicp"]
    assert second["contestants"]["icp"] == first["contestants"]["icp"]
    monkeypatch.setattr(sweep, "code_of", lambda contestant, root: "another code")
    swept(home, ["icp"])
    assert len(runs) == 5 + 2


def test_processes_and_a_cluster_give_what_one_process_does(home: Path) -> None:
    """The same units through a pool and through a local Dask cluster that is given our sources."""
    tasks = [Unit("icp", ({"setting": "clean"},), (40, 53)), Unit("gicp", ({"setting": "clean"},), (40, 53))]
    expected = {unit.method: run_unit(unit) for unit in tasks}
    with sweep.workers(ROOT, tasks, 2) as results:
        assert {unit.method: result for unit, result in results} == expected
    with (
        LocalCluster(n_workers=1, threads_per_worker=1, dashboard_address=None) as cluster,
        sweep.workers(ROOT, tasks, cluster.scheduler_address) as results,
    ):
        assert {unit.method: result for unit, result in results} == expected


def test_results_are_proved_or_said_to_be_stale(home: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A file from this code is partly run again and agrees; a false bit is reported as wrong; other code is reported as
    stale and not run."""
    only = [c for c in racing() if c.method in ("icp", "gicp")]
    monkeypatch.setattr(sweep_verify, "racing", lambda: only)
    small = replace(SMALL, keep=keep_bits)
    data = swept(home, ["icp", "gicp"], small)
    cache = home / "cache"
    fine = sweep_verify.standing(home, [small], cache)
    assert (fine.wrong, fine.stale, fine.proved, fine.ran) == ((), (), 16, 2)
    second = sweep_verify.standing(home, [small], cache)
    assert (second.proved, second.ran) == (16, 0), "what was proved is remembered"
    assert sweep_verify.standing(home, [small]).ran == 2

    path = home / "content/data/sweep/small.json"
    for cell in data["contestants"]["icp"]["cells"].values():
        cell["bits"] = bits([not flag for flag in flags(cell["bits"], 8)])
    path.write_text(json.dumps(data), "utf-8")
    (problem,) = sweep_verify.standing(home, [small], cache).wrong
    assert "small.json:0:0: ICP: 8 of 8 repeated runs end differently" in str(problem)

    data["contestants"]["icp"]["code"] = "older"
    path.write_text(json.dumps(data), "utf-8")
    old = sweep_verify.standing(home, [small])
    assert (old.wrong, old.proved) == ((), 8)
    assert "stale: from other code or settings (ICP)" in str(old.stale[0])

    path.unlink()
    assert "(ICP, GICP)" in str(sweep_verify.standing(home, [small]).stale[0])


@pytest.mark.parametrize("plan", SWEEPS, ids=lambda plan: plan.name)
def test_the_files_in_the_repository_are_whole_and_small(plan: Sweep) -> None:
    """All contestants with all cells, seed by seed; the three files together are below 300 kB."""
    folder = ROOT / "content/data/sweep"
    data = json.loads((folder / f"{plan.name}.json").read_text("utf-8"))
    assert list(data["contestants"]) == [contestant.method for contestant in racing()]
    for entry in data["contestants"].values():
        assert list(entry["cells"]) == list(plan.cells)
        assert all(len(cell["bits"]) == -(-len(plan.seeds) // 4) for cell in entry["cells"].values())
    assert sum(path.stat().st_size for path in folder.glob("*.json")) < 300_000


def test_the_code_of_a_contestant_is_its_own(tmp_path: Path) -> None:
    """Another method's module does not change it; its own module and the shared ones do; comments do not count."""
    shutil.copytree(ROOT / "solvers", tmp_path / "solvers", ignore=shutil.ignore_patterns("__pycache__"))
    icp, mmd = (next(c for c in racing() if c.method == name) for name in ("icp", "mmd"))

    def codes() -> tuple[str, str]:
        return code_of(icp, tmp_path), code_of(mmd, tmp_path)

    def edit(name: str, text: str) -> None:
        path = tmp_path / "solvers" / name
        path.write_text(path.read_text("utf-8") + text, "utf-8")

    before = codes()
    edit("methods/mmd/mmd.py", "\n\n# a comment\n")
    assert codes() == before
    edit("methods/mmd/mmd.py", "NEW = 1\n")
    assert codes()[0] == before[0]
    assert codes()[1] != before[1]
    edit("scenes/rooms.py", "NEW = 1\n")
    assert codes()[0] != before[0]


def test_bits_and_flags_are_inverse() -> None:
    rng = np.random.default_rng(40)
    for count in (1, 4, 10, 25, 1000):
        values = [bool(x) for x in rng.random(count) < 0.5]
        assert flags(bits(values), count) == values


def test_bootstrap_intervals_hold_the_statistic() -> None:
    """For the median of normal draws: about ±1.96·1.2533σ/√n, the same each time."""
    values = np.random.default_rng(40).normal(size=1000).tolist()
    middle, low, high = bootstrap(values, lambda v: np.median(v, axis=-1))
    assert low < middle < high
    assert high - low == pytest.approx(2 * 1.96 * 1.2533 / np.sqrt(1000), rel=0.25)
    assert bootstrap(values, lambda v: np.median(v, axis=-1)) == [middle, low, high]


def test_code_is_what_is_left_without_words() -> None:
    source = '"""Doc."""\n\nX = "#no comment"  # a comment\n\n\ndef f():\n    """Doc\n    of f."""\n    return X\n'
    assert code_text(source) == 'X = "#no comment"\ndef f():\n    return X'


def test_what_is_reached_and_imported() -> None:
    source = "from solvers import METHODS\nfrom solvers.core import validate\n"
    source += "import numpy as np\nA = 1\nB = A\ndef f():\n    return B\nC = 2\n"
    assert set(reached(source, ["f"])) == {"f", "B", "A"}
    assert imports(source, ROOT) == ["solvers", "solvers.core.validate", "numpy"]
    several = "from solvers.core.pose import (\n    Pose,  # a comment\n)\nif 1:\n    import solvers.methods.icp.icp\n"
    assert imports(several, ROOT) == ["solvers.core.pose", "solvers.methods.icp.icp"]
    result = closure(["solvers.methods.pairs.kabsch"], ROOT, skip=["solvers.core.registry"])
    assert "solvers.geometry.rigid" in result
    assert "solvers.methods.icp.icp" not in result
    with pytest.raises(LookupError, match=r"missing module solvers\.kabsch under"):
        closure(["solvers.kabsch"], ROOT)
    with pytest.raises(LookupError, match=r"missing module solvers\.gone under"):
        closure(["solvers.gone"], ROOT)
