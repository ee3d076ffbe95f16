"""Long plots' parts: read from the repository while they match the code, else run; and the files are complete."""

from __future__ import annotations

import json
import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from sitegen.figures.parts import Parts, named
from sitegen.pipeline.plot_parts import long_plots
from sitegen.plots import registry


@pytest.fixture
def parts(tmp_path: Path) -> Parts:
    """Squares of three numbers, and their sum."""
    keys = (("a", 1), ("a", 2), ("b", 3))
    file = tmp_path / "sums.json"
    return Parts(
        keys, lambda name, k: (k * k, name), lambda results: sum(k for k, _ in results.values()), lambda: "code", file
    )


def fail(*key: Any) -> Any:
    raise AssertionError(f"{key} was run")


def test_what_is_kept_is_not_run(parts: Parts) -> None:
    """Without a file the parts are run; with one none is run, and the result is the same."""
    assert parts.stored() is None
    assert parts.result() == 14
    results = {key: parts.run(key) for key in parts.arguments}
    assert results["a", 2] == [4, "a"], "as it comes from a file"
    parts.store(results)
    second = replace(parts, part=fail)
    assert second.stored() == results
    assert second.result() == 14


def test_a_file_that_a_merge_has_damaged_is_as_one_of_other_code(parts: Parts) -> None:
    """The parts are run, and `store` writes a whole file again."""
    results = {key: parts.run(key) for key in parts.arguments}
    parts.store(results)
    parts.file.write_text(parts.file.read_text("utf-8").replace('"a 2"', '<<<<<<< ours\n"a 2"'), "utf-8")
    assert parts.stored() is None
    assert parts.result() == 14
    parts.store(results)
    assert parts.stored() == results


@pytest.mark.parametrize(
    "change",
    [{"code": lambda: "other"}, {"arguments": (("a", 1), ("a", 2))}, {"arguments": (("a", 1), ("a", 2), ("b", 4))}],
    ids=["code", "a part less", "another part"],
)
def test_other_code_and_other_parts_are_run(parts: Parts, change: dict[str, Any]) -> None:
    parts.store({key: parts.run(key) for key in parts.arguments})
    assert parts.stored() is not None
    assert replace(parts, **change).stored() is None


def test_another_numpy_is_run(parts: Parts) -> None:
    parts.store({key: parts.run(key) for key in parts.arguments})
    data = json.loads(parts.file.read_text("utf-8"))
    parts.file.write_text(json.dumps({**data, "numpy": "1.0"}), "utf-8")
    assert parts.stored() is None


@pytest.mark.parametrize("name", long_plots())
def test_the_files_in_the_repository_are_whole(name: str) -> None:
    """One line per part, in their order, without duplicate names; and the plot's result is made from them."""
    plot = long_plots()[name]
    parts = plot.parts
    assert parts is not None
    names = [named(key) for key in parts.arguments]
    assert len(set(names)) == len(names)
    report = json.loads(parts.file.read_text("utf-8"))["parts"]
    assert list(report) == names
    assert plot.compute == parts.result
    assert isinstance(parts.whole({key: report[named(key)] for key in parts.arguments}), plot.result)
    assert len(parts.file.read_text("utf-8").splitlines()) == len(names) + 2


def test_words_make_no_part_stale_and_code_does(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """In the solvers that a plot runs, a comment does not count; a statement does, and so does a trained network."""
    shutil.copytree(registry.ROOT / "solvers", tmp_path / "solvers", ignore=shutil.ignore_patterns("__pycache__"))
    source = (registry.FOLDER / "four_reach.py").read_text("utf-8")
    monkeypatch.setattr(registry, "ROOT", tmp_path)

    def code() -> str:
        registry._code.cache_clear()
        return registry.runs(source, ("part", "PARTS"), words=False)

    def edit(name: str, more: bytes) -> None:
        path = tmp_path / "solvers" / name
        path.write_bytes(path.read_bytes() + more)

    first = code()
    edit("methods/soft/cpd.py", b"\n# a comment\n")
    assert code() == first
    edit("methods/ndt/ndt.py", b"\nNEW = 1\n")
    assert code() == first, "no plot of NDT"
    edit("methods/flow/trained/flow.int8", b"1")
    second = code()
    assert second != first
    edit("methods/soft/cpd.py", b"\nNEW = 1\n")
    assert code() != second
