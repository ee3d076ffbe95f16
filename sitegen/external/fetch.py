"""Files from outside: pinned in pins.toml, fetched from the first source that has them, verified and cached.

Each file that is used is verified, never the archive that it came in, so that any source will do. A file whose sha256
differs is never returned.
"""

from __future__ import annotations

import fnmatch
import zipfile
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

from sitegen.cache.files import cache_dir
from sitegen.cache.store import put_file, used
from sitegen.external.clients import FAULTS, fetched
from sitegen.external.pins import MANIFEST, Bundle, OutsideError, PinnedFile, read_manifest
from sitegen.progress import Progress, quiet

KEPT_LICENCES = Path(__file__).with_name("licences")


@dataclass(frozen=True)
class Licence:
    """A licence as the site shows it: what it covers, in which version, its SPDX name, its full text."""

    title: str
    version: str
    licence: str
    text: str


def gather(
    names: Iterable[str], *, cache: Path | None = None, progress: Progress = quiet, manifest: Path = MANIFEST
) -> dict[str, Path]:
    """Paths of all files of the named bundles, keyed "bundle/file name", each verified against its pin.

    The files of a bundle are in one folder under their own names. `cache` defaults to cache_dir().
    Raises OutsideError that names every file that no source has, with each source's answer.
    """
    cache = cache or cache_dir()
    bundles = read_manifest(manifest)
    unknown = sorted(set(names := list(names)) - set(bundles))
    if unknown:
        raise OutsideError(f"unknown bundle {', '.join(unknown)} in {manifest.name}; known: {', '.join(bundles)}")
    paths: dict[str, Path] = {}
    failures: list[str] = []
    for bundle in bundles.values():
        if bundle.name in names:
            home = cache / "outside" / bundle.folder
            failures += _fill(bundle, home, cache, progress)
            paths |= {f"{bundle.name}/{file.name}": home / file.name for file in bundle.files}
    if failures:
        raise OutsideError("\n".join(failures))
    return paths


def licences(names: Iterable[str], *, cache: Path | None = None, manifest: Path = MANIFEST) -> list[Licence]:
    """The licences of the named bundles with their full texts, in the manifest's order; fetches missing files."""
    selection = set(names)
    by_name = gather(selection, cache=cache, manifest=manifest)
    result = []
    for bundle in read_manifest(manifest).values():
        if bundle.name not in selection:
            continue
        paths = [by_name[f"{bundle.name}/{file.name}"] for file in bundle.files]
        texts = [text for entry in bundle.licence_texts for text in _licence_texts(entry, bundle, paths)]
        if not texts:
            raise OutsideError(f"no licence text found for {bundle.title} ({', '.join(bundle.licence_texts)})")
        result.append(Licence(bundle.title, bundle.version, bundle.licence, "\n\n".join(texts)))
    return result


def _licence_texts(entry: str, bundle: Bundle, paths: Sequence[Path]) -> list[str]:
    kind, _, pattern = entry.partition(":")
    if kind == "kept":
        return [(KEPT_LICENCES / pattern).read_text("utf-8").strip()]
    if kind == "file":
        return [p.read_text("utf-8").strip() for f, p in zip(bundle.files, paths, strict=True) if f.name == pattern]
    with zipfile.ZipFile(paths[0]) as archive:
        members = sorted(m for m in archive.namelist() if fnmatch.fnmatch(m, pattern) and not m.endswith("/"))
        return [f"{m}\n\n{archive.read(m).decode('utf-8').strip()}" for m in members]


def _fill(bundle: Bundle, home: Path, cache: Path, progress: Progress) -> list[str]:
    """Fetch a bundle's missing or damaged files into its folder; messages for those that could not be obtained."""
    attempts: list[str] = []
    missing = []
    for file in bundle.files:
        fault = _kept_fault(file, home / file.name)
        if fault is not None:
            missing.append(file)
        if fault:
            attempts.append(f"the cache: {fault}")
    for source in bundle.sources:
        if not missing:
            break
        try:
            contents = fetched(source, missing, progress)
        except FAULTS as error:
            attempts.append(f"{source.name} ({source.spec}): {error}")
            continue
        for file in list(missing):
            data = contents.get(file.name)
            fault = f"missing {file.name}" if data is None else file.fault(data)
            if data is None or fault:
                attempts.append(f"{source.name} ({source.spec}): {fault}")
            else:
                try:
                    put_file(home / file.name, data, cache)
                except OSError as error:
                    attempts.append(f"the cache: {error.filename}: {error.strerror}")
                    break
                missing.remove(file)
    details = "".join(f"\n  {line}" for line in attempts or ["no sources are listed"])
    return [f"{bundle.title} {bundle.version}: {file.name} could not be obtained{details}" for file in missing]


def _kept_fault(file: PinnedFile, path: Path) -> str | None:
    """What is wrong with a file in the cache: None if nothing is, "" if it is missing."""
    if not used(path):
        return ""
    try:
        with path.open("rb") as stream:
            return file.fault(file.read(stream)) or None
    except OSError as error:
        return f"{path}: {error.strerror}"
