"""`python -m solvers drive FILE`: what it prints, writes and refuses."""

from __future__ import annotations

import json
import re
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest

from solvers.cli.command import main
from solvers.io import g2o
from solvers.scenes.drive import Drive, telecom_loop
from solvers.scenes.simulated_drive import simulated_drive

pytestmark = pytest.mark.native


def as_csv(drive: Drive) -> str:
    """A drive as a CSV file, with its ranges in whole centimetres, as a laser reports them."""
    names = ["seconds", "dx_m", "dy_m", "dphi_rad", *(f"r{k}" for k in range(len(drive.bearings)))]
    centimetres = np.where(np.isinf(drive.ranges), 0, np.rint(100 * drive.ranges))
    rows = np.column_stack([drive.seconds, drive.motion.t, drive.motion.angle, centimetres]).tolist()
    return "\n".join([",".join(names), *(",".join(f"{v:.9g}" for v in row) for row in rows)]) + "\n"


@pytest.fixture(scope="module")
def table(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A simulated drive as a file, rounded to centimetres like a real one."""
    path = tmp_path_factory.mktemp("drive") / "drive.csv"
    path.write_text(as_csv(simulated_drive(scans=70, beams=181)[0]), "utf-8")
    return path


def call(capsys: pytest.CaptureFixture[str], *arguments: object) -> tuple[int, str, str]:
    code = main(["drive", *map(str, arguments)])
    streams = capsys.readouterr()
    return code, streams.out, streams.err


def test_ranges_in_metres_are_suspected(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """ROS gives metres; read as centimetres, a room is as small as a cup."""
    path = tmp_path / "metres.csv"
    head, *rows = as_csv(simulated_drive(scans=3, beams=31)[0]).split()
    metres = [",".join([*row.split(",")[:4], *(f"{float(r) / 100:g}" for r in row.split(",")[4:])]) for row in rows]
    for lines, suspected in ((rows, False), (metres, True)):
        path.write_text("\n".join([head, *lines]), "utf-8")
        out = call(capsys, path, "--no-loops")[1]
        assert ("; a CSV's ranges are centimetres, not metres\n" in out) is suspected


def test_a_drive_becomes_a_map_a_graph_and_poses(
    table: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    outs = [tmp_path / name for name in ("map.svg", "map.png", "graph.g2o", "poses.csv")]
    code, out, err = call(capsys, table, "--ahead", 0.3, *(word for path in outs for word in ("--out", path)))
    assert (code, err) == (0, "")
    assert "70 scans of 181 beams" in out
    assert "69 of 69 scans matched to the scan before" in out
    assert "graph     converged" in out
    ElementTree.fromstring(outs[0].read_text("utf-8"))
    assert outs[1].read_bytes().startswith(b"\x89PNG")
    graph = g2o.read(outs[2].read_bytes())
    poses = np.loadtxt(outs[3], delimiter=",", skiprows=1)
    assert np.allclose(graph.poses.t, poses[:, 1:3], atol=1e-6)
    assert len(graph.edges) > 69
    assert graph.fixed.tolist() == [0]


def test_without_loops_there_is_no_graph(table: Path, capsys: pytest.CaptureFixture[str]) -> None:
    code, out, _ = call(capsys, table, "--no-loops")
    assert code == 0
    assert "loops" not in out
    assert "graph" not in out


def test_json_says_what_the_lines_say(table: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    code, out, err = call(capsys, table, "--json", "--out", tmp_path / "poses.csv")
    report = json.loads(out)
    assert (code, err) == (0, "")
    assert (report["scans"], report["beams"], report["not_matched"]) == (70, 181, [])
    assert 10.0 < report["farthest"] <= 12.0  # the simulated laser's range
    assert report["graph"]["status"] == "converged"
    assert 0 < report["loops"] <= report["candidates"]
    *_, last = np.loadtxt(tmp_path / "poses.csv", delimiter=",", skiprows=1)
    assert report["end"]["translation"] == pytest.approx(last[1:3].tolist(), abs=1e-6)
    assert np.radians(report["end"]["angle_degrees"]) == pytest.approx(last[3], abs=1e-6)


def test_scans_that_are_not_matched_are_exit_code_3(table: Path, capsys: pytest.CaptureFixture[str]) -> None:
    code, out, _ = call(capsys, table, "--no-loops", "--gate", 1e-3, "--json")
    report = json.loads(out)
    assert code == 3
    assert report["not_matched"]


@pytest.mark.parametrize("to", ["scan", "map"])
def test_a_scan_without_echoes_is_only_predicted(
    to: str, table: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The drive is still processed to the end, and its files are written."""
    path = tmp_path / "gap.csv"
    lines = table.read_text("utf-8").splitlines()
    lines[31] = ",".join([*lines[31].split(",")[:4], *["0"] * 181])
    path.write_text("\n".join(lines), "utf-8")
    code, out, err = call(capsys, path, "--ahead", 0.3, "--to", to, "--out", tmp_path / "map.svg")
    assert (code, err) == (3, "")
    assert f"predicted only: {'30, 31' if to == 'scan' else '30'}\n" in out
    assert (tmp_path / "map.svg").exists()
    path.write_text("\n".join([lines[0], *[lines[31]] * 5]), "utf-8")
    code, _, err = call(capsys, path)
    assert code == 2
    assert "none of 5 scans has three echoes" in err


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["nowhere.csv"], "nowhere.csv: No such file"),
        (["telecom-loop", "--out", "map.gif"], "expected a name that ends in .svg, .png, .g2o, .csv"),
        (["telecom-loop", "--out", "no/such/poses.csv"], "--out: no/such/poses.csv: there is no folder no/such"),
        (["telecom-loop", "--gate", "-1"], "gate"),
        (["telecom-loop", "--farthest", "0"], "--farthest"),
        (["telecom-loop", "--radius", "-1"], "radius"),
        (["telecom-loop", "--turns", "-1"], "--turns: must be at least 0, got -1"),
        (["drive.csv", "--turns", "-1"], "--turns: must be at least 0, got -1"),
        (["telecom-loop", "--turns", "3"], "--turns: describes the laser of a file; telecom-loop has its own"),
        (["telecom-loop", "--view", "nan"], "--view: describes the laser of a file"),
        (["telecom-loop", "--hertz", "-1"], "--hertz: describes the laser of a file"),
        (["telecom-loop", "--ahead", "0.78"], "--ahead: describes the laser of a file"),
    ],
)
def test_what_cannot_be_done_is_told_with_code_2(
    arguments: list[str], words: str, capsys: pytest.CaptureFixture[str]
) -> None:
    code, out, err = call(capsys, *arguments)
    assert (code, out) == (2, "")
    assert words in err
    assert err.startswith("python -m solvers: ")


