"""`python -m solvers SOURCE TARGET` on files: what it prints, draws and refuses, run as a user runs it."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest

from solvers import METHODS, Pose, register
from solvers.__main__ import main
from solvers.hall import hall
from solvers.scenes import room

pytestmark = pytest.mark.native
ROOT = Path(__file__).resolve().parents[2]
TRUTH = Pose.from_angle(np.radians(15.0), (0.3, -0.2))


@pytest.fixture
def files(tmp_path):
    """a.csv and b.xyz: a room, the source moved; c.csv and d.xyz: a hall in space."""
    scene, scans = room("noise", seed=40), hall()
    for name, points in (("a.csv", TRUTH.inverse().apply(scene.source)), ("c.csv", scans.source)):
        (tmp_path / name).write_text("\n".join(",".join(map(repr, row)) for row in points.tolist()), "utf-8")
    for name, points in (("b.xyz", scene.target), ("d.xyz", scans.target)):
        (tmp_path / name).write_text("\n".join(" ".join(map(repr, row)) for row in points.tolist()), "utf-8")
    return tmp_path


def said(capsys, *arguments):
    code = main([str(argument) for argument in arguments])
    heard = capsys.readouterr()
    return code, heard.out, heard.err


def test_it_runs_as_a_module_beside_the_files(files):
    """In a process of its own: exit code 0, the pose that `register` finds, and a picture of both clouds twice."""
    command = [sys.executable, "-m", "solvers", "a.csv", "b.xyz", "--method", "gicp", "--options", "gate=1.5"]
    done = subprocess.run(
        [*command, "--out", "picture.svg"],
        cwd=files,
        env={**os.environ, "PYTHONPATH": str(ROOT), "PYTHONIOENCODING": "ascii"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    scene = room("noise", seed=40)
    result = register(TRUTH.inverse().apply(scene.source), scene.target, "gicp", gate=1.5)
    assert f"rotation {np.degrees(result.pose.angle):.4f} deg" in done.stdout
    rows = [[float(v) for v in re.findall(r"-?\d[\d.e+-]*", line)] for line in done.stdout.splitlines()[4:7]]
    np.testing.assert_allclose(rows, result.matrix, rtol=1e-5, atol=1e-6)
    assert f"converged after {result.steps} steps" in done.stdout
    assert "overlap   1.0000" in done.stdout
    tree = ElementTree.fromstring((files / "picture.svg").read_text("utf-8"))
    marks = [node.attrib["class"] for node in tree.iter() if node.tag.endswith("path")]
    assert marks.count("dot s source") == marks.count("square s target") == 2


def test_clouds_in_space_and_from_above(files, capsys):
    """3-D where the method can, x and y where it is asked for, and a word where it cannot."""
    c, d = files / "c.csv", files / "d.xyz"
    code, out, _ = said(capsys, c, d, "--method", "gicp", "--start", "15,0.5,-0.3")
    assert code == 0
    turn = float(re.search(r"rotation ([\d.]+) deg about its axis", out)[1])
    assert turn == pytest.approx(20.0, abs=1.5)
    code, _, err = said(capsys, c, d, "--method", "ndt")
    assert (code, err) == (
        2,
        "solvers: --method: ndt works in 2 dimensions, the points have 3; --above registers x and y\n",
    )
    code, out, _ = said(capsys, c, d, "--method", "ndt", "--above", "--points", "300")
    assert code == 0
    assert out.count(", thinned to ") == 2


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (["a.csv", "nothing.csv"], r"nothing\.csv: No such file"),
        (["a.csv", "bad.csv"], r"bad\.csv: line 2: 'two' is no number"),
        (["a.csv", "b.xyz", "--method", "gipc"], r"--method: 'gipc' is unknown, did you mean 'gicp'"),
        (["a.csv", "b.xyz", "--options", "gat=1"], r"gat: no option of method 'icp', did you mean 'gate'"),
        (["a.csv", "b.xyz", "--options", "gate"], r"--options: 'gate' is not NAME=VALUE"),
        (["a.csv", "b.xyz", "--options", "gate=wide"], r"gate: expected a number, got 'wide'"),
        (["a.csv", "b.xyz", "--start", "1,2"], r"--start: '1,2' has 1 shifts; expected 2"),
        (["a.csv", "b.xyz", "--start", "1,2,x"], r"--start: '1,2,x' is not ANGLE,X,Y"),
        (["a.csv", "d.xyz"], r"the other points in space; --above"),
        (["a.csv", "b.xyz", "--method", "kabsch"], r"target: row i must be the partner"),
        (["a.csv", "b.xyz", "--points", "0"], r"--points: must be at least 1"),
        (["a.csv", "b.xyz", "--out", "no/such/folder.svg"], r"--out: .*No such file"),
    ],
)
def test_what_is_wrong_is_one_line_and_exit_code_2(files, capsys, monkeypatch, arguments, told):
    monkeypatch.chdir(files)
    Path("bad.csv").write_text("1,2\n3,two\n", "utf-8")
    code, _, err = said(capsys, *arguments)
    assert code == 2
    assert re.search(told, err)
    assert err.startswith("solvers: ")
    assert err.count("\n") == 1


def test_help_names_every_method(capsys):
    with pytest.raises(SystemExit) as end:
        main(["--help"])
    assert end.value.code == 0
    out = " ".join(capsys.readouterr().out.split())
    assert all(name in out for name in METHODS)
    assert "benchmark" in out
