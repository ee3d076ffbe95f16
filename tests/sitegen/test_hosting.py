"""Publishing: a folder or a branch gets the site, whole and in an order that no reader notices, and nothing else."""

from __future__ import annotations

import subprocess
from pathlib import Path

import pytest

from sitegen.hosting import LIST, PublishError, files_of, to_branch, to_folder


def write(folder: Path, files: dict[str, str]) -> Path:
    for name, text in files.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(text, "utf-8")
    return folder


@pytest.fixture
def site(tmp_path: Path) -> Path:
    files = {"index.html": "one", "assets/a.1.css": "a", "sw.js": "w", "_headers": "h", ".gitignore": "*"}
    return write(tmp_path / "site", files)


def there(folder: Path) -> dict[str, str]:
    files = [path for path in folder.rglob("*") if path.is_file() and ".git" not in path.parts]
    return {path.relative_to(folder).as_posix(): path.read_text("utf-8") for path in files}


def git(folder: Path, *words: str) -> str:
    return subprocess.run(["git", *words], cwd=folder, capture_output=True, text=True, check=True).stdout.strip()


def test_pages_go_last(site: Path) -> None:
    """A page that is there names only files that are there."""
    assert files_of(site) == ["_headers", "assets/a.1.css", "index.html", "sw.js"]


def test_a_folder_gets_what_changed_and_keeps_what_is_its_own(site: Path, tmp_path: Path) -> None:
    host = write(tmp_path / "host", {"CNAME": "example.org", "assets/own.css": "o"})
    assert "4 files written" in to_folder(site, host)
    own = {"CNAME": "example.org", "assets/own.css": "o"}
    published = {"index.html": "one", "assets/a.1.css": "a", "sw.js": "w", "_headers": "h"}
    assert {k: v for k, v in there(host).items() if k != LIST} == {**own, **published}
    (site / "assets/a.1.css").unlink()
    write(site, {"index.html": "two", "new/b.2.css": "b"})
    assert to_folder(site, host).endswith("2 files written, 2 as they were, 1 old ones removed")
    published = {"index.html": "two", "new/b.2.css": "b", "sw.js": "w", "_headers": "h"}
    assert {k: v for k, v in there(host).items() if k != LIST} == {**own, **published}
    assert "0 files written" in to_folder(site, host)


def test_a_list_that_leads_out_of_the_folder_removes_nothing(site: Path, tmp_path: Path) -> None:
    write(tmp_path, {"precious.txt": "p"})
    host = write(tmp_path / "host", {LIST: f"../precious.txt\n{tmp_path}/precious.txt\nindex.html"})
    to_folder(site, host)
    assert (tmp_path / "precious.txt").read_text("utf-8") == "p"


def test_no_site_is_put_into_itself(site: Path) -> None:
    for folder in (site, site / "assets", site.parent):
        with pytest.raises(PublishError, match="name another folder"):
            to_folder(site, folder)
    with pytest.raises(PublishError, match="no folder"):
        to_folder(site / "assets", site / "index.html")


def test_a_branch_gets_a_commit_for_each_change(site: Path, tmp_path: Path) -> None:
    """The first makes the branch, the next stands on it, one that changes nothing makes none; other branches stay."""
    bare = tmp_path / "bare.git"
    git(tmp_path, "init", "--quiet", "--bare", str(bare))
    assert "5 files" in to_branch(site, str(bare), "gh-pages")
    assert "nothing has changed" in to_branch(site, str(bare), "gh-pages")
    (site / "assets/a.1.css").unlink()
    to_branch(site, str(bare), "gh-pages")
    assert git(bare, "branch", "--format=%(refname:short)") == "gh-pages"
    assert git(bare, "rev-list", "--count", "gh-pages") == "2"
    names = git(bare, "ls-tree", "-r", "--name-only", "gh-pages").split("\n")
    assert names == [".nojekyll", "_headers", "index.html", "sw.js"]


def test_git_says_why_it_cannot(site: Path, tmp_path: Path) -> None:
    with pytest.raises(PublishError, match="git ls-remote: "):
        to_branch(site, str(tmp_path / "nowhere.git"), "gh-pages")
