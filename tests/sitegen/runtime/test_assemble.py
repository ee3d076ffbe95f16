"""The runtime: the same bytes each time, small, complete, and with our wheel as pip installs it."""

from __future__ import annotations

import ast
import gzip
import hashlib
import io
import json
import os
import shutil
import subprocess
import sys
import tomllib
import zipfile
from email import message_from_bytes
from pathlib import Path
from types import CodeType
from typing import Any

import numpy as np
import pytest

import solvers
from sitegen.cache.files import cache_dir
from sitegen.external.fetch import gather
from sitegen.external.node import NodeError, run_node
from sitegen.runtime import wheel
from sitegen.runtime.assemble import RUNNER, RuntimeInfo, assemble, kept_modules, module_name
from sitegen.runtime.compile_in_pyodide import Bare, change, on_one_line
from sitegen.runtime.wheel import build_wheel
from tests.pyodide.inside import run_python_in_shipped_runtime
from widgets.engine.registry import WIDGETS
from widgets.engine.script import WHEEL

MOST = 6_200_000  # the most bytes, by gzip -9, that a reader may have to load


@pytest.fixture(scope="module")
def info() -> RuntimeInfo:
    return assemble()


def pack(info: RuntimeInfo, name: str) -> zipfile.ZipFile:
    (file,) = [file for file in (*info.files, *info.later) if file.name.endswith(f"/{name}.pack")]
    return zipfile.ZipFile(io.BytesIO(gzip.decompress(info.contents[file.name])))


def test_files_are_what_is_said_of_them_and_small_enough(info: RuntimeInfo) -> None:
    for file in (*info.files, *info.later):
        data = info.contents[file.name]
        assert len(data) == file.size
        assert hashlib.sha256(data).hexdigest() == file.sha256
        assert len(data if data[:2] == b"\x1f\x8b" else gzip.compress(data, 9)) == pytest.approx(file.gzipped, rel=0.02)
    assert info.contents.keys() == {file.name for file in (*info.files, *info.later)} | {info.wheel}
    assert info.gzipped <= MOST
    assert [entry["name"] for entry in info.start_files()] == [file.name for file in info.files]


def test_a_second_build_from_an_empty_cache_gives_the_same_bytes(info: RuntimeInfo, tmp_path: Path) -> None:
    cache = tmp_path / "cache"
    cache.mkdir()
    gather(["numpy", "pyodide"])
    (cache / "outside").symlink_to(cache_dir() / "outside", target_is_directory=True)
    assert assemble(cache=cache) == info


def test_packs_hold_bytecode_alone_dated_alike(info: RuntimeInfo) -> None:
    shipped = kept_modules()
    packs = [Path(file.name).stem for file in (*info.files, *info.later) if file.name.endswith(".pack")]
    ours: list[str] = []
    for name in packs:
        with pack(info, name) as members:
            for member in members.infolist():
                assert member.date_time == (1980, 1, 1, 0, 0, 0)
                assert member.compress_type == zipfile.ZIP_STORED
                assert member.create_system == 3, "else the archive tells on which system it was made"
                kinds = (".modules", ".dataclasses", ".pyc", ".so", ".int8", ".scans", ".f4", "LICENSE.txt", "METADATA")
                assert member.filename.endswith((*kinds, "py.typed"))
            names = members.namelist()
            (bundle,) = [n for n in names if n.endswith(".modules")]
            index, _, code = members.read(bundle).partition(b"\n\n")
        assert names == sorted(names)
        modules = dict(line.split(" ") for line in index.decode().split("\n"))
        assert sum(map(int, modules.values())) == len(code), "the index tells where each module's code is"
        files = {n for n in names if n.endswith((".pyc", ".so"))}
        assert not {n.removesuffix(".pyc") for n in files} & set(modules)
        if name not in ("python_stdlib", "numpy"):
            assert not files
            ours += modules
        else:
            assert {module_name(n) for n in files} | {module_name(f"{n}.pyc") for n in modules} <= shipped
    command_line = ("solvers/cli/", "solvers/__main__")  # not run by any page
    sources = [n.removesuffix(".py") for n in wheel.sources() if n.endswith(".py")]
    assert sorted(ours) == sorted(n for n in sources if not n.startswith(command_line)), "each module is in one pack"
    assert not [name for name in shipped if ".tests" in name or ".f2py" in name or ".testing" in name]


