"""Plots: their definitions, and their results and drawings, cached under a hash of what made them."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import cache as once
from functools import lru_cache
from importlib.metadata import version as version_of
from pathlib import Path
from typing import Any

import numpy as np

from sitegen.cache.files import fingerprint
from sitegen.cache.store import Store
from sitegen.figures.parts import Parts
from sitegen.problems import Place
from sitegen.progress import Progress, quiet

FORMAT = "1"  # of the cached data; raised when its form changes
SIZES = {"wide": (680, 380), "narrow": (350, 340)}  # px; the page shows the one that fits

Table = tuple[Sequence[str], Sequence[Sequence[str]]]


@dataclass(frozen=True)
class Plot:
    """A plot as its module defines it. code: the hash of the code that `compute` runs; look: of the whole module.
    seconds: about how long `compute` takes, so that a build begins with the slowest. parts: those of a slow plot, else
    None."""

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
    parts: Parts | None = None


@dataclass(frozen=True)
class Placed:
    """A plot in a chapter."""

    id: str
    number: str
    plot: Plot
    place: Place

    @property
    def dom_id(self) -> str:
        """The id of its element, and the prefix of the ids in its SVGs."""
        return f"fig-{self.id}"


@dataclass(frozen=True)
class Drawn:
    """A plot as a page shows it: its drawings by size, the same in words, and the numbers as a table."""

    svgs: Mapping[str, str]
    words: str
    table: Table | None


@once
def version(package: str) -> str:
    """An installed package's version; cached, since looking it up is slow."""
    return version_of(package)


class Gallery:
    """Results and drawings of plots, made once and then cached."""

    def __init__(self, plots: Mapping[str, Plot], cache: Path, progress: Progress = quiet) -> None:
        self.plots = plots
        self._result_store, self._drawing_store = Store(cache, "plots"), Store(cache, "drawings")
        self._progress = progress
        self._results: dict[str, bytes] = {}
        self._keys: dict[str, str] = {}

    def lacks(self, placed: Placed) -> bool:
        """Whether the plot has to be computed or drawn."""
        if not self._result_store.has(_result_key(placed.plot)):
            return True
        return not self._drawing_store.has(self._drawings_key(placed))

    def result(self, plot: Plot) -> Any:
        """The plot's result. Errors of its module propagate."""
        # A new result is also read back from its bytes, so that cached and new ones are the same.
        return _result(plot.result, self._plain(plot))

    def _plain(self, plot: Plot) -> bytes:
        """The plot's result as cached bytes."""
        if plot.name not in self._results:

            def make() -> bytes:
                self._progress(f"computing {plot.name}", 0, 1)
                data = _bytes(plot)
                self._progress(f"computing {plot.name}", 1, 1)
                return data

            self._results[plot.name] = self._result_store.get(_result_key(plot), make)
        return self._results[plot.name]

    def _drawings_key(self, placed: Placed) -> str:
        """A hash of a plot's result, its module and the drawing code, on which its drawings depend."""
        name = f"{placed.plot.name} {placed.dom_id}"
        if name not in self._keys:
            from sitegen.figures import matplotlib_svg

            source = Path(str(matplotlib_svg.__file__)).read_bytes()
            self._keys[name] = fingerprint(
                [
                    (f"{FORMAT} {version('matplotlib')} {placed.dom_id}", placed.plot.look.encode()),
                    ("result", self._plain(placed.plot)),
                    ("drawing", source + matplotlib_svg.TOKENS.read_bytes()),
                ]
            )
        return self._keys[name]

    def drawn(self, placed: Placed) -> Drawn:
        """The plot for its page. Errors of its module propagate."""
        plot, result = placed.plot, self.result(placed.plot)
        from sitegen.figures import matplotlib_svg

        def make() -> bytes:
            self._progress(f"drawing {plot.name}", 0, 1)
            drawings = {
                name: matplotlib_svg.draw(
                    lambda figure, name=name: plot.draw(result, figure, name == "narrow"),  # type: ignore[misc]
                    size,
                    f"{placed.dom_id}-{name}",
                )
                for name, size in plot.sizes.items()
            }
            self._progress(f"drawing {plot.name}", 1, 1)
            return json.dumps(drawings).encode()

        svgs = json.loads(self._drawing_store.get(self._drawings_key(placed), make))
        return Drawn(svgs, plot.words(result), plot.table(result) if plot.table else None)


@lru_cache(maxsize=128)
def _result(kind: type, plain: bytes) -> Any:
    """Parse a cached result; nobody may change it."""
    return kind(**{name: _tuples(value) for name, value in json.loads(plain).items()})


def _result_key(plot: Plot) -> str:
    """The key of a plot's result: the code that it runs and numpy's version."""
    return f"{FORMAT} {np.__version__} {plot.name} {plot.code}"


def _bytes(plot: Plot) -> bytes:
    """Compute the plot; the result as bytes for the cache."""
    return json.dumps(asdict(plot.compute()), allow_nan=False).encode()


def _tuples(value: Any) -> Any:
    return tuple(map(_tuples, value)) if isinstance(value, list) else value
