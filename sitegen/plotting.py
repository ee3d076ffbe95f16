"""Regression figures: which there are, what they computed and how that looks, kept by the hash of what made them."""

from __future__ import annotations

import inspect
import json
import pkgutil
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import cache as once
from functools import lru_cache
from importlib import import_module
from importlib.metadata import version as version_of
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

import sitegen.plots
from solvers.methods import METHODS

from .directives import Directive
from .figures import listed
from .files import fingerprint
from .outside import Progress, quiet
from .problems import Place, Problems, hint
from .sources import closure, imports, method_modules, reached
from .store import Store

FORMAT = "1"  # of what is kept; raised when its form changes
SIZES = {"wide": (680, 380), "narrow": (350, 340)}  # px; the page shows the one that fits
FOLDER = Path(sitegen.plots.__path__[0])
ROOT = FOLDER.parents[1]
OWN = ("compute", "draw", "words", "table")

Table = tuple[Sequence[str], Sequence[Sequence[str]]]


@dataclass(frozen=True)
class Plot:
    """A regression figure as its module has it. code: the hash of what `compute` runs; look: of all of the module.
    seconds: about how long `compute` takes, so that a build begins with the longest."""

    name: str
    title: str
    result: type
    compute: Callable[[], Any]
    draw: Callable[[Any, Any, bool], None]
    words: Callable[[Any], str]
    table: Callable[[Any], Table] | None
    numbers: Mapping[str, Callable[..., Any]]
    sizes: Mapping[str, tuple[int, int]]
    code: str
    look: str
    seconds: float = 0.0


@dataclass(frozen=True)
class Placed:
    """A plot in a chapter."""

    id: str
    number: str
    plot: Plot
    place: Place

    @property
    def dom_id(self) -> str:
        """The id of its element, and what its SVGs' ids begin with."""
        return f"fig-{self.id}"


@dataclass(frozen=True)
class Drawn:
    """What a page shows of a plot: its drawings by size, the words that say the same, and the numbers as a table."""

    svgs: Mapping[str, str]
    words: str
    table: Table | None


@once
def known() -> dict[str, Plot]:
    """Every plot by the name that chapters use."""
    names = sorted(module.name for module in pkgutil.iter_modules([str(FOLDER)]) if not module.name.startswith("_"))
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
    reads = [(name, path.read_bytes()) for name, path in files if path.is_file()]
    helpers = [(path.name, path.read_bytes()) for path in FOLDER.glob("_*.py")]
    return Plot(
        name.replace("_", "-"),
        module.TITLE,
        module.Result,
        own["compute"],
        own["draw"],
        own["words"],
        own.get("table"),
        {key: value for key, value in own.items() if key not in OWN},
        {**SIZES, **getattr(module, "SIZES", {})},
        fingerprint([("runs", runs(source).encode()), *reads]),
        fingerprint([("module", source.encode()), *helpers]),
        getattr(module, "SECONDS", 0.0),
    )


def runs(source: str, first: str = "compute") -> str:
    """The hash of what a module's function runs: all that it names of it, what those name, and the solvers behind.

    A helper of the folder counts as a whole. `solvers.METHODS` leads to every method; of these count the ones that a
    text in the code names. So neither an edit of the drawing nor one of another method computes anything anew.
    """

    def helper(module: str) -> str:
        inside = module.startswith("sitegen.plots.")
        return (FOLDER / f"{module.rpartition('.')[2]}.py").read_text("utf-8") if inside else ""

    found = reached(source, [first], helper)
    whole = "\n".join(found.values())
    modules = {name for name in imports(whole, ROOT) if name.partition(".")[0] == "solvers"}
    named = {text for pair in re.findall(r"\"([\w-]+)\"|'([\w-]+)'", whole) for text in pair if text in METHODS}
    modules.update(module for name in named for module in method_modules(name))
    files = closure(modules, ROOT, skip=["solvers.methods"])
    pieces = [(name, text.encode()) for name, text in found.items()]
    return fingerprint([*pieces, *((name, path.read_bytes()) for name, path in files.items())])


