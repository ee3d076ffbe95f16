"""The cache is not trusted: whatever happened to an entry, the site is the one that an undamaged cache gives."""

from __future__ import annotations

import errno
import os
import shutil
import subprocess
import sys
import time
from collections.abc import Callable
from functools import cache
from pathlib import Path

import pytest

from sitegen.assets import typefaces
from sitegen.cache import pool, store
from sitegen.cache.store import Store
from sitegen.pipeline.attempt import attempt
from sitegen.runtime import assemble, wheel
from tests.sitegen.conftest import Project, contents, fresh_cache

ROOT = Path(__file__).resolve().parents[3]


def shorten(path: Path) -> None:
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])


def flip(path: Path) -> None:
    """Flip one bit in the middle."""
    data = path.read_bytes()
    middle = len(data) // 2
    path.write_bytes(data[:middle] + bytes(byte ^ 1 for byte in data[middle : middle + 1]) + data[middle + 1 :])


def fill(path: Path) -> None:
    path.write_bytes(b'{"garbage": [1, 2, 3]}' * 100)


@cache
def wholes(folder: Path) -> dict[Path, bytes]:
    """The contents of a folder's files before the first of them was damaged."""
    return {path: path.read_bytes() for path in sorted(folder.iterdir()) if path.is_file()}


def exchange(path: Path) -> None:
    """Replace it by another whole entry of the same kind, or by itself with a trailing newline if there is no other."""
    bodies = [data for sibling, data in wholes(path.parent).items() if sibling != path]
    path.write_bytes(bodies[0] if bodies else path.read_bytes() + b"\n")


def folder(path: Path) -> None:
    """Replace it by a non-empty folder."""
    path.unlink()
    (path / "in it").mkdir(parents=True)
    (path / "in it" / "a").touch()


def loop(path: Path) -> None:
    """Replace it by a link to itself, which cannot be read."""
    path.unlink()
    path.symlink_to(path)


def pipe(path: Path) -> None:
    """Replace it by a pipe, whose readers wait for ever."""
    path.unlink()
    os.mkfifo(path)


DAMAGES: list[Callable[[Path], None]] = [
    *(shorten, lambda path: path.write_bytes(b""), flip, fill, exchange, folder),
    *((loop, pipe) if hasattr(os, "mkfifo") else ()),
]
NAMES = ["shorten", "empty", "flip", "fill", "exchange", "folder", "loop", "pipe"][: len(DAMAGES)]


@pytest.fixture(scope="module")
def first_build(tmp_path_factory: pytest.TempPathFactory) -> tuple[Project, dict[str, bytes]]:
    """The small site with a plot, built for hosts, with its own cache."""
    home = tmp_path_factory.mktemp("store")
    project = Project(home / "checkout", fresh_cache(home / "cache"))
    project.write("content/00-start.md", (project.root / "content/00-start.md").read_text("utf-8") + PLOT)
    project.build(pack=True)
    return project, contents(project.site)


PLOT = "\n::plot[Dots.]{toy-plot id=dots}\n\nIn all :value[plots.toy_plot.highest(2)]{.1f}.\n"


