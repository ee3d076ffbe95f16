"""The package for pip: built without the network, inspected, installed, and used as its README says."""

from __future__ import annotations

import ast
import os
import re
import shlex
import shutil
import subprocess
import sys
import tarfile
import tomllib
import zipfile
from email import message_from_bytes
from email.message import Message
from pathlib import Path

import pytest
import yaml

import solvers
from sitegen.cli import package, use_package
from sitegen.cli.package import PackageError, among, built, ends, unpacked
from sitegen.cli.pythons import Interpreter, copied
from sitegen.runtime import wheel as page
from solvers.cli import benchmark, drive, methods, register
from solvers.cli.command import COMMANDS
from solvers.core.status import ENDED, Status

ROOT = Path(__file__).resolve().parents[3]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
README = (ROOT / package.README).read_text("utf-8")
pytestmark = pytest.mark.native


@pytest.fixture(scope="module")
def archives(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """The source distribution and the wheel, built from a copy of the checkout that also contains build.py."""
    folder = tmp_path_factory.mktemp("package")
    copied(ROOT, folder / "checkout")
    assert (folder / "checkout" / "build.py").is_file()
    return built(folder / "checkout", folder / "made")


@pytest.fixture(scope="module")
def installation(archives: tuple[Path, Path], tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder into which pip has installed the wheel and nothing else."""
    folder = tmp_path_factory.mktemp("installed")
    pip = [sys.executable, "-P", "-m", "pip", "install", "--quiet", "--no-deps", "--no-index", "--target", str(folder)]
    subprocess.run([*pip, str(archives[1])], check=True)
    return folder


def members(wheel: Path) -> dict[str, bytes]:
    with zipfile.ZipFile(wheel) as archive:
        return {name: archive.read(name) for name in archive.namelist()}


def metadata(inside: dict[str, bytes]) -> Message:
    return message_from_bytes(next(data for name, data in inside.items() if name.endswith(".dist-info/METADATA")))


def test_the_wheel_holds_the_solvers_and_nothing_else(archives: tuple[Path, Path]) -> None:
    """Byte for byte the sources of `solvers` that the page's wheel holds too; besides them only its own metadata."""
    inside = members(archives[1])
    results = {name: data for name, data in inside.items() if ".dist-info/" not in name}
    assert results == {name: data for name, data in page.sources().items() if name.startswith("solvers/")}
    assert {"solvers/py.typed", "solvers/_functions.pyi", "solvers/methods/flow/trained/flow.int8"} < set(results)
    licences = {name.partition("/licenses/")[2] for name in inside if "/licenses/" in name}
    assert licences == {"LICENSE", "solvers/scenes/recorded/telecom-loop.LICENSE.txt"}


def test_its_metadata_says_what_an_index_shows(archives: tuple[Path, Path]) -> None:
    """The package's own README, and every field of pyproject.toml in the standard's terms."""
    text = metadata(members(archives[1]))
    assert (text["Name"], text["Version"]) == ("registration-ladder", solvers.__version__)
    assert (text["Summary"], text["Requires-Python"]) == (PROJECT["description"], ">=3.11")
    assert text["Author"] == "The Registration Ladder authors"
    assert text["License-Expression"] == "MIT AND BSD-3-Clause"
    assert text.get_all("Provides-Extra") == ["scipy", "plot"]
    assert text.get_all("Requires-Dist") == ["numpy>=2.0", 'scipy; extra == "scipy"', 'matplotlib; extra == "plot"']
    assert text.get_all("Classifier") == PROJECT["classifiers"]
    assert text["Keywords"].split(",") == PROJECT["keywords"]
    assert text["Description-Content-Type"] == "text/markdown"
    assert text.get_payload(decode=True).decode().strip() == README.strip()


def test_the_source_distribution_can_be_built_and_tested_and_carries_no_site(archives: tuple[Path, Path]) -> None:
    with tarfile.open(archives[0]) as archive:
        names = {name.partition("/")[2] for name in archive.getnames()}
    top = {name.partition("/")[0] for name in names}
    ours = {"CHANGELOG.md", "CITATION.cff", "LICENSE", "MANIFEST.in", "pyproject.toml", "solvers", "tests"}
    assert top - {"", "PKG-INFO", "setup.cfg", "registration_ladder.egg-info"} == ours
    assert {name for name in names if name.startswith("tests/") and not name.startswith("tests/solvers")} == set()
    assert {"tests/solvers/conftest.py", "solvers/README.md", "solvers/methods/flow/trained/log.json"} < names
    assert not [name for name in names if "__pycache__" in name]


def test_its_tests_need_nothing_of_the_generator(archives: tuple[Path, Path], tmp_path: Path) -> None:
    """They import the package, its test requirements and each other; none uses the site's fixture `why` or reads a
    file that is not there."""
    tests = unpacked(archives[0], tmp_path) / "tests"
    paths = sorted(tests.rglob("*.py"))
    assert len(paths) > 40
    tops = {"solvers", "numpy", *package.TESTS, *sys.stdlib_module_names}
    for path in paths:
        for node in ast.walk(ast.parse(path.read_text("utf-8"))):
            names = [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
            names += [node.module or ""] if isinstance(node, ast.ImportFrom) else []
            for name in names:
                file = tests.parent / f"{name.replace('.', '/')}.py"
                assert name.partition(".")[0] in tops or file.is_file(), f"{path.name} imports {name}"
            if isinstance(node, ast.Constant) and isinstance(node.value, str) and len(node.value) < 100:
                there = (tests.parent / node.value).exists() or not (ROOT / node.value).is_file()
                assert there, f"{path.name} names {node.value}"
            if isinstance(node, ast.FunctionDef):
                assert "why" not in [argument.arg for argument in node.args.args], f"{path.name}: {node.name}"


def test_the_readme_s_python_runs_on_what_pip_installs(installation: Path, tmp_path: Path) -> None:
    """In a Python that finds the package but neither the checkout nor the figures."""
    code = f"""
import importlib.util, sys
sys.path[:0] = [{str(installation)!r}, {str(Path(use_package.__file__).parent)!r}]
import use_package, solvers
print(solvers.__file__, importlib.util.find_spec("widgets"), importlib.util.find_spec("sitegen"))
print(use_package.run_blocks(open({str(ROOT / package.README)!r}, encoding="utf-8").read()))
"""
    command = [sys.executable, "-I", "-c", code]
    process = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert process.returncode == 0, process.stderr
    lines = process.stdout.splitlines()
    assert lines == [f"{installation / 'solvers' / '__init__.py'} None None", str(README.count("```python"))]


def test_the_readme_s_commands_run_as_pip_installs_them(
    installation: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Only the quick ones; `build.py package` runs them all."""
    monkeypatch.setenv("PYTHONPATH", str(installation))
    lines = [line for line in README.splitlines() if line.startswith(f"{use_package.COMMAND} ")]
    quick = [line for line in lines if line.split()[1] not in ("drive", "benchmark")]
    text = "\n".join(["```sh", *quick, "```\n"])
    calls = use_package.run_commands(text, installation / "bin" / use_package.COMMAND, tmp_path, draws=False)
    assert calls == len(quick) - 1 == 2, "one draws"


def test_every_command_of_the_readme_is_one() -> None:
    """Its options exist too, and each of the four commands is shown."""
    calls = [shlex.split(words) for words in re.findall(rf"^{use_package.COMMAND} (.*)$", README, re.MULTILINE)]
    parsers = {"register": register, "benchmark": benchmark, "drive": drive, "methods": methods}
    for name, *words in calls:
        parsers[name].parser().parse_args(words)  # ends the process at an unknown word
    assert {name for name, *_ in calls} == set(parsers) == set(COMMANDS)


def test_a_readme_that_is_wrong_is_told(installation: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """An example that prints nothing, and a call of the command that fails."""
    with pytest.raises(AssertionError, match="prints nothing"):
        use_package.run_blocks("```python\nx = 1\n```\n")
    monkeypatch.setenv("PYTHONPATH", str(installation))
    fault = f"```sh\n{use_package.COMMAND} absent.csv scan-b.xyz\n```\n"
    with pytest.raises(AssertionError, match="exited with code 2"):
        use_package.run_commands(fault, installation / "bin" / use_package.COMMAND, tmp_path, draws=False)


def test_the_readme_reads_alone_on_an_index() -> None:
    """No link is relative, and following them needs no file of the repository."""
    links = re.findall(r"\]\(([^)\s]+)\)", README)
    assert [link for link in links if not link.startswith("https://")] == []
    assert "pip install registration-ladder" in README
    assert set(re.findall(r"registration-ladder\[(\w+)\]", README)) == set(PROJECT["optional-dependencies"])


def test_until_the_first_release_the_readme_says_how_to_install_without_an_index() -> None:
    log = (ROOT / "CHANGELOG.md").read_text("utf-8")
    released = re.search(r"^## \[[\d.]+\] - \d{4}", log, re.MULTILINE) is not None
    assert ("Until the first release" in README) is not released
    assert ("\npip install ." in README) is not released


def test_exit_code_3_is_told_in_the_same_words_everywhere() -> None:
    """In the commands' help, the package's README and the docs: every status of a run that no method ends with."""
    first, second = [status.label for status in Status if status not in ENDED and status is not Status.RUNNING]
    docs = (ROOT / "content/docs/package.md").read_text("utf-8").replace("`", "")
    of_register = f"is {first} or {second}, or no source point lies near the target"
    of_drive = "a scan was not matched, or the pose graph did not come to rest"
    for words, command in ((of_register, register), (of_drive, drive)):
        for text in (README, docs, command.parser().epilog or ""):
            assert words in " ".join(text.split())


def test_change_log_citation_and_package_name_one_version() -> None:
    versions = re.findall(r"^## \[([^\]]+)\]", (ROOT / "CHANGELOG.md").read_text("utf-8"), re.MULTILINE)
    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text("utf-8"))
    assert versions[0] in (solvers.__version__, "Unreleased")
    assert solvers.__version__ in versions
    assert citation["version"] == solvers.__version__
    assert [author["name"] for author in citation["authors"]] == [author["name"] for author in PROJECT["authors"]]


def test_pypa_s_build_is_handed_over_to(tmp_path: Path) -> None:
    """`python3 -m build` in the checkout runs PyPA's tool, although the checkout's build.py shadows it."""
    tool, checkout = tmp_path / "site" / "build", tmp_path / "checkout"
    for folder in (tool, checkout):
        folder.mkdir(parents=True)
    (tool / "__init__.py").touch()
    (tool / "__main__.py").write_text("import sys; print('PyPA build', sys.argv[1:])", "utf-8")
    shutil.copy(ROOT / "build.py", checkout)
    shutil.copytree(ROOT / "sitegen", checkout / "sitegen", ignore=shutil.ignore_patterns("__pycache__"))
    env = {**os.environ, "PYTHONPATH": str(tool.parent)}
    command = [sys.executable, "-m", "build", "--sdist"]
    process = subprocess.run(command, cwd=checkout, env=env, capture_output=True, text=True, check=False)
    assert process.stdout == "PyPA build ['--sdist']\n", process.stderr


def test_oldest_and_newest_are_tried() -> None:
    candidates = [Interpreter((3, k, 1), k != 14, Path(f"python3.{k}")) for k in (13, 11, 14, 12)]
    assert [python.name for python in ends(candidates)] == ["3.11.1", "3.13.1"]
    assert [python.name for python in ends(candidates[:1])] == ["3.13.1"]
    with pytest.raises(PackageError, match="ensurepip"):
        ends(candidates[2:3])


def test_releases_are_read_from_what_pip_lists() -> None:
    listing = "numpy (2.10.0)\nAvailable versions: 2.10.0, 2.9.1, 2.0.2, 2.0.0, 2.0.0rc1, 1.26.4\n  INSTALLED: 2.9.1"
    assert among(listing, "2.0") == ["2.0.0", "2.0.2", "2.9.1", "2.10.0"]
    with pytest.raises(PackageError, match=r"no numpy 3\.0 or newer"):
        among(listing, "3.0")


def test_a_step_that_fails_is_told_with_what_was_said(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """In a checkout with a broken pyproject.toml: exit code 1, the backend's own words, and no dist/."""
    root = tmp_path / "checkout"
    (root / "site").mkdir(parents=True)
    (root / "site" / ".gitignore").touch()
    (root / "pyproject.toml").write_text('[project]\nname = "a b c"\nversion = "1"\n', "utf-8")
    assert package.package_command(root) == 1
    assert "project.name" in capsys.readouterr().err
    assert not (root / "dist").exists()
