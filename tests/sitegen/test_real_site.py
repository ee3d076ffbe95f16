"""The project's own content builds, and to the same bytes when nothing that is drawn or computed was kept."""

from __future__ import annotations

from pathlib import Path

from sitegen.build import build
from sitegen.outside import cache_dir

ROOT = Path(__file__).resolve().parents[2]
MADE_ANEW = ("frames", "values", "drawings", "maths", "packed", "runtime")


def contents(folder: Path) -> dict[str, bytes]:
    return {p.relative_to(folder).as_posix(): p.read_bytes() for p in folder.rglob("*") if p.is_file()}


def test_two_builds_of_the_site_are_the_same_bytes(tmp_path: Path) -> None:
    build(ROOT, tmp_path / "one", pack=False)
    cold = tmp_path / "cache"
    cold.mkdir()
    for folder in cache_dir().iterdir():
        if folder.is_dir() and folder.name not in MADE_ANEW:
            (cold / folder.name).symlink_to(folder, target_is_directory=True)
    report = build(ROOT, tmp_path / "two", pack=False, cache=cold)
    assert "index.html" in report.pages
    assert contents(tmp_path / "one") == contents(tmp_path / "two")
