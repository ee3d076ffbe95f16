"""Regression figures: which there are, what they computed and how that looks, kept by the hash of what made them."""

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

FORMAT = "1"  # of what is kept; raised when its form changes
SIZES = {"wide": (680, 380), "narrow": (350, 340)}  # px; the page shows the one that fits

Table = tuple[Sequence[str], Sequence[Sequence[str]]]


@dataclass(frozen=True)
class Plot:
    """A regression figure as its module has it. code: the hash of what `compute` runs; look: of all of the module.
    seconds: about how long `compute` takes, so that a build begins with the longest. parts: of which a long
    one is made."""

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
        """The id of its element, and what its SVGs' ids begin with."""
        return f"fig-{self.id}"


@dataclass(frozen=True)
class Drawn:
    """What a page shows of a plot: its drawings by size, the words that say the same, and the numbers as a table."""

    svgs: Mapping[str, str]
    words: str
    table: Table | None


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
                data = _bytes(plot)
                self._progress(f"computing {plot.name}", 1, 1)
                return data

            self._results[plot.name] = self._computed.get(_result_key(plot), make)
        return self._results[plot.name]

    def _drawings_key(self, placed: Placed) -> str:
        """What a plot's drawings depend on: its result, its module's look, and what draws."""
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
        """The plot for its page. What its module raises is raised."""
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

        svgs = json.loads(self._drawn.get(self._drawings_key(placed), make))
        return Drawn(svgs, plot.words(result), plot.table(result) if plot.table else None)


@lru_cache(maxsize=128)
def _result(kind: type, plain: bytes) -> Any:
    """A result from what is kept of it; nobody changes it."""
    return kind(**{name: _tuples(value) for name, value in json.loads(plain).items()})


def _result_key(plot: Plot) -> str:
    """What a plot's result depends on: the code that it runs and numpy's version."""
    return f"{FORMAT} {np.__version__} {plot.name} {plot.code}"


def _bytes(plot: Plot) -> bytes:
    """What it computes, as it is kept."""
    return json.dumps(asdict(plot.compute()), allow_nan=False).encode()


def _tuples(value: Any) -> Any:
    return tuple(map(_tuples, value)) if isinstance(value, list) else value