def test_what_comes_later_is_listed_with_what_it_holds(info: RuntimeInfo) -> None:
    """A start loads no figure, trained network or drive; the list names the packs with them, and their hashes."""
    (data,) = [info.contents[file.name] for file in info.files if file.name.endswith("/later.json")]
    by_name = {entry["name"]: entry for entry in json.loads(data)}
    assert by_name.keys() == {file.name for file in info.later}
    holds = {top: Path(name).stem for name, entry in by_name.items() for top in entry["holds"]}
    assert holds["solvers.methods.flow"] == "flow"
    assert holds["solvers.posegraph"] == holds["solvers.odometry"] == "drive"
    assert holds["solvers.uncertainty"] == "uncertainty"
    assert {f"widgets.figures.{name.replace('-', '_')}" for name in WIDGETS} <= holds.keys()
    with pack(info, "ladder") as members:
        names = [*members.namelist(), *members.read("ladder.modules").partition(b"\n\n")[0].decode().split()]
    tops = tuple(f"{top}." for top in holds)
    assert not [name for name in names if (".".join(name.split("/")) + ".").startswith(tops)]
    for name, entry in by_name.items():
        assert entry["sha256"] == hashlib.sha256(info.contents[name]).hexdigest()


def test_the_lock_names_our_packages_with_the_hashes_of_their_packs(info: RuntimeInfo) -> None:
    (lock,) = [file for file in info.files if file.name.endswith("pyodide-lock.json")]
    packages = json.loads(info.contents[lock.name])["packages"]
    assert sorted(packages) == ["numpy", "registration-ladder"]
    for package, name in (("numpy", "numpy"), ("registration-ladder", "ladder")):
        (file,) = [file for file in info.files if file.name.endswith(f"/{name}.pack")]
        data = gzip.decompress(info.contents[file.name])
        assert packages[package]["sha256"] == hashlib.sha256(data).hexdigest()
    assert packages["registration-ladder"]["file_name"] == Path(info.wheel).name


def test_no_dataclass_is_compiled_in_the_page(info: RuntimeInfo) -> None:
    code = """
import dataclasses, json

class Watched(dict):
    def get(self, text):
        if text not in self:
            missed.append(text)
        return dict.get(self, text)

def main(text):
    global missed
    missed = []
    dataclasses._PREPARED = Watched(dataclasses._PREPARED)
    import solvers, widgets.engine.host
    return json.dumps([len(dataclasses._PREPARED), missed])
"""
    classes, misses = run_python_in_shipped_runtime(code, info=info)
    assert classes > 0
    assert misses == []


def test_the_start_brings_nothing_that_a_page_does_not_use(info: RuntimeInfo) -> None:
    """The imports of Pyodide, numpy and our packages, after a median and a unique, for which stock numpy needs more."""
    code = """
import json, sys

def main(text):
    import numpy as np
    import solvers, widgets.engine.host
    np.median(np.arange(5.0)), np.unique(np.arange(5))
    return json.dumps(sorted(sys.modules))
"""
    modules = set(run_python_in_shipped_runtime(code, info=info))
    assert not modules & {"annotationlib", "ast", "dis", "logging", "numpy.ma", "pickle", "subprocess", "tokenize"}


def test_a_figure_that_fails_tells_where(info: RuntimeInfo) -> None:
    """The traceback's modules are imported at the first error, and it names our file and line."""
    code = """
import json, traceback

def main(text):
    from widgets.engine.host import Host
    try:
        Host().frame(json.dumps({"figure": "f", "record": {"widget": "kabsh"}}))
    except ValueError as error:
        return json.dumps("".join(traceback.format_exception(error)))
"""
    text = run_python_in_shipped_runtime(code, info=info)
    assert 'File "/lib/python3.14/site-packages/widgets/engine/host.py", line ' in text
    assert "ValueError: no widget 'kabsh'" in text
    assert "kabsch" in text


def test_a_line_to_be_changed_must_be_there_once() -> None:
    assert change("m.py", "a\nb\n", [("b", "c"), ("a", "e")], "d\n") == "e\nc\nd\n"
    with pytest.raises(ValueError, match=r"m\.py: expected this line once, got it 2 times"):
        change("m.py", "b\nb\n", [("b", "c")], "")


def test_the_page_s_numpy_is_the_build_s() -> None:
    """The wheel pinned for pages is of the version that draws the build's figures."""
    (wheel_name,) = [Path(key).name for key in gather(["numpy"], cache=cache_dir()) if key.endswith(".whl")]
    assert wheel_name.split("-")[1] == np.__version__


