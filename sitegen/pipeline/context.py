"""The context shared by all stages of a build: its options, and the parts of the site other than its content."""

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
    """The parts of a build other than content and templates; tests substitute their own."""

    widgets: Mapping[str, Widget]
    plots: Mapping[str, Plot] = field(default_factory=registry.all_plots)
    assemble: Callable[..., RuntimeInfo] | None = assembled
    cut_fonts: Callable[..., typefaces.FontSet] | None = typefaces.make
    draw_emblem: Callable[..., Mapping[str, bytes]] | None = icons.make
    licences: Callable[..., Sequence[fetch.Licence]] = served.licences
    search: Callable[[Path], bytes] | None = search_index.library


STANDARD = Parts(WIDGETS)


@dataclass(frozen=True)
class BuildContext:
    """The settings of one build of the checkout at `root`.

    strict: treat warnings as problems. drafts: build draft chapters too. pack: write .gz and .br copies of the files,
    and a zip of the whole site for download; a preview needs neither. memory: results of earlier builds in this
    process, to be reused; the site is the same without them.
    """

    root: Path
    cache: Path
    progress: Progress
    memory: Memory
    parts: Parts = STANDARD
    strict: bool = False
    drafts: bool = False
    pack: bool = True
