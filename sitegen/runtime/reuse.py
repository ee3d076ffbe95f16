"""The browser runtime, reused from build to build: assembled again only if its inputs change or a file is missing."""

from __future__ import annotations

import json
import sys
from dataclasses import asdict
from functools import partial
from pathlib import Path

import sitegen
from sitegen.cache.files import cache_dir, content, digest, fingerprint
from sitegen.cache.store import Store
from sitegen.progress import Progress, quiet
from sitegen.runtime.assemble import RuntimeFile, RuntimeInfo, assemble
from sitegen.runtime.wheel import backend, inputs

CODE = (".py", ".mjs", ".toml", ".txt")


def assembled(*, cache: Path | None = None, progress: Progress = quiet) -> RuntimeInfo:
    """The cached runtime of the same inputs; assembled again if there is none or one that lacks a file.

    Each file is stored by its own hash: most are the same in every version. Raises OutsideError, NodeError or
    WheelError.
    """
    cache = cache or cache_dir()
    store, made_of = Store(cache, "runtime"), _inputs_hash()
    if entry := store.find(made_of):
        plain = json.loads(entry)
        contents = {name: data for name, key in plain["contents"].items() if (data := store.find(key)) is not None}
        if contents.keys() == plain["contents"].keys():
            first, later = (
                tuple(RuntimeFile(**{**file, "holds": tuple(file["holds"])}) for file in plain[name])
                for name in ("files", "later")
            )
            return RuntimeInfo(first, later, plain["wheel"], plain["version"], contents)
    info = assemble(cache=cache, progress=progress)
    keys = {name: digest(data) for name, data in info.contents.items()}
    for name, key in keys.items():
        store.get(key, partial(info.contents.__getitem__, name))
    listing = {"files": [asdict(file) for file in info.files], "later": [asdict(file) for file in info.later]}
    plain = {**listing, "wheel": info.wheel, "version": info.version}
    store.put(made_of, json.dumps({**plain, "contents": keys}).encode())
    return info


def _inputs_hash() -> str:
    """A hash of everything that goes into a runtime: our packages, the pins of the outside files, the code that
    assembles it, which may be any of the generator's, and the Python that runs it."""
    home = Path(sitegen.__path__[0])
    code = [path for path in home.rglob("*") if path.suffix in CODE]
    ours = [(f"sitegen/{path.relative_to(home).as_posix()}", content(path)) for path in code]
    return fingerprint([*inputs().items(), *ours, ("python", sys.version.encode()), ("backend", backend().encode())])
