"""What the page's Python and numpy are made to do without: what it costs at every start is for what a page never does.

What an entry saves is seen in Python's own list of import times (PYTHONPROFILEIMPORTTIME) and in the cold start
(bench_start.py). All of it is the page's runtime alone: the tests of the solvers run on the complete one, and the
exercise (exercise.py) on this one.
"""

from __future__ import annotations

STDLIB = "/lib/python314.zip/"
SITE_PACKAGES = "/lib/python3.14/site-packages/"
PREPARED = "dataclass_code.bin"  # beside the packages: a marshalled dict, source text → code object

# Members with another source.
REPLACED = {
    # Pyodide's loader of packages brings zipfile, tempfile and three compressors; here all packages lie in place.
    "pyodide/_package_loader.py": '''\
class Folder:
    def __init__(self, path):
        self.path = path

    def __str__(self):
        return self.path


SITE_PACKAGES = Folder("/lib/python3.14/site-packages")
DSO_DIR = Folder("/usr/lib")


def init_loaded_packages():
    pass


def unpack_buffer(*args, **kwargs):
    raise NotImplementedError("this runtime has its packages in place and unpacks no others")
''',
    # asyncio without its own loops, streams and processes: Pyodide's loop is the browser's.
    "asyncio/__init__.py": '''\
from .coroutines import *
from .events import *
from .events import _BaseDefaultEventLoopPolicy as DefaultEventLoopPolicy
from .exceptions import *
from .futures import *
from .locks import *
from .queues import *
from .runners import *
from .tasks import *
from .timeouts import *
''',
    # numpy's docstrings: 200 kB of strings.
    "numpy/_core/_add_newdocs.py": "",
    "numpy/_core/_add_newdocs_scalars.py": "",
    # The types of annotations, which nothing evaluates here: some thousand Literals, Protocols and Unions.
    "numpy/_typing/__init__.py": '''\
from typing import Any

ArrayLike = DTypeLike = Any


class NBitBase:
    pass


class NDArray:
    def __class_getitem__(cls, item):
        return cls
''',
    # The legacy random generator and the bit generators beside PCG64: four of numpy's ten shared libraries.
    "numpy/random/__init__.py": '''\
from . import _bounded_integers, _common
from ._generator import Generator, default_rng
from ._pcg64 import PCG64, PCG64DXSM
from .bit_generator import BitGenerator, SeedSequence

__all__ = ["PCG64", "PCG64DXSM", "BitGenerator", "Generator", "SeedSequence", "default_rng"]


class RandomState:
    """Left out of this numpy; the name stays because default_rng asks whether it was given one."""

    def __init__(self, seed=None):
        raise NotImplementedError("this numpy has default_rng, and no legacy generator")
''',
}

# Members with a changed line: (what stands there exactly once, what comes instead), and lines added at the end.
CHANGED = {
    # A dataclass's methods are source text compiled as the class is made: 1.5 ms each. The texts of our classes are
    # compiled at build time (pycompile.py); a text that is not among them is compiled as ever.
    "dataclasses.py": (
        "        exec(txt, self.globals, ns)",
        "        exec(_PREPARED.get(txt, txt), self.globals, ns)",
        f"""

def _read_prepared():
    import marshal

    try:
        with open("{SITE_PACKAGES}{PREPARED}", "rb") as file:
            return marshal.load(file)
    except OSError:
        return {{}}


_PREPARED = _read_prepared()
""",
    ),
}

# Modules that are imported where they are there, and never used: asyncio's TLS, numpy's bridge to C.
LEFT_OUT = frozenset({"_ssl", "ssl", "ctypes", "ctypes._endian"})
