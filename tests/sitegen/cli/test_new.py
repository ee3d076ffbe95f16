"""What `new` writes works unchanged: a chapter that builds strictly, a figure that is sound and whose test passes."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from sitegen.cli.new import NameTaken, chosen, new_chapter, new_command, new_figure
from tests.sitegen.conftest import ROOT, Project
from tests.sitegen.pages import test_real_chapters as real_chapters
from widgets.engine.registry import WIDGETS

FRAMES = """
from widgets.engine.contract import preset
from widgets.engine.host import Host
from widgets.engine.registry import WIDGETS
widget = WIDGETS["my-figure"]
plain = preset(widget).plain()
logs = [], [["press", "solve"]], [["drag", "turn", 9.0, -3.0]]
frames = [Host().render("f", {**plain, "log": log}) for log in logs]
assert len({frame["description"] for frame in frames}) == 3
printed = {}
for frame in frames:
    exec(frame["python"], {"print": lambda name, value: printed.update({name: value})})
    for readout in frame["readouts"]:
        assert abs(printed[readout["name"]] - float(readout["value"])) < 0.06, readout
"""


def run(root: Path, *words: str) -> None:
    env = {**os.environ, "PYTHONPATH": str(root)}
    process = subprocess.run([sys.executable, *words], cwd=root, env=env, capture_output=True, text=True, check=False)
    assert process.returncode == 0, process.stdout + process.stderr


def test_a_new_chapter_builds_as_it_is(project: Project) -> None:
    project.widgets["kabsch"] = WIDGETS["kabsch"]
    tests = "tests/claims/test_known_pairs.py"
    project.write(tests, (ROOT / tests).read_text("utf-8"))
    project.write("content/02-kabsch.md", "---\ntitle: Known pairs\nslug: kabsch\nsummary: S\n---\nText.\n")
    paths = new_chapter(project.root, "my-chapter", 'Of "this": and that')
    assert paths == [project.root / "content" / "03-my-chapter.md"]
    project.build(drafts=True, strict=True)
    page = project.page("my-chapter.html")
    assert "Of &#34;this&#34;: and that" in page
    assert 'id="fig-my-chapter"' in page
    assert "The one thing to see" in project.page("slides-my-chapter.html")
    assert "my-chapter.html" not in project.build().pages  # a draft


@pytest.mark.parametrize("name", ["other", "old-name", "slides-other", "checks-other", "docs-style"])
def test_no_new_chapter_takes_the_page_of_another(tmp_path: Path, name: str) -> None:
    """A chapter's page is called by its slug, which need not be in its file's name; with both, nothing would build."""
    front = "---\ntitle: T\nslug: other\nsummary: S\nredirects: [old-name]\nslides:\n  - {title: T, text: A.}\n---\n"
    plain = "---\ntitle: T\nquestion: Q\nsummary: S\n---\n"
    for file, text in (("00-start.md", plain), ("02-second.md", front), ("docs/style.md", plain)):
        (tmp_path / "content" / file).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / "content" / file).write_text(text, "utf-8")
    with pytest.raises(NameTaken, match=f"{name}.html is a page of content/"):
        new_chapter(tmp_path, name)
    assert sorted(path.name for path in (tmp_path / "content").glob("*.md")) == ["00-start.md", "02-second.md"]


@pytest.mark.parametrize("title", ["  ", "caf\udce9", "a\tb", "of $x$"])
def test_a_title_that_no_chapter_can_have_is_refused(tmp_path: Path, title: str) -> None:
    """A blank one, one in Latin-1 as a terminal hands it over, one with a tab, one with a formula."""
    with pytest.raises(NameTaken, match="title"):
        new_chapter(tmp_path, "my-chapter", title)
    assert list(tmp_path.iterdir()) == []


def test_a_new_chapter_is_written_as_the_docs_say(tmp_path: Path) -> None:
    """A lead before the bar, a bold button, and everything required of the site's chapters."""
    (path,) = new_chapter(tmp_path, "my-chapter")
    text = path.read_text("utf-8")
    assert re.search(r"^::figure\[[^|]*\*\*Solve\*\*[^|]* \| ", text, re.MULTILINE)
    real_chapters.test_it_opens_with_what_it_assumes_and_answers(path)
    real_chapters.test_it_has_three_exercises_whose_answers_are_computed(path)
    real_chapters.test_it_ends_in_five_lines(path)
    real_chapters.test_it_says_where_next(path)