def test_our_wheel_installs_and_holds_the_sources(info: RuntimeInfo, tmp_path: Path) -> None:
    wheel_path = info.write(tmp_path / "runtime") / info.wheel
    with zipfile.ZipFile(wheel_path) as archive:
        inside = {n: archive.read(n) for n in archive.namelist() if ".dist-info/" not in n}
        names = {n.rpartition("/")[2]: n for n in archive.namelist() if ".dist-info/" in n}
        metadata = message_from_bytes(archive.read(names["METADATA"]))
    assert inside == wheel.sources()
    assert {"solvers/py.typed", "solvers/_functions.pyi"} <= inside.keys()  # without the second, its types are unknown
    assert wheel_path.name == WHEEL
    assert (metadata["Name"], metadata["Version"]) == ("registration-ladder", solvers.__version__)
    package = tomllib.loads((wheel.ROOT / "pyproject.toml").read_text("utf-8"))["project"]
    extras = [f'{spec}; extra == "{name}"' for name, all in package["optional-dependencies"].items() for spec in all]
    assert metadata.get_all("Requires-Dist") == [*package["dependencies"], *extras]
    facts = (package["requires-python"], package["license"], package["name"])
    assert (metadata["Requires-Python"], metadata["License-Expression"], metadata["Name"]) == facts
    assert metadata["Summary"]
    pip = [sys.executable, "-P", "-m", "pip", "install", "--quiet", "--no-deps", "--no-index"]
    subprocess.run([*pip, "--target", str(tmp_path / "site"), str(wheel_path)], check=True, cwd=tmp_path)
    # The learned flow reads its weights, which are in the wheel.
    code = """
import numpy as np, solvers, widgets
print(solvers.register(np.eye(2), np.eye(2), "kabsch").status, solvers.__file__)
print(solvers.register(np.random.default_rng(1).normal(size=(20, 2)), np.eye(2), "flow", seed=1).steps)
"""
    env = {**os.environ, "PYTHONPATH": str(tmp_path / "site")}
    command = [sys.executable, "-c", code]
    output = subprocess.run(command, env=env, cwd=tmp_path / "site", capture_output=True, text=True, check=True).stdout
    assert str(tmp_path / "site") in output
    assert output.splitlines()[1] == "10"


def test_the_wheel_is_kept_until_a_source_changes(tmp_path: Path) -> None:
    root = tmp_path / "checkout"
    for name in ("solvers", "widgets", "widgets/figures"):
        (root / name).mkdir(parents=True)
        (root / name / "__init__.py").write_text('__version__ = "1.2"\n', "utf-8")
        (root / name / "py.typed").touch()
    licence = "solvers/scenes/recorded/telecom-loop.LICENSE.txt"
    (root / licence).parent.mkdir(parents=True)
    shutil.copy(wheel.ROOT / licence, root / licence)
    (root / "LICENSE").write_text("A licence.", "utf-8")
    first = build_wheel(tmp_path / "cache", root)
    assert first.name == "registration_ladder-1.2-py3-none-any.whl"
    assert build_wheel(tmp_path / "cache", root) == first
    (root / "solvers" / "__init__.py").write_text('__version__ = "1.3"\n', "utf-8")
    assert build_wheel(tmp_path / "cache", root).name == "registration_ladder-1.3-py3-none-any.whl"
    assert not [p for p in root.rglob("*") if p.suffix == ".egg-info" or p.name == "build"]


def test_a_failing_script_shows_what_python_said() -> None:
    folder = gather(["pyodide"])["pyodide/pyodide.mjs"].parent
    with pytest.raises(NodeError, match="ZeroDivisionError: division by zero"):
        run_node(RUNNER, {"folder": str(folder), "python": "def main(text):\n    return 1 / 0\n"})


def test_others_bytecode_stands_on_one_line_and_does_the_same() -> None:
    """Functions of any length, and nested ones: every instruction is on the line where its code begins."""
    body = "".join(f"    total += {k} * n\n" for k in range(300))
    inner = "    def inner(d):\n        return 1 / d\n"
    source = f"def outer(n):\n{inner}    total = 0\n{body}    return total + inner(n)\n"
    code = on_one_line(compile(source, "given", "exec"))
    (outer,) = [const for const in code.co_consts if isinstance(const, CodeType)]
    (within,) = [const for const in outer.co_consts if isinstance(const, CodeType)]
    for part, first in ((code, 1), (outer, 1), (within, 2)):
        assert {line for *_, line in part.co_lines()} == {first}
    names: dict[str, Any] = {}
    exec(code, names)
    assert names["outer"](2) == 2 * sum(range(300)) + 0.5
    with pytest.raises(ZeroDivisionError) as error:
        names["outer"](0)
    assert [entry.lineno for entry in error.traceback[1:]] == [0, 1]  # pytest counts from 0


def test_our_bytecode_is_bare_of_docstrings_and_of_functions_annotations_and_does_the_same() -> None:
    source = '''
"""Module."""
from dataclasses import dataclass

@dataclass(frozen=True)
class Point:
    """Class."""
    x: float = 1.0

    def twice(self: "Point", by: int = 2, *more: int, **named: int) -> float:
        """Method."""
        return self.x * by

class Empty:
    """Nothing else."""

def nothing(a: int) -> None:
    """Nothing else."""
'''
    names: dict[str, Any] = {"__name__": __name__}
    exec(compile(ast.fix_missing_locations(Bare().visit(ast.parse(source))), "given", "exec"), names)
    assert names["Point"](3.0).twice() == 6.0
    assert names["Point"].__doc__ == "Point"
    assert names["Empty"].__doc__ == "Empty"
    assert list(names["Point"].__dataclass_fields__) == ["x"]
    for function in (names["Point"].twice, names["nothing"]):
        assert function.__doc__ is None
        assert function.__annotations__ == {}
    assert names["nothing"](1) is None
    assert names.get("__doc__") is None
