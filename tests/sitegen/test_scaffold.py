"""What `new` writes works as it is: a chapter that builds strictly, a figure that is sound and whose test passes."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from sitegen.scaffold import NameTaken, new_chapter, new_command, new_figure
from tests.sitegen.conftest import ROOT, Project
from widgets.registry import WIDGETS

FRAMES = """
from widgets.contract import preset
from widgets.host import Host
from widgets.registry import WIDGETS
widget = WIDGETS["my-figure"]
plain = preset(widget).plain()
logs = [], [["press", "solve"]], [["drag", "turn", 9.0, -3.0]]
frames = [Host().render("f", {**plain, "log": log}) for log in logs]
assert len({frame["description"] for frame in frames}) == 3
printed = {}
for frame in frames:
    exec(frame["python"], {"print": lambda name, value: printed.update({name: value})})
    assert f"{printed['rms']:.3f}" == frame["readouts"][0]["value"]
"""


def run(root: Path, *words: str) -> None:
    env = {**os.environ, "PYTHONPATH": str(root)}
    done = subprocess.run([sys.executable, *words], cwd=root, env=env, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr


def test_a_new_chapter_builds_as_it_is(project: Project) -> None:
    project.widgets["kabsch"] = WIDGETS["kabsch"]
    claimed = "tests/claims/test_known_pairs.py"
    project.write(claimed, (ROOT / claimed).read_text("utf-8"))
    made = new_chapter(project.root, "my-chapter", 'Of "this": and that')
    assert made == [project.root / "content" / "02-my-chapter.md"]
    project.build(drafts=True, strict=True)
    page = project.page("my-chapter.html")
    assert "Of &#34;this&#34;: and that" in page
    assert 'id="fig-my-chapter"' in page
    assert "The one thing to see" in project.page("slides-my-chapter.html")
    assert "my-chapter.html" not in project.build().pages  # a draft


def test_a_new_figure_works_as_it_is(tmp_path: Path) -> None:
    for name in ("solvers", "widgets"):
        shutil.copytree(ROOT / name, tmp_path / name, ignore=shutil.ignore_patterns("__pycache__"))
    made = new_figure(tmp_path, "my-figure", "It's \"mine\"")
    assert [path.relative_to(tmp_path).as_posix() for path in made] == [
        "widgets/figures/my_figure.py",
        "tests/widgets/test_my_figure.py",
    ]
    run(tmp_path, "-m", "pytest", "-q", "-p", "no:cacheprovider", str(made[1]))
    run(tmp_path, "-c", FRAMES)
    ruff = ("ruff", "check", "--no-cache", "--ignore", "I001", "--config", str(ROOT / "pyproject.toml"))
    run(ROOT, "-m", *ruff, *map(str, made))


@pytest.mark.parametrize("name", ["", "Upper", "with space", "9lives", "ünder", "../out", "a--b"])
def test_what_is_no_name_is_refused(project: Project, name: str) -> None:
    for new in (new_chapter, new_figure):
        with pytest.raises(NameTaken, match="is no name"):
            new(project.root, name)


def test_a_name_is_given_once(project: Project, capsys: pytest.CaptureFixture[str]) -> None:
    assert new_command(project.root, "chapter", "second", "") == 2
    assert "there is content/01-second.md" in capsys.readouterr().err
    assert new_command(project.root, "chapter", "glossary", "") == 2
    assert "a page of the site's own" in capsys.readouterr().err
    assert new_command(project.root, "figure", "mine", "") == 0
    assert "made widgets/figures/mine.py" in capsys.readouterr().out
    assert new_command(project.root, "figure", "mine", "") == 2
    assert "there is widgets/figures/mine.py" in capsys.readouterr().err
