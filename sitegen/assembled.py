"""The browser runtime from build to build: put together anew only where it is made of something else, or is faulty."""

from __future__ import annotations

import json
import sys
from dataclasses import asdict
from pathlib import Path
from typing import Any

from .files import content, digest, fingerprint, used, write
from .outside import Progress, cache_dir, quiet
from .runtime import RuntimeFile, RuntimeInfo, assemble
from .wheel import backend, inputs

CODE = (".py", ".mjs", ".toml", ".txt")


def assembled(dest: Path, *, cache: Path | None = None, progress: Progress = quiet) -> RuntimeInfo:
    """The runtime in the folder `dest`, which `assemble` makes where there is another one, or a faulty one.

    Raises OutsideError, NodeError or WheelError.
    """
    note, made_of = dest.with_name(f"{dest.name}.json"), _made_of()
    plain: dict[str, Any] = json.loads(note.read_text("utf-8")) if used(note) else {}
    if plain.get("made_of") == made_of:
        files = tuple(RuntimeFile(**file) for file in plain["files"])
        info = RuntimeInfo(dest, files, plain["wheel"], plain["version"])
        if _is_whole(info, plain["wheel_sha256"]):
            return info
    info = assemble(dest, cache=cache or cache_dir(), progress=progress)
    facts = {
        "made_of": made_of,
        "files": [asdict(file) for file in info.files],
        "wheel": info.wheel,
        "wheel_sha256": digest((dest / info.wheel).read_bytes()),
        "version": info.version,
    }
    write(note, json.dumps(facts).encode())
    return info


def _made_of() -> str:
    """The hash of all that goes into a runtime: our packages, the outside files as they are pinned, what puts it
    together, which may be any of the generator's code, and the Python that runs that."""
    home = Path(__file__).parent
    code = [path for path in home.rglob("*") if path.suffix in CODE]
    ours = [(f"sitegen/{path.relative_to(home).as_posix()}", content(path)) for path in code]
    return fingerprint([*inputs().items(), *ours, ("python", sys.version.encode()), ("backend", backend().encode())])


def _is_whole(info: RuntimeInfo, wheel: str) -> bool:
    """Whether the folder holds these files, byte for byte, and no others."""
    wanted = {**{file.name: file.sha256 for file in info.files}, info.wheel: wheel}
    there = {path.relative_to(info.folder).as_posix(): path for path in info.folder.rglob("*") if path.is_file()}
    if there.keys() != wanted.keys() or not all(used(path) for path in there.values()):
        return False
    return all(digest(content(path)) == wanted[name] for name, path in there.items())
