"""The generator's parts by themselves: directives, citations, calls and numbers, claims and their results."""

from __future__ import annotations

import json
from pathlib import Path
from types import ModuleType

import pytest

from sitegen.chapters import claims
from sitegen.chapters.citations import family_name, read_references
from sitegen.chapters.values import CallError, Values, evaluate, printed, read_call, read_value
from sitegen.figures.bakery import FIGURES, code_hash, code_of
from sitegen.figures.gallery import Gallery
from sitegen.markup.directives import Attribute, DirectiveError, attributes, read
from sitegen.markup.parser import unbroken
from sitegen.problems import Problems, hint
from tests.sitegen.conftest import SECOND, Project
from widgets.engine.registry import WIDGETS


def test_a_directive_knows_where_its_parts_stand() -> None:
    source = 'see :claim[A `]` and $(0, 1]$ and [x](y)]{a::b key="two words" n=1} end'
    result = read(source, 4, len(source), ":")
    assert result is not None
    assert (result.name, result.text) == ("claim", "A `]` and $(0, 1]$ and [x](y)")
    assert source[result.text_start :].startswith("A `]`")
    assert source[result.end :] == " end"
    words = attributes(result)
    assert [(a.name, a.plain) for a in words] == [("", "a::b"), ("key", "two words"), ("n", 1)]
    assert source[words[1].start :].startswith("key=")
    assert source[words[1].value_start :].startswith('"two')
    assert source[words[1].text_start :].startswith("two")
    assert words[2].text_start == words[2].value_start


@pytest.mark.parametrize("text", ["a: b", ":[x]", ": name[x]", ":Name[x]", ":name", ":name x"])
def test_what_is_no_directive(text: str) -> None:
    assert read(text, text.index(":"), len(text), ":") is None


def test_an_unclosed_quote_is_named() -> None:
    result = read(':x[a]{b c"}', 0, 11, ":")
    assert result is not None
    with pytest.raises(DirectiveError, match="unclosed quote") as error:
        attributes(result)
    assert error.value.offset == 9


@pytest.mark.parametrize(
    ("text", "value"),
    [("true", True), ("false", False), ("3", 3), ("-0.5", -0.5), ("1e-3", 0.001), ("noisy", "noisy"), ("", "")],
)
def test_values_of_attributes(text: str, value: object) -> None:
    plain = Attribute("a", text, 0, 2).plain
    assert plain == value
    assert type(plain) is type(value)


def test_hints() -> None:
    assert hint("noize", ["noise", "scene"]) == "; did you mean 'noise'?"
    assert hint("xyz", ["noise", "scene"]) == "; known: noise, scene"
    assert hint("xyz", [f"name-{i}" for i in range(40)]) == ""


@pytest.mark.parametrize(
    ("name", "family"),
    [("Ada One", "One"), ("Cy van der Three", "van der Three"), ("Calvin R. Maurer Jr.", "Maurer"), ("Plato", "Plato")],
)
def test_family_names(name: str, family: str) -> None:
    assert family_name(name) == family


def test_works_of_one_label_get_letters(project: Project) -> None:
    entry = "{}:\n  authors: [A Same]\n  title: {}\n  year: 2000\n  url: https://example.org\n"
    project.write("content/references.yaml", entry.format("b", "Beta") + entry.format("a", "Alpha"))
    references = read_references(project.root, Problems())
    assert [(key, r.label) for key, r in references.items()] == [("a", "Same 2000a"), ("b", "Same 2000b")]


@pytest.mark.parametrize(
    ("value", "spec", "text"),
    [
        (3.14159, ".2f", "3.14"),
        (-3.14159, ".2f", "−3.14"),
        (-0.001, ".2f", "0.00"),
        (1234567, ",d", "1,234,567"),
        (1.5e-12, ".1e", "1.5·10⁻¹²"),
        (17, "", "17"),
        (0.25, "", "0.25"),
        (0.5, ".0%", "50%"),
        (-0.001, ".0%", "0%"),
    ],
)
def test_numbers_as_printed(value: float, spec: str, text: str) -> None:
    assert printed(value, spec) == text


