"""Bakes the figures that chapters place: frames, readouts, tapes and job results, all cached.

Nothing is drawn here: frames come from widgets.engine.host, which also runs in the browser.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Mapping, Sequence
from functools import lru_cache
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

import solvers
import widgets
import widgets.figures
from sitegen.cache.code_hash import DATA
from sitegen.cache.files import content, fingerprint, short_hash
from sitegen.cache.store import Store
from sitegen.figures.model import FIGURES, Figure
from sitegen.figures.picture_faults import FigureFault, Watched, watched_job
from sitegen.figures.tape import StateRoles, state_roles
from sitegen.figures.wire import Plain, dumps
from sitegen.problems import Problems
from widgets.engine.contract import Widget, parsed
from widgets.engine.host import Host
from widgets.engine.jobs import finished
from widgets.engine.registry import WIDGETS

READ = (".py", *DATA)
TAPE = short_hash(content(Path(__file__).with_name("tape.py")))  # of the code that makes the cached tapes
SOUND = short_hash(content(Path(__file__).with_name("picture_faults.py")))  # of the code that checks the pictures first


def code_hash(
    packages: Sequence[ModuleType] = (solvers, widgets), skip: Callable[[Path], bool] = lambda path: False
) -> str:
    """The hash of the code that makes frames and values: the packages' sources and data as imported, and numpy's
    version."""
    files = [("numpy", np.__version__.encode())]
    for package in packages:
        root = Path(package.__path__[0]).parent
        paths = [path for path in (root / package.__name__).rglob("*") if path.suffix in READ and not skip(path)]
        files += [(path.relative_to(root).as_posix(), content(path)) for path in paths]
    return fingerprint(files)


def code_of(name: str, widgets: Mapping[str, Widget]) -> str:
    """The hash of the code that makes one figure's frames: everything except the modules of the other figures, which it
    cannot import."""
    path = Path(str(sys.modules[widgets[name].start.__module__].__file__))
    return _code_beside(path)


@lru_cache
def _code_beside(file: Path) -> str:
    mine = ("__init__.py", _figure_of(file))
    return code_hash(skip=lambda path: path.is_relative_to(FIGURES) and _figure_of(path) not in mine)


def _figure_of(path: Path) -> str:
    """The module or folder in widgets/figures that a file is or belongs to; "" for a file elsewhere."""
    return path.relative_to(FIGURES).parts[0] if path.is_relative_to(FIGURES) else ""


@lru_cache(maxsize=512)
def _frames(data: bytes) -> list[Plain]:
    """Parse cached frames; nobody may change them."""
    return json.loads(data)  # type: ignore[no-any-return]


@lru_cache(maxsize=128)
def _tape(data: bytes) -> tuple[bytes, Plain, tuple[StateRoles, ...]]:
    """Parse a cached tape."""
    script, first, states = json.loads(data)
    return script.encode(), first, tuple(StateRoles(**state) for state in states)


class Bakery:
    """Frames for records, cached under the hash of the code, the figure and the records."""

    def __init__(self, widgets: Mapping[str, Widget], cache: Path) -> None:
        self._widgets = widgets
        self._host = Host(Watched(widgets))
        self._store = Store(cache, "frames")
        self._codes: dict[str, str] = {}

    def frames(self, dom_id: str, records: Sequence[Plain]) -> list[Plain]:
        """One frame for each record of one widget, in order.

        Raises FigureFault if the widget is at fault.
        """

        def make() -> bytes:
            return _plain([self._frame(dom_id, record) for record in records])

        return _frames(self._store.get(self._frames_key(dom_id, records), make))

    def shown(self, figure: Figure, tape_states: Sequence[Plain], record: Plain) -> Plain:
        """The frame of a figure in a state, taken from its tape if `tape_states`, the tape's states, include it.

        Raises FigureFault.
        """
        records = tape_states if record in tape_states else [record]
        return self.frames(figure.dom_id, records)[records.index(record)]

    def readouts(self, figure: Figure, tape_states: Sequence[Plain], record: Plain) -> dict[str, str]:
        """The readouts, by name, in the frame that `shown` returns.

        Raises FigureFault.
        """

        def make() -> bytes:
            frame = self.shown(figure, tape_states, record)
            return _plain([{readout["name"]: readout["value"] for readout in frame["readouts"]}])

        (values,) = _frames(self._store.get(self._readouts_key(figure, record), make))
        return values

    def lacks_readouts(self, figure: Figure, record: Plain) -> bool:
        """Whether a frame has to be drawn for these readouts."""
        return not self._store.has(self._readouts_key(figure, record)) and self.lacks_frames(figure.dom_id, [record])

    def _readouts_key(self, figure: Figure, record: Plain) -> str:
        return f"{self._frames_key(figure.dom_id, [record])} readouts"

    def _frame(self, dom_id: str, record: Plain) -> Plain:
        widget = self._widgets[record["widget"]]
        try:
            frame: Plain = json.loads(self._host.frame(json.dumps({"figure": dom_id, "record": record})))
            return frame
        except Exception as error:
            raise FigureFault.of(widget, "draw", error, record) from error

    def tape(
        self,
        dom_id: str,
        records: Sequence[Plain],
        script: Callable[[str, Sequence[Plain], Sequence[Plain]], str],
    ) -> tuple[bytes, Plain, tuple[StateRoles, ...]]:
        """The tape that `script` makes of a figure's records and their frames, the first frame, and the roles that each
        state shows; cached as well."""

        def make() -> bytes:
            frames = self.frames(dom_id, records)
            states = list(map(state_roles, records, frames))
            return _plain([script(dom_id, records, frames), frames[0], states])

        return _tape(self._store.get(f"{self._frames_key(dom_id, records)} {TAPE}", make))

    def results(self, dom_id: str, record: Plain) -> tuple[Plain, ...]:
        """The result of each job of the record's widget, without machine-dependent parts; cached as well."""
        widget = self._widgets[record["widget"]]
        if not widget.jobs:
            return ()
        state = parsed(widget, record)

        def make() -> bytes:
            try:
                jobs = [watched_job(widget, job) for job in widget.jobs]
                return _plain([dict(finished(job, state.controls, state.seed, f"{dom_id}-{job.name}")) for job in jobs])
            except Exception as error:
                raise FigureFault.of(widget, "jobs", error, record) from error

        return tuple(json.loads(self._store.get(self._results_key(dom_id, record), make)))

    def lacks(self, dom_id: str, records: Sequence[Plain]) -> bool:
        """Whether any of a figure's frames or job results has to be made."""
        jobs = self._widgets[records[0]["widget"]].jobs
        lacks_results = jobs and not self._store.has(self._results_key(dom_id, records[0]))
        return self.lacks_frames(dom_id, records) or bool(lacks_results)

    def lacks_frames(self, dom_id: str, records: Sequence[Plain]) -> bool:
        """Whether any of these frames has to be made."""
        return not self._store.has(self._frames_key(dom_id, records))

    def _frames_key(self, dom_id: str, records: Sequence[Plain]) -> str:
        return self._key(records[0]["widget"], [dom_id, records])

    def _results_key(self, dom_id: str, record: Plain) -> str:
        return self._key(record["widget"], ["jobs", dom_id, record])

    def _key(self, name: str, question: list[Any]) -> str:
        """The cache key: the code of the figure and of the checks, and the request."""
        if name not in self._codes:
            self._codes[name] = code_of(name, self._widgets)
        return json.dumps([self._codes[name], SOUND, *question])


