"""Everything that the README and the docs name exists: files, commands, options, package parts. The README is short."""

from __future__ import annotations

import argparse
import importlib
import re
import shlex
import shutil
import tomllib
from pathlib import Path
from typing import Any

import pytest

from sitegen.chapters.content import read_docs
from sitegen.cli.main import COMMANDS, parse
from sitegen.markup.inline import BLOCK, INLINE
from sitegen.markup.parser import CONTAINERS
from sitegen.problems import Problems
from solvers.cli import benchmark, drive, methods, register
from solvers.uncertainty_study import coverage
from tests.sitegen.conftest import START, Project
from widgets.engine.registry import WIDGETS

ROOT = Path(__file__).resolve().parents[3]
TEXTS = [ROOT / "README.md", *sorted((ROOT / "content" / "docs").glob("*.md"))]
NAMES = [path.relative_to(ROOT).as_posix() for path in TEXTS]
LONGEST = 650
FOLDERS = ("content", "sitegen", "solvers", "templates", "tests", "widgets")
OPTION = re.compile(r"(?<![\w-])--[a-z][a-z-]*")
PAGE = "content/docs/commands.md"
CODE = re.compile(r"`([^`\n]+(?:\n[^`\n]+)?)`")
FENCE = re.compile(r"^```(\w*)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
FOR_NAMES = {"COMMAND": "build", "NAME": "name", "DEST": "folder"}
PARSERS = {command.__name__.rpartition(".")[2]: command.parser() for command in (register, benchmark, drive, methods)}
NO_ROOMS = {"__main__", "problems", "progress", "stopping", "html_reader"}
BESIDE = {"--hostile-calls", "--help"}  # pytest's and argparse's


@pytest.fixture(params=TEXTS, ids=NAMES)
def text(request: pytest.FixtureRequest) -> str:
    return str(request.param.read_text("utf-8"))


def words(text: str) -> list[str]:
    """The words of a text as a reader sees them, without bars and marks of Markdown."""
    return re.findall(r"\S*\w\S*", text)


def commands(text: str, begin: str) -> list[list[str]]:
    """The arguments of every call of a program, without comments and closing quotes."""
    matches = re.findall(rf"{re.escape(begin)}((?: [^`\n]*)?)(?=[`\n])", text)
    return [[FOR_NAMES.get(word, word) for word in shlex.split(re.split(r"\s+#", line)[0])] for line in matches]


def options(parser: argparse.ArgumentParser) -> set[str]:
    return {name for action in parser._actions for name in action.option_strings if name.startswith("--")}


def test_the_readme_is_short() -> None:
    """Its headings are what a newcomer looks for; everything else is in the docs."""
    text = TEXTS[0].read_text("utf-8")
    assert len(words(text)) <= LONGEST
    headings = ["Quickstart", "Use the package", "Commands", "Architecture", "Read on", "Contribute", "Licence"]
    assert [heading for heading in headings if f"\n## {heading}\n" not in text] == []
    names = re.findall(r"^\| `(\w+)` \|", text, re.MULTILINE)
    assert names == list(COMMANDS)


def test_the_readme_s_links_and_pictures_are_there() -> None:
    """Relative to the repository, and including every page of the docs."""
    links = re.findall(r"(?<!\\)\]\(([^)\s]+)\)", TEXTS[0].read_text("utf-8"))
    assert [link for link in links if not (ROOT / link.partition("#")[0]).is_file()] == []
    assert set(NAMES[1:]) - set(links) == set()


def test_every_file_that_is_named_is_there(text: str) -> None:
    """In code, from one of the top folders; a name with a placeholder stands for many."""
    names = [name for name in CODE.findall(text) if re.fullmatch(rf"(?:{'|'.join(FOLDERS)})/[\w./-]*", name)]
    names = [name for name in names if "NAME" not in name]
    assert [name for name in names if not (ROOT / name).exists()] == []


def test_every_command_of_build_py_is_one(text: str, capsys: pytest.CaptureFixture[str]) -> None:
    wrong = []
    for arguments in commands(text, "python3 build.py"):
        try:
            if arguments != ["…"]:
                parse(arguments)
        except SystemExit:
            wrong.append((arguments, capsys.readouterr().err))
    assert wrong == []


def test_every_call_of_the_solvers_is_one(text: str, capsys: pytest.CaptureFixture[str]) -> None:
    for arguments in commands(text, "python3 -m solvers"):
        has_name = bool(arguments) and arguments[0] in PARSERS
        if arguments and arguments != ["--help"]:
            PARSERS[arguments[0] if has_name else "register"].parse_args(arguments[has_name:])
    assert "error" not in capsys.readouterr().err


def test_every_option_is_one_of_some_command() -> None:
    flags: set[str] = set()
    for command in COMMANDS.values():
        parser = argparse.ArgumentParser()
        command.options(parser)
        flags |= options(parser)
    names = {
        word for code in CODE.findall(TEXTS[NAMES.index(PAGE)].read_text("utf-8")) for word in OPTION.findall(code)
    }
    assert names - flags - BESIDE == set()
    everywhere = {word for path in TEXTS for word in OPTION.findall(path.read_text("utf-8"))}
    assert flags - everywhere == set(), "an option that no page of the docs tells of"


def resolve(name: str) -> Any:
    """The object that a dotted name denotes: a module, or something in one."""
    parts = name.split(".")
    result = importlib.import_module(parts[0])
    for i, part in enumerate(parts[1:], 2):
        if not hasattr(result, part):
            importlib.import_module(".".join(parts[:i]))
        result = getattr(result, part)
    return result


def test_every_name_of_the_package_is_there(text: str) -> None:
    without = FENCE.sub("", text)
    names = [code for code in CODE.findall(without) if re.fullmatch(r"solvers(?:\.\w+)+", code)]
    assert [name for name in names if resolve(name) is None] == []


def test_every_message_that_troubleshooting_explains_is_said() -> None:
    """The first cells quote what commands and pages say; an ellipsis stands for the parts that vary."""
    kinds = ("sitegen/**/*.py", "templates/assets/**/*js")
    texts = "\n".join(path.read_text("utf-8") for kind in kinds for path in sorted(ROOT.glob(kind)) if path.is_file())
    text = (ROOT / "content/docs/troubleshooting.md").read_text("utf-8")
    quotes = re.findall(r"^\| (?:[^|]* )?\"([^\"|]+)\"", text, re.MULTILINE)
    assert len(quotes) > 9
    parts = [part.strip(" ,") for message in quotes for part in message.split("…")]
    assert [part for part in parts if part not in texts] == []


def test_a_docs_page_has_no_mistake_of_its_own() -> None:
    problems = Problems()
    docs = read_docs(ROOT, problems)
    assert [doc.source.path for doc in docs] == NAMES[1:]
    assert problems.found == []


@pytest.mark.parametrize("package", ["solvers", "widgets", "sitegen"])
def test_the_tables_of_rooms_are_those_of_the_contracts(package: str) -> None:
    """Each room once, none above a room that may import it; except for two kinds of modules that are not rooms: those
    that users import, and the generator's that are below all rooms."""
    text = (ROOT / "content/docs/architecture.md").read_text("utf-8")
    table = text.partition(f"| room of `{package}` |")[2].partition("\n\n")[0]
    rows = [row.split(", ") for row in re.findall(r"^\| ([a-z_, …]+) \|", table, re.MULTILINE)]
    rooms = [name for row in rows if "…" not in row for name in row]
    contracts = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["tool"]["importlinter"]["contracts"]
    (layers,) = [contract["layers"] for contract in contracts if contract.get("containers") == [package]]
    level = {name: k for k, layer in enumerate(layers) for name in layer.split(" | ")}
    public = {name for name in level if level[name] == level.get("race")}
    assert sorted(rooms) == sorted({*level} - public - NO_ROOMS)
    assert [level[name] for name in rooms] == sorted(level[name] for name in rooms)
    assert {name for row in rows if "…" in row for name in row} <= {*public, "…"}


def test_every_family_of_methods_stands_among_the_rooms() -> None:
    text = (ROOT / "content/docs/architecture.md").read_text("utf-8")
    (families,) = re.findall(r"^\| methods \| one room per family: ([a-z, ]+);", text, re.MULTILINE)
    assert set(families.split(", ")) == {path.parent.name for path in (ROOT / "solvers/methods").glob("*/__init__.py")}


def test_the_counts_of_regions_in_the_docs_on_the_package_are_those_of_the_study() -> None:
    """Another processor may decide a few draws otherwise."""
    text = (ROOT / "content/docs/package.md").read_text("utf-8")
    pattern = r"not at 0\.01 u \((\d+) of (\d+)\s+regions held the truth, of `hessian`'s (\d+)\)"
    ((censi, count, hessian),) = re.findall(pattern, text)
    lines = coverage("room", ways=("censi", "hessian"), count=int(count), noise=0.01)
    assert [line.covered for line in lines] == pytest.approx([int(censi), int(hessian)], abs=3)


def test_the_table_of_directives_names_every_one() -> None:
    text = (ROOT / "content/docs/authoring.md").read_text("utf-8")
    table = text.partition("\n## Directives")[2].partition("\n## ")[0]
    names = [f"`::{name}[" for name in BLOCK] + [f"`:{name}[" for name in INLINE]
    names += [f"`:::{name}`" for name in CONTAINERS]
    assert [name for name in names if name not in table] == []


def test_what_the_page_on_chapters_shows_can_be_pasted() -> None:
    """Its figures and equations have names that no chapter uses, or a link from elsewhere would be ambiguous."""
    pattern = re.compile(r"\bid=([\w-]+)|\$\$ \(([\w-]+)\)")
    text = (ROOT / "content/docs/authoring.md").read_text("utf-8")
    ids = set().union(*(pattern.findall(block) for _, block in FENCE.findall(text)))
    site_ids = set().union(*(pattern.findall(path.read_text("utf-8")) for path in (ROOT / "content").glob("*.md")))
    assert len(ids) > 3
    assert ids & site_ids == set()


def test_the_chapter_that_is_shown_builds(project: Project) -> None:
    """The page on chapters begins with a whole one, and later shows its slides."""
    text = (ROOT / "content/docs/authoring.md").read_text("utf-8")
    blocks = dict(FENCE.findall(text))
    chapter = blocks["markdown"].replace("summary:", f"{blocks['yaml']}summary:", 1)
    project.widgets = {"kabsch": WIDGETS["kabsch"]}
    project.write("content/00-start.md", START.partition("Read")[0])
    (project.root / "content/01-second.md").unlink()
    project.write("content/01-known.md", chapter)
    test = "tests/claims/test_known_pairs.py"
    (project.root / test).parent.mkdir(parents=True)
    for name in (test, "content/references.yaml"):
        shutil.copy(ROOT / name, project.root / name)
    report = project.build()
    assert {"known-pairs.html", "slides-known-pairs.html"} <= set(report.pages)
    assert [warning for warning in report.warnings if "01-known" in warning.path] == []
