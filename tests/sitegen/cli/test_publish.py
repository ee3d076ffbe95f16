"""Publishing: a folder or a branch gets the whole site, in an order that no reader notices, and nothing else."""

from __future__ import annotations

import re
import shutil
import subprocess
from pathlib import Path

import pytest

from sitegen.cli import main as cli
from sitegen.cli import publish
from sitegen.cli.publish import LIST, Branch, PublishError, destination, files_of, to_branch, to_folder
from sitegen.pipeline.attempt import Outcome


def write(folder: Path, files: dict[str, str]) -> Path:
    for name, text in files.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(text, "utf-8")
    return folder


@pytest.fixture
def site(tmp_path: Path) -> Path:
    files = {"index.html": "one", "assets/a.1.css": "a", "sw.js": "w", "_headers": "h", ".gitignore": "*"}
    return write(tmp_path / "site", files)


def texts(folder: Path) -> dict[str, str]:
    files = [path for path in folder.rglob("*") if path.is_file() and ".git" not in path.parts]
    return {path.relative_to(folder).as_posix(): path.read_text("utf-8") for path in files}


def git(folder: Path, *words: str) -> str:
    return subprocess.run(["git", *words], cwd=folder, capture_output=True, text=True, check=True).stdout.strip()


def test_pages_go_last(site: Path) -> None:
    """A published page refers only to files that are already there."""
    write(site, {"tapes/t.js": "t"})  # comes after them by name
    assert files_of(site) == ["_headers", "assets/a.1.css", "tapes/t.js", "index.html", "sw.js"]


def test_a_folder_gets_what_changed_and_keeps_what_is_its_own(site: Path, tmp_path: Path) -> None:
    host = tmp_path / "host"
    assert "4 files written" in to_folder(site, host)
    own = {"CNAME": "example.org", "assets/own.css": "o"}
    write(host, own)
    pages = {"index.html": "one", "assets/a.1.css": "a", "sw.js": "w", "_headers": "h"}
    assert {k: v for k, v in texts(host).items() if k != LIST} == {**own, **pages}
    (site / "assets/a.1.css").unlink()
    write(site, {"index.html": "two", "new/b.2.css": "b"})
    assert to_folder(site, host).endswith("2 files written, 2 unchanged, 1 old ones removed")
    pages = {"index.html": "two", "new/b.2.css": "b", "sw.js": "w", "_headers": "h"}
    assert {k: v for k, v in texts(host).items() if k != LIST} == {**own, **pages}
    assert "0 files written" in to_folder(site, host)


def test_what_others_put_there_is_replaced_only_when_told_to(site: Path, tmp_path: Path) -> None:
    """A folder with files but no list of ours; then one with a list, and a stranger's file in a new one's place."""
    host = write(tmp_path / "host", {"index.html": "a stranger's", "CNAME": "example.org"})
    with pytest.raises(PublishError, match=r"host has files .* \(CNAME, index.html\); .* add --force"):
        to_folder(site, host)
    assert texts(host) == {"index.html": "a stranger's", "CNAME": "example.org"}
    assert "4 files written" in to_folder(site, host, force=True)
    assert texts(host)["index.html"] == "one"
    assert texts(host)["CNAME"] == "example.org"
    write(site, {"CNAME": "elsewhere.org"})
    with pytest.raises(PublishError, match=r"CNAME comes from elsewhere.*add --force"):
        to_folder(site, host)
    assert texts(host)["CNAME"] == "example.org"
    to_folder(site, host, force=True)
    assert texts(host)["CNAME"] == "elsewhere.org"


def test_a_folder_with_a_repository_of_its_own_is_empty(site: Path, tmp_path: Path) -> None:
    git(tmp_path, "init", "--quiet", "host")
    assert "4 files written" in to_folder(site, tmp_path / "host")


LINKS = {
    "index.html.new": "precious/file.txt",
    ".index.html.new": "precious/file.txt",
    "index.html": "precious/file.txt",
    "sw.js": "precious/absent.txt",
    LIST: "precious/file.txt",
}


@pytest.mark.parametrize("name", LINKS)
def test_no_planted_link_to_a_file_is_written_through(site: Path, tmp_path: Path, name: str) -> None:
    """Whatever a link's name, its target stays unchanged; where the site has a file, a file replaces the link."""
    write(tmp_path / "precious", {"file.txt": "p"})
    host = tmp_path / "host"
    to_folder(site, host)
    (host / name).unlink(missing_ok=True)
    (host / name).symlink_to(tmp_path / LINKS[name])
    write(site, {"index.html": "two"})
    to_folder(site, host, force=True)
    assert texts(tmp_path / "precious") == {"file.txt": "p"}
    assert (host / "index.html").read_text("utf-8") == "two"
    for file in ("index.html", "sw.js", LIST):
        assert not (host / file).is_symlink()


