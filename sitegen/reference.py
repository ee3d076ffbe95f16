"""The reference of `solvers`: what is public, in order, with what its docstrings and signatures say of it."""

from __future__ import annotations

import ast
import inspect
import re
import textwrap
from collections.abc import Iterator
from dataclasses import MISSING, dataclass, fields, is_dataclass
from enum import Enum
from functools import cache
from importlib import import_module
from typing import Any

from markupsafe import Markup

from solvers.methods import METHODS
from solvers.stepper import Method

from .docstrings import meanings, pieces, rendered, said
from .highlighting import highlighted

# Heading, what is said of it, and the things under it by their full names.
GROUPS: tuple[tuple[str, str, tuple[str, ...]], ...] = (
    ("Register", "The front door.", ("solvers.register",)),
    (
        "What comes back",
        "",
        ("solvers.Result", "solvers.Pose", "solvers.Status", "solvers.stepper.History"),
    ),
    ("Known pairs", "The closed forms beneath.", ("solvers.fit_rigid", "solvers.fit_planar", "solvers.Fit")),
    (
        "Judging a pose",
        "Against a known truth, and by the clouds alone.",
        (
            *(f"solvers.metrics.{name}" for name in ("rre", "rte", "scale_error", "point_error", "residuals", "rms")),
            *("solvers.verify.evidence", "solvers.verify.Evidence", "solvers.verify.halves"),
        ),
    ),
    (
        "Step by step",
        "What `register` runs, for those who want to stop, look, and go on.",
        (
            *("solvers.stepper.Problem", "solvers.stepper.begin", "solvers.stepper.advance", "solvers.stepper.run"),
            *("solvers.stepper.Batch", "solvers.stepper.Method"),
        ),
    ),
    (
        "Scenes",
        "The figures' clouds, from a seed.",
        (
            *("solvers.scenes.Scene", "solvers.scenes.room", "solvers.scenes.room_start"),
            *("solvers.scenes.kabsch_scene", "solvers.bird_scene.bird", "solvers.bird_scene.bird_start"),
            *(f"solvers.wall_scenes.{name}" for name in ("single_wall", "corridor", "hall", "ndt_room")),
            *("solvers.match_scenes.facade_scene", "solvers.walk_scenes.fish", "solvers.walk_scenes.fish_start"),
            *("solvers.scans.two_scans", "solvers.scans.Scans"),
        ),
    ),
    (
        "The race and its benchmark",
        "",
        (
            *("solvers.race.Controls", "solvers.race.Contestant", "solvers.race.contestants"),
            *("solvers.race.race_problem", "solvers.benchmark.benchmark", "solvers.benchmark.Line"),
            *("solvers.benchmark.table", "solvers.benchmark.entry"),
        ),
    ),
    (
        "Clouds from files",
        "",
        (
            *("solvers.cloud_text.read", "solvers.cloud_text.CloudText", "solvers.thinning.thinned"),
            *("solvers.thinning.slab", "solvers.thinning.spacing"),
        ),
    ),
)


@dataclass(frozen=True)
class Option:
    """One option of a method, or one member of an enumeration."""

    name: str
    type: str
    default: str
    says: Markup


@dataclass(frozen=True)
class Entry:
    """A thing of the reference: its anchor, its name, its signature as code, its words, and what belongs to it."""

    anchor: str
    name: str
    signature: Markup
    words: Markup
    members: tuple[Entry, ...] = ()
    values: tuple[Option, ...] = ()


@dataclass(frozen=True)
class MethodEntry:
    """A method of `solvers.METHODS`: what it is, and its options."""

    anchor: str
    name: str
    method: Method[Any]
    dims: str
    options: tuple[Option, ...]
    words: Markup


@dataclass(frozen=True)
class Group:
    """A heading and what stands under it."""

    anchor: str
    title: str
    says: Markup
    entries: tuple[Entry, ...]


@cache
def groups() -> tuple[Group, ...]:
    """What is public, in order. Raises LookupError for a name of the list that is not there."""
    made = []
    for title, says, names in GROUPS:
        anchor = re.sub(r"\W+", "-", title.lower())
        made.append(Group(anchor, title, said(says), tuple(map(_entry, names))))
    return tuple(made)


@cache
def methods() -> tuple[MethodEntry, ...]:
    """Every method with its options."""
    return tuple(_method(name, method) for name, method in METHODS.items())


def found(name: str) -> Any:
    """What a full name, such as `solvers.scenes.room`, names. Raises LookupError where that is nothing."""
    module, _, own = name.rpartition(".")
    thing = getattr(import_module(module), own, None)
    if thing is None:
        raise LookupError(f"the reference lists {name}, which is not there")
    return thing


def names_of(thing: Any) -> list[str]:
    """What its docstring is to explain: a function's parameters, a dataclass's public fields."""
    if inspect.isclass(thing):
        return [f.name for f in fields(thing)] if is_dataclass(thing) else []
    return [p.name for p in inspect.signature(thing).parameters.values() if p.name not in ("self", "cls")]


def explained(thing: Any) -> dict[str, str]:
    """What the docstring says of each of these; "" where it says nothing."""
    return meanings(inspect.getdoc(thing) or "", names_of(thing), lambda path: _explained_at(path, thing.__module__))


