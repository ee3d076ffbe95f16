"""Records in, frames out: the one place that the build's baking, the tapes and the browser's worker all go through.

A frame is plain data: the panels' SVG, readouts, handles, and what the page needs to carry on. A Host remembers the
states along the last record of each figure, so one more action, a replaced drag or a step back costs at most one `act`.
A panel or mark that is the same object as in the last picture is not rendered again, and a mark shared by several
panels of one view is rendered once.

On request, a slow replay is done in slices, and so is a single action of a widget that acts in pieces: the states that
a slice reaches are kept beside those of the last frame until the frame is drawn or another record is requested.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from functools import partial
from time import perf_counter
from typing import Any

import numpy as np

from widgets.drawing.picture import Group, Handle, Mark, Panel, Picture, View
from widgets.drawing.svg import UNIT, group_svg, mark_svg, panel_svg
from widgets.engine.contract import Action, Animation, Pieces, Record, Trace, Widget, motions, parsed
from widgets.engine.controls import clip, nearest, specs, values
from widgets.engine.jobs import Job, Running, plain
from widgets.engine.registry import WIDGETS
from widgets.engine.script import headed

SLICE = 0.1  # seconds after which a slice of a replay begins no further action or piece


@dataclass
class _Replay:
    """The states along the beginning of a log: states[i] is the state after its first i actions. pieces: the next
    action, if it is partly done."""

    key: Any
    states: list[Any]
    log: tuple[Action, ...] = ()
    pieces: Pieces | None = None

    def shared(self, log: tuple[Action, ...]) -> int:
        """How many leading actions of the log already have known states."""
        pairs = zip(log, self.log[: len(self.states) - 1], strict=False)
        return next((i for i, (one, other) in enumerate(pairs) if one != other), min(len(log), len(self.states) - 1))

    def towards(self, log: tuple[Action, ...]) -> _Replay:
        """A replay of another log that starts from the states both share."""
        common, last = self.shared(log), len(self.states) - 1
        same = common == last and log[last : last + 1] == self.log[last : last + 1]
        return _Replay(self.key, self.states[: common + 1], log, self.pieces if same else None)

    @property
    def whole(self) -> bool:
        """Whether the replay has reached the log's end."""
        return len(self.states) > len(self.log)

    def act(self, widget: Widget) -> None:
        """Replay one more action, or one piece of it if the widget acts in pieces."""
        state, action = self.states[-1], self.log[len(self.states) - 1]
        if widget.pieces is None:
            self.states.append(widget.act(state, action))
            return
        self.pieces = self.pieces or widget.pieces(state, action)
        try:
            next(self.pieces)
        except StopIteration as end:
            self.pieces = None
            self.states.append(end.value)


_Marks = dict[tuple[int, int], tuple[Mark, View, str]]


@dataclass
class _Markup:
    """The markup of a figure's last picture: panels by id prefix, marks by the ids of mark and view.

    The objects are kept with their markup, so that no other object can get the same id.
    """

    panels: dict[str, tuple[Panel, str]] = field(default_factory=dict)
    marks: _Marks = field(default_factory=dict)

    def drawn(self, figure: str, panels: tuple[Panel, ...]) -> list[str]:
        """The panels' SVG; markup that only the last picture used is dropped."""
        before, self.marks = self.marks, {}
        old, self.panels = self.panels, {}
        draw = partial(self._mark, before)
        for panel in panels:
            prefix = f"{figure}-{panel.name}"
            cached = old.get(prefix)
            same = cached is not None and cached[0] is panel
            self.panels[prefix] = cached if cached and same else (panel, panel_svg(panel, prefix, draw))
        return [svg for _, svg in self.panels.values()]

    def _mark(self, before: _Marks, mark: Mark, view: View, prefix: str) -> str:
        # Not a recursive closure: it would keep the last picture's marks alive until the next garbage collection.
        if isinstance(mark, Group):  # its id has the panel's prefix, but the marks inside may be shared
            return group_svg(mark, view, prefix, partial(self._mark, before))
        key = id(mark), id(view)
        cached = self.marks.get(key) or before.get(key) or (mark, view, mark_svg(mark, view, prefix))
        self.marks[key] = cached
        return cached[2]


