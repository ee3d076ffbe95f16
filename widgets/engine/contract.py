"""What a figure is: controls, start, act, draw; and the replayable record that is its whole state.

To write a figure, make one module in widgets/figures with a frozen controls dataclass, three functions and a WIDGET.
`start(controls, seed)` gives the first state, `act(state, action)` the next (states are immutable),
and `draw(state)` the Picture. Everything else (tape, back, links, pins, the browser) is replay of records.

What every figure is held to
----------------------------
By tests that go over all figures; `python3 build.py test -k NAME` runs them for one, with its own.
- The page is laid out once. In every state there are the same panels, in the same order, each with the same view, and
  the same readouts by name and label; a value that there is not yet is "–", without a unit. A chart's axes may grow
  with what was done, but not its size and padding, and in the states of the tape not at all.
- Nothing raises, whatever is done in whatever order with any values that the controls take; the same record gives the
  same bytes. No NaN, infinity or None reaches a mark, a readout or a sentence.
- A panel's width (`View.width`) says how it stands: near 640 px across the page, near 480 beside one other, near 320,
  as charts do, beside two, near 200 beside three. On a phone each is as wide as the page, and the style sheet keeps the
  letters of these four between 11 and 14 px; no word reaches beyond the panel's edge.
- A panel's label is two words or more, and no other's.
- Each `Motion` names a `Group` that `draw` puts into its panel of the state after it. The group "source" holds the
  source's points as dots, and nothing of the target.
- A handle's `keys` are those of `move_keys`, `turn_keys` or `slide_keys`; each takes it elsewhere, one that moves to
  where the key says. A handle that `sets` a slider stands at its value along x. However far a cloud is flung, its
  handles stay in their panel's window and, in one panel, 40 px apart at a width of 358 px (`widgets.parts.placing` sees
  to both). Handles of one panel have different labels, and values in words.
- Readouts are text as `picture.number` writes it: a true minus sign, no exponent. A name promises its label, unit and
  role: `rotation…` is in °, `translation…` in u, `…truth…` has the role "truth"; a label with RMS is in u
  (tests/widgets/test_readouts.py has the list).
- The description is whole sentences of 60 characters or more with a number in them, another after each press of the
  tape. It, or a caption, tells the noise and the share put elsewhere as the controls `noise` and `outliers` are set.
- Each entry of the legend is drawn in some state of the tape. A button draws anew only where the seed plays a part.
- The script that `python` gives runs on numpy and solvers alone and prints three or more lines "name value", which are
  the readouts of these names, to their last digit; no line is longer than 120 characters.
- What a choice `sets` are values that the other controls take.
"""

from __future__ import annotations

from collections.abc import Callable, Generator, Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

from widgets.drawing.picture import Picture, Role, Shape
from widgets.engine.controls import Value, clip, finite, nearest, validated, values
from widgets.engine.jobs import Job

SEED = 40  # the first of the benchmark's seeds 40 + 13k
MAX_LOG = 2000


@dataclass(frozen=True)
class Action:
    """One thing a reader did: pressed a button, put a handle at, picked or pointed at a place in a panel (world)."""

    kind: Literal["press", "drag", "click", "hover"]
    name: str
    x: float = 0.0
    y: float = 0.0

    def plain(self) -> list[str | float]:
        """The action as JSON carries it."""
        return [self.kind, self.name] if self.kind == "press" else [self.kind, self.name, self.x, self.y]


@dataclass(frozen=True)
class Button:
    """A button under the figure.

    does: "press" logs the action `name`; "run" repeats the press of `repeats` until the picture disables that;
    "back" takes the last action off the log; "reset" empties it; "reseed" draws the next seed.
    """

    name: str
    label: str
    does: Literal["press", "run", "back", "reset", "reseed"] = "press"
    primary: bool = False
    repeats: str = ""


Pieces = Generator[None, None, Any]
"""An action done piece by piece; it returns the state."""


def whole(pieces: Pieces) -> Any:
    """The state that an action leads to, its pieces done in one go."""
    while True:
        try:
            next(pieces)
        except StopIteration as end:
            return end.value


UNDONE = (Button("back", "Back", "back"), Button("reset", "Reset", "reset"), Button("new", "New draw", "reseed"))
"""The last buttons of most figures: what was done is taken back, or done on another draw."""

ITERATED = (
    Button("step", "Step", primary=True),
    Button("run", "Run", "run", repeats="step"),
    Button("finish", "To the end"),
    *UNDONE,
)
"""The buttons of a method that iterates."""


