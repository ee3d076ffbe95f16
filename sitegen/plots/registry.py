"""The plots, and what each of them computes and draws."""

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
from sitegen.cache.code_hash import DATA, closure, code_text, imports, method_modules, reached
from sitegen.cache.files import fingerprint
from sitegen.figures.gallery import SIZES, Gallery, Placed, Plot
from sitegen.figures.parts import FOLDER as KEPT
from sitegen.figures.parts import Parts
from sitegen.problems import Place
from solvers.core.registry import METHODS

FOLDER = Path(sitegen.plots.__path__[0])
ROOT = FOLDER.parents[1]
OWN = ("compute", "part", "whole", "draw", "words", "table")
COMPUTING = ("compute", "part", "whole", "PARTS")


@once
def all_plots() -> dict[str, Plot]:
    """All plots, by the names that chapters use."""
    modules = (module.name for module in pkgutil.iter_modules([str(FOLDER)]))
    names = sorted(name for name in modules if not name.startswith("_") and name != Path(__file__).stem)
    return {name.replace("_", "-"): read(import_module(f"sitegen.plots.{name}")) for name in names}


def read(module: ModuleType) -> Plot:
    """The plot defined by a module."""
    name = module.__name__.rpartition(".")[2]
    functions = {
        key: value
        for key, value in vars(module).items()
        if inspect.isfunction(value) and value.__module__ == module.__name__ and not key.startswith("_")
    }
    source = Path(str(module.__file__)).read_text("utf-8")
    files = [(name, ROOT / name) for name in getattr(module, "READS", ())]
    parts = None
    if "part" in functions:
        code = partial(runs, source, ("part", "PARTS"), words=False)
        file = ROOT / KEPT / f"{name.replace('_', '-')}.json"
        parts = Parts(module.PARTS, functions["part"], functions["whole"], code, file)
        files.append(("parts", parts.file))
    inputs = [(name, path.read_bytes()) for name, path in files if path.is_file()]
    helpers = [(path.name, path.read_bytes()) for path in FOLDER.glob("_*.py")]
    return Plot(
        name.replace("_", "-"),
        module.TITLE,
        module.Result,
        parts.result if parts else functions["compute"],
        functions["draw"],
        functions["words"],
        functions.get("table"),
        {key: value for key, value in functions.items() if key not in OWN},
        {**SIZES, **getattr(module, "SIZES", {})},
        fingerprint([("runs", runs(source).encode()), *inputs]),
        fingerprint([("module", source.encode()), *helpers]),
        getattr(module, "SECONDS", 0.0),
        parts,
    )


def runs(source: str, first: Sequence[str] = COMPUTING, *, words: bool = True) -> str:
    """A hash of the code that the definitions in `first` run: all of the module that they refer to, directly or not,
    and the solvers behind it.

    A helper module of this folder counts as a whole, comments included. `solvers.METHODS` leads to every method; only
    those whose name is a string in the code count. So an edit of the drawing or of another method recomputes nothing.
    words: whether the solvers' comments and docstrings count, which is far faster than to leave them out.
    """

    def helper(module: str) -> str:
        is_ours = module.startswith("sitegen.plots.")
        return (FOLDER / f"{module.rpartition('.')[2]}.py").read_text("utf-8") if is_ours else ""

    definitions = reached(source, first, helper)
    whole = "\n".join(definitions.values())
    modules = {name for name in imports(whole, ROOT) if name.partition(".")[0] == "solvers"}
    methods = {text for pair in re.findall(r"\"([\w-]+)\"|'([\w-]+)'", whole) for text in pair if text in METHODS}
    modules.update(module for name in methods for module in method_modules(name))
    files = closure(modules, ROOT, skip=["solvers.core.registry"])
    pieces = [(name, text.encode()) for name, text in definitions.items()]
    solvers = [(name, path.read_bytes() if words else _code(path)) for name, path in files.items()]
    beside = {sibling for path in files.values() for sibling in path.parent.glob("*/*") if sibling.suffix in DATA}
    return fingerprint([*pieces, *solvers, *((path.name, path.read_bytes()) for path in sorted(beside))])


@once
def _code(path: Path) -> bytes:
    return code_text(path.read_text("utf-8")).encode()


def longest_first(plots: Iterable[Placed]) -> list[Placed]:
    """Sort the plots, longest first, to keep every core busy to the end; equally long ones stay in the site's order."""
    return sorted(plots, key=lambda plot: -plot.plot.seconds)


def make_ahead(name: str, plot_id: str, cache: Path) -> None:
    """Compute and draw one of the known plots into the cache; runs in its own process."""
    plot = all_plots()[name]
    Gallery({name: plot}, cache).drawn(Placed(plot_id, "", plot, Place("")))