def test_a_new_figure_works_as_it_is(tmp_path: Path) -> None:
    for name in ("solvers", "widgets", "tests/widgets"):
        shutil.copytree(ROOT / name, tmp_path / name, ignore=shutil.ignore_patterns("__pycache__"))
    shutil.copy(ROOT / "pyproject.toml", tmp_path)
    paths = new_figure(tmp_path, "my-figure", "It's \"mine\"")
    assert [path.relative_to(tmp_path).as_posix() for path in paths] == [
        "widgets/figures/my_figure.py",
        "tests/widgets/figures/test_my_figure.py",
    ]
    run(tmp_path, "-m", "pytest", "-q", "-p", "no:cacheprovider", "-k", chosen("my-figure").strip('"'), "tests/widgets")
    run(tmp_path, "-c", FRAMES)
    run(tmp_path, "-m", "ruff", "check", "--no-cache", *map(str, paths))


def test_what_a_figure_is_held_to_is_told_when_it_fails(tmp_path: Path) -> None:
    """A motion of a missing group, a view that follows the state, too short a sentence: each says what to do."""
    for name in ("solvers", "widgets"):
        shutil.copytree(ROOT / name, tmp_path / name, ignore=shutil.ignore_patterns("__pycache__"))
    (tmp_path / "tests" / "widgets").mkdir(parents=True)
    for name in ("tests/widgets/test_every_widget.py", "pyproject.toml"):
        shutil.copy(ROOT / name, tmp_path / name)
    (path, _) = new_figure(tmp_path, "my-figure")
    text = path.read_text("utf-8")
    mistakes = {
        'Group("source"': 'Group("sourec"',
        '"Source and target", VIEW': '"Source and target", View(-6.0, 6.0 + left, -4.0, 4.0)',
        "which have noise of {number(state.controls.noise)} u.": "as they should be by now.",
    }
    for right, wrong in mistakes.items():
        assert text.count(right) == 1
        text = text.replace(right, wrong)
    path.write_text(text, "utf-8")
    words = ["-m", "pytest", "-q", "-p", "no:cacheprovider", "-k", "my-figure", "tests/widgets"]
    process = subprocess.run([sys.executable, *words], cwd=tmp_path, capture_output=True, text=True, check=False)
    for report in (
        "draw puts no Group of that name into that panel",
        "my-figure: give every state the same readouts (names, labels) and the same panels, each with one view",
        "my-figure: noise is 0.2; say '0.20 u' in the description or a caption",
    ):
        assert report in process.stdout


@pytest.mark.parametrize("name", ["", "Upper", "with space", "9lives", "ünder", "../out", "a--b"])
def test_what_is_no_name_is_refused(project: Project, name: str) -> None:
    for new in (new_chapter, new_figure):
        with pytest.raises(NameTaken, match="invalid name"):
            new(project.root, name)


@pytest.mark.parametrize("name", ["class", "and", "import", "yield"])
def test_a_word_of_python_s_names_no_figure(project: Project, name: str, capsys: pytest.CaptureFixture[str]) -> None:
    """Its test could not import it. A chapter may have the name."""
    assert new_command(project.root, "figure", name, "") == 2
    assert f"{name!r} is a Python keyword" in capsys.readouterr().err
    assert not (project.root / "widgets" / "figures").exists()
    assert new_command(project.root, "chapter", name, "") == 0


@pytest.mark.parametrize("name", ["no", "null", "true", "off"])
def test_a_word_of_yaml_s_names_nothing(project: Project, name: str) -> None:
    """It is used in the front matter, as the name of a page and of a slide's figure."""
    for new in (new_chapter, new_figure):
        with pytest.raises(NameTaken, match=r"is read as .* in a chapter's front matter"):
            new(project.root, name)