@dataclass(frozen=True)
class Key:
    """One entry of the legend. under: the choice and those of its options under which alone such a mark is drawn."""

    role: Role
    label: str
    shape: Shape | Literal["line", "dashed", "dotted", "area"] = "dot"
    under: tuple[str, *tuple[str, ...]] | None = None


@dataclass(frozen=True)
class Motion:
    """How a group came to its new place: turned by `turn` radians about the world point `about`, then moved."""

    group: str
    turn: float
    about: tuple[float, float]
    shift: tuple[float, float]
    panel: str = "main"


@dataclass(frozen=True)
class Trace:
    """A group that comes to be line by line: the page draws its lines from their beginnings, then shows the rest."""

    group: str
    panel: str = "main"


Animation = Motion | Trace


@dataclass(frozen=True)
class Lead:
    """What of a figure is seen at first, by name, None for all; the rest waits behind *More*. A placement may lead with
    other things.
    """

    panels: tuple[str, ...] | None = None
    readouts: tuple[str, ...] | None = None
    controls: tuple[str, ...] | None = None
    buttons: tuple[str, ...] | None = None


@dataclass(frozen=True)
class Widget:
    """A figure. See the module's first lines.

    presets: name → control values that differ from the defaults ("default" should be there).
    tape: what is recorded at build time, so that the page answers before Python is up: pairs of control values (on top
    of the preset's) and button presses; every prefix of the presses is recorded.
    handles: those whose drags the log holds; one that `sets` a slider is not among them.
    clicks, hovers: the panels that take a pick at a place, and those that answer to what is pointed at: by mouse,
    touch or keys. A hover replaces the log's last entry if that is a hover of the same panel. In a panel that does both
    a hover lasts for as long as the pointer is there and nothing is pressed, then it leaves the log.
    details: of how many levels a drawing is, where a whole one takes too long for a live answer; `draw` then has a
    second argument, the level, from 0, the coarsest, to details − 1, which it must take for its default. The page
    shows the coarsest at once, then each finer one for as long as nothing else is asked. `known` is the finest level
    of a state that costs nothing more to draw.
    pieces: `act` for actions that may take long: a generator that yields after every small piece of work and returns
    the state. The page then stays alive, and the reader can cancel. `whole` of it is `act`.
    jobs: long work on the figure's settings, done in slices beside its frames (widgets.engine.jobs).
    motion: how to animate the last action, from the state before it to the state after it: one motion or trace,
    several, each of a panel, or None. Of a coarse drawing there may be none yet; the first finer one that has some is
    animated.
    python: source text that reproduces a state with the solvers package alone.
    takes: what a reader may bring along, such as a file, by the name of its place; `reads(name, data)` makes of its
    name and bytes what `start` gets, as a third argument, by place. It raises ValueError for what it cannot read, and
    the read thing says what it is by `words`. The record holds but a fingerprint of each: what was brought stays where
    it is, and may be missing.
    files: what a reader may take away in a state: file name → text.
    lead: what is seen at first; without it, all there is.
    """

    name: str
    title: str
    controls: type
    presets: Mapping[str, Mapping[str, Value]]
    start: Callable[..., Any]
    act: Callable[[Any, Action], Any]
    draw: Callable[..., Picture]
    buttons: tuple[Button, ...]
    legend: tuple[Key, ...] = ()
    handles: tuple[str, ...] = ()
    clicks: tuple[str, ...] = ()
    hovers: tuple[str, ...] = ()
    details: int = 1
    known: Callable[[Any], int] = lambda state: 0
    tape: tuple[tuple[Mapping[str, Value], tuple[str, ...]], ...] = ()
    pieces: Callable[[Any, Action], Pieces] | None = None
    jobs: tuple[Job, ...] = ()
    motion: Callable[[Any, Any], Animation | tuple[Animation, ...] | None] = lambda before, after: None
    python: Callable[[Any], str] = lambda state: ""
    takes: tuple[str, ...] = ()
    reads: Callable[[str, bytes], Any] | None = None
    files: Callable[[Any], Mapping[str, str]] = lambda state: {}
    lead: Lead | None = None


def motions(given: Animation | tuple[Animation, ...] | None) -> tuple[Animation, ...]:
    """What a widget's `motion` gives, as a tuple."""
    return given if isinstance(given, tuple) else () if given is None else (given,)


