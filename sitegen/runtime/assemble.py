"""The browser runtime: Pyodide, its library and numpy as bytecode without the modules never imported, and our wheel.

A `.pack` is a gzipped zip of stored members: compressed from any host, and inflated by the browser, not by Python.
Every file lies in a folder named by its content's hash, so that browsers may keep it for ever.
"""

from __future__ import annotations

import hashlib
import io
import json
import tempfile
import zipfile
from collections.abc import Callable, Iterable, Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path, PurePosixPath
from typing import Any

from sitegen.cache.files import cache_dir, fingerprint, short_hash, write
from sitegen.cache.packing import gzipped
from sitegen.cache.store import Store
from sitegen.external.fetch import gather
from sitegen.external.node import run_node
from sitegen.progress import Progress, quiet
from sitegen.runtime.compile_in_pyodide import change
from sitegen.runtime.later import START, holds, pack_of
from sitegen.runtime.patches import ADDED, CHANGED, DATACLASSES, ENGINE, REPLACED, SITE_PACKAGES, STDLIB
from sitegen.runtime.wheel import Archive, build_wheel

HERE = Path(__file__).parent
RUNNER = HERE / "pyodide_node.mjs"
COMPILER = HERE / "compile_in_pyodide.py"
KEPT_MODULES = HERE / "kept_modules.txt"
SCRIPT = "pyodide.asm.mjs"
CORE = ("pyodide.mjs", SCRIPT, "pyodide.asm.wasm")
ENVIRONMENT = {"PYTHONNODEBUGRANGES": "1"}  # tracebacks keep lines; columns need sources, and none are here
LISTED = "later.json"  # the later files, for the worker: name, size, sha256 and the modules in each
PYC_HEADER = 16  # bytes before the code in a .pyc
_DATE = (1980, 1, 1, 0, 0, 0)


@dataclass(frozen=True)
class RuntimeFile:
    """A file that the worker loads: name below the runtime's folder, bytes on disk, their sha256, bytes by gzip -9.

    holds: the modules for which it is loaded when Python first imports one; empty if the start loads it.
    """

    name: str
    size: int
    sha256: str
    gzipped: int
    holds: tuple[str, ...] = ()


@dataclass(frozen=True)
class RuntimeInfo:
    """An assembled runtime: the files that the worker loads, and the wheel that readers may install.

    files: loaded at the start, including the list of the later ones. later: loaded when Python needs them. wheel: its
    name, in its own folder named by its content. contents: every file by its name.
    """

    files: tuple[RuntimeFile, ...]
    later: tuple[RuntimeFile, ...]
    wheel: str
    version: str
    contents: Mapping[str, bytes] = field(repr=False)

    @property
    def size(self) -> int:
        """Bytes of all files that the start loads, as they are on disk."""
        return sum(file.size for file in self.files)

    @property
    def gzipped(self) -> int:
        """Bytes of the same files by gzip -9: what a reader downloads once."""
        return sum(file.gzipped for file in self.files)

    def start_files(self) -> list[dict[str, str | int]]:
        """The `files` of the worker's start message."""
        return [{"name": file.name, "size": file.size, "sha256": file.sha256} for file in self.files]

    def kept_files(self) -> list[tuple[str, int, str]]:
        """Name below the site, bytes and sha256 of every file of the runtime that a reader may request."""
        wheel = self.contents[self.wheel]
        files = [(file.name, file.size, file.sha256) for file in (*self.files, *self.later)]
        files.append((self.wheel, len(wheel), hashlib.sha256(wheel).hexdigest()))
        return [(f"runtime/{name}", size, digest) for name, size, digest in files]

    def write(self, folder: Path) -> Path:
        """Put all files into a folder."""
        for name, data in self.contents.items():
            write(folder / name, data)
        return folder


