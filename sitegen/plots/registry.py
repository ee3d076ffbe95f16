"""Which plots there are, and what each of them computes and draws."""

from __future__ import annotations

import inspect
import pkgutil
import re
from collections.abc import Iterable, Sequence
from functools import cache as once
from functools import partial
from importlib import import_module
from pathlib import Path
from types import ModuleType

import sitegen.plots
from sitegen.cache.code_hash import closure, code_text, imports, method_modules, reached
from sitegen.cache.files import fingerprint
from sitegen.figures.gallery import SIZES, Gallery, Placed, Plot
from sitegen.figures.parts import FOLDER as KEPT
from sitegen.figures.parts import Parts
from sitegen.problems import Place
from solvers.core.registry import METHODS

FOLDER = Path(sitegen.plots.__path__[0])
ROOT = FOLDER.parents[1]
OWN = ("compute", "part", "whole", "draw", "words", "table")
DATA = (".int8", ".scans")  # trained networks and recorded scans, in folders beside the code that reads them
COMPUTING = ("compute", "part", "whole", "PARTS")


@once
def known() -> dict[str, Plot]:
    """Every plot by the name that chapters use."""
    modules = (module.name for module in pkgutil.iter_modules([str(FOLDER)]))
    names = sorted(name for name in modules if not name.startswith("_") and name != Path(__file__).stem)
    return {name.replace("_", "-"): read(import_module(f"sitegen.plots.{name}")) for name in names}


def read(module: ModuleType) -> Plot:
    """The plot that a module is."""
    name = module.__name__.rpartition(".")[2]
    own = {
        key: value
        for key, value in vars(module).items()
        if inspect.isfunction(value) and value.__module__ == module.__name__ and not key.startswith("_")
    }
    source = Path(str(module.__file__)).read_text("utf-8")
    files = [(name, ROOT / name) for name in getattr(module, "READS", ())]
    parts = None
    if "part" in own:
        code = partial(runs, source, ("part", "PARTS"), words=False)
        parts = Parts(module.PARTS, own["part"], own["whole"], code, ROOT / KEPT / f"{name.replace('_', '-')}.json")
        files.append(("parts", parts.file))
    reads = [(name, path.read_bytes()) for name, path in files if path.is_file()]
    helpers = [(path.name, path.read_bytes()) for path in FOLDER.glob("_*.py")]
    return Plot(
        name.replace("_", "-"),
        module.TITLE,
        module.Result,
        parts.result if parts else own["compute"],
        own["draw"],
        own["words"],
        own.get("table"),
        {key: value for key, value in own.items() if key not in OWN},
        {**SIZES, **getattr(module, "SIZES", {})},
        fingerprint([("runs", runs(source).encode()), *reads]),
        fingerprint([("module", source.encode()), *helpers]),
        getattr(module, "SECONDS", 0.0),
        parts,
    )


def runs(source: str, first: Sequence[str] = COMPUTING, *, words: bool = True) -> str:
    """The hash of what these of a module run: all that they name of it, what that names, and the solvers behind.

    A helper of the folder counts as a whole. `solvers.METHODS` leads to every method; of these count the ones that a
    text in the code names. So neither an edit of the drawing nor one of another method computes anything anew.
    words: whether comments and docstrings of the solvers count, which takes far less time than to leave them out.
    """

    def helper(module: str) -> str:
        inside = module.startswith("sitegen.plots.")
        return (FOLDER / f"{module.rpartition('.')[2]}.py").read_text("utf-8") if inside else ""

    definitions = reached(source, first, helper)
    whole = "\n".join(definitions.values())
    modules = {name for name in imports(whole, ROOT) if name.partition(".")[0] == "solvers"}
    methods = {text for pair in re.findall(r"\"([\w-]+)\"|'([\w-]+)'", whole) for text in pair if text in METHODS}
    modules.update(module for name in methods for module in method_modules(name))
    files = closure(modules, ROOT, skip=["solvers.core.registry"])
    pieces = [(name, text.encode()) for name, text in definitions.items()]
    solvers = [(name, path.read_bytes() if words else _code(path)) for name, path in files.items()]
    beside = {each for path in files.values() for each in path.parent.glob("*/*") if each.suffix in DATA}
    return fingerprint([*pieces, *solvers, *((path.name, path.read_bytes()) for path in sorted(beside))])


@once
def _code(path: Path) -> bytes:
    return code_text(path.read_text("utf-8")).encode()


def longest_first(placed: Iterable[Placed]) -> list[Placed]:
    """In the order that keeps every core busy to the end; what takes as long stays in the order of the site."""
    return sorted(placed, key=lambda one: -one.plot.seconds)


def make_ahead(name: str, plot_id: str, cache: Path) -> None:
    """Compute and draw one of the known plots, in a process of its own: the cache has it then."""
    plot = known()[name]
    Gallery({name: plot}, cache).drawn(Placed(plot_id, "", plot, Place("")))
