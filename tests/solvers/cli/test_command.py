"""`python -m solvers SOURCE TARGET` on files: what it prints, draws and refuses, run as a user would run it."""

from __future__ import annotations

import itertools
import json
import os
import re
import signal
import subprocess
import sys
import tracemalloc
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest

from solvers import METHODS, Pose, register
from solvers.cli.command import main
from solvers.io import clouds
from solvers.scenes.hall_3d import hall
from solvers.scenes.rooms import room
from solvers.studies.race import CONTESTANTS, EXTRAS
from solvers.verify import usual_reach
from tests.solvers.cli.calls import call

pytestmark = pytest.mark.native
ROOT = Path(__file__).resolve().parents[3]
TRUTH = Pose.from_angle(np.radians(15.0), (0.3, -0.2))


@pytest.fixture
def files(tmp_path):
    """a.csv and b.xyz: a room, with its source moved; c.csv and d.xyz: a hall in space."""
    scene, scans = room("noise", seed=40), hall()
    for name, points in (("a.csv", TRUTH.inverse().apply(scene.source)), ("c.csv", scans.source)):
        (tmp_path / name).write_text("\n".join(",".join(map(repr, row)) for row in points.tolist()), "utf-8")
    for name, points in (("b.xyz", scene.target), ("d.xyz", scans.target)):
        (tmp_path / name).write_text("\n".join(" ".join(map(repr, row)) for row in points.tolist()), "utf-8")
    return tmp_path


