"""The reference page: everything public is there, with the docstring sections that numpydoc requires."""

from __future__ import annotations

import ast
import inspect
import logging
import re
from collections.abc import Iterator
from dataclasses import fields
from importlib import import_module
from pathlib import Path
from typing import Any

import griffe
import numpy as np
import pytest
from griffe import DocstringSectionKind as Kind

import solvers
from sitegen.pages import api_reference
from sitegen.pages.docstrings import parameters, prose, rendered, said, sections
from tests.sitegen.conftest import Project

LISTED = [name for _, _, names in api_reference.GROUPS for name in names]

CODE = '''
def f(gate: float, trim: float = 0.5, **options) -> tuple[int, int]:
    """Leave out.

    By `gate`, x < y:

        E = Σ r²

    1. first
    2. second

    Parameters
    ----------
    gate : float
        Beyond it <b>nothing</b>.
    trim : float, default 0.5
        A fraction.
    **options
        More.

    Returns
    -------
    few : int
        Left.

    Raises
    ------
    ValueError
        If `gate` is negative.

    References
    ----------
    .. [1] A. Author, "On gates", 1999. doi:10.1000/182

    Examples
    --------
    A narrow gate:

    >>> f(1.0)
    2
    """
'''


def test_a_docstring_becomes_html() -> None:
    """Prose with its formulas and lists, names with types and defaults, works with their DOI, examples as code."""
    html = rendered(griffe.visit("sample", filepath=Path("sample.py"), code=CODE, docstring_parser="numpy")["f"])
    for piece in (
        "<p>By <code>gate</code>, x &lt; y:</p>",
        '<pre tabindex="0"><code>E = Σ r²</code></pre>',
        "<ol><li>first</li><li>second</li></ol>",
        "<h4>Parameters</h4>",
        "<dt><code>gate</code> <span>float</span></dt><dd><p>Beyond it &lt;b&gt;nothing&lt;/b&gt;.</p></dd>",
        "<dt><code>trim</code> <span>float, default 0.5</span></dt>",
        "<dt><code>**options</code></dt><dd><p>More.</p></dd>",
        '<h4>Returns</h4>\n<dl class="fields"><dt><code>few</code> <span>int</span></dt>',
        '<h4>Raises</h4>\n<dl class="fields"><dt><code>ValueError</code></dt><dd><p>If <code>gate</code>',
        '<a href="https://doi.org/10.1000/182">doi:10.1000/182</a></li></ol>',
        '<h4>Examples</h4>\n<p>A narrow gate:</p>\n<pre class="code" tabindex="0"><code>&gt;&gt;&gt; f(',
    ):
        assert piece in html, piece


BOX = '''
class Box:
    """A box.

    Attributes
    ----------
    side : float
        Its length.

    Notes
    -----
    Of `wood`.
    """

def cut(width: float | None = None, *sides: float) -> float:
    """Cut.

    Parameters
    ----------
    width : float, optional
        In u.
    *sides
        More.

    Returns
    -------
    float
        The rest.
    """
'''


def test_attributes_notes_and_what_has_no_name_become_html() -> None:
    """A default of None is no number to show, and a value that is returned without a name has its type."""
    module = griffe.visit("sample", filepath=Path("sample.py"), code=BOX, docstring_parser="numpy")
    assert rendered(module["Box"]) == (
        "<p>A box.</p>\n"
        '<h4>Attributes</h4>\n<dl class="fields"><dt><code>side</code> <span>float</span></dt>'
        "<dd><p>Its length.</p></dd></dl>\n"
        "<h4>Notes</h4>\n<p>Of <code>wood</code>.</p>"
    )
    assert rendered(module["cut"]) == (
        "<p>Cut.</p>\n"
        '<h4>Parameters</h4>\n<dl class="fields"><dt><code>width</code> <span>float, optional</span></dt>'
        "<dd><p>In u.</p></dd><dt><code>*sides</code></dt><dd><p>More.</p></dd></dl>\n"
        '<h4>Returns</h4>\n<dl class="fields"><dt><code>float</code></dt><dd><p>The rest.</p></dd></dl>'
    )


