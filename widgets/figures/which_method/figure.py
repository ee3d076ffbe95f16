"""Chapter 0: which method? Four answers light a path up the ladder, and 25 scenes show what the advice is worth."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from widgets.drawing.picture import (
    Arrow,
    Label,
    Mark,
    Panel,
    Path,
    Picture,
    Points,
    Readout,
    Ring,
    Role,
    Segments,
    View,
    number,
)
from widgets.engine.contract import Action, Button, Key, Lead, Widget
from widgets.engine.controls import choice
from widgets.figures.which_method.rules import QUESTIONS, RUNGS, Advice, Answers, Verdict, advise
from widgets.figures.which_method.script import script
from widgets.figures.which_method.trial import OF, STARTS, Run, clouds_of, run

ROW, TOP = 36.0, 30.0  # px
VIEW = View(0.0, 640.0, 0.0, ROW * len(RUNGS) + TOP, width=640.0)
LANES, RADIUS, RAILS = (18.0, 47.0, 76.0), 12.0, (102.0, 132.0)
NUMBERS_AT, NAMES_AT, WORDS_AT, COUNT_AT = 166.0, 176.0, 322.0, 628.0
ROLES: dict[Verdict, Role] = {"take": "accent", "can": "ink", "not": "ghost", "idle": "ghost"}
DETAILS = len(RUNGS)  # nothing; the path's runs; then one more rung each, of those that are run alone


@dataclass(frozen=True)
class Controls:
    """The four questions."""

    pairs: str = choice("none", "Do you have pairs?", QUESTIONS["pairs"], keeps="log")
    start: str = choice("rough", "A start?", QUESTIONS["start"], keeps="log")
    overlap: str = choice("most", "How much overlap?", QUESTIONS["overlap"], keeps="log")
    surfaces: str = choice("walls", "What is scanned?", QUESTIONS["surfaces"], keeps="log")


@dataclass(frozen=True, eq=False)
class State:
    """runs: that of the path, then those of every rung that is run alone, in the ladder's order. tried: whether they
    have been requested."""

    answers: Answers
    advice: Advice
    runs: tuple[Run, ...]
    tried: bool = False


def start(controls: Controls, seed: int) -> State:
    """The advice, before any run."""
    answers = Answers(controls.pairs, controls.start, controls.overlap, controls.surfaces)
    advice = advise(answers)
    return State(answers, advice, tuple(run(path, answers) for path in (advice.path, *alone(advice, answers))))


def alone(advice: Advice, answers: Answers) -> list[tuple[str, ...]]:
    """The rungs off the path that can be run by themselves: without pairs, those for pairs cannot."""
    for_pairs = () if answers.pairs != "none" else ("kabsch", "ransac")
    return [(name,) for name in advice.of("can", "not") if name not in for_pairs]


def act(state: State, action: Action) -> State:
    """Try the advice."""
    return replace(state, tried=True)


def known(state: State) -> int:
    """How many of the runs have been made."""
    computed = [not state.tried or "errors" in r.__dict__ for r in state.runs]
    return DETAILS - 1 if all(computed) else computed.index(False)


def draw(state: State, detail: int = DETAILS - 1) -> Picture:
    """The ladder with its lit path, and how often each run found the truth."""
    runs = state.runs[:detail] if state.tried else ()
    counts = {("judge" if k == 0 else r.path[0]): r.found for k, r in enumerate(runs)}
    return Picture(
        (Panel("ladder", "The ladder, with the recommended path", VIEW, _marks(state, counts), grid=False),),
        _readouts(state, runs),
        _description(state, counts),
        note=_sentence(state.advice),
        disabled=frozenset(("try",) if state.tried else ()),
    )


def _marks(state: State, counts: dict[str, int]) -> tuple[Mark, ...]:
    names = list(RUNGS)
    height = {name: (k + 0.5) * ROW for k, name in enumerate(names)}
    rails = [Path([(x, 0.0), (x, ROW * len(names))], "ghost", thick=True) for x in RAILS]
    bands = [_band(height[name]) for name in state.advice.path]
    marks: list[Mark] = [*bands, *rails, *_route([height[name] for name in state.advice.path])]
    for name, (verdict, words) in state.advice.why.items():
        y, role = height[name], ROLES[verdict]
        bar = [(RAILS[0], y), (RAILS[1], y)]
        marks += [
            Path(bar, role, thick=verdict == "take", dashed=role == "ghost"),
            *_sign(verdict, y),
            Label((NUMBERS_AT, y), RUNGS[name].number, role, "end", dy=5),
            Label((NAMES_AT, y), RUNGS[name].says, role, dy=5, fixed=True),
            Label((WORDS_AT, y), words, role, dy=5, fixed=True),
        ]
        if name in counts:
            marks.append(Label((COUNT_AT, y), str(counts[name]), role, "end", dy=5))
        elif state.tried and name in {"judge", *(r.path[0] for r in state.runs[1:])}:
            marks.append(Label((COUNT_AT, y), "…", role, "end", dy=5))
    if state.tried:
        marks.append(Label((COUNT_AT, ROW * len(names)), f"right, of {OF}", "ink", "end", dy=-12))
    return tuple(marks)


def _band(y: float) -> Path:
    """The band that lights a row."""
    top, bottom, left, right = y + ROW / 2 - 1, y - ROW / 2 + 1, RAILS[0], VIEW.x1 - 4.0
    return Path([(left, bottom), (right, bottom), (right, top), (left, top)], "accent", closed=True, filled=True,
                weight=0.17)  # fmt: skip


def _sign(verdict: Verdict, y: float) -> tuple[Mark, ...]:
    """The sign that distinguishes a verdict without colour."""
    middle = [((RAILS[0] + RAILS[1]) / 2, y)]
    if verdict == "can":
        return (Points(middle, "ink", "ring", radius=5.0),)
    return (Points(middle, "ghost", "cross", radius=5.0),) if verdict == "not" else ()


def _route(heights: Sequence[float]) -> list[Mark]:
    """The numbered stages of the path, each in a lane of its own, with lines from one to the next."""
    marks: list[Mark] = []
    lanes = LANES[-len(heights) :]
    for k, (x, y) in enumerate(zip(lanes, heights, strict=True)):
        if k:
            turn = (lanes[k - 1], y)
            away = RADIUS if y > heights[k - 1] else -RADIUS
            marks += [
                Segments([(lanes[k - 1], heights[k - 1] + away)], [turn], "accent"),
                Arrow(turn, (x - RADIUS, y), "accent", head=7.0),
            ]
        marks += [Ring((x, y), "accent", radius=RADIUS), Label((x, y), str(k + 1), "accent", "middle", dy=5)]
    return marks


def _readouts(state: State, runs: Sequence[Run]) -> tuple[Readout, ...]:
    source, target, _ = clouds_of(state.runs[0].answers)
    others = runs[1:] if len(runs) == len(state.runs) else ()
    unfit = [r.found for r in others if state.advice.why[r.path[0]][0] == "not"]
    pending = "…" if state.tried else "–"
    turn = (number(runs[0].turn), "°") if runs else (pending, "")
    missing = pending if len(state.runs) > 1 and not others else "–"
    off = STARTS[state.answers.start][0]
    return (
        Readout("found", f"The path succeeds, of\u00a0{OF}", str(runs[0].found) if runs else pending, "", "accent"),
        Readout("rotation_error", "Its median rotation error", *turn),
        Readout("unfit", f"Best crossed-out rung, of\u00a0{OF}", str(max(unfit)) if unfit else missing),
        Readout("points_source", "Points of the source", str(source.shape[1])),
        Readout("points_target", "Points of the target", str(target.shape[1])),
        Readout("rotation_start", "Rotation error at the start", number(off, 0), "°", "ghost"),
    )


def _titles(names: Sequence[str]) -> str:
    titles = [RUNGS[name].title for name in names]
    return titles[0] if len(titles) == 1 else f"{', '.join(titles[:-1])} and {titles[-1]}"


def _sentence(advice: Advice) -> str:
    """The recommendation in one line."""
    first, *rest = (RUNGS[name].title for name in advice.path)
    text = ", then ".join([first, *rest])
    return f"{text[0].upper()}{text[1:]}."


def _description(state: State, counts: dict[str, int]) -> str:
    advice = state.advice
    text = "; ".join(f"{key}: {QUESTIONS[key][answer].lower()}" for key, answer in vars(state.answers).items())
    words = [f"A ladder of {len(RUNGS)} rungs, for these answers: {text}. Lit, in this order: {_titles(advice.path)}."]
    words += [
        f"Rung {RUNGS[name].number}, {RUNGS[name].title}: {reason}{' (crossed out)' if verdict == 'not' else ''}."
        for name, (verdict, reason) in advice.why.items()
    ]
    if counts:
        ends = ", ".join(f"{RUNGS[name].title} {count}" for name, count in counts.items() if name != "judge")
        words.append(f"On {OF} scenes with these properties the path ends at the truth {counts['judge']} times.")
        words += [f"Alone: {ends}."] if ends else []
    return " ".join(words)


def python(state: State) -> str:
    """A script that computes the same numbers with the solvers package alone."""
    return script(state.runs[0].path, state.answers, state.tried)


# Recorded with their runs: all answers without pairs, and both kinds of pairs.
_TAPED = [{"start": s, "overlap": o, "surfaces": f} for s in STARTS for o in QUESTIONS["overlap"]
          for f in QUESTIONS["surfaces"]] + [{"pairs": "right"}, {"pairs": "some"}]  # fmt: skip

WIDGET = Widget(
    name="which-method",
    title="Which method?",
    controls=Controls,
    presets={"default": {}},
    start=start,
    act=act,
    draw=draw,
    details=DETAILS,
    known=known,
    buttons=(Button("try", f"Try it on {OF} scenes", primary=True), Button("reset", "Reset", "reset")),
    legend=(
        Key("accent", "the path, in order", "ring"),
        Key("ink", "would do alone", "ring"),
        Key("ghost", "does not fit", "cross"),
        Key("ghost", "not needed", "dashed"),
    ),
    tape=tuple((answers, ("try",)) for answers in _TAPED),
    python=python,
    lead=Lead(readouts=("found", "unfit")),
)