def test_it_runs_as_a_module_beside_the_files(files):
    """In its own process: exit code 0, the pose that `register` finds, and a picture that shows both clouds twice."""
    command = [sys.executable, "-m", "solvers", "a.csv", "b.xyz", "--method", "gicp", "--options", "gate=1.5"]
    process = subprocess.run(
        [*command, "--out", "picture.svg"],
        cwd=files,
        env={**os.environ, "PYTHONPATH": str(ROOT), "PYTHONIOENCODING": "ascii"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert process.returncode == 0, process.stderr
    scene = room("noise", seed=40)
    result = register(TRUTH.inverse().apply(scene.source), scene.target, "gicp", gate=1.5)
    assert f"rotation {np.degrees(result.pose.angle):.4f} deg" in process.stdout
    rows = [[float(v) for v in re.findall(r"-?\d[\d.e+-]*", line)] for line in process.stdout.splitlines()[4:7]]
    np.testing.assert_allclose(rows, result.matrix, rtol=1e-5, atol=1e-6)
    assert f"converged after {result.steps} steps" in process.stdout
    assert "overlap   1.0000" in process.stdout
    tree = ElementTree.fromstring((files / "picture.svg").read_text("utf-8"))
    for cloud, points in (("source", scene.source), ("target", scene.target)):
        for half in ("before", "after"):
            (marks,) = (node for node in tree.iter() if node.get("id") == f"{half}-{cloud}")
            assert sum(node.tag.endswith("use") for node in marks.iter()) == len(points)


def test_an_option_s_other_name_is_understood(files, capsys):
    """`max_distance` works as another name for `gate`, as in `register`."""
    output = [
        call(capsys, files / "a.csv", files / "b.xyz", "--options", f"{name}=0.2") for name in ("gate", "max_distance")
    ]
    assert output[0] == output[1] != call(capsys, files / "a.csv", files / "b.xyz")
    assert output[0][0] == 0


def test_clouds_in_space_and_from_above(files, capsys):
    """Methods that can register in 3-D; the others refuse, and point to --above, which registers x and y."""
    c, d = files / "c.csv", files / "d.xyz"
    code, out, _ = call(capsys, c, d, "--method", "gicp", "--start", "15,0.5,-0.3")
    assert code == 0
    turn = float(re.search(r"rotation ([\d.]+) deg about its axis", out)[1])
    assert turn == pytest.approx(20.0, abs=1.5)
    code, _, err = call(capsys, c, d, "--method", "ndt")
    assert (code, err) == (
        2,
        "python -m solvers: --method: ndt works in 2 dimensions, the points have 3; --above registers x and y\n",
    )
    code, out, _ = call(capsys, c, d, "--method", "ndt", "--above", "--points", "300")
    assert code == 0
    assert "status    stalled" in out
    assert out.count(", thinned to ") == 2


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["a.csv", "nothing.csv"], r"nothing\.csv: No such file"),
        (["a.csv", "bad.csv"], r"bad\.csv: line 2: 'two' is not a number"),
        (["a.csv", "b.xyz", "--method", "gipc"], r"--method: 'gipc' is unknown, did you mean 'gicp'"),
        (["a.csv", "b.xyz", "--options", "gat=1"], r"gat: no option of method 'icp', did you mean 'gate'"),
        (["a.csv", "b.xyz", "--options", "gat=1"], r"; it has: gate, trim, weight, tuning, scale, tolerance, rms_\w+$"),
        (["a.csv", "b.xyz", "--options", "gap=1", "--method", "kabsch"], r"no option of .*; it has: none$"),
        (["a.csv", "b.xyz", "--options", "start=1"], r"--options: start: no option .*, did you mean '--start'"),
        (["a.csv", "b.xyz", "--options", "max_steps=1"], r"--options: max_steps: .*, did you mean '--max-steps'"),
        (["a.csv", "b.xyz", "--options", "seed=1"], r"--options: seed: no option .*, did you mean '--seed'"),
        (["a.csv", "b.xyz", "--options", "callback=1"], r"--options: callback: no option of method 'icp'"),
        (["a.csv", "b.xyz", "--options", "method=1"], r"--options: method: no option of method 'icp'"),
        (["a.csv", "b.xyz", "--options", "gate=1", "max_distance=2"], r"--options: gate is given twice"),
        (["a.csv", "b.xyz", "--options", "gate"], r"--options: 'gate' is not NAME=VALUE"),
        (["a.csv", "b.xyz", "--options", "gate=wide"], r"gate: expected a number, got 'wide'"),
        (["a.csv", "b.xyz", "--start", "1,2"], r"--start: '1,2' has 1 shift; expected 2"),
        (["a.csv", "b.xyz", "--start", "1,2,x"], r"--start: '1,2,x' is not ANGLE,X,Y"),
        (["a.csv", "b.xyz", "--start", "nan,0,0"], r"--start: 'nan,0,0' is not finite$"),
        (["a.csv", "b.xyz", "--start", "0,inf,0"], r"--start: '0,inf,0' is not finite$"),
        (["a.csv", "b.xyz", "--options", "gate={[]}"], r"gate: expected a number, got '\{\[\]\}'$"),
        (["a.csv", "b.xyz", "--options", "gate={[]:1}"], r"gate: expected a number, got '\{\[\]:1\}'$"),
        (["large.csv", "large.csv", "--reach", "1e149"], r"--reach: expected a finite number from 1e-100 to 1e\+100"),
        (["a.csv", "d.xyz"], r"a\.csv has 2-D points, d\.xyz 3-D points; --above registers x and y"),
        (["a.csv", "b.xyz", "--method", "kabsch"], r"takes row i of both .* \d+ and \d+ points; a method such as icp"),
        (["a.csv", "b.xyz", "--seed=-1"], r"--seed: expected non-negative integers"),
        (["a.csv", "b.xyz", "--max-steps", "-1"], r"--max-steps: must be at least 0, got -1"),
        (
            ["a.csv", "b.xyz", "--reach", "1", "--method", "association-bp", "--options", "reach=-1"],
            r": reach: expected a finite number from 0\.1 to 30, got -1",
        ),
        (["a.csv", "b.xyz", "--start", "1"], r"--start: '1' has no shift; expected 2"),
        (["a.csv", "b.xyz", "--start", "0,1e200,0"], r"--start: beyond 1e\+150"),
        (["a.csv", "b.xyz", "--points", "0"], r"--points: must be at least 1"),
        (["a.csv", "a.csv", "--points", "9", "--method", "kabsch"], r"--points: kabsch takes row i of both files as"),
        (["a.csv", "b.xyz", "--out", "p.pdf"], r"--out: p.pdf: expected a name that ends in .svg, .png$"),
        (["a.csv", "b.xyz", "--out", "p"], r"--out: p: expected a name that ends in .svg, .png$"),
    ],
)
def test_what_is_wrong_is_one_line_and_exit_code_2(files, capsys, monkeypatch, arguments, message):
    monkeypatch.chdir(files)
    Path("bad.csv").write_text("1,2\n3,two\n", "utf-8")
    Path("large.csv").write_text("1e149,0\n0,1e149\n", "utf-8")
    code, _, err = call(capsys, *arguments)
    assert code == 2
    assert re.search(message, err)
    assert err.startswith("python -m solvers: ")
    assert err.count("\n") == 1