def frames_of(
    bakery: Bakery, problems: Problems, tapes: Mapping[str, Sequence[Plain]], figure: Figure, records: Sequence[Plain]
) -> list[Plain]:
    """Frames of a figure in some states; an empty list, and a problem, if it cannot be drawn.

    tapes: figure → the states of its tape.
    """
    try:
        return [bakery.shown(figure, tapes.get(figure.id, ()), record) for record in records]
    except FigureFault as fault:
        fault.tell(problems, figure.place)
        return []


def readouts_of(
    bakery: Bakery, problems: Problems, tapes: Mapping[str, Sequence[Plain]], figure: Figure, record: Plain
) -> dict[str, str]:
    """The readouts of a figure in a state, by name; an empty dict, and a problem, if it cannot be drawn.

    tapes: figure → the states of its tape.
    """
    try:
        return bakery.readouts(figure, tapes.get(figure.id, ()), record)
    except FigureFault as fault:
        fault.tell(problems, figure.place)
        return {}


def known_by_name(widget: Widget) -> bool:
    """Whether another process can find a widget by its name, as it can the site's own."""
    return WIDGETS.get(widget.name) is widget


def make_ahead(dom_id: str, records: Sequence[Plain], cache: Path) -> None:
    """Put the tape's frames and the job results of one of the site's figures into the cache; for worker processes."""
    bakery = Bakery(WIDGETS, cache)
    bakery.frames(dom_id, records)
    bakery.results(dom_id, records[0])


def draw_ahead(dom_id: str, records: Sequence[Plain], cache: Path) -> None:
    """Put frames of one of the site's figures into the cache; for worker processes."""
    Bakery(WIDGETS, cache).frames(dom_id, records)


def _plain(values: list[Any]) -> bytes:
    return dumps(values).encode()
