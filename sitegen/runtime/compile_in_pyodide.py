"""Compiles the Python files in archives; runs inside Pyodide, because bytecode belongs to one Python version.

The result is again an archive (stored, one fixed date, sorted) in which each .py is replaced by a .pyc of the
unchecked-hash kind, and everything else is unchanged. assemble.py decides which members are shipped.
"""

from __future__ import annotations

import ast
import builtins
import dataclasses
import importlib
import importlib._bootstrap_external as bootstrap
import json
import marshal
import pkgutil
import sys
import zipfile
from collections.abc import Iterable
from types import CodeType

DATE = (1980, 1, 1, 0, 0, 0)


def compile_archive(
    source: str,
    target: str,
    prefix: str,
    optimize: int,
    replaced: dict[str, str],
    changed: dict[str, tuple[list[tuple[str, str]], str]],
    added: list[str],
    packages: list[str],
    prepared: str,
) -> int:
    """Compile archive `source` into `target` and return the number of modules.

    `prefix` goes before file names in tracebacks. `replaced` gives members another source, `changed` other lines and
    text to append; `added` names the replaced members that the archive lacks. If it holds our `packages`, its sources
    are stripped by `Bare`, and the methods of a module's dataclasses go into a member of the folder `prepared`.
    Raises ValueError if a line to be changed does not occur exactly once.
    """
    count = 0
    with zipfile.ZipFile(source) as reader, zipfile.ZipFile(target, "w", zipfile.ZIP_STORED) as writer:
        if packages:
            for module, texts in dataclass_code(source, packages).items():
                writer.writestr(zipfile.ZipInfo(f"{prepared}/{module}", DATE), texts)
        for name in sorted({*reader.namelist(), *added}):
            if name.endswith("/"):
                continue
            data = replaced[name].encode() if name in replaced else reader.read(name)
            if name in changed:
                data = change(name, data.decode(), *changed[name]).encode()
            if name.endswith(".py"):
                if packages:
                    data = ast.fix_missing_locations(Bare().visit(ast.parse(data)))
                code = compile(data, prefix + name, "exec", dont_inherit=True, optimize=optimize)
                if not packages:
                    code = on_one_line(code)
                # Unchecked: the loader neither looks for the source nor compares anything. The function is private, but
                # the pinned Pyodide's Python has it.
                data = bytes(bootstrap._code_to_hash_pyc(code, bytes(8), False))  # type: ignore[attr-defined]
                name += "c"
                count += 1
            writer.writestr(zipfile.ZipInfo(name, DATE), data)
    return count


def on_one_line(code: CodeType) -> CodeType:
    """The code, all of it on its first line: a page never shows the line numbers of third-party code, which take a
    sixth of its bytes.
    """
    whole, remainder = divmod(len(code.co_code) // 2, 8)
    # An entry covers up to eight units: 1, 1101 (a line without columns), their number minus one; then no line step.
    table = b"\xef\x00" * whole + (bytes([0xE7 + remainder, 0]) if remainder else b"")
    constants = tuple(on_one_line(c) if isinstance(c, CodeType) else c for c in code.co_consts)
    return code.replace(co_linetable=table, co_consts=constants)


def change(name: str, text: str, lines: Iterable[tuple[str, str]], end: str = "") -> str:
    """The text with the first of each pair in `lines` replaced by the second, and `end` appended."""
    for line, instead in lines:
        if text.count(line) != 1:
            raise ValueError(f"{name}: expected this line once, got it {text.count(line)} times: {line.strip()}")
        text = text.replace(line, instead)
    return text + end


class Bare(ast.NodeTransformer):
    """Removes what nothing in the page uses: docstrings, and the annotations of functions.

    Classes keep their annotations, which dataclasses need, and get their name as a docstring: without one, dataclass
    makes one from the signature, by inspect.
    """

    def visit_Module(self, node: ast.Module) -> ast.Module:
        undocumented(node)
        self.generic_visit(node)
        return node

    def visit_FunctionDef(self, node: ast.FunctionDef) -> ast.FunctionDef:
        node.returns = None
        undocumented(node)
        self.generic_visit(node)
        return node

    def visit_arg(self, node: ast.arg) -> ast.arg:
        node.annotation = None
        return node

    def visit_ClassDef(self, node: ast.ClassDef) -> ast.ClassDef:
        undocumented(node)
        node.body.insert(0, ast.Expr(ast.Constant(node.name)))
        self.generic_visit(node)
        return node


def undocumented(node: ast.Module | ast.FunctionDef | ast.ClassDef) -> None:
    """Remove the docstring, if there is one."""
    if ast.get_docstring(node, clean=False) is not None:
        node.body[:1] = [] if len(node.body) > 1 else [ast.Pass()]


def dataclass_code(archive: str, packages: list[str]) -> dict[str, bytes]:
    """Import the packages; by module, a marshalled dict: source text that dataclasses compiled → marshalled code."""
    texts: dict[str, dict[str, bytes]] = {}

    def record(text: str, *scopes: dict[str, object]) -> None:
        code = compile(text, "<string>", "exec", dont_inherit=True)
        texts.setdefault(str(scopes[0]["__name__"]), {})[text] = marshal.dumps(code)
        builtins.exec(code, *scopes)

    dataclasses.exec = record  # type: ignore[attr-defined]
    sys.path.insert(0, archive)
    for top in packages:
        package = importlib.import_module(top)
        for module in pkgutil.walk_packages(package.__path__, top + "."):
            if not module.name.endswith("__main__"):
                importlib.import_module(module.name)
    return {module: marshal.dumps(dict(sorted(its.items()))) for module, its in sorted(texts.items())}


def main(text: str) -> str:
    """The number of compiled modules for each job (compile_archive's arguments) in the JSON list `text`."""
    return json.dumps([compile_archive(**job) for job in json.loads(text)])