@pytest.mark.parametrize("columns", [40, 57, 80, 200])
def test_help_names_every_method(capsys, monkeypatch, columns):
    """Names stay whole at any width; argparse by itself breaks them at their hyphens."""
    monkeypatch.setenv("COLUMNS", str(columns))
    for words, names in ((["--help"], METHODS), (["benchmark", "--help"], [c.method for c in (*CONTESTANTS, *EXTRAS)])):
        with pytest.raises(SystemExit) as end:
            main(words)
        assert end.value.code == 0
        out = capsys.readouterr().out
        assert [name for name in names if name not in re.split(r"[\s,.]+", out)] == []
        assert "benchmark" in out


def test_a_file_is_not_read_before_its_size_is_known(files, capsys):
    """A sparse file of 100 GB and an endless one are both refused without being read in."""
    with open(files / "large.csv", "wb") as file:
        file.truncate(100_000_000_000)
    tracemalloc.start()
    try:
        code, _, err = call(capsys, files / "large.csv", files / "b.xyz")
        assert (code, err.partition("large.csv: ")[2]) == (2, "100000.0 MB are more than the limit of 24 MB\n")
        code, _, err = call(capsys, "drive", files / "large.csv")
        assert (code, err.partition("large.csv: ")[2]) == (2, "100000.0 MB are more than the limit of 64 MB\n")
        code, _, err = call(capsys, "/dev/zero", files / "b.xyz")
        assert (code, err.partition("zero: ")[2]) == (2, "it has more than the limit of 24 MB\n")
        assert tracemalloc.get_traced_memory()[1] < 3 * clouds.MOST_BYTES
    finally:
        tracemalloc.stop()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--options", "gate=" + "9" * 400], r"--options: gate: 400 digits; expected a number below 1e308"),
        (["--options", "gate=0x" + "f" * 400], r"--options: gate: 402 digits"),
        (["--options", "cells=(1," + "9" * 400 + ")", "--method", "ndt"], r"--options: cells: .* below 1e308"),
        (["--options", "gate=" + "9" * 5000], r"--options: gate: 5000 characters; expected 1000 at most"),
        (["--options", "gate=" + "(" * 100_000], r"--options: gate: 100000 characters"),
        (["--options", "gate=" + "-" * 5000 + "1"], r"--options: gate: 5001 characters"),
        (["--options", "gate=" + "[" * 90 + "]" * 90], r"gate: expected a number"),
        (["--options", "gate=" + "(" * 500 + ")" * 500], r".*gate: "),
        (["--options", "gate=" + "-" * 999 + "1"], r".*gate: "),
        (["--start", "9" * 400 + ",0,0"], r"--start"),
        (["--reach", "9" * 400], r"--reach"),
    ],
)
def test_options_beyond_all_measure_are_one_line(files, capsys, arguments, message):
    code, _, err = call(capsys, files / "a.csv", files / "b.xyz", *arguments)
    assert code == 2
    assert re.match(f"python -m solvers: {message}", err)
    assert err.count("\n") == 1
    assert len(err) < 1200


@pytest.mark.parametrize("option", ["--seed", "--max-steps", "--points"])
def test_counts_of_400_digits_are_refused(files, capsys, option):
    with pytest.raises(SystemExit) as end:
        call(capsys, files / "a.csv", files / "b.xyz", option, "9" * 400)
    assert end.value.code == 2
    assert f"argument {option}: a number of 400 digits; expected 18 at most" in capsys.readouterr().err
    code, _, err = call(capsys, "benchmark", "--seeds", "100001")
    assert (code, err) == (2, "python -m solvers: --seeds: 100001 is more than the limit of 100000\n")