def placed(
    directive: Directive, at: Callable[[int], Place], number: str, plots: Mapping[str, Plot], problems: Problems
) -> Placed | None:
    """The plot that a `::plot` line places; None where it names none."""
    given = listed(directive, at, problems)
    if given is None:
        return None
    bare = [a for a in given if not a.name]
    if not bare:
        problems.add(at(directive.attributes_start), "a plot's name is expected first: {trial-budget id=budget}")
        return None
    for extra in bare[1:]:
        problems.add(at(extra.start), f"name=value is expected, not {extra.value!r}")
    plot = plots.get(bare[0].value)
    if plot is None:
        problems.add(at(bare[0].start), f"no plot {bare[0].value!r}{hint(bare[0].value, plots)}")
        return None
    plot_id = plot.name
    for attribute in (a for a in given if a.name):
        if attribute.name != "id":
            problems.add(
                at(attribute.start), f"a plot has no {attribute.name!r}, only an id{hint(attribute.name, ['id'])}"
            )
        elif not re.fullmatch(r"[A-Za-z0-9-]+", attribute.value):
            problems.add(at(attribute.value_start), f"{attribute.value!r} is no id: ASCII letters, digits and hyphens")
        else:
            plot_id = attribute.value
    return Placed(plot_id, number, plot, at(directive.start))


@once
def version(package: str) -> str:
    """An installed package's version, which takes a while to find."""
    return version_of(package)


class Gallery:
    """Results and drawings, each made once for what it is made of."""

    def __init__(self, plots: Mapping[str, Plot], cache: Path, progress: Progress = quiet) -> None:
        self.plots = plots
        self._computed, self._drawn, self._progress = Store(cache, "plots"), Store(cache, "drawings"), progress
        self._results: dict[str, bytes] = {}
        self._keys: dict[str, str] = {}

    def lacks(self, placed: Placed) -> bool:
        """Whether the plot has to be computed or drawn."""
        if not self._computed.has(_result_key(placed.plot)):
            return True
        return not self._drawn.has(self._drawings_key(placed))

    def result(self, plot: Plot) -> Any:
        """What the plot computed. What its module raises is raised."""
        # Also a new result comes from its bytes, so that kept and new are the same.
        return _result(plot.result, self._plain(plot))

    def _plain(self, plot: Plot) -> bytes:
        """The same as it is kept."""
        if plot.name not in self._results:

            def make() -> bytes:
                self._progress(f"computing {plot.name}", 0, 1)
                made = _bytes(plot)
                self._progress(f"computing {plot.name}", 1, 1)
                return made

            self._results[plot.name] = self._computed.get(_result_key(plot), make)
        return self._results[plot.name]

    def _drawings_key(self, placed: Placed) -> str:
        """What a plot's drawings depend on: its result, its module's look, and what draws."""
        name = f"{placed.plot.name} {placed.dom_id}"
        if name not in self._keys:
            from . import drawing

            source = Path(str(drawing.__file__)).read_bytes()
            self._keys[name] = fingerprint(
                [
                    (f"{FORMAT} {version('matplotlib')} {placed.dom_id}", placed.plot.look.encode()),
                    ("result", self._plain(placed.plot)),
                    ("drawing", source + drawing.TOKENS.read_bytes()),
                ]
            )
        return self._keys[name]

    def drawn(self, placed: Placed) -> Drawn:
        """The plot for its page. What its module raises is raised."""
        plot, result = placed.plot, self.result(placed.plot)
        from . import drawing

        def make() -> bytes:
            self._progress(f"drawing {plot.name}", 0, 1)
            drawings = {
                name: drawing.draw(
                    lambda figure, name=name: plot.draw(result, figure, name == "narrow"),  # type: ignore[misc]
                    size,
                    f"{placed.dom_id}-{name}",
                )
                for name, size in plot.sizes.items()
            }
            self._progress(f"drawing {plot.name}", 1, 1)
            return json.dumps(drawings).encode()

        svgs = json.loads(self._drawn.get(self._drawings_key(placed), make))
        return Drawn(svgs, plot.words(result), plot.table(result) if plot.table else None)


@lru_cache(maxsize=128)
def _result(kind: type, plain: bytes) -> Any:
    """A result from what is kept of it; nobody changes it."""
    return kind(**{name: _tuples(value) for name, value in json.loads(plain).items()})


def _result_key(plot: Plot) -> str:
    """What a plot's result depends on: the code that it runs and numpy's version."""
    return f"{FORMAT} {np.__version__} {plot.name} {plot.code}"


def longest_first(placed: Iterable[Placed]) -> list[Placed]:
    """In the order that keeps every core busy to the end; what takes as long stays in the order of the site."""
    return sorted(placed, key=lambda one: -one.plot.seconds)


def make_ahead(name: str, plot_id: str, cache: Path) -> None:
    """Compute and draw one of the known plots, in a process of its own: the cache has it then."""
    plot = known()[name]
    Gallery({name: plot}, cache).drawn(Placed(plot_id, "", plot, Place("")))


def _bytes(plot: Plot) -> bytes:
    """What it computes, as it is kept."""
    return json.dumps(asdict(plot.compute()), allow_nan=False).encode()


def _tuples(value: Any) -> Any:
    return tuple(map(_tuples, value)) if isinstance(value, list) else value
