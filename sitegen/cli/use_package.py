"""Follows the README of the installed package: `python -I use_package.py README.md FOLDER`.

It runs in an environment that has the package but not this generator, so it imports only `solvers` and the standard
library. Each Python block is run separately; each command is run in FOLDER, where two scans are written first. Commands
that draw are skipped without matplotlib.
"""

from __future__ import annotations

import contextlib
import importlib.util
import io
import itertools
import re
import shlex
import subprocess
import sys
import sysconfig
import time
from pathlib import Path

PYTHON = re.compile(r"^```python\n(.*?)^```$", re.MULTILINE | re.DOTALL)
SHELL = re.compile(r"^```sh\n(.*?)^```$", re.MULTILINE | re.DOTALL)
COMMAND = "registration-ladder"


def run_blocks(text: str) -> int:
    """Run each Python block separately; their number. Each must print something."""
    blocks = PYTHON.findall(text)
    assert blocks, "the README contains no Python"
    for code in blocks:
        with contextlib.redirect_stdout(io.StringIO()) as output:
            exec(compile(code, "README", "exec"), {"__name__": "__main__"})
        assert output.getvalue().strip(), f"prints nothing:\n{code}"
    return len(blocks)


def run_commands(text: str, program: Path, folder: Path, *, draws: bool) -> int:
    """Run the README's calls of the command in a folder with its scans; how many were run. Each must end with code 0,
    print something, and write its output files."""
    write_scans(folder)
    lines = [shlex.split(line) for block in SHELL.findall(text) for line in block.splitlines()]
    calls = [words[1:] for words in lines if words[:1] == [COMMAND]]
    calls = [words for words in calls if draws or not any(word.endswith(".svg") for word in words)]
    for words in [["--version"], ["methods"], *calls]:
        result = subprocess.run([program, *words], cwd=folder, capture_output=True, encoding="utf-8", check=False)
        command = " ".join(words)
        assert result.returncode == 0, f"{COMMAND} {command} exited with code {result.returncode}:\n{result.stderr}"
        assert result.stdout.strip(), f"{COMMAND} {command} prints nothing"
        for flag, name in itertools.pairwise(words):
            if flag == "--out":
                assert (folder / name).stat().st_size > 500, f"{COMMAND} {command} did not write {name}"
    return len(calls)


def write_scans(folder: Path) -> None:
    """Write the two scans that the README's commands register: a room, seen twice."""
    from solvers.scenes import room

    folder.mkdir(parents=True, exist_ok=True)
    scene = room("noise")
    for name, points, between in (("scan-a.csv", scene.source, ","), ("scan-b.xyz", scene.target, " ")):
        lines = [between.join(map(repr, row)) for row in points.tolist()]
        (folder / name).write_text("\n".join(lines) + "\n", "utf-8")


def main(readme: str, folder: str) -> None:
    """Follow the README and print a summary."""
    began = time.perf_counter()
    import numpy as np

    import solvers

    assert solvers.register(np.eye(2), np.eye(2), "kabsch").status
    first = time.perf_counter() - began
    assert Path(solvers.__file__).is_relative_to(sys.prefix), f"{solvers.__file__} is not the installed package"
    packages = [name for name in ("widgets", "sitegen", "tests", "build") if importlib.util.find_spec(name)]
    assert not packages, f"installed beside the package: {', '.join(packages)}"

    text = Path(readme).read_text("utf-8")
    draws = importlib.util.find_spec("matplotlib") is not None
    program = Path(sysconfig.get_path("scripts"), COMMAND)
    blocks, calls = run_blocks(text), run_commands(text, program, Path(folder), draws=draws)
    extras = [name for name in ("scipy", "matplotlib") if importlib.util.find_spec(name)]
    summary = f"first registration after {first:.2f} s, {blocks} examples and {calls} commands ran"
    print(f"with {' and '.join(extras) or 'numpy alone'}: {summary}")


if __name__ == "__main__":
    main(*sys.argv[1:])
