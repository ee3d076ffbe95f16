"""Faults in what a figure draws: its functions are wrapped to locate errors, and its pictures checked before rendering.

Only the build checks: a live figure runs code that has passed here.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any, get_args

import numpy as np

from sitegen.figures.widget_faults import def_line, line_of
from sitegen.problems import Place, Problems, hint
from widgets.drawing.picture import ROLES, Anchor, Group, Handle, Mark, Panel, Picture, Readout, Shape
from widgets.engine.contract import Animation, Widget, motions
from widgets.engine.controls import specs
from widgets.engine.jobs import Job, Progress, Result

PAIRS = ("xy", "a", "b", "centre", "direction")
NUMBER = re.compile(r"\d+(?:\.\d+)?(?:e[+-]?\d+)?")
SHAPES, ANCHORS = get_args(Shape), get_args(Anchor)


class FigureFault(Exception):
    """A fault in a figure, found as it draws. place: in its module, None if unknown; messages: what is wrong."""

    def __init__(self, widget: str, place: Place | None, messages: tuple[str, ...]) -> None:
        super().__init__(f"figure {widget}, {'; '.join(messages)}")
        self.widget, self.place, self.messages = widget, place, messages
        self.record: Mapping[str, Any] = {}

    @classmethod
    def of(cls, widget: Widget, field: str, error: Exception, record: Mapping[str, Any] | None = None) -> FigureFault:
        """The fault for an error raised by a widget's function, placed at the last line of widget code it passed."""
        fault = error
        if not isinstance(fault, cls):
            place = line_of(error.__traceback__) or def_line(getattr(widget, field, None))
            fault = cls(widget.name, place, (f"{field}: {type(error).__name__}: {error}",))
        fault.record = record or fault.record
        return fault

    def tell(self, problems: Problems, placement: Place | None) -> None:
        """Add it to the problems, once. placement: where a chapter places the figure, None if none does."""
        place = self.place or placement or Place("widgets/figures")
        presses = ",".join(entry[1] for entry in self.record.get("log", ()))
        state = f"preset {self.record.get('preset')}" + (f" press={presses}" if presses else "")
        by = "not placed in any chapter" if placement is None else f"placed at {placement.path}:{placement.line}"
        # A message that differs only in numbers has been reported for another state.
        earlier = [problem for problem in problems.found if (problem.path, problem.line) == (place.path, place.line)]
        messages = [NUMBER.sub("0", problem.message) for problem in earlier]
        for message in (f"figure {self.widget}, {fault}" for fault in self.messages):
            if not any(m.startswith(NUMBER.sub("0", message)) for m in messages):
                problems.add(place, f"{message} ({state}; {by})")


class Watched(Mapping[str, Widget]):
    """Wraps widgets so that they raise FigureFault if one of their functions fails or a picture is faulty."""

    def __init__(self, widgets: Mapping[str, Widget]) -> None:
        self._widgets = widgets
        self._cache: dict[str, Widget] = {}

    def __getitem__(self, name: str) -> Widget:
        if name not in self._cache:
            self._cache[name] = _watch(self._widgets[name])
        return self._cache[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._widgets)

    def __len__(self) -> int:
        return len(self._widgets)


def _watch(widget: Widget) -> Widget:
    panels: dict[str, Panel] = {}

    def ran(name: str, *arguments: Any) -> Any:
        try:
            return getattr(widget, name)(*arguments)
        except Exception as error:
            raise FigureFault.of(widget, name, error) from error

    def require(name: str, messages: tuple[str, ...]) -> None:
        if messages:
            raise FigureFault(widget.name, def_line(getattr(widget, name)), tuple(f"{name}: {m}" for m in messages))

    def draw(*arguments: Any) -> Picture:
        picture: Picture = ran("draw", *arguments)
        require("draw", tuple(picture_faults(widget, picture)))
        panels.clear()
        panels.update({panel.name: panel for panel in picture.panels})
        return picture

    def motion(previous: Any, current: Any) -> tuple[Animation, ...]:
        animations = motions(ran("motion", previous, current))
        unknown = (m.panel for m in animations if m.panel not in panels)
        require("motion", tuple(f"unknown panel {name!r}{hint(name, panels)}" for name in unknown))
        return animations

    def python(state: Any) -> str:
        text = ran("python", state)
        require("python", () if isinstance(text, str) else (f"expected text, got {text!r:.60}",))
        return str(text)

    return replace(
        widget,
        start=lambda *arguments: ran("start", *arguments),
        act=lambda *arguments: ran("act", *arguments),
        known=lambda state: ran("known", state),
        files=lambda state: ran("files", state),
        draw=draw,
        motion=motion,
        python=python,
    )


def watched_job(widget: Widget, job: Job) -> Job:
    """Wrap a job so that its errors and its faulty results raise FigureFault."""

    def work(controls: Any, seed: int, part: str) -> Iterator[Progress]:
        try:
            yield from job.work(controls, seed, part)
        except Exception as error:
            raise FigureFault.of(widget, f"job {job.name}", error) from error

    def result(controls: Any, outcomes: Mapping[str, Any]) -> Result:
        try:
            drawn = job.result(controls, outcomes)
        except Exception as error:
            raise FigureFault.of(widget, f"job {job.name}", error) from error
        messages = tuple(f"job {job.name}: {message}" for message in _result(drawn))
        if messages:
            raise FigureFault(widget.name, def_line(job.result), messages)
        return drawn

    return replace(job, work=work, result=result)


