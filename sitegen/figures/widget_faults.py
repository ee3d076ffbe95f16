"""Faults in a figure's module, found without drawing: it is imported, and its WIDGET is checked for consistency."""

from __future__ import annotations

import ast
import dataclasses
import sys
import traceback
from collections.abc import Iterator, Mapping
from inspect import getsource
from operator import attrgetter
from pathlib import PurePath
from types import TracebackType
from typing import Any, get_args, get_type_hints

from sitegen.figures.model import FIGURES
from sitegen.problems import Place, Problems, hint
from widgets.drawing.picture import ROLES
from widgets.engine.contract import Key, Widget, parsed, preset
from widgets.engine.controls import Spec, validated

LISTS = ("buttons", "legend", "handles", "clicks", "hovers", "tape", "jobs", "takes")
COMMA = "one item needs a comma: (item,)"  # parentheses alone make no tuple
SHAPES = [shape for part in get_args(get_type_hints(Key)["shape"]) for shape in get_args(part)]
MACHINERY = ("widgets.engine.", "widgets.drawing.picture", "widgets.drawing.svg")


def module_file(name: str) -> str:
    """The path of a figure's file, as problems cite it."""
    module = name.replace("-", "_")
    return f"widgets/figures/{module}/figure.py" if (FIGURES / module).is_dir() else f"widgets/figures/{module}.py"


def sound(widgets: Mapping[str, Widget], problems: Problems) -> dict[str, Widget]:
    """The figures that can be placed. Faults of the others are reported, so placing one of them is not."""
    good = {}
    for name in widgets:
        widget = _import(widgets, name, problems)
        if widget is None:
            problems.unread.add(module_file(name))
            continue
        if widget.name != name:
            message = f"expected {name!r}, the name of its module, got {widget.name!r}"
            problems.add(place_of(widget, name, "name"), f"figure {name}, name: {message}")
            widget = dataclasses.replace(widget, name=name)
        faults = list(widget_faults(widget))
        for field, item, message in faults:
            words = f"{field} {item!r}" if item else field
            problems.add(place_of(widget, name, field, item), f"figure {name}, {words}: {message}")
        if faults:
            problems.unread.add(module_file(name))
        else:
            good[name] = widget
    return good


def _import(widgets: Mapping[str, Widget], name: str, problems: Problems) -> Widget | None:
    try:
        widget = widgets[name]
    except SyntaxError as error:
        place = Place(_under_widgets(error.filename or "") or module_file(name), error.lineno or 0, error.offset or 0)
        problems.add(place, f"figure {name} cannot be imported: {error.msg}")
    except Exception as error:
        place = line_of(error.__traceback__) or Place(module_file(name))
        message = str(error)
        if isinstance(error, AttributeError) and error.name == "WIDGET":
            place, message = Place(module_file(name), 1, 1), "missing WIDGET = Widget(…)"
        problems.add(place, f"figure {name} cannot be imported: {type(error).__name__}: {message}")
    else:
        if isinstance(widget, Widget):
            return widget
        problems.add(Place(module_file(name), 1, 1), f"figure {name}: WIDGET: expected a Widget, got {widget!r:.60}")
    return None


def widget_faults(widget: Widget) -> Iterator[tuple[str, str, str]]:
    """Yield the faults in a widget's controls, presets, buttons, legend and tape: field, item or "", and message.

    If the controls are faulty, or a field is not a tuple, nothing else is checked.
    """
    values: dict[str, Any] = {field: getattr(widget, field) for field in LISTS}
    faulty = [(field, "", f"expected a tuple, got {value!r:.60}; {COMMA}")
              for field, value in values.items() if not isinstance(value, tuple | list)]  # fmt: skip
    faulty += _control_faults(widget.controls)
    yield from faulty
    if faulty:
        return
    if "default" not in widget.presets:
        yield "presets", "", f"missing 'default'{hint('default', widget.presets)}"
    for name in widget.presets:
        if fault := _refusal(lambda name=name: preset(widget, name)):
            yield "presets", name, fault
    presses = [button.name for button in widget.buttons if button.does == "press"]
    for button in widget.buttons:
        if button.does == "run" and button.repeats not in presses:
            message = f"repeats: unknown button to press {button.repeats!r}{hint(button.repeats, presses)}"
            yield "buttons", button.name, message
    for key in widget.legend:
        if key.role not in ROLES:
            yield "legend", key.label, f"unknown role {key.role!r}{hint(key.role, ROLES)}"
        if key.shape not in SHAPES:
            yield "legend", key.label, f"unknown shape {key.shape!r}{hint(key.shape, SHAPES)}"
        choice, *options = key.under or ("",)
        for option in options:
            if fault := _refusal(lambda choice=choice, option=option: validated(widget.controls, {choice: option})):
                yield "legend", key.label, f"under: {fault}"
    for i, entry in enumerate(values["tape"]):
        match entry:
            case [Mapping() as changes, [*buttons]]:
                log = [["press", press] for press in buttons]
            case _:
                yield "tape", "", f"entry {i + 1}: expected ({{controls}}, (presses,)), got {entry!r:.60}; {COMMA}"
                return
        plain = {"preset": next(iter(widget.presets), "default"), "controls": dict(changes), "log": log}
        if fault := _refusal(lambda plain=plain: parsed(widget, plain)):
            yield "tape", "", f"entry {i + 1}: {fault}"


