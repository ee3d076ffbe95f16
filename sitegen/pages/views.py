"""What the templates show of figures and plots, and the environment that fills them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from jinja2 import BytecodeCache, Environment, FileSystemLoader, StrictUndefined
from jinja2.bccache import Bucket
from markupsafe import Markup

from sitegen.assets.panel_classes import panel_class
from sitegen.cache.store import Store
from sitegen.figures.gallery import Drawn, Placed
from sitegen.figures.model import Figure
from sitegen.figures.wire import Plain, dumps, first_frame, spec
from widgets.drawing.picture import number
from widgets.engine.contract import Widget
from widgets.engine.controls import Spec, specs

if TYPE_CHECKING:
    pass



@dataclass(frozen=True)
class Chosen:
    """What a slide shows of a figure: names of panels and of readouts."""

    panels: tuple[str, ...]
    readouts: tuple[str, ...]


@dataclass(frozen=True)
class FigureView:
    """What the figure's template shows."""

    id: str
    number: str
    widget: Widget
    controls: Mapping[str, Spec]
    frame: Plain
    record: Markup
    tape: str
    caption: Markup
    jobs: tuple[JobView, ...] = ()
    chosen: Chosen | None = None

    @property
    def readouts(self) -> list[Plain]:
        """The readouts beside the picture: all, or those that are chosen."""
        return [r for r in self.frame["readouts"] if self.chosen is None or r["name"] in self.chosen.readouts]


@dataclass(frozen=True)
class JobView:
    """A job of a figure: its name, its button's label, what it found at the figure's first settings, and that as
    JSON."""

    name: str
    label: str
    result: Plain
    data: Markup


class Bytecode(BytecodeCache):
    """The templates' code, kept by the templates' own hashes; a bucket knows the version that compiled it."""

    def __init__(self, store: Store) -> None:
        self._store = store

    def load_bytecode(self, bucket: Bucket) -> None:
        """Fill the bucket, if its template was compiled before."""
        if kept := self._store.find(f"{bucket.key} {bucket.checksum}"):
            bucket.bytecode_from_string(kept)

    def dump_bytecode(self, bucket: Bucket) -> None:
        """Keep what was compiled."""
        self._store.put(f"{bucket.key} {bucket.checksum}", bucket.bytecode_to_string())


def environment(root: Path, cache: Path) -> Environment:
    """The templates of a checkout; a name that is not there is an error, text is escaped. Their code is kept."""
    made = Environment(
        loader=FileSystemLoader(root / "templates"),
        bytecode_cache=Bytecode(Store(cache, "templates")),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    made.globals |= {"shown": shown, "plain": plain, "panel_class": panel_class, "wheel": ""}
    return made


def shown(spec: Spec, value: float) -> str:
    """A slider's value as its output says it."""
    text = number(value, spec.decimals)
    return f"{text}\u00a0{spec.unit}" if spec.unit else text


def plain(value: float) -> str:
    """A number as an attribute of an input holds it."""
    return f"{value:.10g}"


def figure_view(figure: Figure, frame: Plain, tape: str, caption: Markup, results: Sequence[Plain] = ()) -> FigureView:
    """The view of a figure whose first frame is drawn, and whose jobs are done."""
    record = {"record": figure.records[0], "frame": first_frame(frame), "spec": spec(figure.widget)}
    return FigureView(
        figure.dom_id,
        figure.number,
        figure.widget,
        specs(figure.widget.controls),
        frame,
        Markup(dumps(record)),
        tape,
        caption,
        tuple(
            JobView(job.name, job.label, result, Markup(dumps(_undrawn(result))))
            for job, result in zip(figure.widget.jobs, results, strict=True)
        ),
    )


def _undrawn(result: Plain) -> Plain:
    """A job's result without its drawings, which stand in the page already."""
    return {**result, "panels": [{k: v for k, v in panel.items() if k != "svg"} for panel in result["panels"]]}


def figure_html(templates: Environment) -> Callable[[FigureView], Markup]:
    """The figure macro of the templates."""
    macro = templates.get_template("figure.html").module.figure  # type: ignore[attr-defined]
    return lambda view: Markup(macro(view))


def plot_html(templates: Environment) -> Callable[[Placed, Drawn, Markup], Markup]:
    """The plot macro of the templates."""
    macro = templates.get_template("graph.html").module.graph  # type: ignore[attr-defined]
    return lambda placed, drawn, caption: Markup(macro(placed, drawn, caption))