def test_a_reader_that_goes_away_is_no_fault(files):
    """If the reader goes away, as `| head` does, there is no traceback, and the exit code is 1."""
    env = {**os.environ, "PYTHONPATH": str(ROOT)}
    for unbuffered in ("", "1"):
        command = [sys.executable, "-m", "solvers", "a.csv", "b.xyz"]
        reading, writing = os.pipe()
        os.close(reading)
        process = subprocess.run(
            command,
            cwd=files,
            env={**env, "PYTHONUNBUFFERED": unbuffered},
            stdout=writing,
            stderr=subprocess.PIPE,
            text=True,
            check=False,
        )
        os.close(writing)
        assert (process.returncode, process.stderr) == (1, "")


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="only Linux has a disk that is always full")
@pytest.mark.parametrize(
    ("words", "unbuffered"),
    # argparse itself ignores an error where help is not buffered
    [*itertools.product([["a.csv", "b.xyz"], ["methods", "--json"]], ["", "1"]), (["--help"], "")],
)
def test_an_output_on_a_full_disk_is_told_in_one_line(files, words, unbuffered):
    with open("/dev/full", "wb") as full:
        process = subprocess.run(
            [sys.executable, "-m", "solvers", *words],
            cwd=files,
            env={**os.environ, "PYTHONPATH": str(ROOT), "PYTHONUNBUFFERED": unbuffered},
            stdout=full,
            stderr=subprocess.PIPE,
            text=True,
            check=False,
        )
    assert (process.returncode, process.stderr) == (1, "python -m solvers: standard output: No space left on device\n")


def test_ctrl_c_is_one_line_and_exit_code_130(files, capsys, monkeypatch):
    def interrupted(*_, **__):
        signal.raise_signal(signal.SIGINT)

    monkeypatch.setattr("solvers.cli.register.register", interrupted)
    before = signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell's background job inherits "ignored"
    try:
        answer = call(capsys, files / "a.csv", files / "b.xyz")
    finally:
        signal.signal(signal.SIGINT, before)
    assert answer == (130, "", "python -m solvers: stopped by Ctrl-C\n")


def test_a_picture_is_well_formed_whatever_a_file_is_called(files, capsys):
    """File names may have control characters and invalid UTF-8, neither of which XML allows."""
    name = os.fsdecode(b"a\x01\x0b<&\xff\x1b[31m.csv")
    (files / "a.csv").rename(files / name)
    code, _, _ = call(capsys, files / name, files / "b.xyz", "--out", files / "picture.svg")
    assert code == 0
    tree = ElementTree.fromstring((files / "picture.svg").read_text("utf-8"))
    title = next(node.text for node in tree.iter() if node.tag.endswith("title"))
    assert title == "a\ufffd\ufffd<&\ufffd\ufffd[31m.csv registered to b.xyz by icp"
    code, _, _ = call(capsys, files / name, files / "b.xyz", "--out", files / "picture.PNG")
    assert (code, (files / "picture.PNG").read_bytes()[:4]) == (0, b"\x89PNG")


def test_what_is_given_twice_is_heard_twice(files, capsys):
    """Repeated --options add up like one list, a repeated option is refused, and each picture is drawn."""
    words = [files / "a.csv", files / "b.xyz", "--json"]
    answer = call(capsys, *words, "--options", "gate=0.1", "--options", "trim=0.1")
    assert answer == call(capsys, *words, "--options", "gate=0.1", "trim=0.1")
    assert answer != call(capsys, *words, "--options", "trim=0.1")
    refusal = call(capsys, *words, "--options", "gate=1.5", "--options", "gate=2.0")
    assert refusal == (2, "", "python -m solvers: --options: gate is given twice\n")
    outs = [files / name for name in ("one.svg", "two.png")]
    code, out, _ = call(capsys, *words, *(word for path in outs for word in ("--out", path)))
    assert (code, json.loads(out)["written"]) == (0, [str(path) for path in outs])
    assert all(path.stat().st_size > 1000 for path in outs)


def test_a_method_of_known_pairs_says_which_it_took(files, capsys):
    for name, result in (("kabsch", True), ("icp", False)):
        _, out, _ = call(capsys, files / "a.csv", files / "a.csv", "--method", name)
        assert ("pairs     row i of the source with row i of the target\n" in out) is result


def test_a_cloud_on_itself_is_moved_by_no_negative_zero(files, capsys):
    _, out, _ = call(capsys, files / "b.xyz", files / "b.xyz", "--max-steps", "0")
    assert out.partition("\nmatrix")[2].split()[:6] == ["1", "0", "0", "0", "1", "0"]


def test_the_matrix_told_moves_the_points_in_a_national_grid_too(files, capsys):
    grid = np.array([465_000.0, 5_247_000.0])
    source, target = (room("clean", seed=40).source, TRUTH.apply(room("clean", seed=40).source))
    for name, points in (("p.npy", source), ("q.npy", target)):
        np.save(files / name, points + grid)
    _, out, _ = call(capsys, files / "p.npy", files / "q.npy", "--method", "kabsch")
    rows = out.partition("\nmatrix")[2].partition("\nresidual")[0].split()
    matrix = np.array(rows, dtype=np.float64).reshape(3, 3)
    assert np.abs((source + grid) @ matrix[:2, :2].T + matrix[:2, 2] - (target + grid)).max() < 1e-6


