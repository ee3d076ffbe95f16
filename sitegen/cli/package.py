"""`package`: builds, checks, installs and tries the source distribution and the wheel of `solvers`.

Both are built from a copy of the checkout, the wheel from the unpacked source distribution, so that a file missing
there is noticed at once. The wheel is then used as its README says: on the oldest and the newest Python of this
machine, each with the oldest numpy that has a wheel for it, and with the newest plus scipy and matplotlib.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import tarfile
import tempfile
import time
import tomllib
from collections.abc import Mapping, Sequence
from pathlib import Path

from sitegen.cli.pythons import Interpreter, candidates, copied, interpreters

README = "solvers/README.md"
USE = Path(__file__).with_name("use_package.py")
TESTS = ("pytest", "hypothesis", "scipy", "matplotlib")  # what the source distribution's tests need
# Calls the backend as a front end does: with the project as the working folder, but without importing from there.
BACKEND = "import sys, setuptools.build_meta as backend; getattr(backend, sys.argv[1])(sys.argv[2])"


class PackageError(RuntimeError):
    """A step has failed; the message holds its output."""


def package_command(root: Path, *, tests: bool = False) -> int:
    """Put both files into dist/ and try them; the exit code is 1 if a step fails. `tests`: also run the solvers' tests
    from the source distribution with each Python and numpy."""
    with tempfile.TemporaryDirectory(prefix="ladder-package-") as temporary:
        directory, out = Path(temporary), root / "dist"
        try:
            copied(root, directory / "checkout")
            files = built(directory / "checkout", directory / "made")
            shutil.rmtree(out, ignore_errors=True)
            shutil.copytree(directory / "made", out)
            for path in files:
                print(f"dist/{path.name}: {path.stat().st_size / 1000:.0f} kB", flush=True)
            check(files, directory / "twine")
            for interpreter in ends(interpreters(candidates(os.environ))):
                use(interpreter, files, directory, root, tests=tests)
        except PackageError as error:
            print(f"package: {error}", file=sys.stderr)
            return 1
    return 0


def built(checkout: Path, out: Path) -> tuple[Path, Path]:
    """Build a checkout's source distribution, and from that the wheel, into a folder. Raises PackageError.

    The backend is this environment's, so no network is needed. It leaves files in the checkout.
    """
    out.mkdir(parents=True)
    _output([sys.executable, "-P", "-c", BACKEND, "build_sdist", str(out)], checkout)
    (sdist,) = out.glob("*.tar.gz")
    with tempfile.TemporaryDirectory(prefix="ladder-sdist-") as temporary:
        _output([sys.executable, "-P", "-c", BACKEND, "build_wheel", str(out)], unpacked(sdist, Path(temporary)))
    (wheel,) = out.glob("*.whl")
    return sdist, wheel


def unpacked(sdist: Path, folder: Path) -> Path:
    """Unpack a source distribution into `folder`; the one folder in it."""
    with tarfile.open(sdist) as archive:
        archive.extractall(folder, filter="data")
    return folder / sdist.name.removesuffix(".tar.gz")


def check(files: Sequence[Path], folder: Path) -> None:
    """Check by twine, in its own environment, that an index would accept the files. Raises PackageError."""
    python = environment(Path(sys.executable), folder)
    _output([str(python), "-m", "pip", "install", "--quiet", "twine"])
    output = _output([str(python), "-m", "twine", "--no-color", "check", "--strict", *map(str, files)])
    print("\n".join(re.sub(r"\S*/", "", line) for line in output.splitlines() if line.strip()), flush=True)


def ends(pythons: Sequence[Interpreter]) -> list[Interpreter]:
    """The oldest and the newest of the Pythons that can set up environments. Raises PackageError."""
    able = sorted(python for python in pythons if python.can_set_up)
    if not able:
        raise PackageError("cannot test the package: no Python on this machine has ensurepip")
    return [able[0], able[-1]] if len(able) > 1 else able


def numpys(interpreter: Interpreter, root: Path) -> tuple[str, str]:
    """The oldest allowed numpy that has a wheel for this Python, and the newest one. Raises PackageError."""
    project = tomllib.loads((root / "pyproject.toml").read_text("utf-8"))["project"]
    (minimum,) = (r.partition(">=")[2] for r in project["dependencies"] if r.startswith("numpy"))
    pip = [str(interpreter.path), "-m", "pip"]
    releases = among(_output([*pip, "index", "versions", "numpy"]), minimum)
    trial = [*pip, "install", "--quiet", "--dry-run", "--ignore-installed", "--no-deps", "--only-binary=:all:"]
    return next(name for name in releases if name == releases[-1] or _can([*trial, f"numpy=={name}"])), releases[-1]


def among(output: str, minimum: str) -> list[str]:
    """The releases in the output of `pip index versions` from `minimum` on, oldest first, whether or not they have a
    wheel for its Python. Raises PackageError."""
    match = re.search(r"^Available versions: (.*)$", output, re.MULTILINE)
    releases = [name for name in match[1].split(", ") if re.fullmatch(r"[\d.]+", name)] if match else []
    recent = sorted((name for name in releases if _number(name) >= _number(minimum)), key=_number)
    if not recent:
        raise PackageError(f"pip finds no numpy {minimum} or newer:\n{output.strip()}")
    return recent


def _number(version: str) -> tuple[int, ...]:
    return tuple(map(int, version.split(".")))


def use(interpreter: Interpreter, files: tuple[Path, Path], directory: Path, root: Path, *, tests: bool) -> None:
    """Install the wheel with this Python and follow its README: first with the oldest numpy only, then with the newest
    and the extras. Raises PackageError."""
    sdist, wheel = files
    folder = directory / interpreter.name
    python = environment(interpreter.path, folder / "env")
    pip = [str(python), "-m", "pip", "install", "--quiet", "--only-binary=:all:"]
    oldest, newest = numpys(interpreter, root)
    for numpy, extras in ((oldest, ""), (newest, "[plot,scipy]")):
        began = time.monotonic()
        _output([*pip, f"{wheel}{extras}", f"numpy=={numpy}"])
        print(f"Python {interpreter.name}, numpy {numpy}: installed in {time.monotonic() - began:.1f} s", flush=True)
        output = _output([str(python), "-I", str(USE), str(root / README), str(folder / numpy)])
        print(f"  {output.strip()}", flush=True)
        if tests:
            _output([*pip, *TESTS, f"numpy=={numpy}"])
            source = unpacked(sdist, folder / f"tests-{numpy}")
            output = _output([str(python), "-m", "pytest", "-q", "-p", "no:cacheprovider", "tests/solvers"], source)
            print(f"  the source distribution's tests: {output.strip().splitlines()[-1]}", flush=True)


def environment(python: Path, folder: Path) -> Path:
    """Create a fresh environment of a Python; its interpreter. Raises PackageError."""
    _output([str(python), "-P", "-m", "venv", str(folder)])
    return folder / ("Scripts/python.exe" if os.name == "nt" else "bin/python")


def _can(command: Sequence[str]) -> bool:
    try:
        _output(command)
    except PackageError:
        return False
    return True


def _output(command: Sequence[str], folder: Path | None = None) -> str:
    """Run a program; its stdout. Raises PackageError with all its output if it ends with a code other than 0."""
    env: Mapping[str, str] = {
        name: value for name, value in os.environ.items() if name not in ("VIRTUAL_ENV", "PYTHONPATH", "PYTHONHOME")
    } | {"PIP_DISABLE_PIP_VERSION_CHECK": "1", "PYTHONIOENCODING": "utf-8", "COLUMNS": "500"}
    result = subprocess.run(
        command, cwd=folder, env=env, stdin=subprocess.DEVNULL, capture_output=True, encoding="utf-8", check=False
    )
    if result.returncode != 0:
        words = " ".join(command)
        raise PackageError(f"{words}\nexited with code {result.returncode}:\n{(result.stdout + result.stderr).strip()}")
    return result.stdout
