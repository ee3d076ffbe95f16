"""What a type checker makes of a user's calls: correct ones pass, and each mistake is reported where it occurs."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

pytestmark = pytest.mark.native
ROOT = Path(__file__).resolve().parents[2]
HEAD = """
from dataclasses import replace
import numpy as np
import solvers
from solvers import METHODS, Pose, register
from solvers.api import register as by_any_name
from solvers.options import IcpOptions
p = np.zeros((3, 2))
q = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]
"""
RIGHT = """
register(p, q).pose.matrix
register(p, q, gate=0.5, max_steps=3, start=Pose.identity(), seed=None, callback=lambda k, state: k > 3)
register(p, q, max_distance=0.5)
register(p, q, "icp", weight="huber", weights=[1.0, 1.0, 1.0])
register(p, q, method="gicp", gate=1)
register([p, p], [q, q], "umeyama", pairs=[[0, 0], [1, 1]])
register(p, q, options=IcpOptions(gate=0.5))
register(p, q, "gicp", options=solvers.options.GicpOptions(gate=0.5))
register(p, q, "gicp", options=METHODS["gicp"].options(gate=0.5))
[register(p, q, name) for name in METHODS]
[register(p, q, name, options=method.options()) for name, method in METHODS.items()]
by_any_name(p, q, input(), gate=0.5)
register(p, q, replace(METHODS["icp"], max_steps=9), gate=0.5, start=Pose.identity())
METHODS[input()].options(gate=0.5)
METHODS.get(input())
solvers.icp(p, q, max_distance=0.5, weight="tukey").fitness
solvers.capped_icp(p, q, max_distance=None)
solvers.filterreg(p, q, filter="grid", variance="scheduled")
solvers.mmd(p, q, kernel="laplace", lengths=[2.0, 1.0], count=[8, 16])
register(p, q, "mmd", lengths=2.0)
register(p, q, "mmd", lengths=np.geomspace(2.0, 0.5, 3), count=np.array([8, 16, 32]))
register(p, q, "ndt", cells=np.array([2.0, 1.0]), offset=np.array([0.5, 0.5]))
solvers.options.D2dOptions(cells=np.array([2.0, 1.0]))
solvers.umeyama(p, q, pairs=[[0, 0], [1, 1]])
solvers.cloud_text.read(b"0 0").points
solvers.uncertainty.covariance(register(p, q)).edge_information()
[one.steps for one in register([p, p], [q, q])]
", ".join(str(one.status) for one in register([p, p], [q, q]))
(register(p, q).covariance or exit()).words()
[one.angle for one in Pose([np.eye(2)] * 2, [[0.0, 0.0], [1.0, 0.0]])]
solvers.posegraph.Edges([0, 1], [1, 0], Pose.identity(2, (2,)), np.eye(3))
solvers.drives.Drive([0.0], [np.eye(3)], [[1.0, 2.0]], [0.0, 0.1], np.eye(3))
"""
WRONG = """
register(p, q, "icpp")
register(p, q, "ICP")
register(p, q, gat=1.0)
register(p, q, gate="x")
register(p, q, "icp", gat=1.0)
register(p, q, "gicp", gate="x")
register(p, q, "mmd", gate=1.0)
register(p, q, "mmd", max_distance=1.0)
register(p, q, "icp", weight="hubr")
register(p, q, "icp", pairs=[[0, 0]])
register(p, q, "gicp", options=IcpOptions())
register(p, q, input())
register(p, q, max_steps="many")
register(p)
METHODS["icp"].options(gat=1.0)
solvers.cloud_text.read("scan.csv")
IcpOptions(gate="x")
solvers.icp(p, q, gat=1.0)
solvers.icp(p, q, weight="hubr")
solvers.icp(p, q, max_distance="x")
solvers.trimmed_icp(p, q, max_distance=1.0)
solvers.kabsch(p, q, gate=1.0)
solvers.mmd(p, q, kernel="cauchi")
solvers.umeyama(p, q, gate=1.0)
register(p, q).covariance.words()
(register(p, q).covariance or exit()).wrods()
"""


def test_a_mistake_is_told_and_nothing_else(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    api = pytest.importorskip("mypy.api")
    calls = tmp_path / "calls.py"
    calls.write_text(HEAD + RIGHT + WRONG, "utf-8")
    monkeypatch.chdir(ROOT)
    text, errors, _ = api.run(["--strict", str(calls)])
    assert errors == ""
    matches = {int(line) for line in re.findall(r"calls\.py:(\d+): error:", text)}
    first = (HEAD + RIGHT).count("\n") + 2
    assert matches == set(range(first, first + WRONG.strip().count("\n") + 1))
