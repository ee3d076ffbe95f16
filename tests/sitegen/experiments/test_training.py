"""The training of the learned flows, without PyTorch: its scenes, its comparison, its message where it cannot run."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import numpy as np
import pytest

from sitegen.experiments import training
from solvers import fit_rigid


def test_the_network_is_taught_a_rigid_motion_of_what_it_is_given() -> None:
    source, target, true = training.batch(training.SEED)
    fit = fit_rigid(source, true)
    assert fit.pose.apply(source) == pytest.approx(true, abs=1e-9)
    assert np.degrees(np.abs(fit.pose.angle)).max() <= 90
    assert (target**2).sum(-1).mean(-1) == pytest.approx(1.0)
    assert np.abs(target.mean(axis=1)).max() < 1e-12


def test_another_seed_is_another_batch() -> None:
    first, twin, second = (training.batch(seed)[0] for seed in (1000, 1000, 1021))
    assert (first == twin).all()
    assert np.abs(first - second).max() > 0.1


def test_studies_that_differ_by_more_than_the_bound_are_told() -> None:
    entries = [{"variant": "flow", "kind": "k", "count": 200, "turned": 150, "placed": 140}]
    assert training.differences(entries, [{**entries[0], "turned": 121, "placed": 169}]) == []
    report = training.differences(entries, [{**entries[0], "turned": 119}])
    assert report == ["flow, k: turned was 150 of 200, now 119"]


def test_the_second_training_that_was_noted_is_within_the_bounds() -> None:
    log = json.loads((training.KEPT / "log.json").read_text("utf-8"))
    assert log["again"]["seed"] == training.OTHER_SEED
    assert training.differences(log["held_out"], log["again"]["held_out"]) == []


def test_without_pytorch_the_command_says_what_it_needs(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    monkeypatch.setitem(sys.modules, "torch", None)
    assert training.train_command(tmp_path) == 2
    assert "torch==" in capsys.readouterr().out
    assert not list(tmp_path.iterdir())
