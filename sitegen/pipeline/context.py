"""What every stage of a build works with: what was asked for, and what the site is made of beside its content."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from sitegen.assets import icons, typefaces
from sitegen.cache.memory import Memory
from sitegen.external import fetch, served
from sitegen.figures.gallery import Plot
from sitegen.pages import search_index
from sitegen.plots import registry
from sitegen.progress import Progress
from sitegen.runtime.assemble import RuntimeInfo
from sitegen.runtime.reuse import assembled
from widgets.engine.contract import Widget
from widgets.engine.registry import WIDGETS


@dataclass(frozen=True)
class Parts:
    """What a build is made of beside content and templates; tests put others in their place."""

    widgets: Mapping[str, Widget]
    plots: Mapping[str, Plot] = field(default_factory=registry.known)
    assemble: Callable[..., RuntimeInfo] | None = assembled
    cut_fonts: Callable[..., typefaces.FontSet] | None = typefaces.make
    draw_emblem: Callable[..., Mapping[str, bytes]] | None = icons.make
    licences: Callable[..., Sequence[fetch.Licence]] = served.licences
    search: Callable[[Path], bytes] | None = search_index.library


STANDARD = Parts(WIDGETS)


@dataclass(frozen=True)
class BuildContext:
    """A build of the checkout at `root`.

    strict: warnings are problems. drafts: chapters that are drafts are built too. pack: .gz and .br beside the files,
    and the whole site in a zip to take away; who only looks at pages needs neither. memory: what an earlier build in
    this process left there is not made again; the site is the same without.
    """

    root: Path
    cache: Path
    progress: Progress
    memory: Memory
    parts: Parts = STANDARD
    strict: bool = False
    drafts: bool = False
    pack: bool = True
