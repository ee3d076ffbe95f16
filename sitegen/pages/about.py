"""Facts about a build for the About page: the same for every build of one commit."""

from __future__ import annotations

import subprocess
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

import solvers
from sitegen.chapters.rendered import Body
from sitegen.chapters.surveyed import Survey
from sitegen.external.pins import read_manifest


@dataclass(frozen=True)
class Made:
    """A build in numbers. `commit`: "" if git cannot tell; `changed`: whether the checkout has been edited since."""

    version: str
    commit: str
    changed: bool
    numpy: str
    pyodide: str
    chapters: int
    figures: int
    plots: int
    claims: int
    tests: int
    runtime_bytes: int


def made(root: Path, surveys: Sequence[Survey], bodies: Sequence[Body], runtime_bytes: int) -> Made:
    """Collect the numbers for a build of a checkout."""
    claims = [claim for body in bodies for claim in body.claims]
    commit = _git(root, "rev-parse", "--short=12", "HEAD")
    return Made(
        solvers.__version__,
        commit,
        bool(commit and _git(root, "status", "--porcelain")),
        np.__version__,
        read_manifest()["pyodide"].version,
        len(surveys),
        sum(len(survey.figures) for survey in surveys),
        sum(len(survey.plots) for survey in surveys),
        len(claims),
        len({claim.test_id for claim in claims}),
        runtime_bytes,
    )


def _git(root: Path, *words: str) -> str:
    """The output of a git command; "" if git is missing or fails, or the checkout has no history of its own."""
    if not (root / ".git").exists():
        return ""
    command = ["git", "--no-optional-locks", *words]
    try:
        result = subprocess.run(command, cwd=root, capture_output=True, text=True, timeout=20, check=False)
    except (OSError, subprocess.TimeoutExpired):
        return ""
    return result.stdout.strip() if result.returncode == 0 else ""


def bibtex(title: str, author: str, year: int, url: str) -> str:
    """A BibTeX entry for citing the site."""
    lines: Mapping[str, str] = {"title": f"{{{title}}}", "author": f"{{{author}}}", "year": str(year), "url": url}
    fields = "".join(f"  {name} = {{{value}}},\n" for name, value in lines.items() if value)
    return f"@misc{{registration-ladder,\n{fields}}}\n"