def test_a_name_that_windows_or_every_test_has_is_refused(project: Project) -> None:
    for new in (new_chapter, new_figure):
        with pytest.raises(NameTaken, match="a reserved device name on Windows"):
            new(project.root, "aux")
    for name in ("test", "py", "e", "figure", "widgets"):
        with pytest.raises(NameTaken, match=f"`test -k {name}` would run them all"):
            new_figure(project.root, name)


def test_names_that_only_look_dangerous_work(tmp_path: Path) -> None:
    """Names of modules that the figure imports, and Python's soft keywords: the figures' tests pass, side by side."""
    names = ("svgs", "none", "numpy", "match", "self", "placing", "dataclasses")
    for folder in ("solvers", "widgets"):
        shutil.copytree(ROOT / folder, tmp_path / folder, ignore=shutil.ignore_patterns("__pycache__"))
    tests = [str(new_figure(tmp_path, name)[1]) for name in names]
    run(tmp_path, "-m", "pytest", "-q", "-p", "no:cacheprovider", "--import-mode=importlib", *tests)


def test_what_cannot_be_written_leaves_nothing(project: Project, capsys: pytest.CaptureFixture[str]) -> None:
    """On a read-only tree, or here with a file in a folder's place: one line, exit code 1."""
    project.write("tests/widgets/figures", "a file")
    assert new_command(project.root, "figure", "mine", "") == 1
    output = capsys.readouterr().err
    assert re.fullmatch(r"new figure: tests/widgets/figures/test_mine\.py: .+; nothing was created\n", output)
    assert not (project.root / "widgets" / "figures" / "mine.py").exists()


def test_the_command_that_is_told_chooses_the_figure_s_tests(monkeypatch: pytest.MonkeyPatch) -> None:
    """Its own test file and its case in every test over all figures, but no other figure's cases."""
    monkeypatch.delenv("PYTEST_ADDOPTS", raising=False)  # a -v there would undo the -q
    choosing = chosen("two-poses").strip('"')
    words = ["-m", "pytest", "--collect-only", "-q", "-k", choosing, "tests/widgets", "tests/pyodide/test_frames.py"]
    process = subprocess.run([sys.executable, *words], cwd=ROOT, capture_output=True, text=True, check=True)
    output = [line.removeprefix("tests/") for line in process.stdout.splitlines() if "::" in line]
    own = [line for line in output if line.startswith("widgets/figures/test_two_poses.py::")]
    cases = [line for line in output if line.endswith("[two-poses]")]
    assert len(own) > 3
    files = {line.partition("::")[0] for line in cases}
    over_all = {
        path.relative_to(ROOT / "tests").as_posix()
        for path in [*(ROOT / "tests" / "widgets").rglob("test_*.py"), ROOT / "tests" / "pyodide" / "test_frames.py"]
        if re.search(r'parametrize\("name", (?:list\()?WIDGETS\)?\)', path.read_text("utf-8"))
    }
    assert over_all == files >= {"widgets/test_every_widget.py", "pyodide/test_frames.py"}
    assert not [line for line in output if line not in own and "[" in line and "two-poses" not in line]


def test_a_name_is_given_once(project: Project, capsys: pytest.CaptureFixture[str]) -> None:
    assert new_command(project.root, "chapter", "second", "") == 2
    assert "content/01-second.md already exists" in capsys.readouterr().err
    assert new_command(project.root, "chapter", "glossary", "") == 2
    assert "is a built-in page" in capsys.readouterr().err
    assert new_command(project.root, "figure", "mine", "") == 0
    assert "created widgets/figures/mine.py" in capsys.readouterr().out
    assert new_command(project.root, "figure", "mine", "") == 2
    assert "widgets/figures/mine.py already exists" in capsys.readouterr().err
    project.write("widgets/figures/broad/figure.py", "")
    assert new_command(project.root, "figure", "broad", "") == 2
    assert "widgets/figures/broad already exists;" in capsys.readouterr().err
