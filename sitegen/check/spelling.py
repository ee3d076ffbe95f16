"""Spelling: no misspelt word in prose, comments and messages, no American spelling in text for readers; and style."""

from __future__ import annotations

import subprocess
import sys
import tempfile
from importlib.resources import files
from pathlib import Path

from sitegen.check.style import style

# Tests misspell on purpose.
WRITTEN = ("content", "solvers", "sitegen", "widgets", "templates", "README.md", "CHANGELOG.md")
READ = ("content", "README.md", "CHANGELOG.md", "solvers/README.md")
TITLES = "content/references.yaml"  # other authors' spelling
# Also British in the sense used here: a computer program, the file LICENSE, how a story goes, good practice.
BOTH = "program,programs,story,stories,practice,practices,license,licenses,math"
DRAWN = ("widgets", "templates")  # their text is mixed with names of HTML, CSS, SVG and matplotlib
NAMES = "color,center,dialog,capitalize,behavior,normalize,miter,focused"


def spelling(root: Path) -> int:
    """Print every misspelling and every phrase listed in style.py. The exit code is 1 if there is one; pyproject.toml
    has the project's own words."""
    with tempfile.TemporaryDirectory(prefix="ladder-spelling-") as folder:
        american = Path(folder, "american.txt")
        american.write_text(anglicised(), "utf-8")
        processes = [
            _codespell(root, ["--builtin", "clear,rare"], WRITTEN),
            _codespell(root, ["-D", str(american), "-L", BOTH, "--skip", TITLES], READ),
            _codespell(root, ["-D", str(american), "-L", f"{BOTH},{NAMES}"], DRAWN),
        ]
        phrases = style(root)
        for process in filter(None, processes):
            sys.stdout.write(process.communicate()[0])
        sys.stdout.flush()
    return 1 if phrases or any(process and process.returncode for process in processes) else 0


def anglicised() -> str:
    """codespell's British dictionary, reversed: American spellings and their British corrections."""
    text = files("codespell_lib").joinpath("data/dictionary_en-GB_to_en-US.txt").read_text("utf-8")
    pairs = dict(line.split("->") for line in text.splitlines())
    return "".join(f"{theirs}->{ours}\n" for ours, theirs in pairs.items() if theirs not in pairs)


def _codespell(root: Path, words: list[str], names: tuple[str, ...]) -> subprocess.Popen[str] | None:
    """Start codespell on those of the names that exist; None if none do, since without names it would check
    everything."""
    existing = [name for name in names if (root / name).exists()]
    command = [sys.executable, "-P", "-m", "codespell_lib", *words, *existing]
    if not existing:
        return None
    return subprocess.Popen(command, cwd=root, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, text=True)