def assemble(*, cache: Path | None = None, progress: Progress = quiet) -> RuntimeInfo:
    """Assemble the runtime. Raises OutsideError, NodeError or WheelError."""
    cache = cache or cache_dir()
    originals = gather(["numpy", "pyodide"], cache=cache, progress=progress)
    numpy_path = numpy_wheel(originals)
    module_names = kept_modules()

    stdlib, numpy = library_and_numpy(originals, cache, progress)
    wheel = build_wheel(cache)
    ladder = compiled(wheel, SITE_PACKAGES, originals, cache, progress, ours=True)

    library = bundled(pick(stdlib, lambda name: module_name(name) in module_names), "library", before_bundles)
    stdlib_zip = stored_zip(library)
    numpy_zip = stored_zip(bundled(pick(numpy, lambda name: in_numpy(name, module_names)), "numpy"))
    ours = our_packs(ladder)
    lock = lock_text(originals["pyodide/pyodide-lock.json"], {numpy_path.name: numpy_zip, wheel.name: ours[START]})

    core = {name: originals[f"pyodide/{name}"].read_bytes() for name in CORE}
    core[SCRIPT] = change(SCRIPT, core[SCRIPT].decode(), ENGINE).encode()
    contents = {f"core-{fingerprint(core.items())[:10]}/{name}": data for name, data in core.items()}
    for name, data in {"python_stdlib": stdlib_zip, "numpy": numpy_zip, **ours}.items():
        contents[f"{short_hash(data)}/{name}.pack"] = gzipped(data, cache)
    contents[f"{short_hash(lock)}/pyodide-lock.json"] = lock

    def describe(name: str) -> RuntimeFile:
        data, modules = contents[name], holds(PurePosixPath(name).stem)
        return RuntimeFile(name, len(data), hashlib.sha256(data).hexdigest(), len(gzipped(data, cache)), modules)

    later = tuple(file for file in map(describe, contents) if file.holds)
    listing = json.dumps([{k: v for k, v in asdict(file).items() if k != "gzipped"} for file in later]).encode()
    contents[f"{short_hash(listing)}/{LISTED}"] = listing
    files = tuple(file for file in map(describe, contents) if not file.holds)
    wheel_path = f"{short_hash(wheel.data)}/{wheel.name}"
    version = fingerprint((file.name, file.sha256.encode()) for file in files)[:12]
    return RuntimeInfo(files, later, wheel_path, version, {**contents, wheel_path: wheel.data})


def numpy_wheel(originals: Mapping[str, Path]) -> Path:
    """numpy's wheel for Pyodide among the gathered files."""
    return next(path for key, path in originals.items() if key.startswith("numpy/"))


def kept_modules() -> frozenset[str]:
    """The dotted names of the modules that are shipped (made by `python -m sitegen.runtime.trace_modules`)."""
    lines = KEPT_MODULES.read_text("utf-8").splitlines()
    return frozenset(line for line in lines if line and not line.startswith("#"))


def module_name(member: str) -> str:
    """The dotted name of an archive's member: "a/b/__init__.pyc" is a.b, "a/c.cpython-314-….so" is a.c."""
    stem = member.removesuffix(".pyc") if member.endswith(".pyc") else member.partition(".")[0]
    return stem.removesuffix("/__init__").replace("/", ".")


def in_numpy(member: str, modules: Iterable[str]) -> bool:
    """Whether a member of numpy's wheel is shipped: the kept modules, and of the rest only the metadata."""
    if member.endswith((".pyc", ".so")):
        return module_name(member) in modules
    return member.endswith(".dist-info/METADATA")


def library_and_numpy(originals: Mapping[str, Path], cache: Path, progress: Progress = quiet) -> tuple[bytes, bytes]:
    """Pyodide's standard library and numpy's wheel, compiled. originals: the gathered files of both."""
    sources = ((originals["pyodide/python_stdlib.zip"], STDLIB), (numpy_wheel(originals), SITE_PACKAGES))
    library, numpy = (
        compiled(Archive(path.name, path.read_bytes()), prefix, originals, cache, progress) for path, prefix in sources
    )
    return library, numpy


def compiled(
    archive: Archive,
    prefix: str,
    originals: Mapping[str, Path],
    cache: Path,
    progress: Progress = quiet,
    *,
    ours: bool = False,
) -> bytes:
    """The archive with its .py files compiled by Pyodide's own Python; cached by a hash of all its inputs.

    originals: the gathered files of numpy and pyodide. Our own wheel keeps its assertions, and its modules are imported
    in order to compile the methods of its dataclasses too.
    """
    engine = originals["pyodide/pyodide.asm.wasm"]
    job: dict[str, Any] = {"prefix": prefix, "optimize": 0 if ours else 2, "replaced": REPLACED, "changed": CHANGED}
    job |= {"packages": ["solvers", "widgets"] if ours else [], "prepared": DATACLASSES}
    job |= {"added": ADDED if prefix == STDLIB else ()}
    inputs = {
        "archive": archive.data,
        "compiler": COMPILER.read_bytes(),
        "engine": hashlib.sha256(engine.read_bytes()).digest(),
        "job": json.dumps([job, ENVIRONMENT], sort_keys=True).encode(),
    }

    def make() -> bytes:
        progress(f"compiling {archive.name}", 0, 1)
        with tempfile.TemporaryDirectory(prefix="ladder-compile-") as temporary:
            directory = Path(temporary)
            write(directory / "given" / archive.name, archive.data)
            request: dict[str, Any] = {
                "folder": str(engine.parent),
                "mounts": {"/in": str(directory / "given"), "/out": temporary},
                "env": ENVIRONMENT,
                "python": COMPILER.read_text("utf-8"),
                "input": [{"source": f"/in/{archive.name}", "target": "/out/out.zip", **job}],
            }
            if ours:
                library, numpy = library_and_numpy(originals, cache, progress)
                request |= mounted(library, [numpy], directory)
            run_node(RUNNER, request, timeout=900)
            data = (directory / "out.zip").read_bytes()
        progress(f"compiling {archive.name}", 1, 1)
        return data

    return Store(cache, "compiled").get(f"{archive.name} {fingerprint(inputs.items())}", make)