class Host:
    """Draws figures. A page's worker has one, and so has each baking of the build."""

    def __init__(self, widgets: Mapping[str, Widget] = WIDGETS, now: Callable[[], float] = perf_counter) -> None:
        self._widgets = widgets
        self._now = now
        self._replays: dict[str, _Replay] = {}  # of the last frames
        self._begun: dict[str, _Replay] = {}  # on the way to a frame
        self._markup: dict[str, _Markup] = {}
        self._running = Running()
        self._given: dict[str, Any] = {}

    def frame(self, request: str) -> str:
        """The frame for a request, JSON in and out: {"figure": id prefix, "record": record, "detail": level} → frame.

        With "slices": true, the answer to a slow replay is its progress, {"replayed": actions, "of": all of them};
        repeating the request continues it. Raises ValueError for an invalid record.
        """
        query = _read(request)
        figure, (widget, record) = query["figure"], self._asked(query["record"])
        due = self._now() + SLICE if query.get("slices") is True else np.inf
        replay = self._replay(figure, widget, record, due)
        if replay.whole:
            answer = self._drawn(figure, widget, record, replay.states, query.get("detail"))
        else:
            answer = {"replayed": len(replay.states) - 1, "of": len(replay.log)}
        return json.dumps(answer, ensure_ascii=False, separators=(",", ":"))

    def render(self, figure: str, plain: Mapping[str, Any], detail: int | None = None) -> dict[str, Any]:
        """The frame of the figure with id prefix `figure` in the state that the plain record names.

        detail: the level of detail that will do; None for the finest. A finer level is drawn if it is already known:
        the frame states its level, and record and level together determine every byte of it.
        """
        widget, record = self._asked(plain)
        return self._drawn(figure, widget, record, self._replay(figure, widget, record).states, detail)

    def job(self, request: str) -> str:
        """Part of a job, JSON in and out: {"figure": id prefix, "record": record, "job": name, "do": what}.

        do: "parts" → their names; "begin", with the "part", which also does its first slice, or "go on" → the fraction
        done of it from 0 to 1, in words, whether it is done, and its outcome; "stop" → null; "result", with "outcomes"
        by part → the result (widgets.engine.jobs). Raises ValueError for an invalid record, an unknown job or part, and
        a job that is not running.
        """
        query = _read(request)
        widget, record = self._asked(query["record"])
        jobs = {job.name: job for job in widget.jobs}
        name, do, figure = query.get("job"), query.get("do"), query["figure"]
        if not isinstance(name, str) or name not in jobs:
            raise ValueError(f"job: {widget.name} has no {clip(name)}{nearest(name, jobs)}")
        answer = self._job(query, figure, jobs[name], record, do)
        return json.dumps(answer, ensure_ascii=False, separators=(",", ":"))

    def _job(self, query: Mapping[str, Any], figure: str, job: Job, record: Record, do: object) -> Any:
        if do == "parts":
            return job.parts(record.controls)
        if do == "result":
            return plain(job.result(record.controls, query["outcomes"]), f"{figure}-{job.name}")
        if do == "stop":
            return self._running.stop(figure, job)
        if do == "begin":
            self._running.begin(figure, job, record.controls, record.seed, query.get("part"))
        return self._running.slice(figure, job)

    def give(self, request: str, data: bytes) -> str:
        """Read and store what a reader supplied, JSON in and out: {"widget": name, "name": of the file} → its
        fingerprint `key`, by which records name it, and `words` that describe it. Equal names and bytes have equal
        keys.

        Raises ValueError for what the widget cannot read.
        """
        query = json.loads(request)
        name, widget = str(query["name"]), self._widgets.get(query["widget"])
        if widget is None or widget.reads is None:
            raise ValueError(f"{query['widget']!r:.60}: no widget that takes anything")
        key = _fingerprint(name.encode("utf-8", "replace") + b"\0" + data)
        if key not in self._given:
            self._given[key] = widget.reads(name, data)
        return json.dumps({"key": key, "words": self._given[key].words}, ensure_ascii=False)

    def forget(self, key: str) -> None:
        """Drop what was stored under this key."""
        self._given.pop(key, None)

    def _drawn(
        self, figure: str, widget: Widget, record: Record, states: list[Any], detail: int | None
    ) -> dict[str, Any]:
        level = _level(widget, states[-1], detail)
        picture = widget.draw(states[-1]) if widget.details == 1 else widget.draw(states[-1], level)
        animations = motions(widget.motion(states[-2], states[-1])) if len(states) > 1 else ()
        svgs = self._markup.setdefault(figure, _Markup()).drawn(figure, picture.panels)
        panels = [_panel(panel, svg) for panel, svg in zip(picture.panels, svgs, strict=True)]
        frame = _frame(figure, record, picture, panels, animations, headed(widget.python(states[-1]), widget.title))
        files = dict(widget.files(states[-1]))
        return {**frame, "detail": level, **({"files": files} if files else {})}

    def _asked(self, plain: Mapping[str, Any]) -> tuple[Widget, Record]:
        name = plain.get("widget") if isinstance(plain, Mapping) else None
        if not isinstance(name, str) or name not in self._widgets:
            raise ValueError(f"no widget {clip(name)}{nearest(name, self._widgets)}")
        widget = self._widgets[name]
        return widget, parsed(widget, plain)

    def _replay(self, figure: str, widget: Widget, record: Record, due: float = np.inf) -> _Replay:
        """Replay the record: to its end, or as far as it gets by `due`."""
        here = tuple(key in self._given for _, key in record.given)
        key = (widget.name, record.controls, record.seed, record.given, here)
        # A replay that raises half way is dropped; one that is abandoned leaves the last frame's states intact.
        replays = [one for one in (self._begun.pop(figure, None), self._replays.get(figure)) if one and one.key == key]
        if replays:
            replay = max(replays, key=lambda one: one.shared(record.log)).towards(record.log)
        else:
            replay = _Replay(key, [self._started(widget, record)], record.log)
        moved = not replays
        while not replay.whole:
            if moved and self._now() > due:
                self._begun[figure] = replay
                return replay
            replay.act(widget)
            moved = True
        self._replays[figure] = replay
        return replay

    def _started(self, widget: Widget, record: Record) -> Any:
        if not widget.takes:
            return widget.start(record.controls, record.seed)
        # A link names what its writer supplied but does not contain it: the state is then as if nothing was supplied.
        uploads = {place: self._given[key] for place, key in record.given if key in self._given}
        return widget.start(record.controls, record.seed, uploads)


