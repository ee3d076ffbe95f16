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