def test_a_planted_link_to_the_same_words_does_not_stand_for_the_page(site: Path, tmp_path: Path) -> None:
    """The owner of its target could change the page later."""
    write(tmp_path / "precious", {"file.txt": "one"})
    host = tmp_path / "host"
    to_folder(site, host)
    (host / "index.html").unlink()
    (host / "index.html").symlink_to(tmp_path / "precious" / "file.txt")
    assert "1 files written" in to_folder(site, host)
    assert not (host / "index.html").is_symlink()


@pytest.mark.parametrize("leads", ["precious", "absent", "../precious"])
def test_no_planted_link_to_a_folder_is_followed(site: Path, tmp_path: Path, leads: str) -> None:
    """Neither for writing nor, once the site has no such file, for removing."""
    precious = write(tmp_path / "precious", {"a.1.css": "p"})
    host = tmp_path / "host"
    to_folder(site, host)
    shutil.rmtree(host / "assets")
    (host / "assets").symlink_to(leads if leads.startswith("..") else tmp_path / leads)
    write(site, {"index.html": "two"})
    for force in (False, True):
        with pytest.raises(PublishError, match=r"host: assets leads outside through a link: remove the link first"):
            to_folder(site, host, force=force)
    assert (host / "index.html").read_text("utf-8") == "one"  # nothing at all was written
    shutil.rmtree(site / "assets")
    assert "0 old ones removed" in to_folder(site, host)
    assert texts(precious) == {"a.1.css": "p"}
    assert not (tmp_path / "absent").exists()


def test_a_list_that_leads_out_of_the_folder_removes_nothing(site: Path, tmp_path: Path) -> None:
    write(tmp_path, {"precious.txt": "p"})
    host = write(tmp_path / "host", {LIST: f"../precious.txt\n{tmp_path}/precious.txt\nindex.html"})
    to_folder(site, host)
    assert (tmp_path / "precious.txt").read_text("utf-8") == "p"


def test_no_site_is_put_into_itself(site: Path) -> None:
    for folder in (site, site / "assets", site.parent):
        with pytest.raises(PublishError, match="choose another folder"):
            to_folder(site, folder)
    with pytest.raises(PublishError, match="is not a folder"):
        to_folder(site / "assets", site / "index.html")


def test_a_branch_gets_a_commit_for_each_change(site: Path, tmp_path: Path) -> None:
    """The first makes the branch, the next commits on top, an unchanged site commits nothing; other branches stay."""
    bare = tmp_path / "bare.git"
    git(tmp_path, "init", "--quiet", "--bare", str(bare))
    branch = Branch(str(bare), "gh-pages")
    assert "6 files" in to_branch(site, branch)
    assert "nothing has changed" in to_branch(site, branch)
    (site / "assets/a.1.css").unlink()
    to_branch(site, branch)
    assert git(bare, "branch", "--format=%(refname:short)") == "gh-pages"
    assert git(bare, "rev-list", "--count", "gh-pages") == "2"
    names = git(bare, "ls-tree", "-r", "--name-only", "gh-pages").split("\n")
    assert names == [".nojekyll", "_headers", "index.html", LIST, "sw.js"]


AUTHOR = ("-c", "user.name=a", "-c", "user.email=a@localhost")


@pytest.fixture
def project(tmp_path: Path) -> Path:
    """A repository with its own branch `main` and one commit."""
    git(tmp_path, "init", "--quiet", "--initial-branch", "main", "project")
    project = write(tmp_path / "project", {"index.html": "the author's"})
    git(project, "add", ".")
    git(project, *AUTHOR, "commit", "--quiet", "-m", "one")
    git(project, "switch", "--quiet", "--create", "work")  # git refuses a push to the branch that is checked out
    return project


def test_a_branch_with_the_files_of_others_is_left_alone(site: Path, project: Path) -> None:
    """Unless --force is given; files of other names then stay."""
    main = Branch(str(project), "main")
    write(project, {"notes.txt": "n"})
    with pytest.raises(PublishError, match=r"project, branch main has files .* \(index.html\); .* --force"):
        to_branch(site, main)
    assert git(project, "rev-list", "--count", "main") == "1"
    to_branch(site, main, force=True)
    assert git(project, "show", "main:index.html") == "one"


def test_a_link_on_a_branch_is_not_followed(site: Path, project: Path, tmp_path: Path) -> None:
    precious = write(tmp_path / "precious", {"a.1.css": "p"})
    (project / "assets").symlink_to(precious)
    git(project, "add", "assets")
    git(project, *AUTHOR, "commit", "--quiet", "-m", "link")
    git(project, "branch", "--force", "main", "work")
    with pytest.raises(PublishError, match="assets leads outside through a link"):
        to_branch(site, Branch(str(project), "main"), force=True)
    assert texts(precious) == {"a.1.css": "p"}


