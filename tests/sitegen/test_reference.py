"""The reference page: everything public is there, and everything of it is explained."""

from __future__ import annotations

import inspect
import re
from dataclasses import fields

import pytest

import solvers
from sitegen import reference
from sitegen.docstrings import Label, meanings, pieces, rendered, said
from tests.sitegen.conftest import Project

DOC = """gate, trim (a fraction): what is left out, `none` at first. weight: a kernel.
It stops when `tolerance` is met.

As it is.

    E = Σ r²
"""


def test_labels_are_told_from_prose() -> None:
    """Names with what they mean, in order; the sentences on the whole and the formulas stay prose."""
    found = pieces(DOC, ["gate", "trim", "weight", "tolerance"])
    assert found[0] == Label(("gate", "trim"), "gate, trim (a fraction)", "what is left out, `none` at first")
    assert found[1] == Label(("weight",), "weight", "a kernel")
    assert found[2:] == ["It stops when `tolerance` is met.", "As it is.", "    E = Σ r²"]
    says = meanings(DOC, ["gate", "trim", "weight", "tolerance", "absent"])
    assert says["trim"] == "what is left out, `none` at first (a fraction)"
    assert says["tolerance"] == "It stops when `tolerance` is met."
    assert says["absent"] == ""


def test_what_a_docstring_refers_to_is_looked_up() -> None:
    """"As in" leads to the other's words; a docstring that begins so adds its own."""
    other = {"gate": "pairs beyond it are dropped", "grids": "1 or 4"}
    says = meanings("keep: a share. The others as in `Other`.", ["keep", "gate"], lambda path: other)
    assert says == {"keep": "a share", "gate": "pairs beyond it are dropped"}
    assert meanings("As `Other`; grids: of the target.", ["grids"], lambda path: other)["grids"] == (
        "1 or 4; here of the target"
    )


def test_nothing_of_a_docstring_becomes_markup() -> None:
    """Only what stands in backticks is code; a formula keeps its lines."""
    assert said("a < b, `x > 0` <i>") == "a &lt; b, <code>x &gt; 0</code> &lt;i&gt;"
    assert "<pre tabindex=\"0\"><code>E = Σ r²</code></pre>" in rendered(DOC, ["gate"])
    assert said("`Σ wᵢ < aₓ`") == "<code>Σ w<sub>i</sub> &lt; a<sub>x</sub></code>"


@pytest.mark.parametrize("name", [name for name in solvers.__all__ if name != "METHODS"])
def test_every_public_name_is_listed_and_every_parameter_explained(name: str) -> None:
    """What `from solvers import *` gives is on the page, and its docstring speaks of each parameter or field."""
    listed = [each for _, _, names in reference.GROUPS for each in names]
    assert f"solvers.{name}" in listed
    thing = getattr(solvers, name)
    assert inspect.getdoc(thing)
    assert [each for each, says in reference.explained(thing).items() if not says] == []


def test_every_option_of_every_method_is_explained() -> None:
    """With its type, its default, and a meaning."""
    assert [one.name for one in reference.methods()] == list(solvers.METHODS)
    for one in reference.methods():
        assert [option.name for option in one.options] == [f.name for f in fields(one.method.options)]
        assert all(option.says and option.type and option.default for option in one.options), one.name


def test_everything_listed_has_words() -> None:
    """Each entry and each of its methods and properties has a docstring and a signature with types."""
    for group in reference.groups():
        for entry in group.entries:
            for one in (entry, *entry.members):
                assert len(re.sub(r"<[^>]*>", "", one.words)) > 15, one.name
                assert one.signature
    (result,) = (entry for entry in reference.groups()[1].entries if entry.name == "solvers.Result")
    assert {member.name for member in result.members} == {
        "Result.matrix", "Result.transform", "Result.inverse", "Result.detail"
    }  # fmt: skip


def test_the_page_is_on_the_site(project: Project) -> None:
    """Linked from every page; every method has its anchor, every anchor stands once."""
    project.build()
    assert '<a href="reference.html">' in project.page("second.html")
    page = project.page("reference.html")
    ids = re.findall(r' id="([^"]+)"', page)
    assert len(ids) == len(set(ids))
    assert {f"method-{name}" for name in solvers.METHODS} <= set(ids)
    assert "solvers-register" in ids
    assert page.count("<th scope=\"row\"><code>gate</code></th>") >= 3
