"""Claims: statements in chapters that name the test that checks them, and the last outcome of that test.

The build reads tests as text and never runs them. `write_results` is for the test run: it stores, in a small committed
file, the outcome of every claimed test with the hash of the code that it ran on.
"""

from __future__ import annotations

import ast
import hashlib
import inspect
import json
import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, Literal

from sitegen.cache.code_hash import DATA
from sitegen.cache.files import content, digest, fingerprint, write
from sitegen.cache.memo import Remembered
from sitegen.cache.memory import Memory
from sitegen.chapters import whys
from sitegen.chapters.content import Chapter, read_chapters, read_docs, read_site
from sitegen.chapters.placing import listed
from sitegen.markup.directives import Directive, DirectiveError, attributes
from sitegen.markup.located import located
from sitegen.problems import Place, Problems, hint

FORMAT = "2"  # of the cached entries for test files; raised when the parsing changes
RESULTS = Path("tests/results.json")
TESTED = ("solvers", "widgets")
WIDGETS = re.compile(rb"^\s*(?:from|import) (?:tests\.)?widgets\b", re.MULTILINE)  # imports of them or their helpers
KINDS = ("why",)  # besides the plain kind, which has no name
Outcome = Literal["passed", "failed"]


@dataclass(frozen=True)
class Test:
    """A test function: id (file::function or file::Class::function), docstring, source, line in its file.

    changes: whether it takes the fixture `why`, with which it records the effect of changing one factor.
    """

    id: str
    doc: str
    source: str
    line: int
    changes: bool = False


@dataclass(frozen=True)
class Result:
    """A test's last outcome, and what changing one factor did in it. `current`: whether it ran on the code as it is."""

    outcome: Outcome
    current: bool
    change: whys.Change | None = None


def standing(result: Result | None) -> str:
    """A test's state for readers: its outcome, or "unknown" if it has not yet run on this code."""
    return result.outcome if result is not None and result.current else "unknown"


def read_tests(root: Path, files: Iterable[str], cache: Path, memory: Memory | None = None) -> dict[str, Test]:
    """The tests in the named files, by id. Names are relative to the root; missing files have no tests."""
    paths = {name: root / name for name in sorted(set(files)) if name.endswith(".py")}
    sources = {name: content(path) for name, path in paths.items() if path.is_file()}
    return (memory or Memory()).answer("tests", sources, partial(_tests_of, sources, cache))


def _tests_of(sources: Mapping[str, bytes], cache: Path) -> dict[str, Test]:
    memo = Remembered(cache, f"tests-{FORMAT}")
    tests: list[Test] = []
    for name, data in sources.items():
        source = data.decode().replace("\r\n", "\n").replace("\r", "\n")
        tests += [Test(*fields) for fields in memo.answer(f"{name}\0{source}", partial(_tests_in, name, source))]
    memo.keep()
    return {test.id: test for test in tests}


def _tests_in(name: str, source: str) -> list[list[Any]]:
    """The tests of one file, each as the arguments of Test; none if the file is not valid Python."""
    try:
        tree = ast.parse(source)
    except SyntaxError:
        return []
    tests: list[list[Any]] = []
    lines = source.splitlines()
    for node in tree.body:
        members = node.body if isinstance(node, ast.ClassDef) and node.name.startswith("Test") else [node]
        owner = f"{node.name}::" if isinstance(node, ast.ClassDef) else ""
        for member in members:
            if isinstance(member, (ast.FunctionDef, ast.AsyncFunctionDef)) and member.name.startswith("test"):
                first = min([member.lineno, *(d.lineno for d in member.decorator_list)])
                text = inspect.cleandoc("\n" + "\n".join(lines[first - 1 : member.end_lineno]))
                changes = any(argument.arg == whys.FIXTURE for argument in member.args.args)
                tests.append([f"{name}::{owner}{member.name}", ast.get_docstring(member) or "", text, first, changes])
    return tests


def test_files(root: Path) -> list[str]:
    """Every test file of the project, relative to the root."""
    return sorted(path.relative_to(root).as_posix() for path in (root / "tests").rglob("test_*.py"))


def anchor(test_id: str) -> str:
    """The id of a test's entry on a page of checks."""
    return "check-" + hashlib.sha256(test_id.encode()).hexdigest()[:10]


def tested_code(root: Path) -> dict[str, str]:
    """The hash of each tested package's sources and data."""
    paths = {name: [p for p in (root / name).rglob("*") if p.suffix in (".py", *DATA)] for name in TESTED}
    return {name: fingerprint((p.relative_to(root).as_posix(), content(p)) for p in paths[name]) for name in TESTED}


def code_hash(root: Path, file: str, packages: Mapping[str, str]) -> str:
    """The hash of a test file and of what it tests: the solvers, and also the widgets if it uses those."""
    source = content(root / file) if (root / file).is_file() else b""
    with_widgets = file.startswith(("tests/widgets/", "tests/browser/")) or WIDGETS.search(source)
    names = TESTED if with_widgets else TESTED[:1]
    return hashlib.sha256("".join([digest(source), *(packages[name] for name in names)]).encode()).hexdigest()[:16]


def test_of(directive: Directive) -> str:
    """The id of the test that a claim names; "" if it names none."""
    try:
        return next((attribute.value for attribute in attributes(directive) if not attribute.name), "")
    except DirectiveError:
        return ""