@dataclass(frozen=True)
class Record:
    """A figure's whole state as plain data: enough to rebuild it anywhere, bit for bit, with what the reader brought.

    given: (place, fingerprint) of each thing that the reader brought.
    """

    widget: str
    preset: str
    controls: Any
    seed: int = SEED
    log: tuple[Action, ...] = field(default=())
    given: tuple[tuple[str, str], ...] = ()

    def plain(self) -> dict[str, Any]:
        """The record as JSON carries it, every control value written out."""
        return {
            "widget": self.widget,
            "preset": self.preset,
            "controls": values(self.controls),
            "seed": self.seed,
            "log": [action.plain() for action in self.log],
            **({"given": dict(self.given)} if self.given else {}),
        }


def preset(widget: Widget, name: str = "default", changes: Mapping[str, Any] | None = None) -> Record:
    """The untouched record of a preset, with `changes` to its control values.

    Raises ValueError naming the preset or the control that is not there.
    """
    if not isinstance(name, str) or name not in widget.presets:
        raise ValueError(f"{widget.name}: no preset {clip(name)}{nearest(name, widget.presets)}")
    return Record(widget.name, name, validated(widget.controls, {**widget.presets[name], **(changes or {})}))


def parsed(widget: Widget, plain: Mapping[str, Any]) -> Record:
    """A record read from plain data that anybody may have written.

    Raises ValueError that says what is wrong.
    """
    if not isinstance(plain, Mapping):
        raise ValueError(f"record: {clip(plain)} is not a mapping")
    seed = plain.get("seed", SEED)
    if isinstance(seed, bool) or not isinstance(seed, int) or not 0 <= seed < 2**31:
        raise ValueError(f"seed: {clip(seed)} is not a whole number from 0 to 2³¹ − 1")
    log = plain.get("log", [])
    if not isinstance(log, list) or len(log) > MAX_LOG:
        raise ValueError(f"log: not a list of at most {MAX_LOG} actions")
    controls = plain.get("controls", {})
    if not isinstance(controls, Mapping):
        raise ValueError("controls: not a mapping of names to values")
    start = preset(widget, plain.get("preset", "default"), controls)
    names = _known(widget)
    actions = tuple(_action(widget, names, e) for e in log)
    return Record(widget.name, start.preset, start.controls, seed, actions, _given(widget, plain.get("given", {})))


def action(widget: Widget, entry: Any) -> Action:
    """One log entry as an Action of this widget.

    Raises ValueError for what is none.
    """
    return _action(widget, _known(widget), entry)


def _given(widget: Widget, plain: Any) -> tuple[tuple[str, str], ...]:
    if not isinstance(plain, Mapping) or not all(isinstance(key, str) for key in plain.values()):
        raise ValueError("given: not a mapping of places to fingerprints")
    for place in plain:
        if place not in widget.takes:
            raise ValueError(f"given: {widget.name} takes nothing called {clip(place)}")
    return tuple((place, plain[place]) for place in widget.takes if place in plain)


def _known(widget: Widget) -> Mapping[str, set[str]]:
    """Kind of action → what it can be done to."""
    return {
        "press": {b.name for b in widget.buttons if b.does == "press"},
        "drag": set(widget.handles),
        "click": set(widget.clicks),
        "hover": set(widget.hovers),
    }


def _action(widget: Widget, names: Mapping[str, set[str]], entry: Any) -> Action:
    if not isinstance(entry, list) or len(entry) < 2 or not isinstance(entry[0], str) or not isinstance(entry[1], str):
        raise ValueError(f"log: {clip(entry)} is not an action")
    if entry[0] not in names:
        raise ValueError(f"log: no kind of action {clip(entry[0])}{nearest(entry[0], names)}")
    kind, name, *place = entry
    if name not in names[kind]:
        raise ValueError(
            f"log: {widget.name} has nothing to {kind} called {clip(name)}{nearest(name, sorted(names[kind]))}"
        )
    if kind == "press" and not place:
        return Action("press", name)
    if kind == "press":
        raise ValueError(f"log: {clip(entry)} presses a button at a place")
    if len(place) != 2 or not all(finite(v, 1e6) for v in place):
        raise ValueError(f"log: {clip(entry)} does not give a place (x, y)")
    x, y = (float(v) + 0.0 for v in place)  # a negative zero would compare equal and act otherwise
    return Action(_PLACED[kind], name, x, y)


_PLACED: Mapping[str, Literal["drag", "click", "hover"]] = {"drag": "drag", "click": "click", "hover": "hover"}
