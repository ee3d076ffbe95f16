"""The view models of figures, plots and pictures, and the Jinja environment of the templates."""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from jinja2 import BytecodeCache, Environment, FileSystemLoader, StrictUndefined
from jinja2.bccache import Bucket
from markupsafe import Markup

from sitegen.assets.panel_classes import WIDEST, panel_class
from sitegen.cache.store import Store
from sitegen.chapters.rendered import Question
from sitegen.figures.gallery import Drawn, Placed
from sitegen.figures.model import Figure
from sitegen.figures.tape import StateRoles, Tape
from sitegen.figures.wire import Plain, attribute, dumps, spec, without_drawings
from sitegen.markup.typography import apostrophes, breakable
from widgets.drawing.picture import ROLES, number
from widgets.engine.contract import Button, Key, Lead, Widget
from widgets.engine.controls import Spec, specs

IDS = re.compile(r' id="[^"]*"')
ROWS = (3, 8)  # numbers of pictures that fill one or two full-width rows, with the desk below them
FLAT = 2  # a picture wider than this times its height leaves room below it, while charts fill its desk
EMPTY = Markup()
_BOLD = re.compile(r"<strong>(.*?)</strong>")


@dataclass(frozen=True)
class Part:
    """A part of a figure: the leading part, or the rest."""

    panels: Sequence[Plain]
    readouts: Sequence[Plain]
    controls: Mapping[str, Spec]
    buttons: Sequence[Button]
    legend: Sequence[Key]


@dataclass(frozen=True)
class Layout:
    """How a figure is laid out. stage: the panels that form the picture; charts: those with data about it."""

    name: str
    stage: Sequence[Plain]
    charts: Sequence[Plain]


@dataclass(frozen=True)
class FigureView:
    """The view model of the figure's template.

    says: the leading sentence; lead: the parts shown at first, None for all; roles: those that pictures can show while
    only the leading controls are used; whole: whether the rest is there as well, behind *More*; after: the frame of the
    outcome, for readers without scripts and on paper; question: what it asks before it runs; beside: a
    slide's text, where that names the button to press.
    """

    id: str
    number: str
    widget: Widget
    controls: Mapping[str, Spec]
    frame: Plain
    record: Markup
    tape: str
    says: Markup
    caption: Markup
    jobs: tuple[JobView, ...] = ()
    lead: Lead | None = None
    roles: Collection[str] = ROLES
    whole: bool = True
    after: Plain | None = None
    question: Question | None = None
    beside: Markup = EMPTY

    @property
    def main(self) -> Button | None:
        """The filled button: the first that the words name in bold, else the widget's primary one if that leads."""
        labels = {button.label: button for button in self.widget.buttons}
        in_bold = [labels[bold] for bold in _BOLD.findall(self.says + self.beside) if bold in labels]
        primary = [button for button in self.leading.buttons if button.primary]
        return next(iter([*in_bold, *primary]), None)

    @property
    def leading(self) -> Part:
        """The part shown at first."""
        return self._part(self._leads, self._may_lead)

    @property
    def layout(self) -> Layout:
        """The leading part's layout: one picture or many small ones beside the desk, or a few in a row above it."""
        panels = self.leading.panels
        if not self.whole or not panels:  # no name in `lead` is a panel's, which has been reported
            return Layout("", self.frame["panels"], ())
        width, height = panels[0]["view"][4:6]
        wide = panel_class(width) == WIDEST
        if len(panels) > 2 and not wide:
            alike = [panel for panel in panels if panel["view"][4] == width]
            charts = [panel for panel in panels if panel["view"][4] != width]
            return Layout("many row" if len(alike) in ROWS else "many", alike, charts)
        if len(panels) == 1 or wide:
            flat = width > FLAT * height and len(panels) > 1
            return Layout("beside flat" if flat else "beside", panels[:1], panels[1:])
        return Layout("row", panels, ())

    @property
    def outcome(self) -> Sequence[Plain]:
        """The panels of the figure's picture in the outcome, without ids, since those must be unique in the page. Only
        in the layout "many" does each have its caption."""
        captions = self.layout.name == "many"
        names = [panel["name"] for panel in self.layout.stage]
        panels = self.after["panels"] if self.after else ()
        stage = [panel for panel in panels if panel["name"] in names]
        return [
            {"svg": Markup(IDS.sub("", panel["svg"])), "caption": panel["caption"] if captions else ""}
            for panel in stage
        ]

    @property
    def rest(self) -> Part | None:
        """The part behind *More*; None if there is none."""
        if self.lead is None or not self.whole:
            return None
        return self._part(lambda kind, name: not self._leads(kind, name), lambda key: not self._may_lead(key))

    def _leads(self, kind: str, name: str) -> bool:
        names = getattr(self.lead, kind, None)
        return names is None or name in names

    def _may_lead(self, key: Key) -> bool:
        """Whether the pictures can show a legend key's marks while only the leading controls are used."""
        choice, *options = key.under or ("",)
        fixed = choice and not self._leads("controls", choice)
        return key.role in self.roles and not (fixed and self.frame["controls"][choice] not in options)

    def _part(self, has: Callable[[str, str], bool], keyed: Callable[[Key], bool]) -> Part:
        return Part(
            [panel for panel in self.frame["panels"] if has("panels", panel["name"])],
            [readout for readout in self.frame["readouts"] if has("readouts", readout["name"])],
            {name: control for name, control in self.controls.items() if has("controls", name)},
            [button for button in self.widget.buttons if has("buttons", button.name)],
            [key for key in self.widget.legend if keyed(key)],
        )