def _control_faults(controls: Any) -> Iterator[tuple[str, str, str]]:
    if not dataclasses.is_dataclass(controls) or not isinstance(controls, type):
        yield "controls", "", f"expected a frozen dataclass, got {controls!r:.60}"
        return
    if not attrgetter("__dataclass_params__.frozen")(controls):
        yield "controls", "", "expected a frozen dataclass: write @dataclass(frozen=True)"
    by_name = {field.name: field for field in dataclasses.fields(controls)}
    without = [name for name, field in by_name.items() if not isinstance(field.metadata.get("spec"), Spec)]
    for name in without:
        yield "controls", name, "expected slider(…), choice(…) or toggle(…)"
    if without:
        return
    for name, field in by_name.items():
        if fault := _refusal(lambda name=name, field=field: validated(controls, {name: field.default})):
            yield "controls", name, f"invalid default: {fault.removeprefix(f'{name}: ')}"
        for option, effects in field.metadata["spec"].sets.items():
            if option not in field.metadata["spec"].options:
                yield "controls", name, f"sets: unknown option {option!r}{hint(option, field.metadata['spec'].options)}"
            if fault := _refusal(lambda effects=effects: validated(controls, effects)):
                yield "controls", name, f"option {option!r} sets {fault}"
        by, labels = field.metadata["spec"].named or ("", {})
        for option in labels:
            if fault := _refusal(lambda by=by, option=option: validated(controls, {by: option})):
                yield "controls", name, f"its label depends on {fault}"


def _refusal(attempt: Any) -> str:
    """The message of the ValueError that `attempt` raises; "" if it raises none."""
    try:
        attempt()
    except ValueError as error:
        return str(error)
    return ""


def place_of(widget: Widget, name: str, field: str, item: str = "") -> Place:
    """Where a field of a widget, or an item of it, is written; the module itself if that is not found."""
    file = Place(module_file(name))
    if field == "controls" and isinstance(widget.controls, type):
        return _place_in(widget.controls.__module__, _control_line, (widget.controls.__name__, item)) or file
    return _place_in(getattr(widget.draw, "__module__", ""), _field_line, (field, item)) or file


def _place_in(module: str, find: Any, arguments: tuple[str, str]) -> Place | None:
    if not module.startswith("widgets.") or module not in sys.modules:
        return None
    try:
        node = find(ast.parse(getsource(sys.modules[module])), *arguments)
    except (OSError, SyntaxError):  # edited since the import
        return None
    return Place(_file_of(module), node.lineno, node.col_offset + 1) if node else Place(_file_of(module), 1, 1)


def _field_line(tree: ast.Module, field: str, item: str) -> ast.expr | None:
    calls = [node for node in ast.walk(tree) if isinstance(node, ast.Call)]
    widget_calls = [call for call in calls if isinstance(call.func, ast.Name) and call.func.id == "Widget"]
    for value in (word.value for call in widget_calls for word in call.keywords if word.arg == field):
        texts = (node for node in ast.walk(value) if isinstance(node, ast.Constant))
        return next((node for node in texts if item and node.value == item), value)
    return None


def _control_line(tree: ast.Module, name: str, field: str) -> ast.stmt | None:
    for cls in (node for node in ast.walk(tree) if isinstance(node, ast.ClassDef) and node.name == name):
        lines = (line for line in cls.body if isinstance(line, ast.AnnAssign) and isinstance(line.target, ast.Name))
        return next((line for line in lines if ast.unparse(line.target) == field), cls)
    return None


def line_of(trace: TracebackType | None) -> Place | None:
    """The last line of a figure's own code, or of code that figures share, in a traceback."""
    place = None
    for (frame, line), summary in zip(traceback.walk_tb(trace), traceback.extract_tb(trace), strict=True):
        module = frame.f_globals.get("__name__", "")
        if module.startswith("widgets.") and not module.startswith(MACHINERY):
            place = Place(_file_of(module), line, (summary.colno or 0) + 1)
    return place


def def_line(function: Any) -> Place | None:
    """Where a figure's function is defined."""
    module, code = getattr(function, "__module__", None) or "", getattr(function, "__code__", None)
    return Place(_file_of(module), code.co_firstlineno, 1) if code and module.startswith("widgets.") else None


def _file_of(module: str) -> str:
    return f"{module.replace('.', '/')}.py"


def _under_widgets(path: str) -> str:
    """A file's path from widgets/ on; "" for a file elsewhere."""
    parts = PurePath(path).parts
    start = max((i for i, part in enumerate(parts) if part == "widgets"), default=-1)
    return "/".join(parts[start:]) if start >= 0 else ""
