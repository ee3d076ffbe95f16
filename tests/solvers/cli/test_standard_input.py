"""A cloud or a drive from standard input, under the name `-`."""

from __future__ import annotations

import io
import json
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from solvers.cli.command import main
from solvers.scenes.rooms import room

pytestmark = pytest.mark.native
Piped = Callable[..., tuple[int, str, str]]


@pytest.fixture
def piped(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Piped:
    """Run the command with bytes on standard input; None: it is closed."""

    def run(data: bytes | None, *arguments: object) -> tuple[int, str, str]:
        monkeypatch.setattr(sys, "stdin", None if data is None else io.TextIOWrapper(io.BytesIO(data)))
        code = main([str(argument) for argument in arguments])
        streams = capsys.readouterr()
        return code, streams.out, streams.err

    return run


@pytest.fixture
def clouds(tmp_path: Path) -> tuple[Path, Path]:
    scene = room("noise", seed=40)
    paths = tmp_path / "source.npy", tmp_path / "target.npy"
    for path, points in zip(paths, (scene.source, scene.target), strict=True):
        np.save(path, points)
    return paths


def test_either_cloud_may_come_from_standard_input(piped: Piped, clouds: tuple[Path, Path]) -> None:
    source, target = clouds
    answers = [
        piped(b"", source, target, "--json"),
        piped(source.read_bytes(), "-", target, "--json"),
        piped(target.read_bytes(), "register", source, "-", "--json"),
    ]
    assert [(code, err) for code, _, err in answers] == [(0, "")] * 3
    poses = [json.loads(out)["matrix"] for _, out, _ in answers]
    assert poses[1] == poses[2] == poses[0]


def test_what_is_wrong_is_told_of_the_dash(piped: Piped, clouds: tuple[Path, Path]) -> None:
    """Empty, too long, and closed by the caller."""
    _, target = clouds
    empty = "line 1: no line with numbers was found; expected x and y, or x, y and z, on every line"
    for data, names, message in (
        (b"", ("-", target), empty),
        (bytes(24_000_001), ("-", target), "it has more than the limit of 24 MB"),
        (None, ("-", target), "standard input is closed"),
    ):
        assert piped(data, *names) == (2, "", f"python -m solvers: -: {message}\n")


def test_both_clouds_cannot_come_from_standard_input(piped: Piped, clouds: tuple[Path, Path]) -> None:
    told = "SOURCE, TARGET: standard input holds one cloud; give - for one and a file for the other"
    assert piped(clouds[0].read_bytes(), "-", "-") == (2, "", f"python -m solvers: {told}\n")


def test_a_drive_may_come_from_standard_input(piped: Piped) -> None:
    """Three scans of the middle of a square room, the robot at rest."""
    bearings = np.linspace(-np.pi / 2, np.pi / 2, 181)
    walls = 300.0 / np.maximum(np.abs(np.cos(bearings)), np.abs(np.sin(bearings)))
    rows = [["seconds", "dx_m", "dy_m", "dphi_rad", *(f"r{k}" for k in range(181))]]
    rows += [[f"{k}", "0", "0", "0", *(f"{wall:.0f}" for wall in walls)] for k in range(3)]
    code, out, err = piped("\n".join(map(",".join, rows)).encode(), "drive", "-", "--no-loops", "--json")
    assert (code, err) == (0, "")
    assert json.loads(out)["scans"] == 3