def test_a_call_is_evaluated_once_for_one_state_of_the_code(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    call = read_call('solvers.core.validate.number(2.5, "x")')
    assert evaluate(call) == 2.5
    gallery = Gallery({}, tmp_path)
    values = Values(tmp_path, {"solvers": "code", "widgets": "one"}, gallery)
    assert values.value(call) == 2.5
    values.keep()

    def fail(call: object) -> float:
        raise AssertionError("evaluated again")

    monkeypatch.setattr("sitegen.chapters.values.evaluate", fail)
    assert Values(tmp_path, {"solvers": "code", "widgets": "another"}, gallery).value(call) == 2.5
    with pytest.raises(AssertionError, match="again"):
        Values(tmp_path, {"solvers": "other code", "widgets": "one"}, gallery).value(call)


@pytest.mark.parametrize(
    ("text", "number"),
    [("5 / sqrt(16)", 1.25), ("-2**2 + 1", -3.0), ("degrees(pi)", 180.0), ("log2(8) - exp(0)", 2.0)],
)
def test_arithmetic_is_worked_out(text: str, number: float) -> None:
    assert read_value(text) == pytest.approx(number, rel=1e-15)


def test_arithmetic_is_worked_out_as_an_argument() -> None:
    call = read_call("solvers.core.validate.number(29 / 49, low=1 - sqrt(4), name='x')")
    assert evaluate(call) == 29 / 49
    assert evaluate(read_call("solvers.core.validate.count(1 + 2, name='x')")) == 3
    assert call.named["low"] == -1.0


@pytest.mark.parametrize("text", ["1 / 0", "sqrt(-1)", "sqrt()", "1 + x", "True", "exit(1)", "1 if 1 else 2", "9**999"])
def test_what_gives_no_number_is_told(text: str) -> None:
    with pytest.raises(CallError):
        read_value(text)


@pytest.mark.parametrize(
    ("text", "offset"),
    [
        ("solvers.core.validate.number(", 28),
        ("1 + 1", 0),
        ("open('x')", 0),
        ("solvers.f(**{})", 10),
        ("solvers.f(__import__('os'))", 10),
        ("solvers.f(1 / 0)", 10),
        ("solvers.f(sqrt(-1))", 10),
        ("solvers.f(1 + 'x')", 10),
        ("solvers.core.validate.__repr__()", 22),
        ("solvers.é.nothing(1)", 8),
    ],
)
def test_what_is_no_call(text: str, offset: int) -> None:
    with pytest.raises(CallError) as error:
        evaluate(read_call(text))
    assert error.value.offset == offset


def test_tests_are_read_and_never_run(project: Project) -> None:
    project.write(
        "tests/test_more.py", "raise SystemExit\n\n\ndef test_a():\n    '''Doc.'''\n\n\ndef helper():\n    pass\n"
    )
    project.write("tests/test_broken.py", "def test_b(:\n")
    tests = claims.read_tests(project.root, claims.test_files(project.root), project.cache)
    assert sorted(tests) == [
        "tests/test_claimed.py::TestGroup::test_inside",
        "tests/test_claimed.py::test_it_holds",
        "tests/test_more.py::test_a",
    ]
    inside = tests["tests/test_claimed.py::TestGroup::test_inside"]
    assert inside.doc == "Inside a class."
    assert inside.source.startswith("def test_inside")


def test_one_failing_case_fails_its_test_whichever_comes_last() -> None:
    reports: list[tuple[str, claims.Outcome]] = [("t[1]", "passed"), ("t[2]", "failed"), ("t[3]", "passed")]
    assert claims.merged(reports) == {"t": "failed"}


def test_a_claim_is_the_whole_sentence_where_it_stands_alone(project: Project) -> None:
    """Terms, references and links in it become plain words without links."""
    entry = "gate:\n  term: Gate\n  says: The largest distance.\n  chapter: second\n"
    project.write("content/glossary.yaml", entry)
    message = "A :term[gate] and *:ref[second#deep]* [are](https://example.org/) open."
    project.write("content/01-second.md", f"{SECOND}\n:claim[{message}]{{tests/test_claimed.py::test_it_holds}}\n")
    project.build()
    assert '<em><a class="ref"' in project.page("second.html")
    assert "<h2>A gate and <em>A section</em> are open.</h2>" in project.page("checks-second.html")


def test_results_hold_for_the_code_that_they_were_made_on(project: Project) -> None:
    holds = "tests/test_claimed.py::test_it_holds"
    reports: list[tuple[str, claims.Outcome]] = [
        (f"{holds}[1]", "passed"),
        (f"{holds}[2]", "passed"),
        ("other", "passed"),
    ]
    claims.write_results(project.root, claims.merged(reports))
    results = json.loads((project.root / claims.RESULTS).read_text())
    assert list(results) == [holds], "only what is claimed is kept"
    assert claims.read_results(project.root) == {holds: claims.Result("passed", True)}
    assert claims.behind(project.root) == []
    project.build()
    assert 'data-outcome="passed"' in project.page("second.html")
    assert "Passed on this code." in project.page("checks-second.html")

    project.write("solvers/new.py", "x = 1\n")
    assert claims.read_results(project.root) == {holds: claims.Result("passed", False)}
    assert claims.behind(project.root) == [holds]
    project.build()
    assert "Not yet run on this code." in project.page("checks-second.html")

    claims.write_results(project.root, claims.merged([*reports, (f"{holds}[3]", "failed")]))
    project.build()
    assert "Failed on this code." in project.page("checks-second.html")
    claims.write_results(project.root, {})
    assert claims.read_results(project.root) == {holds: claims.Result("failed", True)}, (
        "what did not run keeps its result"
    )


@pytest.mark.parametrize("line", ["from widgets.engine import host", "import widgets", "from tests.widgets import a"])
def test_results_of_tests_that_use_widgets_hold_for_the_widgets_as_well(project: Project, line: str) -> None:
    holds = "tests/test_claimed.py::test_it_holds"
    for source, current in (("", True), (f"def test_it_holds():\n    {line}\n", False)):
        project.write("tests/test_claimed.py", source)
        claims.write_results(project.root, {holds: "passed"})
        project.write("widgets/new.py", f"x = {current}\n")
        assert claims.read_results(project.root) == {holds: claims.Result("passed", current)}


@pytest.mark.parametrize("name", ["code.py", "flow.int8", "drive.scans", "poses.f4"])
def test_frames_and_claims_depend_on_code_and_on_the_data_beside_it(tmp_path: Path, name: str) -> None:
    package = ModuleType("solvers")
    package.__path__ = [str(tmp_path / "solvers")]
    for other in ("solvers", "widgets"):
        (tmp_path / other / "deep").mkdir(parents=True)
    hashes = set()
    for data in (b"1", b"2"):
        (tmp_path / "solvers" / "deep" / name).write_bytes(data)
        hashes.add((code_hash([package]), claims.tested_code(tmp_path)["solvers"]))
    frames, tests = zip(*hashes, strict=True)
    assert len({*frames}) == len({*tests}) == 2


def test_a_figures_frames_depend_on_its_own_module_and_on_no_other_figures() -> None:
    own, second = code_of("kabsch", WIDGETS), code_of("two-poses", WIDGETS)
    assert own == code_of("kabsch", WIDGETS)
    assert len({own, second, code_hash()}) == 3
    names = {path.name for path in FIGURES.iterdir()} - {"kabsch.py", "__init__.py"}
    assert "race" in names, "a figure of several modules is a folder"
    assert own == code_hash(
        skip=lambda path: path.is_relative_to(FIGURES) and path.relative_to(FIGURES).parts[0] in names
    )


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("80 % of 0.6 u, 0.2 rad.", "80\u00a0% of 0.6\u00a0u, 0.2\u00a0rad."),
        (" u off", "\u00a0u off"),
        ("7 m in 2 ms of ε = 0.04 u", "7\u00a0m in 2\u00a0ms of ε\u00a0=\u00a00.04\u00a0u"),
        ("12 main streets, a = b", "12 main streets, a = b"),
        ("in 25 unlike draws", "in 25 unlike draws"),
        ("an u, a %", "an u, a %"),
    ],
)
def test_a_unit_stays_with_its_number(text: str, expected: str) -> None:
    """No line begins with the unit of a number, typed or computed; words stay as they are."""
    assert unbroken(text) == expected
