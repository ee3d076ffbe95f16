"""The repository's results of long plots: rerun in several processes, reported if stale, and checked by a sample."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import pytest

from sitegen.cache import pool
from sitegen.figures.gallery import Plot
from sitegen.pipeline import plot_parts
from sitegen.pipeline.plot_parts import alike, renew, sample, standing
from sitegen.plots.registry import all_plots
from sitegen.progress import quiet

NAME = "graduated"


@pytest.fixture
def plots(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> dict[str, Plot]:
    """One of the site's plots with two of its parts, and nothing kept."""
    plot = all_plots()[NAME]
    assert plot.parts is not None
    small = replace(plot.parts, arguments=(("graduated", 0.1), ("graduated", 0.8)), file=tmp_path / "graduated.json")
    few = {NAME: replace(plot, parts=small)}
    monkeypatch.setattr(plot_parts, "long_plots", lambda: few)
    return few


def test_stale_parts_are_run_over_processes(plots: dict[str, Plot]) -> None:
    """Missing parts are run, existing ones are not, and each part gives the same result as by itself."""
    parts = plots[NAME].parts
    assert parts is not None
    assert renew(["another"], 2, quiet) == []
    assert not parts.file.exists()
    assert renew([NAME], 2, quiet) == [NAME]
    assert parts.stored() == {key: parts.run(key) for key in parts.arguments}
    before = parts.file.stat().st_mtime_ns
    assert renew([NAME], 2, quiet) == []
    assert parts.file.stat().st_mtime_ns == before


def test_a_part_that_fails_is_told_and_nothing_is_written(plots: dict[str, Plot]) -> None:
    parts = plots[NAME].parts
    assert parts is not None
    plots[NAME] = replace(plots[NAME], parts=replace(parts, arguments=(*parts.arguments, ("graduated", "none"))))
    with pytest.raises(pool.PieceFailed):
        renew([NAME], 2, quiet)
    assert not parts.file.exists()


def test_kept_parts_are_proved_or_said_to_be_stale(plots: dict[str, Plot], tmp_path: Path) -> None:
    """A part is run again and agrees, once per state of the file; a false count is wrong; other code is stale."""
    parts = plots[NAME].parts
    assert parts is not None
    (stale,) = standing(plots).stale
    assert "graduated.json:0:0: stale" in str(stale)
    assert "sweep --only graduated" in str(stale)
    renew([NAME], 2, quiet)
    assert (standing(plots).wrong, standing(plots).stale, standing(plots).proved) == ((), (), 1)

    cache = tmp_path / "cache"
    assert standing(plots, cache).proved == 1
    variant = {NAME: replace(plots[NAME], parts=replace(parts, part=lambda *key: -1))}
    assert standing(variant, cache).proved == 1, "what was proved is remembered"
    assert standing(variant).wrong

    data = json.loads(parts.file.read_text("utf-8"))
    data["parts"] = {name: count + 2 for name, count in data["parts"].items()}
    parts.file.write_text(json.dumps(data), "utf-8")
    (wrong,) = standing(plots, cache).wrong
    assert "the same code gives" in str(wrong)

    parts.file.write_text(json.dumps({**data, "code": "older"}), "utf-8")
    assert standing(plots).stale
    assert not standing(plots).wrong


def test_the_sample_depends_on_what_was_found() -> None:
    """Other results lead to another sample, so every part has its turn."""
    samples = {sample({("a", k): k * n for k in range(5)}) for n in range(100)}
    assert samples == {("a", k) for k in range(5)}


@pytest.mark.parametrize(
    ("a", "b", "same"),
    [
        (5, 6, True), (5, 7, False), (0.5, 0.5004, True), (0.5, 0.502, False), (3, None, False), (None, None, True),
        ({"a": [5, 0.1]}, {"a": [4, 0.1]}, True), ({"a": [5, 0.1]}, {"b": [5, 0.1]}, False), ([1], [1, 1], False),
    ],
)  # fmt: skip
def test_counts_may_differ_by_one_and_measures_by_a_thousandth(a: object, b: object, same: bool) -> None:
    assert alike(a, b) is same
    assert alike(b, a) is same