def test_nothing_of_a_docstring_becomes_markup() -> None:
    """Only text in backticks is code; letters below the line are subscripts."""
    assert said("a < b, `x > 0` <i>") == "a &lt; b, <code>x &gt; 0</code> &lt;i&gt;"
    assert said("`Σ wᵢ < aₓ`") == "<code>Σ w<sub>i</sub> &lt; a<sub>x</sub></code>"
    assert said("as in [2]_") == "as in [2]"
    assert prose("") == ""
    assert prose("- one\n  more\n- `two`") == "<ul><li>one more</li><li><code>two</code></li></ul>"


def test_every_public_name_is_listed() -> None:
    """Everything that `from solvers import *` provides is on the page; a listed name that is missing is an error."""
    assert {f"solvers.{name}" for name in solvers.__all__ if name != "METHODS"} <= set(LISTED)
    with pytest.raises(LookupError, match="which does not exist"):
        api_reference.named("solvers.scenes.rom")


def public() -> Iterator[tuple[str, griffe.Object]]:
    """Everything that the page lists and all else that `solvers` exports, by module, with methods and properties."""
    modules = {name.rpartition(".")[0] for name in LISTED} - {"solvers"}
    modules |= {f"solvers.{name}" for name in solvers._MODULES.values()}
    for name in dict.fromkeys([*LISTED, *(f"{module}.{name}" for module in sorted(modules) for name in own(module))]):
        item = api_reference.named(name)
        yield name, item
        if isinstance(item, griffe.Class):
            yield from ((f"{name}.{member.name}", member) for member in api_reference.members(item))


def own(module: str) -> Iterator[str]:
    """The functions and classes that a module defines, and those that it lists in `__all__`."""
    room = api_reference.named(module)
    assert isinstance(room, griffe.Module)
    names = {str(name) for name in room.exports or ()}
    for name in room.members:
        if name.startswith("_") or (isinstance(room.members[name], griffe.Alias) and name not in names):
            continue
        if isinstance(api_reference.named(f"{module}.{name}"), griffe.Function | griffe.Class):
            yield name


PUBLIC = dict(public())


@pytest.mark.parametrize("name", PUBLIC)
def test_a_public_docstring_has_its_sections(name: str) -> None:
    """A one-line summary, every parameter, and what is returned; for listed names and functions, an example."""
    item = PUBLIC[name]
    assert item.docstring is not None
    summary, _, rest = item.docstring.value.partition("\n")
    assert summary.endswith(".")
    assert not rest.partition("\n")[0]
    kinds = {part.kind for part in sections(item)}
    if isinstance(item, griffe.Function):
        expected = [p for p in item.parameters if p.name not in ("self", "cls")]
        assert [p.name.lstrip("*") for p in parameters(item)] == [p.name for p in expected]
        assert Kind.returns in kinds or not expected or str(item.returns) == "None"
    elif isinstance(item, griffe.Class) and not api_reference.is_enum(item):
        fields_of = [part.value for part in sections(item) if part.kind in (Kind.parameters, Kind.attributes)]
        expected = [p for p in item.parameters if p.name != "self"]
        assert [entry.name for part in fields_of for entry in part] == [p.name for p in expected]
    is_function = isinstance(item, griffe.Function) and isinstance(item.parent, griffe.Module)
    assert Kind.examples in kinds or not (name in LISTED or is_function)


@pytest.mark.parametrize("name", PUBLIC)
def test_a_docstring_tells_the_true_defaults(name: str) -> None:
    """The value after "default", or None after "optional", is the code's."""
    item = PUBLIC[name]
    if isinstance(item, griffe.Function | griffe.Class):
        check_defaults(item)


