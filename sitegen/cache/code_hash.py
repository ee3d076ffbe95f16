"""The code that a piece of code depends on, as text to hash: the modules that it imports, or the names that it uses.

Comments, blank lines and the docstrings of modules, classes and functions do not count, so editing them makes nothing
stale. The strings that document constants count.
"""

from __future__ import annotations

import ast
import io
import re
import tokenize
from collections.abc import Callable, Iterable
from pathlib import Path

from solvers.core.registry import METHODS

DATA = (".int8", ".scans", ".f4")
"""Files of numbers beside the code that reads them: trained networks, recorded scans, solved poses."""

IMPORT = re.compile(r"^\s*(?:from\s+([\w.]+)\s+import\s+(\([^)]*\)|[^\n(]+)|import\s+([\w., ]+))", re.MULTILINE)

TYPES = re.compile(r"^if TYPE_CHECKING:\n(?:(?:[ \t].*)?\n)*", re.MULTILINE)
"""Blocks that only type checkers read."""


def code_text(source: str) -> str:
    """The source without comments, blank lines, trailing spaces, and the docstrings of modules, classes, functions."""
    lines = source.split("\n")
    for token in tokenize.generate_tokens(io.StringIO(source).readline):
        if token.type == tokenize.COMMENT:
            row, column = token.start
            lines[row - 1] = lines[row - 1][:column]
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, (ast.Module, ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef)):
            first = node.body[0] if node.body else None
            constant = isinstance(first, ast.Expr) and isinstance(first.value, ast.Constant)
            if first is not None and constant and isinstance(first.value.value, str):  # type: ignore[attr-defined]
                for row in range(first.lineno - 1, first.end_lineno or first.lineno):
                    lines[row] = ""
    return "\n".join(line.rstrip() for line in lines if line.strip())


def closure(modules: Iterable[str], root: Path, skip: Iterable[str] = ()) -> dict[str, Path]:
    """The named modules and everything that they import, directly or indirectly, from the same packages: module → file.

    Imports inside functions count; `skip` names modules to leave out. Other packages are ignored. Raises LookupError if
    a module of these packages is missing, since its code could not be hashed.
    """
    waiting, skipped = list(modules), set(skip)
    packages = {name.partition(".")[0] for name in waiting}
    files: dict[str, Path] = {}
    while waiting:
        name = waiting.pop()
        path = _file(name, root)
        if name in files or name in skipped or name.partition(".")[0] not in packages:
            continue
        if path is None:
            raise LookupError(f"missing module {name} under {root}")
        files[name] = path
        waiting += imports(path.read_text("utf-8"), root)
    return dict(sorted(files.items()))


def imports(source: str, root: Path) -> list[str]:
    """The full names of the modules that a source imports; `from a import b` counts as a.b if that is a module."""
    modules: list[str] = []
    source = TYPES.sub("", source)
    for module, names, plain in IMPORT.findall(source):
        if plain:
            modules += [name.split()[0] for name in plain.split(",")]
            continue
        inner = [f"{module}.{name}" for name in re.findall(r"(\w+)(?: as \w+)?", re.sub(r"#.*", "", names))]
        submodules = [name for name in inner if _file(name, root) is not None]
        modules += submodules if len(submodules) == len(inner) else [*submodules, module]
    return modules


def method_modules(name: str) -> set[str]:
    """The modules that define a method's own parts."""
    method = METHODS[name]
    return {part.__module__ for part in (method.options, method.start, method.step)}


def _file(name: str, root: Path) -> Path | None:
    base = root.joinpath(*name.split("."))
    for path in (base.with_suffix(".py"), base / "__init__.py"):
        if path.is_file():
            return path
    return None


def reached(source: str, first: Iterable[str], imported: Callable[[str], str] = lambda module: "") -> dict[str, str]:
    """The top-level definitions of these names in a module, and of the names that they use in turn: name → code.

    `imported(module)` may return text to append to the code of a name that is imported from that module.
    """
    definitions: dict[str, ast.stmt] = {}
    for node in ast.parse(source).body:
        for name in _defines(node):
            definitions[name] = node
    code: dict[str, str] = {}
    waiting, lines = list(first), source.split("\n")
    while waiting:
        name = waiting.pop()
        if name in code or name not in definitions:
            continue
        node = definitions[name]
        decorators = [_segment(lines, decorator) for decorator in getattr(node, "decorator_list", [])]
        code[name] = "\n".join([*decorators, code_text(_segment(lines, node))])
        if isinstance(node, ast.ImportFrom):
            code[name] += imported(node.module or "")
        waiting += sorted({child.id for child in ast.walk(node) if isinstance(child, ast.Name)})
    return code


def _segment(lines: list[str], node: ast.stmt | ast.expr) -> str:
    """The source text of a node. ast.get_source_segment would split the source again for each. Columns count bytes."""
    last = (node.end_lineno or node.lineno) - 1
    end = lines[last].encode()[: node.end_col_offset].decode()
    if last == node.lineno - 1:
        return end.encode()[node.col_offset :].decode()
    begin = lines[node.lineno - 1].encode()[node.col_offset :].decode()
    return "\n".join([begin, *lines[node.lineno : last], end])


def _defines(node: ast.stmt) -> list[str]:
    """The names that a top-level statement defines."""
    match node:
        case ast.FunctionDef() | ast.ClassDef():
            return [node.name]
        case ast.Import() | ast.ImportFrom():
            return [(alias.asname or alias.name).partition(".")[0] for alias in node.names]
        case ast.Assign():
            return [child.id for target in node.targets for child in ast.walk(target) if isinstance(child, ast.Name)]
        case ast.AnnAssign(target=ast.Name() as target):
            return [target.id]
    return []