def mounted(library: bytes, packages: Iterable[bytes], folder: Path) -> dict[str, str]:
    """Lay out a library and packages in a folder; the part of Node's request that uses them."""
    write(folder / "python_stdlib.zip", library)
    for package in packages:
        with zipfile.ZipFile(io.BytesIO(package)) as archive:
            archive.extractall(folder / "site")
    return {"stdlib": str(folder / "python_stdlib.zip"), "site": str(folder / "site")}


def pick(archive: bytes, accepts: Callable[[str], bool]) -> dict[str, bytes]:
    """The members of a zip whose names are wanted, sorted by name."""
    with zipfile.ZipFile(io.BytesIO(archive)) as reader:
        return {name: reader.read(name) for name in sorted(reader.namelist()) if accepts(name)}


def our_packs(ladder: bytes) -> dict[str, bytes]:
    """Our packs by name, from the compiled wheel: modules, the compiled methods of their dataclasses, and data."""
    packs: dict[str, dict[str, bytes]] = {}
    for member, data in pick(ladder, lambda member: pack_of(member) is not None).items():
        packs.setdefault(str(pack_of(member)), {})[member] = data
    zips = {}
    for name, members in sorted(packs.items()):
        names = [member for member in members if member.startswith(f"{DATACLASSES}/")]
        texts = b"".join(members.pop(member) for member in names)
        zips[name] = stored_zip(bundled({**members, f"{name}.{DATACLASSES}": texts}, name))
    return zips


def bundled(
    members: Mapping[str, bytes], name: str, exclude: Callable[[str], bool] = lambda member: False
) -> dict[str, bytes]:
    """The members with all bytecode but that of `exclude` in one: `name`.modules, for page-python/sitecustomize.py.

    It holds an index with a line "path size" per module, an empty line, and the modules' marshalled code in that order.
    """
    modules = {member: data[PYC_HEADER:] for member, data in members.items() if member.endswith(".pyc")}
    modules = {member: data for member, data in modules.items() if not exclude(member)}
    index = "\n".join(f"{member.removesuffix('.pyc')} {len(data)}" for member, data in modules.items())
    bundle = index.encode() + b"\n\n" + b"".join(modules.values())
    loose = {member: data for member, data in members.items() if member not in modules}
    return dict(sorted({**loose, f"{name}.modules": bundle}.items()))


def before_bundles(member: str) -> bool:
    """Whether Python imports a member of the library before it can read bundles: text encodings and sitecustomize."""
    return member.startswith("encodings/") or member == "sitecustomize.pyc"


def stored_zip(members: Mapping[str, bytes]) -> bytes:
    """A zip of stored members with one fixed date: the same members give the same bytes."""
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w", zipfile.ZIP_STORED) as archive:
        for name, data in members.items():
            info = zipfile.ZipInfo(name, _DATE)
            info.create_system = 3  # otherwise the build machine's system is recorded
            archive.writestr(info, data)
    return out.getvalue()


def lock_text(stock: Path, wheels: Mapping[str, bytes]) -> bytes:
    """A pyodide-lock.json of our packages only, with the sha256 of the wheels in the packs; platform as in `stock`."""
    from pyodide_lock import PackageSpec  # its import takes long, and most builds make no runtime

    packages: dict[str, Any] = {}
    for file_name, data in wheels.items():
        name, version = file_name.split("-")[:2]
        name = name.replace("_", "-")
        ours = name != "numpy"
        spec = PackageSpec(
            name=name,
            version=version,
            file_name=file_name,
            install_dir="site",
            sha256=hashlib.sha256(data).hexdigest(),
            imports=["solvers", "widgets"] if ours else ["numpy"],
            depends=["numpy"] if ours else [],
        )
        packages[name] = spec.model_dump()
    info = json.loads(stock.read_text("utf-8"))["info"]
    return json.dumps({"info": info, "packages": packages}, indent=1, sort_keys=True).encode()
