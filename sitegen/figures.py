"""Figures as chapters place them: which widget in which state, what the page needs of it, its frames, baked and kept.

Nothing is drawn here: frames come from widgets.host, which the browser runs too.
"""

from __future__ import annotations

import json
import re
import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

import solvers
import widgets
import widgets.figures
from widgets.contract import MAX_LOG, Record, Widget, parsed, preset
from widgets.controls import Spec, specs, validated, values
from widgets.host import Host
from widgets.jobs import finished
from widgets.registry import WIDGETS

from .directives import Attribute, Directive, DirectiveError, attributes
from .files import content, fingerprint, short_hash
from .picture_faults import FigureFault, Watched, watched_job
from .problems import Place, Problems, hint
from .store import Store
from .widget_faults import module_file

Plain = dict[str, Any]
FIGURES = Path(widgets.figures.__path__[0])
TAPE = short_hash(content(Path(__file__).with_name("tape.py")))  # of what makes the tapes that are kept
SOUND = short_hash(content(Path(__file__).with_name("picture_faults.py")))  # of what looks at the pictures before


@dataclass
class Figure:
    """A figure in a chapter. `records` are the states of its tape, the first of them its own."""

    id: str
    number: str
    widget: Widget
    record: Record
    place: Place
    records: list[Plain] = field(default_factory=list)

    @property
    def dom_id(self) -> str:
        """The id of its element, and what its SVG's ids begin with."""
        return f"fig-{self.id}"

    def remember(self, record: Record) -> None:
        """Put a state, and all that lead to it, on the tape."""
        plain = record.plain()
        for length in range(len(plain["log"]) + 1):
            state = {**plain, "log": plain["log"][:length]}
            if state not in self.records:
                self.records.append(state)


def listed(directive: Directive, at: Callable[[int], Place], problems: Problems) -> list[Attribute] | None:
    """The directive's attributes; None where they cannot be read. That, and one that stands twice, is a problem."""
    try:
        found = attributes(directive)
    except DirectiveError as error:
        problems.add(at(error.offset), str(error))
        return None
    seen: set[str] = set()
    for attribute in found:
        if attribute.name and attribute.name in seen:
            problems.add(at(attribute.start), f"{attribute.name!r} stands twice")
        seen.add(attribute.name)
    return found


def placed(
    directive: Directive, at: Callable[[int], Place], number: str, widgets: Mapping[str, Widget], problems: Problems
) -> Figure | None:
    """The figure that a `::figure` line places, its tape as its widget wants it; None where it names no widget."""
    given = listed(directive, at, problems)
    if given is None:
        return None
    bare = [a for a in given if not a.name]
    if not bare:
        problems.add(
            at(directive.attributes_start), "a figure names its widget first: {kabsch preset=default id=solve}"
        )
        return None
    if bare[0].value not in widgets:
        near = hint(bare[0].value, widgets)
        problems.lacks(module_file(bare[0].value), at(bare[0].start), f"no widget {bare[0].value!r}{near}")
        return None
    for extra in bare[1:]:
        problems.add(at(extra.start), f"name=value is expected, not {extra.value!r}")
    widget = widgets[bare[0].value]
    named = {a.name: a for a in given if a.name}
    chosen = named.pop("preset", None)
    name = chosen.value if chosen else "default"
    if name not in widget.presets:
        problems.add(
            at(chosen.value_start if chosen else bare[0].start),
            f"{widget.name} has no preset {name!r}{hint(name, widget.presets)}",
        )
        return None
    figure_id = named.pop("id", None)
    if (figure_id and not figure_id.value.replace("-", "").isalnum()) or (figure_id and not figure_id.value.isascii()):
        problems.add(at(figure_id.value_start), f"{figure_id.value!r} is no id: ASCII letters, digits and hyphens")
    base = preset(widget, name)
    record = changed(widget, base, named.values(), at, problems, ("preset", "id"))
    figure = Figure(figure_id.value if figure_id else widget.name, number, widget, record, at(directive.start))
    figure.records.append(record.plain())  # its own comes first, also where presses lead to it
    figure.remember(record)
    for changes, presses in widget.tape:
        log = [["press", press] for press in presses]
        figure.remember(parsed(widget, {**record.plain(), "controls": merged(widget, record, changes), "log": log}))
    return figure


def id_of(directive: Directive) -> str:
    """The id that a `::figure` or `::plot` line gives, also where it cannot be read: that named, or its first word."""
    named = re.search(r"\bid\s*=\s*([\w-]+)", directive.attributes) or re.match(r"\s*([\w-]+)", directive.attributes)
    return named[1] if named else ""


