"""Where the site goes: a folder that the build makes itself, replacing nothing else."""

from __future__ import annotations

import os
import shutil
from pathlib import Path

import pytest

from sitegen.pipeline.attempt import Outcome, tell
from sitegen.problems import BuildFailed
from tests.sitegen.conftest import Project


def test_a_file_of_the_site_s_name_stays(project: Project, monkeypatch: pytest.MonkeyPatch) -> None:
    """This is reported before anything is read, and the build leaves nothing beside it."""
    project.site.write_text("notes", "utf-8")
    before = sorted(project.root.iterdir())
    monkeypatch.setattr("sitegen.pipeline.build.read_chapters", lambda *_: pytest.fail("the content was read first"))
    message = r"^site:0:0: expected a folder to build in, got a file: move or rename it first$"
    with pytest.raises(BuildFailed, match=message):
        project.build()
    assert project.site.read_text("utf-8") == "notes"
    assert sorted(project.root.iterdir()) == before


@pytest.mark.parametrize("leads", ["elsewhere", "nowhere"])
def test_a_link_of_the_site_s_name_stays(project: Project, tmp_path: Path, leads: str) -> None:
    """A build renames folders, which would move the link away."""
    (tmp_path / "elsewhere").mkdir()
    project.site.symlink_to(tmp_path / leads)
    with pytest.raises(BuildFailed, match="expected a folder to build in, got a link"):
        project.build()
    assert project.site.is_symlink()
    assert list((tmp_path / "elsewhere").iterdir()) == []


def test_a_mounted_folder_is_told_before_the_build(project: Project, monkeypatch: pytest.MonkeyPatch) -> None:
    """As containers do it: such a folder cannot be renamed."""
    project.site.mkdir(exist_ok=True)
    monkeypatch.setattr("os.path.ismount", lambda path: path == project.site)
    monkeypatch.setattr("sitegen.pipeline.build.read_chapters", lambda *_: pytest.fail("the content was read first"))
    with pytest.raises(BuildFailed, match="got a mount point: unmount it first"):
        project.build()


@pytest.mark.parametrize("moment", ["before the old site is moved", "after it"])
def test_builds_that_end_together_both_succeed(project: Project, monkeypatch: pytest.MonkeyPatch, moment: str) -> None:
    """Another build has moved the old site away, or has put its own in the place; nothing is left beside."""
    project.build()
    replace, other = os.replace, project.root / "other"

    def interfere(source: Path, dest: Path) -> None:
        if project.site in (source, dest) and not other.exists():
            if moment == "before the old site is moved":
                replace(project.site, other)
            elif dest == project.site:
                shutil.copytree(source, other)
                shutil.copytree(source, dest)
        replace(source, dest)

    monkeypatch.setattr("sitegen.pipeline.output.os.replace", interfere)
    before = {path.name for path in project.root.iterdir()}
    project.build()
    assert other.is_dir()
    assert (project.site / "index.html").is_file()
    assert {path.name for path in project.root.iterdir()} == before | {"other"}


@pytest.mark.parametrize(("exists", "message"), [(True, "the previous site is kept"), (False, "there is no site yet")])
def test_a_failed_build_says_what_is_left(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], exists: bool, message: str
) -> None:
    if exists:
        (tmp_path / "index.html").touch()
    tell(Outcome(trouble="no disk"), tmp_path)
    assert capsys.readouterr().err == f"no disk\nthe build failed: {message}\n"
