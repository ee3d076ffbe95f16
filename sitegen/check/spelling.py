"""Spelling: no misspelt word in prose, comments and messages, and no American one in what readers read."""

from __future__ import annotations

import subprocess
import sys
import tempfile
from importlib.resources import files
from pathlib import Path

# Tests misspell on purpose.
WRITTEN = ("content", "solvers", "sitegen", "widgets", "templates", "README.md", "CHANGELOG.md")
READ = ("content", "README.md", "CHANGELOG.md", "solvers/README.md")
TITLES = "content/references.yaml"  # others spell as they like
# British too, in what is meant: a program that runs, the file LICENSE, how a story goes, good practice.
BOTH = "program,programs,story,stories,practice,practices,license,licenses,math"


def spelling(root: Path) -> int:
    """Tell every misspelling. The exit code is 1 where there is one; pyproject.toml has the project's own words."""
    with tempfile.TemporaryDirectory(prefix="ladder-spelling-") as folder:
        american = Path(folder, "american.txt")
        american.write_text(anglicised(), "utf-8")
        found = [
            _codespell(root, ["--builtin", "clear,rare", *_there(root, WRITTEN)]),
            _codespell(root, ["-D", str(american), "-L", BOTH, "--skip", TITLES, *_there(root, READ)]),
        ]
    return max(found)


def anglicised() -> str:
    """codespell's dictionary of British words, turned round: what is spelt in the American way, and how it is here."""
    british: dict[str, list[str]] = {}
    text = files("codespell_lib").joinpath("data/dictionary_en-GB_to_en-US.txt").read_text("utf-8")
    pairs = [line.split("->") for line in text.splitlines() if "->" in line]
    for ours, theirs in pairs:
        for word in filter(None, (each.strip() for each in theirs.split(","))):
            british.setdefault(word, []).append(ours)
    known = {ours for ours, _ in pairs}
    return "".join(
        f"{word}->{', '.join(ours)}{',' * (len(ours) > 1)}\n" for word, ours in british.items() if word not in known
    )


def _there(root: Path, names: tuple[str, ...]) -> list[str]:
    return [name for name in names if (root / name).exists()]


def _codespell(root: Path, words: list[str]) -> int:
    command = [sys.executable, "-P", "-m", "codespell_lib", *words]
    return 1 if subprocess.run(command, cwd=root, stdin=subprocess.DEVNULL, check=False).returncode else 0
