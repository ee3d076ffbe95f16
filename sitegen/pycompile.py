"""Compiles the Python files of archives; runs inside Pyodide, because bytecode belongs to one Python version.

The result of an archive is an archive again (stored, one fixed date, sorted): each .py has become a .pyc of the
unchecked-hash kind in its place, everything else is as it was. Which of it is shipped, runtime.py decides.
"""

from __future__ import annotations

import importlib._bootstrap_external as bootstrap
import json
import zipfile

DATE = (1980, 1, 1, 0, 0, 0)


def compile_archive(source: str, target: str, prefix: str, optimize: int, replaced: dict[str, str]) -> int:
    """Compile archive `source` into `target` and return the number of modules.

    `prefix` goes before file names in tracebacks; `replaced` gives members another source.
    """
    count = 0
    with zipfile.ZipFile(source) as given, zipfile.ZipFile(target, "w", zipfile.ZIP_STORED) as made:
        for name in sorted(given.namelist()):
            if name.endswith("/"):
                continue
            data = replaced[name].encode() if name in replaced else given.read(name)
            if name.endswith(".py"):
                code = compile(data, prefix + name, "exec", dont_inherit=True, optimize=optimize)
                # Unchecked: the loader neither looks for the source nor compares anything.
                data = bytes(bootstrap._code_to_hash_pyc(code, bytes(8), False))  # type: ignore[attr-defined]
                name += "c"
                count += 1
            made.writestr(zipfile.ZipInfo(name, DATE), data)
    return count


def main(text: str) -> str:
    """The compiled modules' number for each job (compile_archive's arguments) of the JSON list `text`."""
    return json.dumps([compile_archive(**job) for job in json.loads(text)])