@pytest.mark.parametrize("damage", DAMAGES, ids=NAMES)
def test_a_damaged_cache_gives_the_same_site(
    first_build: tuple[Project, dict[str, bytes]],
    damage: Callable[[Path], None],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Every file that builds put in it is damaged at once; after the next build the entries are whole again."""
    (project, right), cache = first_build, tmp_path / "cache"
    shutil.copytree(project.cache, cache)
    entries = [path for path in sorted(cache.rglob("*")) if path.is_file() and "outside" not in path.parts]
    kinds = {path.relative_to(cache).parts[0] for path in entries}
    usual = {"brotli", "bundles", "drawings", "frames", "gzip", "notebooks", "plots", "remembered", "templates"}
    assert kinds == {*usual, "pruned"}
    # Tables may be written in another order, and templates' code in other bytes.
    paths = [path for path in entries if path.parent.name not in ("remembered", "templates", "cache")]
    before = {path: path.read_bytes() for path in paths}
    for path in entries:
        damage(path)
    monkeypatch.setattr(project, "cache", cache)
    project.build(pack=True)
    assert contents(project.site) == right
    assert {path for path, data in before.items() if not path.is_file() or path.read_bytes() != data} == set()


@pytest.mark.parametrize("damage", DAMAGES, ids=NAMES)
def test_what_is_dear_to_make_is_not_trusted_either(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, damage: Callable[[Path], None]
) -> None:
    """Compiled archives, our wheel, cut typefaces, runtime files: the functions that cache them, on small inputs."""
    archive = wheel.Archive("thing.zip", assemble.stored_zip({"thing.py": b"print(1)\n"}))
    monkeypatch.setattr(assemble, "run_node", compile_here)
    monkeypatch.setattr(wheel, "_build", lambda files: b"a-1.whl\n" + b"wheel" * 100)
    monkeypatch.setattr(typefaces, "_subset", lambda face, original, codes: b"font" * 100 + bytes(codes))
    (tmp_path / "given").write_bytes(b"engine, original")
    engine = {"pyodide/pyodide.asm.wasm": tmp_path / "given"}
    cache = tmp_path / "cache"

    def answers() -> list[object]:
        return [
            assemble.compiled(archive, "/", engine, cache),
            wheel.build_wheel(cache),
            typefaces._cut(typefaces.FACES[0], tmp_path / "given", [65, 66], cache),
        ]

    first = answers()
    entries = [path for path in cache.rglob("*") if path.is_file()]
    assert {path.parent.name for path in entries} == {"compiled", "wheel", "fonts"}
    before = {path: path.read_bytes() for path in entries}
    for path in entries:
        damage(path)
    assert answers() == first
    assert {path: path.read_bytes() for path in entries} == before


def compile_here(script: Path, request: dict[str, dict[str, str]], *, timeout: float) -> None:
    """Stands in for Node: the archive unchanged, with a mark appended."""
    (name,) = os.listdir(request["mounts"]["/in"])
    data = Path(request["mounts"]["/in"], name).read_bytes()
    Path(request["mounts"]["/out"], "out.zip").write_bytes(data + b"compiled")


def test_a_store_gives_what_was_put_under_the_key_alone(tmp_path: Path) -> None:
    """It ignores an entry of another key or kind, even a whole one."""
    entries = Store(tmp_path, "gzip")
    entries.put("a", b"first")
    assert (entries.find("a"), entries.has("a"), entries.find("b"), entries.has("b")) == (b"first", True, None, False)
    for path in (Store(tmp_path, "gzip").path("b"), Store(tmp_path, "brotli").path("a")):
        path.parent.mkdir(exist_ok=True)
        shutil.copy(entries.path("a"), path)
    assert entries.find("b") is None
    assert Store(tmp_path, "brotli").get("a", lambda: b"second") == b"second"
    assert entries.find("a") is entries.find("a"), "what has not changed is read once"


def test_what_is_rejected_or_damaged_is_made_again(tmp_path: Path) -> None:
    """Be it shorter, longer, empty or of the same length, and whatever was last read of it."""
    entries = Store(tmp_path, "gzip")
    entries.put("a", b"first")
    assert entries.get("a", lambda: b"second", lambda data: data == b"first") == b"first"
    assert entries.get("a", lambda: b"second", lambda data: data != b"first") == b"second"
    path, moment = entries.path("a"), time.time_ns()
    entire = path.read_bytes()
    for k, data in enumerate((entire[:-1], entire + b"x", b"", entire[:-1] + b"x", b"x" + entire[1:])):
        path.write_bytes(data)
        os.utime(path, ns=(moment + k * 10**9,) * 2)  # a file system's clock may not tell two writes apart
        assert entries.find("a") is None
        assert entries.get("a", lambda: b"second") == b"second"
        assert entries.find("a") == b"second"


def test_a_file_where_a_folder_belongs_gives_way(tmp_path: Path) -> None:
    (tmp_path / "gzip").write_bytes(b"in the way")
    assert Store(tmp_path, "gzip").get("a", lambda: b"made") == b"made"
    assert Store(tmp_path, "gzip").get("a", lambda: b"made anew") == b"made"


def test_nothing_beside_the_cache_gives_way(tmp_path: Path) -> None:
    """If LADDER_CACHE names someone's file, that file stays."""
    (tmp_path / "cache").write_bytes(b"mine")
    assert Store(tmp_path / "cache", "gzip").get("a", lambda: b"made") == b"made"
    assert (tmp_path / "cache").read_bytes() == b"mine"


def full(path: Path, data: bytes) -> None:
    raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), str(path))


def test_a_site_is_built_with_a_cache_that_keeps_nothing_and_that_is_told(
    project: Project, monkeypatch: pytest.MonkeyPatch
) -> None:
    """On a full or read-only disk, what cannot be cached is made each time, and one warning says why it is slow."""
    project.build(pack=True)
    right = contents(project.site)
    monkeypatch.setattr(store, "write", full)
    monkeypatch.setattr(store.tempfile, "TemporaryFile", lambda dir: full(dir, b""))
    ahead: list[pool.Piece] = []
    monkeypatch.setattr("sitegen.pipeline.build.missing", lambda *_: [(str, ()), (str, ())])
    monkeypatch.setattr(pool, "make", lambda what, pieces, progress: ahead.extend(pieces))
    for kind in ("frames", "gzip", "remembered", "notebooks"):
        shutil.rmtree(project.cache / kind)
    report = project.build(pack=True)
    assert contents(project.site) == right
    assert ahead == []  # it would be made twice
    (message,) = [str(problem) for problem in report.warnings]
    assert message == f"{project.cache}:0:0: this cache cannot be written: No space left on device; " + (
        "every build starts from scratch"
    )
    monkeypatch.undo()
    project.build(pack=True)


def test_a_full_disk_is_told_in_one_line(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """This also holds if the site itself cannot be written."""
    monkeypatch.setattr("sitegen.pipeline.build.build", lambda root, dest, **options: full(dest / "a.html", b""))
    assert attempt(tmp_path, tmp_path / "site").trouble == f"{tmp_path / 'site' / 'a.html'}: No space left on device"


ALIKE = """
import sys
import time
from pathlib import Path
from sitegen.cache.store import Store
store = Store(Path(sys.argv[1]), "frames")
for i in range(300):
    data = bytes([i % 10]) * 20_000
    assert store.get(str(i % 10), lambda: data) == data
    if i % 3 == 0:
        store.put(str(i % 10), data)
"""


def test_processes_that_share_a_cache_read_whole_entries(tmp_path: Path) -> None:
    """Several write and read the same entries at once."""
    running = [subprocess.Popen([sys.executable, "-P", "-c", ALIKE, str(tmp_path)], cwd=ROOT, env=PATHS) for _ in "abc"]
    assert [process.wait() for process in running] == [0, 0, 0]
    assert len(list((tmp_path / "frames").iterdir())) == 10, "nothing half written is left"


PATHS = {**os.environ, "PYTHONPATH": str(ROOT)}