def test_a_hook_s_repository_is_not_taken_for_the_branch_s(
    site: Path, project: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Where a hook publishes, git's variables name the project's own repository."""
    git(tmp_path, "init", "--quiet", "--bare", "bare.git")
    monkeypatch.setenv("GIT_DIR", str(project / ".git"))
    monkeypatch.setenv("GIT_INDEX_FILE", str(project / ".git" / "index"))
    to_branch(site, Branch(str(tmp_path / "bare.git"), "gh-pages"))
    monkeypatch.undo()
    assert git(project, "branch", "--format=%(refname:short)").split() == ["main", "work"]
    assert git(project, "rev-list", "--all", "--count") == "1"
    assert git(tmp_path / "bare.git", "rev-list", "--count", "gh-pages") == "1"


REFUSED = {
    "https://example.org/ladder.git": r"is a URL, not a folder; .* write git\+https://example.org/ladder.git#gh-pages",
    "git@example.org:me/ladder.git": r"write git\+git@example.org:me/ladder.git#gh-pages",
    "": "missing destination",
    300 * "x": "File name too long",
    "git+": r"missing repository in git\+; write git\+REPOSITORY#BRANCH",
    "git+#gh-pages": "missing repository",
    "git+repository#": "invalid branch name ''",
    "git+--upload-pack=touch ran;": "invalid repository --upload-pack=",
    "git+--receive-pack=touch ran#gh-pages": "invalid repository",
    "git+ext::sh -c 'touch ran'": "invalid repository ext::",
    "git+fd::7#gh-pages": "invalid repository fd::7",
    "git+repository#--force": "invalid branch name '--force'",
    "git+repository#a..b": "invalid branch name 'a..b'",
    "git+repository#a:refs/heads/main": "invalid branch name",
    "git+repository#@{-1}": "invalid branch name",
    "git+repository#HEAD": "invalid branch name",
}


@pytest.mark.parametrize("target", REFUSED)
def test_what_is_no_place_is_refused_before_anything_is_built(
    target: str, project: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """The message says what to write instead; nothing is run, and nothing is made."""
    monkeypatch.chdir(project)
    before = {path: path.stat().st_mtime_ns for path in project.rglob("*")}
    monkeypatch.setattr(publish, "attempt", lambda *_, **__: pytest.fail("it was built"))
    assert cli.run(project, cli.parse(["publish", "--", target])) == 2
    output = capsys.readouterr().err
    assert re.match(f"publish: .*{REFUSED[target]}", output)
    assert output.count("\n") == 1
    assert {path: path.stat().st_mtime_ns for path in project.rglob("*")} == before


def test_no_url_that_stands_for_another_runs_a_command(
    site: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Even if the user's configuration allows ext:: and substitutes it for a harmless URL."""
    lines = ['[protocol "ext"]', "allow = always", f'[url "ext::touch {tmp_path}/ran "]', "insteadOf = https://example.org/"]
    write(tmp_path, {"config": "\n".join(lines)})
    monkeypatch.setenv("GIT_CONFIG_GLOBAL", str(tmp_path / "config"))
    with pytest.raises(PublishError, match="transport 'ext' not allowed"):
        to_branch(site, Branch("https://example.org/ladder.git", "gh-pages"))
    assert not (tmp_path / "ran").exists()


def test_where_to_is_a_folder_or_a_branch(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    assert destination("host") == tmp_path / "host"
    assert destination("git+https://example.org/x.git") == Branch("https://example.org/x.git", "gh-pages")
    assert destination("git+git@example.org:x.git#pages/new") == Branch("git@example.org:x.git", "pages/new")
    assert destination("git+.#pages") == Branch(str(tmp_path), "pages")


def test_a_folder_that_will_not_do_is_refused_before_anything_is_built(
    site: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """A suitable folder is published to with the options as given."""
    host = write(tmp_path / "host", {"index.html": "a stranger's"})
    builds = []
    monkeypatch.setattr(publish, "attempt", lambda *_, **__: builds.append(1) or Outcome(pages=1))
    assert cli.run(tmp_path, cli.parse(["publish", str(host)])) == 2
    assert not builds
    assert "add --force" in capsys.readouterr().err
    assert cli.run(tmp_path, cli.parse(["publish", str(host), "--force"])) == 0
    assert "4 files written" in capsys.readouterr().out


def test_git_says_why_it_cannot(site: Path, tmp_path: Path) -> None:
    with pytest.raises(PublishError, match="git ls-remote: "):
        to_branch(site, Branch(str(tmp_path / "nowhere.git"), "gh-pages"))


def test_the_same_file_on_both_sides_is_no_stranger_s(site: Path, tmp_path: Path) -> None:
    host = tmp_path / "host"
    to_folder(site, host)
    for folder in (site, host):
        write(folder, {"robots.txt": "r"})
    assert "0 files written" in to_folder(site, host)


def test_publishing_goes_on_where_it_was_cut_short(
    site: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Files written before the interruption are known to be ours."""
    host, original = tmp_path / "host", publish.write

    def interrupt(path: Path, data: bytes) -> None:
        if path.name == "index.html":
            raise OSError("cut short")
        original(path, data)

    monkeypatch.setattr(publish, "write", interrupt)
    with pytest.raises(OSError, match="cut short"):
        to_folder(site, host)
    monkeypatch.undo()
    assert "2 files written, 2 unchanged" in to_folder(site, host)