def kind_of(directive: Directive, at: Callable[[int], Place], problems: Problems) -> str:
    """The kind that a claim names, or ""; any other attribute besides its test goes to `problems`."""
    attrs = listed(directive, at, problems) or []
    for extra in [attribute for attribute in attrs if not attribute.name][1:]:
        suggestion = f"; did you mean kind={extra.value}?" if extra.value in KINDS else ""
        problems.add(at(extra.start), f"expected name=value, got {extra.value!r}{suggestion}")
    for unknown in (attribute for attribute in attrs if attribute.name not in ("", "kind")):
        problems.add(at(unknown.start), f"unknown claim attribute {unknown.name!r}{hint(unknown.name, ['kind'])}")
    for kind in (a for a in attrs if a.name == "kind"):
        if kind.value in KINDS:
            return kind.value
        problems.add(at(kind.value_start), f"unknown kind of claim {kind.value!r}{hint(kind.value, KINDS)}")
    return ""


def unknown(test_id: str, tests: Mapping[str, Test]) -> str:
    """What is wrong with a claim's test that is not among all `tests`."""
    if not test_id:
        return "missing test, as in {tests/file.py::test_name}"
    file, files = test_id.partition("::")[0], {known.partition("::")[0] for known in tests}
    if "::" in test_id and file not in files:  # the nearest test would be one of another file
        return f"no tests in {file!r}{hint(file, files)}"
    return f"unknown test {test_id!r}{hint(test_id, tests)}"


def lacking(test: Test, result: Result | None) -> str:
    """What a claim of kind *why* lacks, "" if nothing: a test with the fixture, or outcomes of its run on this code."""
    if not test.changes:
        return f"{test.id} changes no factor: a kind=why claim needs a test with the fixture `{whys.FIXTURE}`"
    if result is not None and standing(result) == "passed" and result.change is None:
        return f"{test.id} passed on this code but recorded no outcomes in {RESULTS.as_posix()}: run the tests again"
    return ""


def claimed(root: Path) -> list[str]:
    """The ids of all tests named by chapters (including drafts) and docs."""
    problems = Problems()
    chapters, _ = read_chapters(root, read_site(root, problems), problems, drafts=True)
    return claimed_by([*chapters, *read_docs(root, problems)])


def claimed_by(chapters: Iterable[Chapter]) -> list[str]:
    """The ids of the tests that chapters name."""
    ids = set()
    for chapter in chapters:
        flows = [chapter.document.tokens, *chapter.document.footnotes.values()]
        for child in (child for flow in flows for token in flow for child in token.children or []):
            if child.type == "claim_open":
                ids.add(test_of(located(child, Directive).thing))
    return sorted(ids)


def tests_for(root: Path, chapters: Iterable[Chapter], cache: Path, memory: Memory) -> dict[str, Test]:
    """The tests in the files that chapters name; all tests if one of theirs is missing, to suggest the closest."""
    ids = claimed_by(chapters)
    tests = read_tests(root, (test_id.partition("::")[0] for test_id in ids), cache, memory)
    return tests if set(ids) <= set(tests) else read_tests(root, test_files(root), cache)


def read_results(root: Path, memory: Memory | None = None) -> dict[str, Result]:
    """Read the last results of the claimed tests."""
    path = root / RESULTS
    if not path.is_file():
        return {}
    packages = (memory or Memory()).answer("tested code", (), partial(tested_code, root))
    results = json.loads(path.read_text("utf-8"))
    codes = {name: code_hash(root, name, packages) for name in {test_id.partition("::")[0] for test_id in results}}
    return {
        test_id: Result(
            entry["outcome"],
            entry["code"] == codes[test_id.partition("::")[0]],
            whys.read(entry[whys.FIXTURE]) if whys.FIXTURE in entry else None,
        )
        for test_id, entry in sorted(results.items())
    }


def behind(root: Path) -> list[str]:
    """The claimed tests whose last result is missing or from other code."""
    results = read_results(root)
    return [i for i in claimed(root) if i not in results or not results[i].current]


def write_results(
    root: Path, outcomes: Mapping[str, Outcome], changes: Mapping[str, whys.Change] | None = None
) -> None:
    """Store the outcomes and changes of the claimed tests that ran; the others keep their earlier results."""
    path = root / RESULTS
    old = json.loads(path.read_text("utf-8")) if path.is_file() else {}
    ids = claimed(root)
    packages = tested_code(root)
    new: dict[str, dict[str, Any]] = {
        i: {"outcome": outcomes[i], "code": code_hash(root, i.partition("::")[0], packages)}
        for i in ids
        if i in outcomes
    }
    for i, change in (changes or {}).items():
        if i in new:
            new[i][whys.FIXTURE] = change.plain()
    result = {i: new.get(i) or old[i] for i in ids if i in new or i in old}
    text = json.dumps(result, indent=1, sort_keys=True) + "\n"
    if not path.is_file() or path.read_text("utf-8") != text:
        write(path, text.encode())


def merged(reports: Iterable[tuple[str, Outcome]]) -> dict[str, Outcome]:
    """Outcomes by test function from reports of parametrised cases: failed if any case failed."""
    result: dict[str, Outcome] = {}
    for node_id, outcome in reports:
        test_id = node_id.partition("[")[0]
        result[test_id] = "failed" if "failed" in (outcome, result.get(test_id)) else "passed"
    return result
