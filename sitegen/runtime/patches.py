"""What the page's Python and numpy are made to do without: what it costs at every start is for what a page never does.

What an entry saves is seen in Python's own list of import times (PYTHONPROFILEIMPORTTIME) and in the cold start
(sitegen/bench/starts.py). All of it is the page's runtime alone: the tests of the solvers run on the complete one, and
the exercise (exercise.py) on this one.
"""

from __future__ import annotations

from pathlib import Path

STDLIB = "/lib/python314.zip/"
SITE_PACKAGES = "/lib/python3.14/site-packages/"
# Beside the packages: of each module whose dataclasses have methods a marshalled dict, source text → marshalled code;
# of a pack all of them, one after the other, in a file with this ending.
DATACLASSES = "dataclasses"

# Members with another source: the files of page-python/, which stand at their place in the archive; and the one of them
# that the library has not.
PAGE_PYTHON = Path(__file__).parent / "page-python"
REPLACED = {
    path.relative_to(PAGE_PYTHON).as_posix(): path.read_text("utf-8") for path in sorted(PAGE_PYTHON.rglob("*.py"))
}
ADDED = ("sitecustomize.py",)

# A module that is imported when it is first used.
_LATER = """
class _Later:
    def __init__(self, name):
        self.name = name

    def __getattr__(self, wanted):
        return getattr(__import__(self.name), wanted)


"""


def _named(kind: str, name: str, *fields: str) -> tuple[str, str]:
    """A NamedTuple whose fields are of one kind, and the same without a look at its annotations."""
    lines = "".join(f"    {field}: {kind}\n" for field in fields)
    return f"class {name}(NamedTuple):\n{lines}", f'{name} = namedtuple("{name}", "{" ".join(fields)}")\n'


# Members with changed lines: (what stands there exactly once, what comes instead) for each, and lines added at the end.
CHANGED = {
    # A dataclass's methods are source text compiled as the class is made: 1.5 ms each. The texts of our classes are
    # compiled at build time (compile_in_pyodide.py); a text that is not among them is compiled as ever.
    # Annotationlib brings the parser's tree; our classes' annotations are plain text.
    "dataclasses.py": (
        (
            ("        exec(txt, self.globals, ns)", "        exec(_prepared(txt), self.globals, ns)"),
            ("import annotationlib\n", _LATER + 'annotationlib = _Later("annotationlib")\n'),
            (
                "annotationlib.get_annotations(\n        cls, format=annotationlib.Format.FORWARDREF)\n",
                "cls.__annotations__\n",
            ),
        ),
        f"""

def _read_prepared(path):
    with open(path, "rb") as file:
        while True:
            try:
                _PREPARED.update(marshal.load(file))
            except EOFError:
                return


def _prepared(txt):
    code = _PREPARED.get(txt)
    return txt if code is None else marshal.loads(code)


import marshal, os
_PREPARED = {{}}
if os.path.isdir("{SITE_PACKAGES}"):
    for _name in os.listdir("{SITE_PACKAGES}"):
        if _name.endswith(".{DATACLASSES}"):
            _read_prepared("{SITE_PACKAGES}" + _name)
""",
    ),
    # Pyodide holds it from the start; what it takes to show an error is imported with the first one.
    "traceback.py": (
        (
            ("import linecache\n", _LATER + 'linecache = _Later("linecache")\n'),
            ("import textwrap\n", 'textwrap = _Later("textwrap")\n'),
            ("import codeop\n", 'codeop = _Later("codeop")\n'),
            ("import tokenize\n", 'tokenize = _Later("tokenize")\n'),
            ("import _colorize\n", '_colorize = _Later("_colorize")\n'),
        ),
        "",
    ),
    "numpy/_core/_internal.py": ((("import ast\n", _LATER + 'ast = _Later("ast")\n'),), ""),
    "numpy/matrixlib/defmatrix.py": ((("import ast\n", _LATER + 'ast = _Later("ast")\n'),), ""),
    "numpy/_core/_methods.py": ((("import pickle\n", _LATER + 'pickle = _Later("pickle")\n'),), ""),
    # Named tuples look at their annotations by annotationlib, which brings the parser's tree.
    "numpy/linalg/_linalg.py": (
        (
            ("from typing import Any, NamedTuple\n", "from collections import namedtuple\nfrom typing import Any\n"),
            _named("NDArray[Any]", "EigResult", "eigenvalues", "eigenvectors"),
            _named("NDArray[Any]", "EighResult", "eigenvalues", "eigenvectors"),
            _named("NDArray[Any]", "QRResult", "Q", "R"),
            _named("NDArray[Any]", "SlogdetResult", "sign", "logabsdet"),
            _named("NDArray[Any]", "SVDResult", "U", "S", "Vh"),
        ),
        "",
    ),
    "numpy/lib/_arraysetops_impl.py": (
        (
            ("from typing import NamedTuple\n", "from collections import namedtuple\n"),
            _named("np.ndarray", "UniqueAllResult", "values", "indices", "inverse_indices", "counts"),
            _named("np.ndarray", "UniqueCountsResult", "values", "counts"),
            _named("np.ndarray", "UniqueInverseResult", "values", "inverse_indices"),
            (" and not np.ma.is_masked(ar):\n", ":  # masked arrays: 9,000 lines imported to ask whether it is one\n"),
        ),
        "",
    ),
    "numpy/lib/_format_impl.py": ((("import pickle\n", _LATER + 'pickle = _Later("pickle")\n'),), ""),
    "numpy/lib/_npyio_impl.py": ((("import pickle\n", _LATER + 'pickle = _Later("pickle")\n'),), ""),
    "numpy/lib/_utils_impl.py": (
        (
            ("import platform\n", _LATER + 'platform = _Later("platform")\n'),
            ("    if np.ma.isMaskedArray(n):\n", "    if False:\n"),
        ),
        "",
    ),
}

# Modules that are imported where they are there, and never used: asyncio's TLS, numpy's bridge to C.
LEFT_OUT = frozenset({"_ssl", "ssl", "ctypes", "ctypes._endian"})