def _fingerprint(data: bytes) -> str:
    """A 128-bit fingerprint of the bytes; the browser's Python comes without hashlib."""
    return f"{int.from_bytes(b'1' + data, 'big') % (2**128 - 159):032x}"  # modulo a prime, so that every byte counts


def _read(request: str) -> Mapping[str, Any]:
    """Parse a page's request, which must name a figure and a record.

    Raises ValueError for anything else.
    """
    try:
        query = json.loads(request)
    except RecursionError:
        raise ValueError("request: nested too deeply") from None
    if not isinstance(query, Mapping) or not isinstance(query.get("figure"), str) or "record" not in query:
        raise ValueError(f"request: {clip(query)} does not name a figure and a record")
    return query


def _level(widget: Widget, state: Any, detail: int | None) -> int:
    """The level of detail to draw at.

    Raises ValueError if the widget has no such level.
    """
    if detail is None:
        return widget.details - 1
    if isinstance(detail, bool) or not isinstance(detail, int) or not 0 <= detail < widget.details:
        raise ValueError(f"detail: {clip(detail)} is not a whole number from 0 to {widget.details - 1}")
    return max(detail, widget.known(state))


def _frame(
    figure: str,
    record: Record,
    picture: Picture,
    drawings: list[dict[str, Any]],
    animations: Iterable[Animation],
    python: str,
) -> dict[str, Any]:
    """A picture as plain data for the page; `drawings` are its rendered panels."""
    panels = {panel.name: panel for panel in picture.panels}
    return {
        "panels": drawings,
        "readouts": [
            {"name": r.name, "label": r.label, "value": r.value, "unit": r.unit, "role": r.role or ""}
            for r in picture.readouts
        ],
        "handles": [_handle(h, panels[h.panel], type(record.controls)) for h in picture.handles],
        "description": picture.description,
        "note": picture.note,
        "disabled": sorted(picture.disabled),
        "motions": [_motion(figure, one, panels[one.panel]) for one in animations],
        "controls": values(record.controls),
        "python": python,
    }