@dataclass(frozen=True)
class JobView:
    """A job of a figure: its name, its button's label, its result at the initial settings, and that result as JSON."""

    name: str
    label: str
    result: Plain
    data: Markup


class Bytecode(BytecodeCache):
    """Caches compiled templates, keyed by the hashes of their sources; a bucket checks which version compiled it."""

    def __init__(self, store: Store) -> None:
        self._store = store

    def load_bytecode(self, bucket: Bucket) -> None:
        """Load the bucket's bytecode, if it is cached."""
        if code := self._store.find(f"{bucket.key} {bucket.checksum}"):
            bucket.bytecode_from_string(code)

    def dump_bytecode(self, bucket: Bucket) -> None:
        """Cache the bucket's bytecode."""
        self._store.put(f"{bucket.key} {bucket.checksum}", bucket.bytecode_to_string())


def environment(root: Path, cache: Path) -> Environment:
    """The Jinja environment of a checkout: undefined names are errors, text is escaped, and bytecode is cached."""
    templates = Environment(
        loader=FileSystemLoader(root / "templates"),
        bytecode_cache=Bytecode(Store(cache, "templates")),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    templates.globals |= {"slider_text": slider_text, "plain": plain, "attribute": attribute}
    templates.globals |= {"panel_class": panel_class, "wheel": ""}
    templates.filters |= {"apostrophes": apostrophes, "breakable": breakable}
    return templates


def slider_text(spec: Spec, value: float) -> str:
    """A slider's value as its output shows it; no space before °."""
    text = number(value, spec.decimals)
    return f"{text}\u00a0{spec.unit}" if spec.unit not in ("", "°") else f"{text}{spec.unit}"


def plain(value: float) -> str:
    """A number as the value of an input's attribute."""
    return f"{value:.10g}"


def figure_view(
    figure: Figure, state: Plain, frame: Plain, tape: Tape, sentence: Markup = EMPTY, caption: Markup = EMPTY
) -> FigureView:
    """The view of a figure with its drawn frame and finished jobs. sentence: the leading one."""
    record = {"record": state, "frame": without_drawings(frame), "spec": spec(figure.widget)}
    return FigureView(
        figure.dom_id,
        figure.number,
        figure.widget,
        specs(figure.widget.controls),
        frame,
        Markup(dumps(record)),
        tape.name,
        sentence,
        caption,
        tuple(
            JobView(job.name, job.label, result, Markup(dumps(without_drawings(result))))
            for job, result in zip(figure.widget.jobs, tape.results, strict=True)
        ),
        figure.lead,
    )


def with_roles(
    view: FigureView, tape: Tape, starts: Sequence[Plain], promised: Sequence[StateRoles] = ()
) -> FigureView:
    """The view with the roles that its leading panels may show from these settings on, by its leading parts alone, and
    in the promised states."""
    lead = view.leading
    effects = {name for spec in lead.controls.values() for sets in spec.sets.values() for name in sets}
    presses = [button.name for button in lead.buttons if button.does == "press"]
    panels = [panel["name"] for panel in lead.panels]
    free = {*lead.controls, *effects}
    roles = {role for start in starts for role in tape.roles(start, free, presses, panels, promised)}
    return replace(view, roles=roles)


def figure_html(templates: Environment) -> Callable[[FigureView], Markup]:
    """The figure macro of the templates."""
    macro = templates.get_template("figure.html").module.figure  # type: ignore[attr-defined]
    return lambda view: Markup(macro(view))


def plot_html(templates: Environment) -> Callable[[Placed, Drawn, Markup], Markup]:
    """The plot macro of the templates."""
    macro = templates.get_template("plot.html").module.plot  # type: ignore[attr-defined]
    return lambda plot, drawing, caption: Markup(macro(plot, drawing, caption))


def picture_html(templates: Environment) -> Callable[[Sequence[Plain], str, Markup], Markup]:
    """The picture macro of the templates; it takes panels, their description in words, and a caption."""
    macro = templates.get_template("figure.html").module.picture  # type: ignore[attr-defined]
    return lambda panels, words, caption: Markup(macro(panels, words, caption))
