"""The contract of a figure: controls, start, act, draw; and the replayable record that is its whole state.

To write a figure, make one module in widgets/figures with a frozen controls dataclass, three functions and a WIDGET.
`start(controls, seed)` returns the first state, `act(state, action)` the next (states are immutable),
and `draw(state)` the Picture. Everything else (tape, back, links, pins, the browser) replays records.

Rules for every figure
----------------------
Tests check them for all figures; `python3 build.py test -k NAME` runs those of one figure, along with its own tests.
- The page is laid out once. Every state has the same panels, in the same order and with the same views, and the same
  readouts by name and label; a value that does not exist yet is "–", without a unit. A chart's axes may grow as the
  reader acts, but its size and padding may not change, and within the tape's states neither may its axes.
- Nothing raises, whatever the reader does, in whatever order, with any values that the controls accept; the same record
  gives the same bytes. No NaN, infinity or None reaches a mark, a readout or a sentence.
- A panel's width (`View.width`) suits its place: near 640 px across the page, near 480 beside one other panel, near 320
  beside two, as charts are, near 200 beside three. On a phone each is as wide as the page, and the style sheet keeps
  the letters of these four between 11 and 14 px; no word reaches beyond the panel's edge.
- A panel's label has two words or more, and is unique in its figure.
- Each `Motion` names a `Group` that `draw` puts into the motion's panel in the state that follows. The group "source"
  contains the source's points as dots, and nothing of the target.
- A handle's `keys` come from `move_keys`, `turn_keys` or `slide_keys`. Each key takes the handle somewhere else; a
  handle that moves ends exactly where the key says. One that `sets` a slider has that slider's value as its x. However
  far a cloud is flung, its handles stay in their panel's window and, within a panel, at least 40 px apart at a width of
  358 px (`widgets.parts.placing` sees to both). Handles of one panel have different labels, and values in words.
- Readouts are text as `picture.number` writes it: a true minus sign, no exponent. A name promises its label, unit and
  role: `rotation…` is in °, `translation…` in u, `…truth…` has the role "truth"; a label with RMS is in u
  (tests/widgets/test_readouts.py has the list).
- The description is in whole sentences, 60 characters or more, contains a number and changes with each press of the
  tape. It or a caption states the noise and the outlier share that the controls `noise` and `outliers` are set to.
- Each entry of the legend is drawn in some state of the tape. A "reseed" button is there only if the seed matters.
- The script that `python` returns needs only numpy and solvers. It prints three or more lines "name value" that match
  the readouts of these names to the last digit; none of its own lines is longer than 120 characters.
- What a choice `sets` are values that the other controls accept.
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
    """One thing that a reader did: press a button, drag a handle to (x, y), or click on or hover over that place in a
    panel (world coordinates).
    """

    kind: Literal["press", "drag", "click", "hover"]
    name: str
    x: float = 0.0
    y: float = 0.0

    def plain(self) -> list[str | float]:
        """The action as a list for JSON."""
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
"""An action carried out piece by piece; the generator returns the new state."""


def whole(pieces: Pieces) -> Any:
    """Run all pieces of an action in one go and return the state that it leads to."""
    while True:
        try:
            next(pieces)
        except StopIteration as end:
            return end.value


UNDONE = (Button("back", "Back", "back"), Button("reset", "Reset", "reset"), Button("new", "New draw", "reseed"))
"""The last buttons of most figures: undo one action or all, or repeat them on another draw."""

ITERATED = (
    Button("step", "Step", primary=True),
    Button("run", "Run", "run", repeats="step"),
    Button("finish", "To the end"),
    *UNDONE,
)
"""The buttons of a method that iterates."""


@dataclass(frozen=True)
class Key:
    """One entry of the legend. under: a choice, then those of its options that draw such a mark; None: always drawn."""

    role: Role
    label: str
    shape: Shape | Literal["line", "dashed", "dotted", "area"] = "dot"
    under: tuple[str, *tuple[str, ...]] | None = None


@dataclass(frozen=True)
class Motion:
    """How a group reached its new place: turned by `turn` radians about the world point `about`, then shifted."""

    group: str
    turn: float
    about: tuple[float, float]
    shift: tuple[float, float]
    panel: str = "main"


@dataclass(frozen=True)
class Trace:
    """A group that appears line by line: the page draws each line from its beginning, then shows the other marks."""

    group: str
    panel: str = "main"


Animation = Motion | Trace


@dataclass(frozen=True)
class Lead:
    """The parts of a figure that are visible at first, by name, None for all; the rest is behind *More*. A placement
    in a chapter may override this.
    """

    panels: tuple[str, ...] | None = None
    readouts: tuple[str, ...] | None = None
    controls: tuple[str, ...] | None = None
    buttons: tuple[str, ...] | None = None


@dataclass(frozen=True)
class Widget:
    """A figure. See the module's docstring.

    presets: name → control values that differ from the defaults ("default" should be there).
    tape: what is recorded at build time, so that the page answers before Python is up: pairs of control values (on top
    of the preset's) and button presses; every prefix of the presses is recorded.
    handles: those whose drags go into the log; a handle that `sets` a slider is not listed.
    clicks, hovers: the panels that can be clicked at a place, and those that respond to pointing, by mouse, touch or
    keys. A hover replaces the log's last entry if that is a hover of the same panel. In a panel that does both, a hover
    is removed from the log once the pointer leaves or something is pressed.
    details: the number of levels of detail, for drawings too slow for a live answer. `draw` then has a second argument,
    the level, from 0, the coarsest, to details − 1, which must be its default. The page shows the coarsest at once,
    then each finer one while nothing else is requested. `known(state)` is the finest level that costs nothing more to
    draw.
    pieces: `act` for slow actions: a generator that yields after every small piece of work and returns the state, so
    that the page stays responsive and the reader can cancel. `act` is then `whole` of it.
    jobs: long work on the figure's settings, done in slices beside its frames (widgets.engine.jobs).
    motion: how to animate the last action, from the state before it to the state after it: one motion or trace, several
    (each of one panel), or None. A coarse drawing may have none yet; the first finer one that has some is animated.
    python: source text that reproduces a state with the solvers package alone.
    takes: slots for what a reader may supply, such as a file. `reads(name, data)` parses its name and bytes, or raises
    ValueError if it cannot; the result describes itself in `words`. `start` gets the results as a third argument, by
    slot. The record contains only a fingerprint of each: the data stays with the reader, and may be missing.
    files: what a reader may download in a state: file name → text.
    lead: what is visible at first; None: everything.
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


def motions(motion: Animation | tuple[Animation, ...] | None) -> tuple[Animation, ...]:
    """The result of a widget's `motion` as a tuple."""
    return motion if isinstance(motion, tuple) else () if motion is None else (motion,)


@dataclass(frozen=True)
class Record:
    """A figure's whole state as plain data: with what the reader supplied, enough to rebuild it anywhere, bit for bit.

    given: (slot, fingerprint) of each thing that the reader supplied.
    """

    widget: str
    preset: str
    controls: Any
    seed: int = SEED
    log: tuple[Action, ...] = field(default=())
    given: tuple[tuple[str, str], ...] = ()

    def plain(self) -> dict[str, Any]:
        """The record as a dict for JSON, with every control value written out."""
        return {
            "widget": self.widget,
            "preset": self.preset,
            "controls": values(self.controls),
            "seed": self.seed,
            "log": [action.plain() for action in self.log],
            **({"given": dict(self.given)} if self.given else {}),
        }


def preset(widget: Widget, name: str = "default", changes: Mapping[str, Any] | None = None) -> Record:
    """The record of a preset with `changes` to its control values and an empty log.

    Raises ValueError that names the unknown preset, or says which control value is wrong.
    """
    if not isinstance(name, str) or name not in widget.presets:
        raise ValueError(f"{widget.name}: no preset {clip(name)}{nearest(name, widget.presets)}")
    return Record(widget.name, name, validated(widget.controls, {**widget.presets[name], **(changes or {})}))


def parsed(widget: Widget, plain: Mapping[str, Any]) -> Record:
    """Read a record from untrusted plain data.

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
    names = _action_names(widget)
    actions = tuple(_action(widget, names, e) for e in log)
    return Record(widget.name, start.preset, start.controls, seed, actions, _inputs(widget, plain.get("given", {})))


def action(widget: Widget, entry: Any) -> Action:
    """One log entry as an Action of this widget.

    Raises ValueError if it is not one.
    """
    return _action(widget, _action_names(widget), entry)


def _inputs(widget: Widget, plain: Any) -> tuple[tuple[str, str], ...]:
    if not isinstance(plain, Mapping) or not all(isinstance(key, str) for key in plain.values()):
        raise ValueError("given: not a mapping of places to fingerprints")
    for slot in plain:
        if slot not in widget.takes:
            raise ValueError(f"given: {widget.name} takes nothing called {clip(slot)}")
    return tuple((slot, plain[slot]) for slot in widget.takes if slot in plain)


def _action_names(widget: Widget) -> Mapping[str, set[str]]:
    """Kind of action → the names that it applies to."""
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
    kind, name, *position = entry
    if name not in names[kind]:
        raise ValueError(
            f"log: {widget.name} has nothing to {kind} called {clip(name)}{nearest(name, sorted(names[kind]))}"
        )
    if kind == "press" and not position:
        return Action("press", name)
    if kind == "press":
        raise ValueError(f"log: {clip(entry)} presses a button at a place")
    if len(position) != 2 or not all(finite(v, 1e6) for v in position):
        raise ValueError(f"log: {clip(entry)} does not give a place (x, y)")
    x, y = (float(v) + 0.0 for v in position)  # −0.0 would compare equal to 0.0 but might act differently
    return Action(_PLACED[kind], name, x, y)


_PLACED: Mapping[str, Literal["drag", "click", "hover"]] = {"drag": "drag", "click": "click", "hover": "hover"}
