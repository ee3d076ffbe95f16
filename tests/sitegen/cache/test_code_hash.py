"""The code that counts for a result: all that it uses, whichever way that is imported or defined, and no comment."""

from __future__ import annotations

from pathlib import Path
from textwrap import dedent

import pytest

from sitegen.cache.code_hash import closure, code_text, imports, reached
from sitegen.cache.files import write

SOURCE = dedent('''\
    """A module."""
    import os.path as place
    import gone.deeper
    from solvers import register as solve

    LEFT, (RIGHT, *REST) = 1, (2, 3)
    SIZE: int = 4
    """Documents SIZE."""


    def marked(function):
        return function


    @marked
    class Box:
        """A box."""

        side = SIZE

        async def open(self):
            """Open it."""
            return "é", LEFT


    def far(of=RIGHT):
        return place.join("Σ", *REST), gone, solve, nothing
    ''')


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ('"""A module."""', '"""A module of this name.\n\n    More."""'),
        ('"""A box."""', '"""A box,\n    in two lines."""'),
        ('"""Open it."""', '"""Opens."""'),
        ("    return function\n", "    # A comment.\n\n    return function  # another   \n"),
    ],
)
def test_what_does_not_count(old: str, new: str) -> None:
    """Docstrings, comments, blank lines and trailing spaces."""
    assert old in SOURCE
    assert code_text(SOURCE.replace(old, new)) == code_text(SOURCE)


@pytest.mark.parametrize(
    ("old", "new"), [('"""Documents SIZE."""', '"""Says SIZE."""'), ('"é"', '"e"'), ("= SIZE", "=  SIZE"), ("1", "2")]
)
def test_what_counts(old: str, new: str) -> None:
    """All else, and strings that document constants."""
    assert old in SOURCE
    assert code_text(SOURCE.replace(old, new, 1)) != code_text(SOURCE)


def test_a_definition_without_a_body_of_code_is_kept() -> None:
    assert code_text("class A:\n    '''Doc.'''\n    x = 1\n\ndef f(): ...\n") == "class A:\n    x = 1\ndef f(): ..."
    assert code_text("") == ""


@pytest.mark.parametrize(
    ("name", "names"),
    [
        ("Box", {"Box", "marked", "SIZE", "LEFT", "RIGHT", "REST"}),
        ("far", {"far", "RIGHT", "place", "REST", "gone", "solve", "LEFT"}),
        ("LEFT", {"LEFT", "RIGHT", "REST"}),
        ("marked", {"marked"}),
        ("nothing", set()),
    ],
)
def test_what_a_name_reaches(name: str, names: set[str]) -> None:
    """Decorators, defaults, names of imports, and all that are assigned together. Unknown names reach nothing."""
    assert set(reached(SOURCE, [name])) == names


def test_the_code_of_a_name_is_all_of_its_statement() -> None:
    """With its decorators, without its docstrings; a name imported from a module also has what is said of that."""
    code = reached(SOURCE, ["Box", "far"], lambda module: f"\n# {module}")
    assert code["Box"].splitlines()[:2] == ["marked", "class Box:"]
    assert code["Box"].splitlines()[-1] == '        return "é", LEFT'
    assert '"""' not in code["Box"]
    assert code["far"] == 'def far(of=RIGHT):\n    return place.join("Σ", *REST), gone, solve, nothing'
    assert code["solve"] == "from solvers import register as solve\n# solvers"
    assert code["place"] == "import os.path as place"
    assert code["LEFT"] == code["REST"] == "LEFT, (RIGHT, *REST) = 1, (2, 3)"
    two = reached("é = 'Σ'; b = 'é'\n", ["é", "b"])
    assert two == {"é": "é = 'Σ'", "b": "b = 'é'"}


@pytest.fixture
def package(tmp_path: Path) -> Path:
    """A package whose modules import each other in all ways, and a module beside it."""
    files = {
        "a/__init__.py": "",
        "a/one.py": "from a import two, four as other\nimport a.sub.three as three, beside\n",
        "a/two.py": "if TYPE_CHECKING:\n    from a import unused\n\n    from a import unused\nX = 1\n",
        "a/four.py": "from a.one import (\n    x,\n    y,  # and z\n)\n",
        "a/sub/__init__.py": "from a.sub.deep import f\n",
        "a/sub/three.py": "def f():\n    from a.sub import deep, g\n",
        "a/sub/deep.py": "import numpy\n",
        "a/unused.py": "",
        "beside.py": "",
    }
    for name, text in files.items():
        write(tmp_path / name, text.encode())
    return tmp_path


def test_a_module_stands_on_all_that_it_imports(package: Path) -> None:
    """Of its own package, directly or indirectly, within functions too; not what only type checkers read."""
    files = closure(["a.one"], package)
    assert list(files) == ["a.four", "a.one", "a.sub", "a.sub.deep", "a.sub.three", "a.two"]
    assert files["a.sub"] == package / "a/sub/__init__.py"
    assert "beside" in closure(["a.one", "beside"], package)
    assert list(closure(["a.one"], package, skip=["a.sub.three", "a.four"])) == ["a.one", "a.two"]


def test_names_of_a_module_stand_for_it(package: Path) -> None:
    """`from a.sub import deep, g` is of both the module a.sub.deep and the package, which has g."""
    assert imports("from a.sub import deep, g\n", package) == ["a.sub.deep", "a.sub"]
    assert imports("from a.sub import deep as d  # g\n", package) == ["a.sub.deep"]
    assert imports("import a.one as o, beside\n", package) == ["a.one", "beside"]