def test_a_line_that_is_wrong_is_named(table: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "broken.csv"
    lines = table.read_text("utf-8").splitlines()
    path.write_text("\n".join([*lines[:5], "1,2,3", *lines[5:]]), "utf-8")
    code, _, err = call(capsys, path)
    assert code == 2
    assert "line 6: 3 fields found; expected 185" in err


def test_the_recorded_drive_from_a_file_is_the_one_included(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Given the laser's mounting and rotation, the command reports the same for the file as for the included drive, and
    what the chapter says. Without them, the robot's poses, and so the loop candidates, are the laser's."""
    path, poses = tmp_path / "recorded.csv", tmp_path / "poses.csv"
    path.write_text(as_csv(telecom_loop()), "utf-8")
    code, reference, _ = call(capsys, "telecom-loop")
    assert code == 0
    assert "225 scans of 361 beams over 180 deg, 11.5 % without echo, the farthest echo at 58.04 m\n" in reference
    assert "224 of 224 scans matched" in reference
    assert "loops     55 of 55 candidates accepted" in reference
    assert "loop gap  0.106 m" in reference
    code, out, _ = call(capsys, path, "--ahead", 0.78, "--turns", 2, "--out", poses)
    assert code == 0
    assert out.splitlines()[1:-1] == reference.splitlines()[1:]
    assert len(np.loadtxt(poses, delimiter=",", skiprows=1)) == 225


def test_a_bar_grows_in_small_pieces_on_a_terminal(
    table: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Matching, loops and graph each have a bar that is drawn at least three times and cleared before the next line."""
    monkeypatch.setattr("sys.stderr.isatty", lambda: True)
    answer = call(capsys, table, "--ahead", 0.3)
    parts = answer[2].split("\r\033[K")
    assert parts.pop() == ""
    assert [part.split()[0].lstrip("\r") for part in parts] == ["matching", "closing", "graph"]
    for part in parts:
        hits = [re.fullmatch(r"[a-z ]+ \[(#*) *\] (\d+)/(\d+)", text) for text in part.split("\r")[1:]]
        counts = [(len(hit[1]), int(hit[2]), int(hit[3])) for hit in hits if hit]
        assert len(counts) == len(hits) >= 3
        assert counts == sorted(counts)
        assert all(bars == 30 * done // total for bars, done, total in counts)
        assert part is parts[2] or counts[-1][0] == 30  # the graph's bar may stop early


def test_the_picture_shows_the_map_before_and_after(
    table: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Two panels of one drive with different paths: by odometry, and with loops closed, or matched if there are
    none."""
    map_path, chain_path = tmp_path / "closed.svg", tmp_path / "chained.svg"
    assert call(capsys, table, "--ahead", 0.3, "--out", map_path)[0] == 0
    assert call(capsys, table, "--ahead", 0.3, "--no-loops", "--out", chain_path)[0] == 0
    for path, names in (
        (map_path, ("Before: by odometry", "After: loops closed")),
        (chain_path, ("By odometry", "By matched scans")),
    ):
        text = path.read_text("utf-8")
        first, second = (re.findall(rf'<g id="way-{k}">\s*<path d="([^"]*)"', text) for k in (0, 1))
        assert all(name in text for name in names)
        assert len(first) == len(second) == 1
        assert first != second
        assert all(f'id="map-{k}"' in text for k in (0, 1))