def merged(widget: Widget, base: Record, changes: Mapping[str, Any]) -> dict[str, Any]:
    """Control values with `changes` in place and, where they do not say, what their chosen options bring along."""
    known = specs(widget.controls)
    brought = {k: v for name, value in changes.items() for k, v in known[name].sets.get(str(value), {}).items()}
    return {**values(base.controls), **brought, **changes}


def changed(
    widget: Widget,
    base: Record,
    given: Iterable[Attribute],
    at: Callable[[int], Place],
    problems: Problems,
    more: Sequence[str] = (),
) -> Record:
    """A record with other control values, `seed=`, and `press=a,b*3` for a log; what is wrong goes to `problems`.

    more: what else may be named where this is written.
    """
    known = specs(widget.controls)
    presses = {b.name for b in widget.buttons if b.does == "press"}
    controls: dict[str, Any] = {}
    seed, log = base.seed, []
    for attribute in given:
        where = at(attribute.value_start)
        if attribute.name == "seed":
            if (
                isinstance(attribute.plain, bool)
                or not isinstance(attribute.plain, int)
                or not 0 <= attribute.plain < 2**31
            ):
                problems.add(where, f"seed: a whole number is expected, not {attribute.value!r}")
            else:
                seed = attribute.plain
        elif attribute.name == "press":
            offset = attribute.value_start
            for written in attribute.value.split(","):
                name, star, times = written.partition("*")
                if name not in presses:
                    problems.add(at(offset), f"{widget.name} has no button {name!r} to press{hint(name, presses)}")
                elif star and not (times.isascii() and times.isdigit() and 0 < int(times[:9]) <= MAX_LOG):
                    problems.add(at(offset), f"{written!r}: how often is a whole number from 1 to {MAX_LOG}")
                else:
                    log += [["press", name]] * (int(times) if star else 1)
                offset += len(written) + 1
        elif attribute.name not in known:
            near = hint(attribute.name, [*known, "seed", "press", *more])
            if attribute.name in ("preset", "id"):
                near = ": that is the ::figure line's; controls, seed and press are set here"
            problems.add(at(attribute.start), f"{widget.name} has no control {attribute.name!r}{near}")
        else:
            value = attribute.value if known[attribute.name].kind == "choice" else attribute.plain
            try:
                validated(widget.controls, {attribute.name: value})
                controls[attribute.name] = value
            except ValueError as error:
                problems.add(where, str(error))
    if len(log) > MAX_LOG:
        problems.add(at(0), f"a log holds at most {MAX_LOG} actions")
        log = []
    return parsed(widget, {**base.plain(), "controls": merged(widget, base, controls), "seed": seed, "log": log})


def code_hash(
    packages: Sequence[ModuleType] = (solvers, widgets), skip: Callable[[Path], bool] = lambda path: False
) -> str:
    """The hash of what frames and values are made by: the packages' sources as imported, and numpy's version."""
    files = [("numpy", np.__version__.encode())]
    for package in packages:
        root = Path(package.__path__[0]).parent
        paths = [path for path in (root / package.__name__).rglob("*.py") if not skip(path)]
        files += [(path.relative_to(root).as_posix(), content(path)) for path in paths]
    return fingerprint(files)


def code_of(name: str, widgets: Mapping[str, Widget]) -> str:
    """The hash of what the frames of one figure are made by: all but the modules of the other figures."""
    own = Path(str(sys.modules[widgets[name].start.__module__].__file__))
    return _code_beside(own)


@lru_cache
def _code_beside(own: Path) -> str:
    return code_hash(skip=lambda path: path.parent == FIGURES and path != own and not path.name.startswith("_"))


@lru_cache(maxsize=512)
def _frames(kept: bytes) -> list[Plain]:
    """Frames as they are kept; nobody changes them."""
    return json.loads(kept)  # type: ignore[no-any-return]


@lru_cache(maxsize=128)
def _tape(kept: bytes) -> tuple[bytes, Plain]:
    """A tape as it is kept."""
    script, first = json.loads(kept)
    return script.encode(), first


