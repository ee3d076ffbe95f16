"""Bundles of scripts and style sheets for browsers: bundled and minified by esbuild, with a source map each.

Bundles are cached by a key of all their inputs; esbuild, which takes half a second to start, runs only if some have
changed.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from sitegen.cache.files import digest
from sitegen.cache.store import Store
from sitegen.external import fetch, pins
from sitegen.external.node import run_node
from sitegen.problems import Place, Problems, read_text
from sitegen.progress import Progress, quiet

SCRIPT = Path(__file__).with_name("esbuild.mjs")
FORMAT = "1"  # of cached bundles; to be raised when their making changes in a way that the key does not cover
SECONDS = 120.0  # timeout, for a machine under load


@dataclass(frozen=True)
class Entry:
    """The input of one bundle: its entry file, all files by name that it may import, addresses of pictures."""

    path: str
    files: Mapping[str, str]
    pictures: Mapping[str, str] = field(default_factory=dict)

    def key(self, made_by: str) -> str:
        """The cache key: everything that the bundle depends on."""
        hashes = {name: digest(text.encode()) for name, text in sorted(self.files.items())}
        return json.dumps([made_by, self.path, hashes, sorted(self.pictures.items())])


@dataclass(frozen=True)
class Bundle:
    """A script or style sheet and its source map; both are empty if esbuild reported problems."""

    code: str
    source_map: str

    def placed(self, lines: int) -> str:
        """The source map for the code when it is placed below that many other lines."""
        data = json.loads(self.source_map)
        return json.dumps({**data, "mappings": ";" * lines + data["mappings"]}, ensure_ascii=False)


def read_files(root: Path, folder: str, pattern: str, problems: Problems) -> dict[str, str]:
    """Read the files in a folder and below it; keyed by their names in the checkout."""
    paths = sorted((root / folder).rglob(pattern))
    names = {path.relative_to(root).as_posix(): path for path in paths}
    return {name: read_text(path, name, problems) for name, path in names.items()}


def bundled(
    entries: Sequence[Entry], cache: Path, problems: Problems, progress: Progress = quiet
) -> list[Bundle]:
    """The bundle of each entry; esbuild's errors and warnings go to `problems`."""
    store = Store(cache, "bundles")
    made_by = f"{FORMAT} {pins.read_manifest()['esbuild'].version} {SCRIPT.read_text('utf-8')}"
    keys = {entry.path: entry.key(made_by) for entry in entries}
    cached = {path: store.find(key) for path, key in keys.items()}
    new = [entry for entry in entries if cached[entry.path] is None]
    answers = dict(zip((entry.path for entry in new), _run(new, cache, progress), strict=True)) if new else {}
    for entry in new:
        answer = answers[entry.path]
        for message in answer["messages"]:
            problems.add(Place(message["path"] or entry.path, message["line"], message["column"]), message["text"])
        if not answer["messages"]:
            store.put(keys[entry.path], json.dumps([answer["code"], answer["map"]]).encode())
    bundles = {path: json.loads(data) for path, data in cached.items() if data is not None}
    for path, answer in answers.items():
        bundles[path] = ["", ""] if answer["messages"] else [answer["code"], answer["map"]]
    return [Bundle(*bundles[entry.path]) for entry in entries]


def _run(entries: Sequence[Entry], cache: Path, progress: Progress) -> list[Any]:
    paths = fetch.gather(["esbuild"], cache=cache, progress=progress)
    bundles = [{"entry": entry.path, "files": dict(entry.files), "pictures": dict(entry.pictures)} for entry in entries]
    request = {
        "library": str(paths["esbuild/lib/browser.min.js"]),
        "wasm": str(paths["esbuild/esbuild.wasm"]),
        "bundles": bundles,
    }
    answer: list[Any] = run_node(SCRIPT, request, timeout=SECONDS)
    return answer