def _panel(panel: Panel, svg: str) -> dict[str, Any]:
    return {"name": panel.name, "svg": svg, "view": _view(panel), "caption": panel.caption}


def _view(panel: Panel) -> list[float]:
    """World window, nominal size and padding: what the page needs to convert a pointer position to world units."""
    v = panel.view
    return [v.x0, v.x1, v.y0, v.y1, *(round(side, 4) for side in v.size), *v.pad]


def _handle(handle: Handle, panel: Panel, controls: type) -> dict[str, Any]:
    """The handle as plain data, with its position in percent of the panel, as the page's overlay needs it.

    slider: least, greatest and current value of the one number that an ARIA slider must report: an angle, or x.
    """
    (place,) = panel.view.px([handle.xy])
    left, top = (_rounded(100 * v / size, 3) for v, size in zip(place, panel.view.size, strict=True))
    turns, spec = handle.kind == "turn", specs(controls)[handle.sets] if handle.sets else None
    least, most = (spec.low, spec.high) if spec else (panel.view.x0, panel.view.x1)
    slider = (-180.0, 180.0, handle.angle) if turns else (least, most, handle.xy[0])
    sets = {"sets": handle.sets} if handle.sets else {}
    return {
        "name": handle.name,
        "panel": handle.panel,
        "kind": handle.kind,
        "label": handle.label,
        "value": handle.value,
        "left": left,
        "top": top,
        "radius": handle.radius,
        "also": list(handle.also),
        "world": _place(handle.xy),
        "slider": [_rounded(v, 2) for v in slider],
        "keys": {key: _place(xy) for key, xy in handle.keys.items()},
        **sets,
    }


def _place(xy: tuple[float, float]) -> list[float]:
    """World coordinates as in records: four decimals (0.1 mm where a unit is a metre), no negative zero."""
    return [_rounded(v, 4) for v in xy]


def _rounded(value: float, decimals: int) -> float:
    """Round with a nudge that breaks ties, as in the SVG, and without negative zero: natively and in the browser the
    digits are the same.
    """
    return round(float(value) + 1e-9, decimals) + 0.0


def _motion(figure: str, motion: Animation, panel: Panel) -> dict[str, Any]:
    """A motion in SVG user units and degrees, y down, as the page needs it; a trace only names its group."""
    if isinstance(motion, Trace):
        return {"group": f"{figure}-{panel.name}-{motion.group}", "trace": True}
    (about,) = panel.view.px([motion.about])
    scale = panel.view.scale
    return {
        "group": f"{figure}-{panel.name}-{motion.group}",
        "turn": _rounded(-np.degrees(motion.turn), 3),
        "about": [_rounded(v * UNIT, 1) for v in about],
        "shift": [_rounded(motion.shift[0] * scale * UNIT, 1), _rounded(-motion.shift[1] * scale * UNIT, 1)],
    }
