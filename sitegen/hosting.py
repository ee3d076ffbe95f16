"""`publish`: the built site → a folder that a host serves, or a branch of a git repository.

Readers may come at any moment: files that no page names yet go first, then the pages, and what is no longer named goes
last. Only what an earlier publish put somewhere is ever removed there.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from sitegen.building import attempt, tell
from sitegen.progress import shown

LIST = "published.txt"  # in the folder: what this command put there
LAST = (".html", ".html.gz", ".html.br", "sw.js", "sw.js.gz", "sw.js.br")
BRANCH = "gh-pages"


class PublishError(RuntimeError):
    """The site cannot be put there; the message says why."""


def publish_command(root: Path, where: str) -> int:
    """Build strictly, then put the site where the author says. The exit code is 1 when either fails."""
    with shown() as progress:
        outcome = attempt(root, root / "site", strict=True, progress=progress)
    tell(outcome)
    if not outcome.good:
        return 1
    try:
        if where.startswith("git+"):
            remote, _, branch = where.removeprefix("git+").rpartition("#")
            done = to_branch(root / "site", remote or branch, branch if remote else BRANCH)
        else:
            done = to_folder(root / "site", Path(where).resolve())
    except (PublishError, OSError) as error:
        print(f"publish: {error}", file=sys.stderr)
        return 1
    print(done)
    return 0


def files_of(site: Path) -> list[str]:
    """The names of a site's files in the order in which they are put: pages and the service worker last."""
    names = [path.relative_to(site).as_posix() for path in site.rglob("*") if path.is_file()]
    return sorted((name for name in names if name != ".gitignore"), key=lambda name: (name.endswith(LAST), name))


def to_folder(site: Path, folder: Path) -> str:
    """Put the site into a folder; what was done, in words.

    Raises PublishError where the folder is the site, lies in it or around it, or is a file.
    """
    if folder == site or site in folder.parents or folder in site.parents:
        raise PublishError(f"{folder} is the built site, or lies in or around it: name another folder")
    if folder.exists() and not folder.is_dir():
        raise PublishError(f"{folder} is no folder")
    listed = folder / LIST
    before = listed.read_text("utf-8").split("\n") if listed.is_file() else []
    names = files_of(site)
    folder.mkdir(parents=True, exist_ok=True)
    listed.write_text("\n".join(sorted({*before, *names} - {""})), "utf-8")  # what a publish cut short leaves is known
    written = sum(_put(site / name, folder / name) for name in names)
    gone = [name for name in before if name and name not in set(names) and _removed(folder, name)]
    listed.write_text("\n".join(sorted(names)), "utf-8")
    return f"{folder}: {written} files written, {len(names) - written} as they were, {len(gone)} old ones removed"


def _put(source: Path, dest: Path) -> bool:
    """Copy a file by way of a new one beside it, unless the same is there; whether it was copied."""
    data = source.read_bytes()
    if dest.is_file() and dest.stat().st_size == len(data) and dest.read_bytes() == data:
        return False
    dest.parent.mkdir(parents=True, exist_ok=True)
    beside = dest.with_name(dest.name + ".new")
    beside.write_bytes(data)
    os.replace(beside, dest)
    return True


def _removed(folder: Path, name: str) -> bool:
    """Remove a file that an earlier publish put, and the folders that it leaves empty; whether it was there."""
    path = folder / name
    if folder not in path.resolve().parents or not path.is_file():
        return False
    path.unlink()
    for parent in path.parents:
        if parent == folder or any(parent.iterdir()):
            break
        parent.rmdir()
    return True


def to_branch(site: Path, remote: str, branch: str) -> str:
    """Put the site on a branch as one commit on top of what is there; what was done, in words.

    Raises PublishError with what git said.
    """
    if not shutil.which("git"):
        raise PublishError("git is not installed")
    remote = str(Path(remote).resolve()) if Path(remote).exists() else remote
    with tempfile.TemporaryDirectory(prefix="ladder-publish-") as temporary:
        clone = Path(temporary, "clone")
        _git(Path(temporary), "init", "--quiet", "--initial-branch", branch, str(clone))
        there = _git(clone, "ls-remote", "--heads", remote, f"refs/heads/{branch}")
        if there:
            _git(clone, "fetch", "--quiet", "--depth", "1", remote, f"refs/heads/{branch}")
            _git(clone, "reset", "--quiet", "--soft", "FETCH_HEAD")
        for name in files_of(site):
            (clone / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(site / name, clone / name)
        (clone / ".nojekyll").write_bytes(b"")  # GitHub Pages else leaves out what begins with an underscore
        _git(clone, "-c", "core.autocrlf=false", "add", "--all", "--force", ".")
        if not _git(clone, "status", "--porcelain"):
            return f"{remote}, branch {branch}: nothing has changed"
        who = _git(site.parent, "log", "-1", "--format=%h") if (site.parent / ".git").exists() else ""
        message = f"The site as of {who}" if who else "The site"
        author = ["-c", "user.name=publish", "-c", "user.email=publish@localhost"] if not _known(clone) else []
        _git(clone, *author, "commit", "--quiet", "--message", message)
        _git(clone, "push", "--quiet", remote, f"HEAD:refs/heads/{branch}")
        count = _git(clone, "ls-files").count("\n") + 1
        return f"{remote}, branch {branch}: {count} files in a new commit"


def _known(clone: Path) -> bool:
    """Whether git knows who commits."""
    try:
        return bool(_git(clone, "config", "user.email"))
    except PublishError:
        return False


def _git(folder: Path, *words: str) -> str:
    done = subprocess.run(["git", *words], cwd=folder, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise PublishError(f"git {words[0]}: {(done.stderr or done.stdout).strip() or 'failed'}")
    return done.stdout.strip()
