"""`sweep` knows the race's sweeps and the long plots by name, and runs those that are requested."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from sitegen.cli import main, sweep


def test_names_that_are_none_are_told(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert sweep.sweep(tmp_path, 1, "", ["tabel"], ["icpp"]) == 2
    output = capsys.readouterr().err
    assert "unknown icpp, tabel; known: table, basins, curves, coarse-to-fine, coverage, " in output
    assert ", trial-budget, icp, " in output
    assert main.parse(["sweep", "--only", "table", "--processes", "2"]).only == "table"


def test_a_plot_is_not_asked_for_by_methods(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert sweep.sweep(tmp_path, 1, "", ["table", "four-reach"], ["icp"]) == 2
    assert capsys.readouterr().err == "sweep: --methods cannot be combined with four-reach: a plot runs whole\n"


@pytest.mark.parametrize(
    ("words", "sweeps", "plots"),
    [
        ([], ["table", "basins", "curves"], True),
        (["--only", "basins,four-reach"], ["basins"], ["four-reach"]),
        (["--only", "four-reach"], [], ["four-reach"]),
        (["--methods", "icp"], ["table", "basins", "curves"], []),
    ],
)
def test_what_is_asked_for_is_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, words: list[str], sweeps: list[str], plots: Any
) -> None:
    """By default all of both; a plot needs several methods, so naming methods runs no plot."""
    runs: list[str] = []
    updates: list[str] = []

    def run(root: Path, item: Any, *rest: Any) -> None:
        runs.append(item.name)
        (root / sweep.FOLDER).mkdir(parents=True, exist_ok=True)
        (root / sweep.FOLDER / f"{item.name}.json").write_text("{}")

    def renew(names: list[str], *rest: Any) -> list[str]:
        updates.extend(names)
        return names

    monkeypatch.setattr(sweep, "run", run)
    monkeypatch.setattr(sweep, "renew", renew)
    assert main.run(tmp_path, main.parse(["sweep", *words])) == 0
    assert runs == sweeps
    assert updates == (list(sweep.long_plots()) if plots is True else plots)
