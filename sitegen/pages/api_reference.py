"""The API reference of `solvers`: all public names, in order, with signatures and docstrings as parsed by griffe."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any, cast

import griffe
from markupsafe import Markup

from sitegen.markup.code import highlighted
from sitegen.pages.docstrings import parameters, prose, rendered, said, sections
from solvers.core.method import Method
from solvers.core.registry import METHODS

ROOT = Path(__file__).resolve().parents[2]

# Heading, a sentence about it, and its entries by their full names.
GROUPS: tuple[tuple[str, str, tuple[str, ...]], ...] = (
    ("Register", "The front door.", ("solvers.register",)),
    (
        "What comes back",
        "",
        ("solvers.Result", "solvers.Pose", "solvers.Status", "solvers.stepper.History"),
    ),
    (
        "Known pairs",
        "The closed forms beneath.",
        ("solvers.fit_rigid", "solvers.fit_planar", "solvers.Fit", "solvers.collinear.poses_about_line"),
    ),
    (
        "Judging a pose",
        "Against a known truth, and by the clouds alone.",
        (
            *(f"solvers.metrics.{name}" for name in ("rre", "rte", "scale_error", "point_error", "residuals", "rms")),
            *(f"solvers.verify.{name}" for name in ("evidence", "Evidence", "usual_reach", "halves")),
        ),
    ),
    (
        "How sure a pose is",
        "In the plane.",
        (
            *(f"solvers.uncertainty.{name}" for name in ("covariance", "Covariance", "from_matrix", "range_bearing")),
            *(f"solvers.uncertainty.{name}" for name in ("monte_carlo", "spread_of", "Spread", "from_starts")),
            *(f"solvers.uncertainty.{name}" for name in ("state_covariance", "quantile", "exp", "log", "adjoint")),
            *(f"solvers.uncertainty_study.{name}" for name in ("coverage", "CoverageLine", "runs", "redrawn")),
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
            *("solvers.scans.two_scans", "solvers.scans.TwoScans"),
            *(f"solvers.mug_scene.{name}" for name in ("mug", "mug_pairs", "mug_start", "Mug")),
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
        "Many poses",
        "Graphs of poses, and their files; drives, and their poses from their scans.",
        (
            *(f"solvers.posegraph.{name}" for name in ("Edges", "optimise", "GraphResult", "begin", "advance")),
            *(f"solvers.posegraph.{name}" for name in ("GraphRun", "marginals", "residuals", "jacobians")),
            *(f"solvers.odometry.{name}" for name in ("read_drive", "prepare", "Scans", "match", "MatchOptions")),
            *(f"solvers.odometry.{name}" for name in ("Matches", "scan_to_scan", "scan_to_map", "Chain", "keyframes")),
            *(f"solvers.drives.{name}" for name in ("Drive", "telecom_loop", "simulated_drive", "chained")),
            *(f"solvers.odometry.{name}" for name in ("candidates", "verified", "LoopOptions", "close", "missed")),
            *("solvers.odometry.straightened", "solvers.posegraph.chi_squared"),
            *("solvers.posegraph.stacked", "solvers.posegraph.concatenated"),
            *("solvers.g2o.read", "solvers.g2o.GraphText", "solvers.g2o.write"),
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
    """An entry of the reference: anchor, name, signature as code, docstring, a class's members, an enum's values."""

    anchor: str
    name: str
    signature: Markup
    words: Markup
    members: tuple[Entry, ...] = ()
    values: tuple[Option, ...] = ()


@dataclass(frozen=True)
class MethodEntry:
    """A method of `solvers.METHODS`, with its description and options."""

    anchor: str
    name: str
    method: Method[Any]
    dims: str
    options: tuple[Option, ...]
    words: Markup


@dataclass(frozen=True)
class Group:
    """A heading and the entries under it."""

    anchor: str
    title: str
    says: Markup
    entries: tuple[Entry, ...]


@cache
def groups() -> tuple[Group, ...]:
    """All public entries, in order. Raises LookupError for a listed name that does not exist."""
    return tuple(
        Group(re.sub(r"\W+", "-", title.lower()), title, said(summary), tuple(map(_entry, names)))
        for title, summary, names in GROUPS
    )


@cache
def methods() -> tuple[MethodEntry, ...]:
    """Every method with its options."""
    return tuple(_method(name, method) for name, method in METHODS.items())


@cache
def package() -> griffe.Module:
    """`solvers` as griffe parses it, without importing it."""
    module = griffe.load("solvers", search_paths=[ROOT], docstring_parser="numpy", allow_inspection=False)
    assert isinstance(module, griffe.Module)
    return module


def named(name: str) -> griffe.Object:
    """The object with a full name such as `solvers.scenes.room`. Raises LookupError if there is none."""
    try:
        member = package()[name.removeprefix("solvers.")]
    except KeyError:
        raise LookupError(f"the reference lists {name}, which does not exist") from None
    return member.final_target if isinstance(member, griffe.Alias) else member


def members(thing: griffe.Object) -> Iterator[griffe.Function | griffe.Attribute]:
    """The public methods and properties that a class of ours defines itself."""
    for name, member in thing.members.items():
        is_property = isinstance(member, griffe.Attribute) and "property" in member.labels
        if not name.startswith("_") and (is_property or isinstance(member, griffe.Function)):
            yield cast(griffe.Function | griffe.Attribute, member)


def _entry(name: str) -> Entry:
    thing = named(name)
    anchor = re.sub(r"\W+", "-", name)
    if not isinstance(thing, griffe.Class):
        return Entry(anchor, name, _signature(thing, name), rendered(thing))
    entries = tuple(
        Entry(f"{anchor}-{member.name.replace('_', '-')}", code, _signature(member, code), rendered(member))
        for member in members(thing)
        for code in (f"{thing.name}.{member.name}",)
    )
    values = tuple(
        Option(key, "", str(value.value), said(value.docstring.value if value.docstring else ""))
        for key, value in thing.attributes.items()
        if is_enum(thing) and "property" not in value.labels
    )
    return Entry(anchor, name, _signature(thing, name), rendered(thing), entries, values)


def _signature(thing: griffe.Object, name: str) -> Markup:
    """The signature in Python's syntax, with one parameter per line if it is too long for a single line."""
    if isinstance(thing, griffe.Attribute):
        return highlighted(f"{name}: {thing.annotation}", "python")
    if isinstance(thing, griffe.Class):
        line = f"class {name}" if is_enum(thing) else f"class {thing.signature(name=name)}"
    else:
        assert isinstance(thing, griffe.Function)
        line = thing.signature(name=name)
    if len(line) > 88:
        head, inner, tail = re.fullmatch(r"(.*?\()(.*)(\).*?)", line).groups()  # type: ignore[union-attr]
        parts = re.split(r", (?=\*{0,2}\w+: |\*, )", inner)
        line = "\n".join([head, *(f"    {part}," for part in parts), tail])
    return highlighted(line, "python")


def is_enum(thing: griffe.Class) -> bool:
    """Whether a class is an enumeration, so that its attributes are its members."""
    return any(str(base).endswith("Enum") for base in thing.bases)


def _method(name: str, method: Method[Any]) -> MethodEntry:
    thing = named(f"{method.options.__module__}.{method.options.__qualname__}")
    options = tuple(Option(p.name, str(p.annotation), str(p.default), said(p.description)) for p in parameters(thing))
    # Its own module first, then the step's if that is shared: `gicp` steps as `point-to-plane` does.
    modules = dict.fromkeys(getattr(part, "__wrapped__", part).__module__ for part in (method.start, method.step))
    words = [rendered(named(module)) for module in modules]
    # An options docstring describes the method as a whole after its first line.
    first = next((str(part.value) for part in sections(thing) if part.kind is griffe.DocstringSectionKind.text), "")
    words.append(prose(first.partition("\n")[2]))
    dims = "any" if method.dims is None else " or ".join(map(str, method.dims))
    return MethodEntry(f"method-{name}", name, method, dims, options, Markup("\n").join(words))