def _result(result: Result) -> Iterator[str]:
    for row in result.rows:
        if row.role not in ROLES:
            yield f"row {row.name!r}: unknown role {row.role!r}{hint(row.role, ROLES)}"
    for panel in result.panels:
        yield from _marks(panel.marks, f"panel {panel.name!r}")


def picture_faults(widget: Widget, picture: Picture) -> Iterator[str]:
    """Yield the faults of a picture: the field, and what was expected."""
    if not isinstance(picture, Picture):
        yield f"expected a Picture, got {picture!r:.60}"
        return
    yield from _texts(picture, "picture", "description", "note")
    names = [panel.name for panel in picture.panels]
    for panel in picture.panels:
        subject = f"panel {panel.name!r}"
        yield from _texts(panel, subject, "name", "label", "caption")
        if names.count(panel.name) > 1:
            yield f"{subject}: duplicate panel name"
        if not np.isfinite([panel.view.x0, panel.view.x1, panel.view.y0, panel.view.y1]).all():
            yield f"{subject}: view: expected finite numbers, got {panel.view!r:.80}"
        yield from _marks(panel.marks, subject)
    for readout in picture.readouts:
        yield from _readout(readout)
    for handle in picture.handles:
        yield from _handle(widget, handle, names)
    buttons = [button.name for button in widget.buttons]
    for name in sorted(set(picture.disabled) - set(buttons)):
        yield f"disabled: unknown button {name!r}{hint(str(name), buttons)}"
    for field in ("clicks", "hovers"):
        for name in getattr(widget, field):
            if name not in names:
                yield f"{field}: unknown panel {name!r}{hint(name, names)}"


def _marks(marks: tuple[Mark, ...], subject: str) -> Iterator[str]:
    for i, mark in enumerate(marks, 1):
        mark_subject = f"{subject}, mark {i}"
        if isinstance(mark, Group):
            yield from _marks(mark.marks, f"{mark_subject} (Group {mark.name!r})")
            continue
        if not isinstance(mark, get_args(Mark)):
            yield f"{mark_subject}: expected a mark of widgets.drawing.picture, got {mark!r:.60}"
            continue
        mark_subject = f"{mark_subject} ({type(mark).__name__})"
        role = getattr(mark, "role", "ink")
        if role not in ROLES:
            yield f"{mark_subject}: unknown role {role!r}{hint(str(role), ROLES)}"
        for name, choices in (("shape", SHAPES), ("anchor", ANCHORS)):
            if getattr(mark, name, choices[0]) not in choices:
                yield f"{mark_subject}: unknown {name} {getattr(mark, name)!r}{hint(str(getattr(mark, name)), choices)}"
        if hasattr(mark, "text"):
            yield from _texts(mark, mark_subject, "text")
        for name in (name for name in PAIRS if hasattr(mark, name)):
            yield from _coordinates(getattr(mark, name), f"{mark_subject}: {name}")


def _coordinates(values: Any, subject: str) -> Iterator[str]:
    """Check rows of two numbers. Infinity is allowed, as a point far out."""
    try:
        rows = np.asarray(values, dtype=float).reshape(-1, 2)
    except (TypeError, ValueError):
        yield f"{subject}: expected rows of two numbers, got {values!r:.60}"
        return
    bad = np.flatnonzero(np.isnan(rows).any(axis=1))
    if len(bad):
        x, y = rows[bad[0]]
        suffix = f" (and {len(bad) - 1} more)" if len(bad) > 1 else ""
        yield f"{subject}: expected numbers, got ({x:g}, {y:g}) in row {bad[0]}{suffix}: omit points without a place"


def _texts(thing: Any, subject: str, *names: str) -> Iterator[str]:
    for name in names:
        value = getattr(thing, name)
        if not isinstance(value, str):
            yield f"{subject}: {name}: expected text, got {value!r:.40}"


def _readout(readout: Readout) -> Iterator[str]:
    subject = f"readout {readout.name!r}"
    yield from _texts(readout, subject, "name", "label", "unit")
    if not isinstance(readout.value, str):
        as_text = "number(value)" if isinstance(readout.value, (int, float)) else "str(value)"
        yield f"{subject}: value: expected text, got {readout.value!r:.40}: use {as_text}"
    if readout.role is not None and readout.role not in ROLES:
        yield f"{subject}: unknown role {readout.role!r}{hint(str(readout.role), ROLES)}"


def _handle(widget: Widget, handle: Handle, panels: list[str]) -> Iterator[str]:
    subject = f"handle {handle.name!r}"
    yield from _texts(handle, subject, "label", "value")
    if handle.sets:
        sliders = [name for name, spec in specs(widget.controls).items() if spec.kind == "slider"]
        if handle.sets not in sliders:
            yield f"{subject}: sets: unknown slider {handle.sets!r}{hint(handle.sets, sliders)}"
    elif handle.name not in widget.handles:
        yield f"{subject}: missing from the WIDGET's handles{hint(handle.name, widget.handles)}"
    for name in (handle.panel, *handle.also):
        if name not in panels:
            yield f"{subject}: unknown panel {name!r}{hint(name, panels)}"
    yield from _coordinates(handle.xy, f"{subject}: xy")
    for key, xy in handle.keys.items():
        yield from _coordinates(xy, f"{subject}: keys {key!r}")
