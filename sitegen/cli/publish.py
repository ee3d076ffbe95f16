"""`publish`: puts the built site into a folder that a host serves, or on a branch of a git repository.

Readers may come at any moment: new files that no page names yet are written first, then the pages; old files are
removed last. Only files from an earlier publish are ever replaced or removed; links in the folder cannot cause writes
or removals outside it.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Set
from dataclasses import dataclass
from pathlib import Path

from sitegen.cache.files import write
from sitegen.pipeline.attempt import attempt, tell
from sitegen.progress import reporting

LIST = "published.txt"  # in the folder: the files that this command put there
LAST = (".html", ".html.gz", ".html.br", "sw.js", "sw.js.gz", "sw.js.br")
BRANCH = "gh-pages"
URL = re.compile(r"[A-Za-z][A-Za-z0-9+.-]*://|[\w.-]+@[\w.-]+:")  # the second form is git's short one for SSH
HELPER = re.compile(r"[A-Za-z0-9]+::")  # git runs a helper program for such a remote: ext:: runs any command
PROTOCOLS = "file:git:http:https:ssh"
# Set inside git hooks; git would then use the hook's repository, not the one in the working folder.
ELSEWHERE = ("GIT_DIR", "GIT_WORK_TREE", "GIT_INDEX_FILE", "GIT_OBJECT_DIRECTORY", "GIT_COMMON_DIR", "GIT_NAMESPACE")


class PublishError(RuntimeError):
    """The site cannot be published there; the message says why."""


@dataclass(frozen=True)
class Branch:
    """A branch of a git repository: its URL or path, and its name."""

    remote: str
    name: str

    def __str__(self) -> str:
        return f"{self.remote}, branch {self.name}"


def publish_command(root: Path, address: str, *, force: bool = False) -> int:
    """Build strictly, then publish the site at the author's destination. The exit code is 1 if either fails, 2 for an
    unsuitable destination."""
    site = root / "site"
    try:
        target = destination(address)
        if isinstance(target, Path):
            fit(site, target, force=force)
    except (PublishError, OSError) as error:
        print(f"publish: {error}", file=sys.stderr)
        return 2
    with reporting() as progress:
        outcome = attempt(root, site, strict=True, progress=progress)
    tell(outcome, site)
    if not outcome.good:
        return 1
    try:
        if isinstance(target, Path):
            report = to_folder(site, target, force=force)
        else:
            report = to_branch(site, target, force=force)
    except (PublishError, OSError) as error:
        print(f"publish: {error}", file=sys.stderr)
        return 1
    print(report)
    return 0


def destination(address: str) -> Path | Branch:
    """The folder or the branch that an author names.

    Raises PublishError if it is neither, with what to write instead.
    """
    if not address.startswith("git+"):
        if URL.match(address):
            raise PublishError(
                f"{address} is a URL, not a folder; to publish on a git branch, write git+{address}#{BRANCH}"
            )
        if not address:
            raise PublishError("missing destination: name a folder, or git+REPOSITORY#BRANCH")
        return Path(address).resolve()
    remote, hash_, name = address.removeprefix("git+").rpartition("#")
    if not hash_:
        remote, name = name, BRANCH
    if not remote:
        raise PublishError(f"missing repository in {address}; write git+REPOSITORY#BRANCH, with a URL or a path")
    if remote.startswith("-") or HELPER.match(remote):
        raise PublishError(f"invalid repository {remote}: expected a path, or a URL starting with https:// or ssh://")
    if name.startswith("-") or not name or git(Path.cwd(), "check-ref-format", "--branch", name, fails=True) != name:
        raise PublishError(f"invalid branch name {name!r}; write git+{remote}#{BRANCH}")
    return Branch(str(Path(remote).resolve()) if Path(remote).exists() else remote, name)


def files_of(site: Path) -> list[str]:
    """The names of a site's files in the order of writing: pages and the service worker last."""
    names = [path.relative_to(site).as_posix() for path in site.rglob("*") if path.is_file()]
    return sorted((name for name in names if name != ".gitignore"), key=lambda name: (name.endswith(LAST), name))


def fit(site: Path, folder: Path, *, force: bool = False) -> None:
    """Check that the site may be put into a folder.

    Raises PublishError if the folder is the site, is inside it or contains it, if it is a file, or if it has files from
    elsewhere and `force` is not set.
    """
    if folder == site or site in folder.parents or folder in site.parents:
        raise PublishError(f"{folder} is, contains or lies in the built site: choose another folder")
    if folder.exists() and not folder.is_dir():
        raise PublishError(f"{folder} is not a folder")
    _check_owner(folder, str(folder), force)


def to_folder(site: Path, folder: Path, *, force: bool = False) -> str:
    """Put the site into a folder; a report of what was done. Raises PublishError like `fit` and `_fill`."""
    fit(site, folder, force=force)
    return f"{folder}: {_fill(site, folder, str(folder), force)}"


def _check_owner(folder: Path, label: str, force: bool) -> None:
    """Raise PublishError if a folder has files but no list of ours."""
    existing = sorted(path.name for path in folder.iterdir() if path.name != ".git") if folder.is_dir() else []
    if existing and not force and not _is_list(folder / LIST):
        examples = ", ".join(existing[:3]) + (" …" if len(existing) > 3 else "")
        raise PublishError(
            f"{label} has files from elsewhere ({examples}); name an empty folder or a new branch, "
            "or add --force to publish among them, replacing files of the same name"
        )


