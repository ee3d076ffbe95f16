"""Where the site goes: a folder that the build makes itself, replacing nothing else."""

from __future__ import annotations

from pathlib import Path

import pytest

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