class Bakery:
    """Frames for records, kept by the hash of the code, the figure and the records."""

    def __init__(self, widgets: Mapping[str, Widget], cache: Path) -> None:
        self._widgets = widgets
        self._host = Host(Watched(widgets))
        self._store = Store(cache, "frames")
        self._codes: dict[str, str] = {}

    def frames(self, dom_id: str, records: Sequence[Plain]) -> list[Plain]:
        """One frame for each record of one widget, in order.

        Raises FigureFault for what a widget does wrong.
        """

        def made() -> bytes:
            return _plain([self._frame(dom_id, record) for record in records])

        return _frames(self._store.get(self._frames_key(dom_id, records), made))

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
    ) -> tuple[bytes, Plain]:
        """What `script` makes of a figure's records and their frames, and the first of these, kept likewise."""

        def made() -> bytes:
            frames = self.frames(dom_id, records)
            return _plain([script(dom_id, records, frames), frames[0]])

        return _tape(self._store.get(f"{self._frames_key(dom_id, records)} {TAPE}", made))

    def results(self, dom_id: str, record: Plain) -> tuple[Plain, ...]:
        """What each job of the record's widget finds, without what depends on the machine, kept likewise."""
        widget = self._widgets[record["widget"]]
        if not widget.jobs:
            return ()
        asked = parsed(widget, record)

        def made() -> bytes:
            try:
                jobs = [watched_job(widget, job) for job in widget.jobs]
                return _plain([dict(finished(job, asked.controls, asked.seed, f"{dom_id}-{job.name}")) for job in jobs])
            except Exception as error:
                raise FigureFault.of(widget, "jobs", error, record) from error

        return tuple(json.loads(self._store.get(self._results_key(dom_id, record), made)))

    def lacks(self, dom_id: str, records: Sequence[Plain]) -> bool:
        """Whether any of a figure's frames, or what its jobs find, has to be made."""
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

    def _key(self, name: str, asked: list[Any]) -> str:
        """What is kept depends on the figure's code and on what is asked of it."""
        if name not in self._codes:
            self._codes[name] = code_of(name, self._widgets)
        return json.dumps([self._codes[name], SOUND, *asked])


def frames_of(bakery: Bakery, problems: Problems, figure: Figure, records: Sequence[Plain]) -> list[Plain]:
    """Frames of a figure in other states; none, and a problem, where it cannot be drawn."""
    try:
        return bakery.frames(figure.dom_id, records)
    except FigureFault as fault:
        fault.tell(problems, figure.place)
        return []


def make_ahead(dom_id: str, records: Sequence[Plain], cache: Path) -> None:
    """Draw a tape of one of the site's figures, in a process of its own: the cache has it then."""
    bakery = Bakery(WIDGETS, cache)
    bakery.frames(dom_id, records)
    bakery.results(dom_id, records[0])


def draw_ahead(dom_id: str, records: Sequence[Plain], cache: Path) -> None:
    """Draw records of one of the site's figures, in a process of its own: the cache has them then."""
    Bakery(WIDGETS, cache).frames(dom_id, records)


def _plain(made: list[Any]) -> bytes:
    return dumps(made).encode()


def dumps(data: Any) -> str:
    """JSON as pages carry it: short, and unable to end a script element."""
    text = json.dumps(data, ensure_ascii=False, separators=(",", ":"), allow_nan=False)
    return text.replace("<", "\\u003c").replace("\u2028", "\\u2028").replace("\u2029", "\\u2029")


def spec(widget: Widget) -> Plain:
    """What the page's script needs to know of a widget."""
    return {
        "buttons": [
            {"name": b.name, "label": b.label, "does": b.does, "primary": b.primary, "repeats": b.repeats}
            for b in widget.buttons
        ],
        "controls": {name: _control(control) for name, control in specs(widget.controls).items()},
        "handles": list(widget.handles),
        "clicks": list(widget.clicks),
        "hovers": list(widget.hovers),
        "takes": list(widget.takes),
        "details": widget.details,
    }


def _control(control: Spec) -> Plain:
    shared: Plain = {"kind": control.kind, "label": control.label, "keeps": control.keeps}
    if control.kind == "slider":
        numbers = {"low": control.low, "high": control.high, "step": control.step}
        return {**shared, **numbers, "unit": control.unit, "decimals": control.decimals}
    return (
        {**shared, "options": dict(control.options), "sets": {k: dict(v) for k, v in control.sets.items()}}
        if control.kind == "choice"
        else shared
    )


def first_frame(frame: Plain) -> Plain:
    """A frame without its drawings, which stand in the page already."""
    return {**frame, "panels": [{k: v for k, v in panel.items() if k != "svg"} for panel in frame["panels"]]}