def _entry(name: str) -> Entry:
    thing = found(name)
    short = name.rpartition(".")[2]
    anchor = re.sub(r"\W+", "-", name)
    doc = inspect.getdoc(thing) or ""
    signature = _signature(thing, name)
    words = rendered(doc, names_of(thing))
    if inspect.isclass(thing) and issubclass(thing, Enum):
        notes = _member_notes(thing)
        values = tuple(Option(m.name, "", str(m.value), said(notes.get(m.name, ""))) for m in thing)
        return Entry(anchor, name, signature, words, _members(thing, short, anchor), values)
    return Entry(anchor, name, signature, words, _members(thing, short, anchor) if inspect.isclass(thing) else ())


def _members(thing: type, short: str, anchor: str) -> tuple[Entry, ...]:
    """The methods and properties that a class of ours defines itself."""
    made = []
    for name, value in vars(thing).items():
        function: Any = value.fget if isinstance(value, property) else getattr(value, "__func__", value)
        if name.startswith("_") or not inspect.isfunction(function):
            continue
        code = f"{short}.{name}"
        if isinstance(value, property):
            returns = inspect.signature(function).return_annotation
            signature = highlighted(f"{code}: {_type(returns)}", "python")
        else:
            signature = _signature(function, code)
        words = rendered(inspect.getdoc(function) or "", names_of(function))
        made.append(Entry(f"{anchor}-{name.replace('_', '-')}", code, signature, words))
    return tuple(made)


def _signature(thing: Any, name: str) -> Markup:
    """As Python would write it, a line a parameter where one line is too long."""
    if inspect.isclass(thing) and issubclass(thing, Enum):
        return highlighted(f"class {name}", "python")
    signature = inspect.signature(thing)
    parts, starred = [], False
    for p in signature.parameters.values():
        if p.name in ("self", "cls"):
            continue
        if p.kind is p.KEYWORD_ONLY and not starred:
            parts.append("*")
        starred = starred or p.kind in (p.KEYWORD_ONLY, p.VAR_POSITIONAL)
        mark = "**" if p.kind is p.VAR_KEYWORD else "*" if p.kind is p.VAR_POSITIONAL else ""
        default = "" if p.default is p.empty else f" = {_value(p.default)}"
        parts.append(f"{mark}{p.name}: {_type(p.annotation)}{default}")
    lead = "class " if inspect.isclass(thing) else ""
    returns = "" if inspect.isclass(thing) else f" -> {_type(signature.return_annotation)}"
    line = f"{lead}{name}({', '.join(parts)}){returns}"
    if len(line) > 88:
        line = "\n".join([f"{lead}{name}(", *(f"    {part}," for part in parts), f"){returns}"])
    return highlighted(line, "python")


def _type(annotation: Any) -> str:
    if isinstance(annotation, str):
        return annotation
    return str(getattr(annotation, "__name__", annotation))


def _value(value: Any) -> str:
    """A default as a reader would write it."""
    text = str(value.__name__) if callable(value) and hasattr(value, "__name__") else repr(value)
    return text if len(text) <= 60 and not text.startswith("<") else "…"


def _method(name: str, method: Method[Any]) -> MethodEntry:
    doc = inspect.getdoc(method.options) or ""
    own = [f.name for f in fields(method.options)]
    says = explained(method.options)
    options = tuple(
        Option(f.name, str(f.type), "" if f.default is MISSING else _value(f.default), said(says[f.name]))
        for f in fields(method.options)
    )
    step = inspect.unwrap(method.step)
    module = import_module(getattr(step, "__module__", method.options.__module__))
    dims = "any" if method.dims is None else " or ".join(map(str, method.dims))
    words = rendered("\n\n".join([inspect.getdoc(module) or "", *_unlabelled(doc, own)]), [])
    return MethodEntry(f"method-{name}", name, method, dims, options, words)


def _unlabelled(doc: str, names: list[str]) -> Iterator[str]:
    """What an options' docstring says of the whole, such as when a run stops."""
    for piece in pieces(doc, names):
        if isinstance(piece, str) and not piece.startswith(("The others", "As `", "The options of a method that has")):
            yield piece


def _explained_at(path: str, module: str) -> dict[str, str]:
    """The meanings of what a docstring names: by its full name, or of the same module. Prose may name no such thing."""
    where, _, own = path.rpartition(".")
    try:
        thing = getattr(import_module(where or module), own)
    except (ImportError, AttributeError):
        return {}
    return explained(thing) if callable(thing) else {}


def _member_notes(thing: type) -> dict[str, str]:
    """The texts that stand under the members of an enumeration."""
    body = ast.parse(textwrap.dedent(inspect.getsource(thing))).body[0]
    assert isinstance(body, ast.ClassDef)
    notes = {}
    for before, after in zip(body.body, body.body[1:], strict=False):
        if isinstance(before, ast.Assign) and isinstance(after, ast.Expr) and isinstance(after.value, ast.Constant):
            notes[ast.unparse(before.targets[0])] = str(after.value.value)
    return notes
