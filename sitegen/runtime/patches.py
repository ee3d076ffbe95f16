"""Patches to the page's engine, Python and numpy that remove what costs time at every start but no page ever uses.

Python's own list of import times (PYTHONPROFILEIMPORTTIME) and the cold start (sitegen/bench/starts.py) show what an
entry saves. Only the page's runtime is patched: the solvers' tests run on a complete one, and the exercise
(exercise.py) runs on this one.
"""

from __future__ import annotations

from pathlib import Path

STDLIB = "/lib/python314.zip/"
SITE_PACKAGES = "/lib/python3.14/site-packages/"
# The folder, beside the packages, with a marshalled dict, source text → marshalled code, for each module whose
# dataclasses have methods. In a pack they are concatenated in a file with this ending.
DATACLASSES = "dataclasses"

# Members with another source: the files in page-python/, by their path in the archive; and the one of them that the
# library lacks.
PAGE_PYTHON = Path(__file__).parent / "page-python"
REPLACED = {
    path.relative_to(PAGE_PYTHON).as_posix(): path.read_text("utf-8") for path in sorted(PAGE_PYTHON.rglob("*.py"))
}
ADDED = ("sitecustomize.py",)

# A stand-in that imports a module on first use.
_LATER = """
class _Later:
    def __init__(self, name):
        self.name = name

    def __getattr__(self, wanted):
        return getattr(__import__(self.name), wanted)


"""


def _named_tuple(kind: str, name: str, *fields: str) -> tuple[str, str]:
    """The source of a NamedTuple whose fields all have one type, and of an equivalent that needs no annotations."""
    lines = "".join(f"    {field}: {kind}\n" for field in fields)
    return f"class {name}(NamedTuple):\n{lines}", f'{name} = namedtuple("{name}", "{" ".join(fields)}")\n'


# Members with changed lines: (text that occurs exactly once, its replacement) for each, and text to append.
CHANGED = {
    # A dataclass's methods are source text, compiled when the class is made: 1.5 ms each. The sources of our classes
    # are compiled at build time (compile_in_pyodide.py); any other source is compiled as usual. annotationlib imports
    # ast; our classes' annotations are plain strings.
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
    # Pyodide imports it at the start; the modules that it needs to show an error are imported with the first error.
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
    # Named tuples read their annotations by annotationlib, which imports ast.
    "numpy/linalg/_linalg.py": (
        (
            ("from typing import Any, NamedTuple\n", "from collections import namedtuple\nfrom typing import Any\n"),
            _named_tuple("NDArray[Any]", "EigResult", "eigenvalues", "eigenvectors"),
            _named_tuple("NDArray[Any]", "EighResult", "eigenvalues", "eigenvectors"),
            _named_tuple("NDArray[Any]", "QRResult", "Q", "R"),
            _named_tuple("NDArray[Any]", "SlogdetResult", "sign", "logabsdet"),
            _named_tuple("NDArray[Any]", "SVDResult", "U", "S", "Vh"),
        ),
        "",
    ),
    "numpy/lib/_arraysetops_impl.py": (
        (
            ("from typing import NamedTuple\n", "from collections import namedtuple\n"),
            _named_tuple("np.ndarray", "UniqueAllResult", "values", "indices", "inverse_indices", "counts"),
            _named_tuple("np.ndarray", "UniqueCountsResult", "values", "counts"),
            _named_tuple("np.ndarray", "UniqueInverseResult", "values", "inverse_indices"),
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

# Modules that are imported if present but never used: asyncio's TLS, numpy's bridge to C.
LEFT_OUT = frozenset({"_ssl", "ssl", "ctypes", "ctypes._endian"})

# Lines of pyodide.asm.mjs, replaced like those above.
# - Its linker compiles a library from its bytes while Python waits; here it takes one that worker.mjs has compiled.
# - The linker enters all 8,600 symbols of the engine in the table by which libraries link, of which they and the engine
#   ask for a few hundred, and looks through the whole table for unresolved ones whenever a library is loaded. Here a
#   symbol is entered when it is asked for, and looked at once.
# - The function that is nearly the whole script is put in parentheses, so that browsers compile it in one go instead of
#   first parsing it to find its end.
ENGINE = (
    (
        "async function _createPyodideModule(moduleArg={}){",
        "const _createPyodideModule=(async function(moduleArg={}){",
    ),
    (
        ";return moduleRtn}export default _createPyodideModule;",
        ";return moduleRtn});export default _createPyodideModule;",
    ),
    (
        "function loadLibData(){",
        'function loadLibData(){var library=Module["libraries"]?.[libName];'
        "if(library)return flags.loadAsync?Promise.resolve(library):library;",
    ),
    ("var GOTHandler={", "var linked=Object.create(null),unresolved=[];var GOTHandler={"),
    (
        'rtn=GOT[symName]=new WebAssembly.Global({value:"i32",mutable:true},-1)}',
        'rtn=GOT[symName]=new WebAssembly.Global({value:"i32",mutable:true},-1);unresolved.push([symName,rtn]);'
        "if(symName in linked)updateGOT({[symName]:linked[symName]})}",
    ),
    (
        "updateGOT(origExports);",
        "linked=origExports;for(var symName in GOT)if(symName in linked)updateGOT({[symName]:linked[symName]});",
    ),
    (
        "var reportUndefinedSymbols=()=>{for(var[symName,entry]of Object.entries(GOT)){",
        "var reportUndefinedSymbols=()=>{for(var[symName,entry]of unresolved.splice(0)){",
    ),
)