def check_defaults(item: griffe.Object) -> None:
    """Compare the literals in a docstring with those in the code."""
    own: Any = import_module(item.module.path)
    for name in item.path.removeprefix(item.module.path + ".").split("."):
        own = getattr(own, name)
    for p in parameters(item):
        if isinstance(p.default, str) and not p.name.startswith("*"):
            value = {"inf": np.inf, "π": np.pi, "1/75": 1.0 / 75.0}.get(p.default) or ast.literal_eval(p.default)
            assert inspect.signature(own).parameters[p.name].default == value, p.name


def test_every_option_of_every_method_is_explained() -> None:
    """With its type, its true default and a meaning, in the order of the code."""
    assert [m.name for m in api_reference.methods()] == list(solvers.METHODS)
    for m in api_reference.methods():
        assert [option.name for option in m.options] == [f.name for f in fields(m.method.options)]
        assert all(option.says and option.type and option.default for option in m.options), m.name
        check_defaults(api_reference.named(f"{m.method.options.__module__}.{m.method.options.__qualname__}"))


def test_griffe_has_nothing_to_object_to(caplog: pytest.LogCaptureFixture) -> None:
    """Its parser warns of names missing from the signature, missing types, and sections that it cannot read."""
    api_reference.package.cache_clear()
    with caplog.at_level(logging.WARNING, "griffe"):
        waiting: list[griffe.Object] = [api_reference.package()]
        while waiting:
            item = waiting.pop()
            sections(item)
            waiting += [member for member in item.members.values() if isinstance(member, griffe.Object)]
    assert [record.getMessage() for record in caplog.records] == []


def test_a_method_shows_its_own_module_before_that_of_its_step() -> None:
    """With the paper that it follows."""
    gicp = next(m for m in api_reference.methods() if m.name == "gicp")
    assert gicp.words.index("<p>Generalised ICP.</p>") < gicp.words.index("<p>ICP that knows surfaces.</p>")
    assert "https://doi.org/10.15607/RSS.2009.V.021" in gicp.words


def test_everything_listed_has_words() -> None:
    """Each entry, and each of its methods and properties, has a docstring and a signature with types."""
    for group in api_reference.groups():
        for entry in group.entries:
            for part in (entry, *entry.members):
                assert len(re.sub(r"<[^>]*>", "", part.words)) > 15, part.name
                assert part.signature
    results = {entry.name: entry for entry in api_reference.groups()[1].entries}
    assert {member.name for member in results["solvers.Result"].members} == {
        "Result.matrix", "Result.transform", "Result.inverse", "Result.detail", "Result.converged", "Result.ended",
        "Result.correspondences", "Result.fitness", "Result.rmse", "Result.covariance", "Result.lower", "Result.gap",
    }  # fmt: skip
    stops = {value.name: value for value in results["solvers.Status"].values}
    assert stops["CAPPED"].default == "3"
    assert stops["CAPPED"].says == "The allowed number of steps was used up, or of boxes in a search."


def test_a_long_signature_has_a_line_a_parameter() -> None:
    """A short one has a single line."""
    entry = api_reference.groups()[0].entries[0]
    lines = re.sub(r"<[^>]*>", "", entry.signature).strip().replace("&#39;", "'").split("\n")
    assert lines[0] == "solvers.register("
    assert lines[3:5] == ["    method: MethodName | str | Method[Any] = 'icp',", "    *,"]
    assert lines[-1].startswith(")")
    short = api_reference.groups()[1].entries[3]
    assert "\n" not in re.sub(r"<[^>]*>", "", short.signature).strip()


def test_the_page_is_on_the_site(project: Project) -> None:
    """Linked from every page; every method has its anchor, and every anchor appears once."""
    project.build()
    assert '<a href="reference.html">' in project.page("second.html")
    page = project.page("reference.html")
    ids = re.findall(r' id="([^"]+)"', page)
    assert len(ids) == len(set(ids))
    assert {f"method-{name}" for name in solvers.METHODS} <= set(ids)
    assert "solvers-register" in ids
    assert page.count('<th scope="row"><code translate="no">gate</code></th>') >= 3
    assert page.count("<h4>Examples</h4>") >= len(LISTED)