def _fill(site: Path, folder: Path, label: str, force: bool) -> str:
    """Put the site's files into a folder and remove an earlier publish's old ones; a report of what was done.

    Raises PublishError, before anything is written, if a link in the folder leads out of it or if the site would
    replace a file from elsewhere and `force` is not set.
    """
    published, names = _names_on_list(folder), files_of(site)
    for name in names:
        if not _is_inside(folder, name):
            raise PublishError(f"{label}: {Path(name).parent} leads outside through a link: remove the link first")
        if not force and name not in published and os.path.lexists(folder / name) and not _is_same(site, folder, name):
            raise PublishError(
                f"{label}: {name} comes from elsewhere, and the site has a file of that name; "
                "move it away, or add --force to replace it"
            )
    manifest = folder / LIST
    write(manifest, "\n".join(sorted({*published, *names})).encode())  # so that an interrupted publish is known
    updates = [name for name in names if not _is_same(site, folder, name)]
    for name in updates:
        write(folder / name, (site / name).read_bytes())
    removals = [name for name in sorted(published - set(names)) if _remove(folder, name)]
    write(manifest, "\n".join(sorted(names)).encode())
    return f"{len(updates)} files written, {len(names) - len(updates)} unchanged, {len(removals)} old ones removed"


def _is_list(path: Path) -> bool:
    return path.is_file() and not path.is_symlink()


def _names_on_list(folder: Path) -> Set[str]:
    """The names of the files that earlier publishes put into a folder."""
    if not _is_list(folder / LIST):
        return frozenset()
    lines = (folder / LIST).read_text("utf-8", "replace").split("\n")
    return frozenset(name for name in lines if name and "\0" not in name)


def _is_inside(folder: Path, name: str) -> bool:
    """Whether a file of this name would be inside the folder, and not elsewhere through a link."""
    return Path(os.path.realpath((folder / name).parent)).is_relative_to(os.path.realpath(folder))


def _is_same(site: Path, folder: Path, name: str) -> bool:
    """Whether the folder already has this file of the site, as a file and not as a link."""
    source, dest = site / name, folder / name
    if dest.is_symlink() or not dest.is_file() or dest.stat().st_size != source.stat().st_size:
        return False
    return dest.read_bytes() == source.read_bytes()


def _remove(folder: Path, name: str) -> bool:
    """Remove a file of an earlier publish, and the folders that this leaves empty; whether it was there."""
    path = folder / name
    if not _is_inside(folder, name) or path.is_symlink() or not path.is_file():
        return False
    path.unlink()
    for parent in path.parents:
        if parent == folder or parent.is_symlink() or any(parent.iterdir()):
            break
        parent.rmdir()
    return True


def to_branch(site: Path, branch: Branch, *, force: bool = False) -> str:
    """Put the site on a branch as one commit on top of its head; a report of what was done.

    Raises PublishError with git's message, or like `_check_owner` and `_fill`.
    """
    full = f"refs/heads/{branch.name}"
    with tempfile.TemporaryDirectory(prefix="ladder-publish-") as temporary:
        clone = Path(temporary, "clone")
        git(Path(temporary), "init", "--quiet", "--initial-branch", branch.name, str(clone))
        git(clone, "config", "core.autocrlf", "false")
        if git(clone, "ls-remote", "--heads", "--", branch.remote, full):
            git(clone, "fetch", "--quiet", "--depth", "1", "--", branch.remote, full)
            git(clone, "reset", "--quiet", "--hard", "FETCH_HEAD")
        _check_owner(clone, str(branch), force)
        _fill(site, clone, str(branch), force)
        write(clone / ".nojekyll", b"")  # otherwise GitHub Pages omits names with a leading underscore
        git(clone, "add", "--all", "--force", ".")
        if not git(clone, "status", "--porcelain"):
            return f"{branch}: nothing has changed"
        commit = git(site.parent, "log", "-1", "--format=%h") if (site.parent / ".git").exists() else ""
        message = f"The site as of {commit}" if commit else "The site"
        identity = git(clone, "config", "user.email", fails=True)
        author = [] if identity else ["-c", "user.name=publish", "-c", "user.email=publish@localhost"]
        git(clone, *author, "commit", "--quiet", "--message", message)
        git(clone, "push", "--quiet", "--", branch.remote, f"HEAD:{full}")
        count = git(clone, "ls-files").count("\n") + 1
        return f"{branch}: {count} files in a new commit"


def git(folder: Path, *words: str, fails: bool = False) -> str:
    """Run git in a folder; its output, or "" if it fails and `fails` allows that.

    Raises PublishError with git's message, or if git is not installed.
    """
    env = {name: value for name, value in os.environ.items() if name not in ELSEWHERE}
    env |= {"GIT_ALLOW_PROTOCOL": PROTOCOLS}
    if not shutil.which("git"):
        raise PublishError("git is not installed")
    result = subprocess.run(["git", *words], cwd=folder, env=env, capture_output=True, text=True, check=False)
    if result.returncode != 0 and not fails:
        raise PublishError(f"git {words[0]}: {(result.stderr or result.stdout).strip() or 'failed'}")
    return result.stdout.strip() if result.returncode == 0 else ""
