"""The Python shown in the chapters, the docs and the README runs."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
BLOCK = re.compile(r"^```python\n(.*?)^```$", re.MULTILINE | re.DOTALL)
SNIPPETS = [
    pytest.param(code, id=f"{path.stem}-{k}")
    for path in [ROOT / "README.md", *sorted((ROOT / "content").rglob("*.md"))]
    for k, code in enumerate(BLOCK.findall(path.read_text("utf-8")))
]


@pytest.mark.native
def test_there_are_snippets():
    """Code blocks are found in the chapters and in the README."""
    assert len(SNIPPETS) > 1
    assert SNIPPETS[0].id == "README-0"


@pytest.mark.native
@pytest.mark.parametrize("code", SNIPPETS)
def test_a_chapters_code_runs(code, capsys):
    """A code block of a chapter runs by itself, as a reader would run it, and prints something."""
    exec(compile(code, "chapter", "exec"), {"__name__": "__main__"})
    assert capsys.readouterr().out


@pytest.mark.native
def test_the_documented_method_of_ones_own_gives_the_shift(capsys):
    """The docs' example of a new method is registered with, and its answer is right."""
    page = (ROOT / "content/docs/package.md").read_text("utf-8")
    (code,) = BLOCK.findall(page.partition("## A new method")[2])
    exec(compile(code, "package", "exec"), {"__name__": "__main__"})
    assert "Result(centred: finished, steps=1, pose=Pose(angle=0°, t=(1, 3), scale=1))" in capsys.readouterr().out
