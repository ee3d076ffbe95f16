"""The packs that the page's Python loads on first use: one per figure, and one per group of the solvers' modules.

A page starts without them. When an import names a module in a pack, the worker loads the pack and asks again.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import PurePosixPath

from sitegen.runtime.patches import DATACLASSES

START = "ladder"
ROOMS: Mapping[str, tuple[str, ...]] = {
    "flow": ("solvers.methods.flow",),
    "search": ("solvers.methods.search",),
    "uncertainty": ("solvers.uncertainty", "solvers.studies.coverage", "solvers.studies.redrawn"),
    "drive": (
        *("solvers.odometry", "solvers.posegraph", "solvers.io.g2o", "solvers.scenes.drive"),
        *("solvers.scenes.drive_packing", "solvers.scenes.recorded"),
        *("widgets.parts.drive_map", "widgets.parts.drive_table"),
        *("widgets.parts.drive_solved", "widgets.parts.drive_poses"),
    ),
    "files": ("solvers.io",),  # except for solvers.io.g2o
}
"""The groups' packs by name, and the modules and packages in each of them, with everything below."""
FIGURES = "widgets.figures"
LEFT_OUT = ("solvers.cli", "solvers.__main__")  # the command line, which no page runs


def pack_of(member: str) -> str | None:
    """The pack of a member of our compiled wheel; None if no page has it."""
    parts = PurePosixPath(member.removeprefix(f"{DATACLASSES}/"))
    name = ".".join(parts.with_suffix("").parts) if parts.suffix in (".pyc", ".f4") else ".".join(parts.parts)
    name = name.removesuffix(".__init__")
    if ".dist-info" in name:
        return START if name.endswith(".METADATA") else None
    if _is_below(name, LEFT_OUT) or parts.suffix == ".pyi":
        return None
    if _is_below(name, (FIGURES,)) and name != FIGURES:
        return "figure-" + name.split(".")[2]
    return next((pack for pack, modules in ROOMS.items() if _is_below(name, modules)), START)


def holds(pack: str) -> tuple[str, ...]:
    """The modules for which a pack is loaded; empty if the start loads it."""
    figure = pack.removeprefix("figure-")
    return ROOMS.get(pack, () if figure == pack else (f"{FIGURES}.{figure}",))


def _is_below(name: str, tops: tuple[str, ...]) -> bool:
    return any(f"{name}.".startswith(f"{top}.") for top in tops)