@pytest.mark.parametrize("kind", ["csv", "npy"])
def test_rows_left_out_do_not_move_the_partners_of_the_others(files, capsys, kind):
    """Dropping one bad row from each file would leave equal counts but wrong partners, so kabsch refuses."""
    source = room("noise", seed=40).source
    for name, moved, row in (("p", source.copy(), 2), ("q", TRUTH.apply(source), 15)):
        moved[row] = np.nan
        np.save(files / f"{name}.npy", moved)
        np.savetxt(files / f"{name}.csv", moved, delimiter=",")
    arguments = files / f"p.{kind}", files / f"q.{kind}", "--method"
    code, out, err = call(capsys, *arguments, "kabsch")
    assert (code, out) == (2, "")
    assert "1 of its rows has NaN or infinity, and kabsch takes row i of both files as partners" in err
    assert call(capsys, *arguments, "icp")[0] == 0


@pytest.mark.parametrize(
    ("out", "message"),
    [
        ("p.pdf", "p.pdf: expected a name that ends in .svg, .png"),
        ("no/such/p.svg", "no/such/p.svg: there is no folder no/such"),
        ("a.csv/p.svg", "a.csv/p.svg: there is no folder a.csv"),
        ("folder.svg", "folder.svg: is a folder; expected a file's name"),
    ],
)
def test_a_picture_that_cannot_be_written_is_refused_before_anything_is_computed(
    files, capsys, monkeypatch, out, message
):
    monkeypatch.chdir(files)
    monkeypatch.setattr("solvers.cli.register.register", None)
    Path("folder.svg").mkdir()
    assert call(capsys, "a.csv", "b.xyz", "--out", out) == (2, "", f"python -m solvers: --out: {message}\n")
    assert not Path(out).is_file()


@pytest.mark.parametrize(("out", "target"), [("p.svg", "."), ("old.svg", "old.svg")])
def test_a_place_where_nothing_may_be_written_is_told_before_anything_is_computed(
    files, capsys, monkeypatch, out, target
):
    """The test's user may be allowed to write anywhere, so the system's answer is faked: for the file to be replaced,
    or else its folder."""
    monkeypatch.chdir(files)
    monkeypatch.setattr("solvers.cli.register.register", None)
    Path("old.svg").touch()
    monkeypatch.setattr("os.access", lambda path, mode: (str(path), mode) != (target, os.W_OK))
    message = f"python -m solvers: --out: {out}: no permission to write there\n"
    assert call(capsys, "a.csv", "b.xyz", "--out", out) == (2, "", message)


@pytest.mark.parametrize(
    ("error", "detail"), [(MemoryError(), ""), (MemoryError("Unable to allocate 7 TiB"), ": Unable to allocate 7 TiB")]
)
def test_too_little_memory_is_one_line(files, capsys, monkeypatch, error, detail):
    """The error is faked, since a system that overcommits memory would kill the test instead."""

    def hungry(*_, **__):
        raise error

    monkeypatch.setattr("solvers.cli.register.register", hungry)
    answer = call(capsys, files / "a.csv", files / "b.xyz")
    assert answer == (2, "", f"python -m solvers: there is not enough memory{detail}\n")


@pytest.mark.parametrize("unit", [1e-149, 1e149])
def test_clouds_of_any_size_have_a_reach_of_their_own(files, capsys, unit):
    """The reach may even be one that --reach would refuse: `register` takes such clouds without any complaint about
    it."""
    for name in ("a.csv", "b.xyz"):
        points = clouds.read((files / name).read_bytes()).points * (0.1 * unit)
        (files / name).write_text("\n".join(" ".join(map(repr, row)) for row in points.tolist()), "utf-8")
    code, out, err = call(capsys, files / "a.csv", files / "b.xyz", "--method", "gicp", "--json")
    assert (code, err) == (0 if unit > 1.0 else 3, "")  # too narrow: the method's status says so
    assert json.loads(out)["reach"] == pytest.approx(0.1 * unit * usual_reach(room("noise", seed=40).target), rel=1e-9)
