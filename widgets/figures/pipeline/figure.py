"""Rung 8: a registration in stages. Propose everywhere, refine nearby, judge by signs, and accept or refuse."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

from solvers import Pose
from solvers.scenes.rooms import Scene, room_start
from widgets.drawing.picture import (
    Label,
    Mark,
    Panel,
    Path,
    Picture,
    Points,
    Readout,
    Role,
    Segments,
    Shape,
    View,
    degrees,
    number,
)
from widgets.engine.contract import UNDONE, Action, Button, Key, Lead, Motion, Widget
from widgets.engine.controls import choice, slider
from widgets.engine.script import called, named
from widgets.figures.pipeline.door import door
from widgets.figures.pipeline.run import (
    CALLS,
    METHODS_OF,
    REACH,
    SCENES,
    SEARCH,
    Judgement,
    Sign,
    Stage,
    judged,
    proposed,
    refined,
    right,
    scene_of,
)
from widgets.parts.placing import HANDLES, place, written
from widgets.parts.room import ANCHOR, BRINGS, PLACING, errors, outline, source, still

BROUGHT = {name: BRINGS.get(name, {"noise": 0.02, "outliers": 0.0}) for name in SCENES}
REFINES = {"none": "Left out", "point": "Point", "plane": "Plane", "gicp": "GICP"}
ACCEPTS = {"signs": "All five signs", "flag": "Stop flag"}
TITLES = {"start": "start", "propose": "proposed", "refine": "refined"}
AROUND = View(-7.1, 7.1, -4.6, 5.606)  # u: with all of the scene turned as the prediction turns it at first
SIGNS = View(0.0, 1.0, 0.0, 5.0, 320.0, 360.0, (12.0, 10.0, 14.0, 0.0))


@dataclass(frozen=True)
class Controls:
    """The reader's settings. A scene sets its noise and outliers."""

    scene: str = choice("combo", "Scene", SCENES, sets=BROUGHT, keeps="pose")
    turn: float = slider(150.0, "Prediction: turn", -180.0, 180.0, 1.0, "°", "Also the start", "nothing")
    offset: float = slider(1.43, "Prediction: offset", 0.0, 3.0, 0.01, "u", keeps="nothing")
    draws: float = slider(70.0, "Propose: steps", 0.0, 70.0, 1.0, "", "32 hypotheses each; 0 skips it", "pose")
    refine: str = choice("point", "Refine", REFINES, keeps="pose")
    gate: float = slider(0.5, "Refine: gate", 0.1, 3.0, 0.1, "u", keeps="log")
    accept: str = choice("signs", "Accept by", ACCEPTS, keeps="log")
    least: float = slider(75.0, "Overlap required", 0.0, 100.0, 5.0, "%", f"Source within {REACH} u", "log")
    trust: float = slider(180.0, "Trust the prediction to", 5.0, 180.0, 5.0, "°", "At 180° it is not used", "log")
    noise: float = slider(0.11, "Noise σ", 0.0, 0.3, 0.01, "u", keeps="pose")
    outliers: float = slider(20.0, "Outliers", 0.0, 60.0, 5.0, "%", "Of each cloud, at random", "pose")
    overlap: float = slider(100.0, "Target seen", 30.0, 100.0, 5.0, "%", "For rooms, not hall or corridor", "pose")

    @property
    def plan(self) -> tuple[str, ...]:
        """The stages that are not skipped, in order."""
        return (*(["propose"] if self.draws > 0 else []), *(["refine"] if self.refine != "none" else []), "verify")


@dataclass(frozen=True, eq=False)
class State:
    """stages: those done, the start first. verdict: whether the last stage, the judgement, has been requested.
    judgement: the signs at the current pose."""

    controls: Controls
    scene: Scene
    backdrop: tuple[Mark, ...]
    stages: tuple[Stage, ...]
    verdict: bool
    judgement: Judgement

    @property
    def pose(self) -> Pose:
        """The source's current pose."""
        return self.stages[-1].pose

    @property
    def accepted(self) -> bool:
        """Whether the pose is accepted: by its signs, or by the stop flag, that is if the last search converged."""
        if self.controls.accept == "flag":
            return self.stages[-1].stop.startswith("converged")
        return not self.judgement.failed


def start(controls: Controls, seed: int) -> State:
    """The scene from the predicted pose."""
    c = controls
    scene = scene_of(c.scene, seed, c.noise, c.outliers / 100.0, c.overlap / 100.0)
    return _at(c, scene, still(scene), (Stage("start", room_start(c.turn, c.offset)),))


def _at(c: Controls, scene: Scene, backdrop: tuple[Mark, ...], stages: tuple[Stage, ...]) -> State:
    residual = "point" if c.refine == "none" else c.refine
    judgement = judged(scene, stages, residual, c.gate, c.least / 100.0, c.trust)
    return State(c, scene, backdrop, stages, False, judgement)


def act(state: State, action: Action) -> State:
    """Run the next stage or all that are left, or begin from another predicted pose."""
    c, scene = state.controls, state.scene
    if action.kind == "drag":
        pose = PLACING.act(state.pose, ANCHOR, action)
        return _at(c, scene, state.backdrop, (Stage("start", pose),))
    stages = state.stages
    for name in c.plan[len(stages) - 1 :] if not state.verdict else ():
        if name == "verify":
            state = replace(_at(c, scene, state.backdrop, stages), verdict=True)
        else:
            stages = (*stages, _stage(name, c, scene, stages[-1]))
        if action.name == "next":
            break
    return state if state.verdict else _at(c, scene, state.backdrop, stages)


def _stage(name: str, c: Controls, scene: Scene, before: Stage) -> Stage:
    return proposed(scene, int(c.draws)) if name == "propose" else refined(scene, before, c.refine, c.gate)


def motion(before: State, after: State) -> Motion | None:
    """The move of one stage."""
    if len(after.stages) != len(before.stages) + 1:
        return None
    return PLACING.motion(before.pose, after.pose, ANCHOR)


def draw(state: State) -> Picture:
    """The scene after the last stage done, and the signs there."""
    scene, evidence = state.scene, state.judgement.evidence
    moved, group = state.pose.apply(scene.source), source(scene, state.pose, evidence.explained)
    marks: tuple[Mark, ...] = (
        *(outline(scene, state.stages[0].pose, "ghost") if len(state.stages) > 1 else ()),
        *state.backdrop,
        *door(scene, scene.truth, "truth"),
        replace(group, marks=(*door(scene, state.pose, "source"), *group.marks)),
        Points(moved[~evidence.explained], "outlier", "cross", radius=4.0),
        _heading(state),
    )
    return Picture(
        (Panel("main", "The two scans in the target’s coordinates", AROUND, marks), _signs(state)),
        _readouts(state),
        _description(state),
        PLACING.handles(state.pose, ANCHOR),
        _note(state),
        frozenset({"next", "finish"} if state.verdict else ()),
    )


def _heading(state: State) -> Label:
    stage = TITLES[state.stages[-1].name]
    role: Role = "ink" if not state.verdict else "inlier" if state.accepted else "outlier"
    text = f"{stage}, {'accepted' if state.accepted else 'refused'}" if state.verdict else stage
    return Label([AROUND.x0, AROUND.y1], text, role, dx=12, dy=24)


def _signs(state: State) -> Panel:
    """A scale for each sign: its good part, the value, and whether the sign is met."""
    marks: list[Mark] = []
    for row, sign in enumerate(state.judgement.signs):
        y = 4.45 - row
        marks += _scale(sign, y)
    label = "Five signs at the current pose, each against its threshold"
    return Panel("signs", label, SIGNS, tuple(marks), grid=False)


def _scale(sign: Sign, y: float) -> tuple[Mark, ...]:
    good = (sign.limit, 1.0) if sign.more else (0.0, sign.limit)
    role: Role = "inlier" if sign.met else "outlier"
    shape: Shape = "dot" if sign.met else "cross"
    return (
        Segments([0.0, y], [1.0, y], "guide"),
        Path([[good[0], y], [good[1], y]], "inlier", thick=True),
        Segments([sign.limit, y - 0.14], [sign.limit, y + 0.14], "ink"),
        *(() if sign.at is None else (Points([[sign.at, y]], role, shape, radius=6.0),)),
        Label([0.0, y], f"{sign.name.capitalize()} {sign.said}", "ink", dy=-14),
        Label([1.0, y], sign.asked, "guide", "end", dy=-14),
    )


def _readouts(state: State) -> tuple[Readout, ...]:
    turn, shift = errors(state.pose, state.scene.truth)
    judgement = state.judgement
    texts = {sign.name: sign.said.removesuffix("°").partition(" ")[::2] for sign in judgement.signs}  # number, unit
    verdict = ("accepted" if state.accepted else "refused") if state.verdict else "–"
    return (
        Readout("stop", "The last stage stopped", state.stages[-1].stop or "–"),
        Readout("verdict", "Verdict", verdict),
        Readout("share", "Source explained", *texts["overlap"]),
        Readout("rms", "RMS of what is explained", *texts["residual"]),
        Readout("conditioning", "Smallest eigenvalue / largest", *texts["conditioning"]),
        Readout("halves", "Gap between two halves", *texts["two halves"]),
        Readout("prediction", "Angle from the prediction", texts["prediction"][0], "°"),
        Readout("right", "Within 5° and 0.2\u00a0u", "yes" if right(state.scene, state.pose) else "no", "", "truth"),
        Readout("rotation_error", "Rotation error", number(turn, 1), "°", "truth"),
        Readout("translation_error", "Translation error", number(shift), "u", "truth"),
    )


def _note(state: State) -> str:
    if not state.verdict:
        c = state.controls
        return "Target seen has no effect in this scene." if c.scene in ("hall", "corridor") and c.overlap < 100 else ""
    by = "the stop flag" if state.controls.accept == "flag" else "the signs"
    fits = right(state.scene, state.pose)
    end = {
        (True, True): "The pose is right.",
        (True, False): "The pose is wrong: a false acceptance.",
        (False, True): "The pose is right: a false refusal.",
        (False, False): "The pose is wrong.",
    }[state.accepted, fits]
    failures = state.judgement.failed if state.controls.accept == "signs" else ()
    reason = f": {', '.join(failures)}" if failures else ""
    return f"{'Accepted' if state.accepted else 'Refused'} by {by}{reason}. {end}"


def _description(state: State) -> str:
    c, scene = state.controls, state.scene
    (x, y), heading = place(state.pose, ANCHOR)
    turn, shift = errors(state.pose, scene.truth)
    left_out = [name for name, out in (("proposal", c.draws == 0), ("refinement", c.refine == "none")) if out]
    words = [
        f"{len(scene.source)} source and {len(scene.target)} target points, scene {SCENES[c.scene].lower()}, noise of"
        f" σ = {number(c.noise)} u, {number(c.outliers, 0)} % outliers.",
        *([_ends(turn)] if scene.name == "hall" else []),
        f"Left out: {' and '.join(left_out)}." if left_out else "No stage is left out.",
        f"The stage shown is called {TITLES[state.stages[-1].name]}: the source is turned by {degrees(heading)}°, with"
        f" its origin at ({number(x)}, {number(y)}) u, {number(turn, 1)}° and {number(shift)} u from the truth.",
        f"The signs: {'; '.join(map(_told, state.judgement.signs))}.",
    ]
    if state.verdict:
        words.append(_note(state))
    return " ".join(words)


def _ends(turn: float) -> str:
    end = "the other end of the hall from" if turn > 90.0 else "the same end of the hall as"
    return f"The closed door, which no scan sees, would be at {end} the true one."


def _told(sign: Sign) -> str:
    if sign.at is None:
        return f"{sign.name} not known"
    requirement = sign.asked
    if sign.asked != "not required":
        requirement = f"required {sign.asked}, {'met' if sign.met else 'not met'}"
    return f"{sign.name} {sign.said}, {requirement}"


def python(state: State) -> str:
    """A script that computes the same numbers with the solvers package alone."""
    c, seed = state.controls, state.scene.seed
    name = f'"{c.scene}", ' if CALLS[c.scene] == "room" else ""
    overlap = f", overlap={c.overlap / 100!r}" if name else ""
    stages = [stage.name for stage in state.stages]
    lines = [
        "import numpy as np",
        "from solvers import Pose, register",
        "from solvers.metrics import rre, rte",
        f"from solvers.{'scenes' if name else 'wall_scenes'} import {CALLS[c.scene]}",
        f"from solvers.verify import evidence{', halves' if len(stages) > 1 else ''}",
        "",
        f"scene = {CALLS[c.scene]}({name}seed={seed}, noise={c.noise!r}, outliers={c.outliers / 100!r}{overlap})",
        "both = scene.source, scene.target",
        f"start = pose = {written(state.stages[0].pose)}",
    ]
    if "propose" in stages:
        arguments = f"seed={seed}", f"max_steps={int(c.draws)}", *named(SEARCH)
        lines += called("pose = register", "*both", '"ransac-congruent"', *arguments, after=".pose")
    if "refine" in stages:
        lines.append(f'pose = register(*both, "{METHODS_OF[c.refine]}", start=pose, gate={c.gate!r}).pose')
    method = METHODS_OF["point" if c.refine == "none" else c.refine]
    has_share = float(state.judgement.evidence.share) > 0.0
    lines += [
        f"signs = evidence(*both, pose, reach={REACH!r})",
        "",
        'print("share", 100 * signs.share)',
        *(['print("rms", signs.rms)', 'print("conditioning", signs.weakest)'] if has_share else []),
        *([f'print("halves", halves(*both, pose, "{method}", gate={c.gate!r}))'] if len(stages) > 1 else []),
        'print("prediction", np.degrees(rre(pose, start)))',
        'print("rotation_error", np.degrees(rre(pose, scene.truth)))',
        'print("translation_error", rte(pose, scene.truth))',
    ]
    return "\n".join(lines) + "\n"


PRESETS: dict[str, dict[str, Any]] = {
    "default": {},
    "local": {"draws": 0.0, "turn": 45.0, "gate": 2.6},
    "hall": {"scene": "hall", "turn": 20.0, "offset": 0.5},
    "corridor": {"scene": "corridor", "turn": 10.0, "offset": 0.9},
    "half": {"overlap": 50.0, "least": 40.0},
}

WIDGET = Widget(
    name="pipeline",
    title="Propose, refine, verify",
    controls=Controls,
    presets=PRESETS,
    start=start,
    act=act,
    draw=draw,
    buttons=(
        Button("next", "Next stage", primary=True),
        Button("finish", "All stages"),
        *UNDONE,
    ),
    legend=(
        Key("source", "source, as the stage leaves it"),
        Key("outlier", "unexplained source point", "cross"),
        Key("target", "target", "square"),
        Key("truth", "true pose, unknown to every stage", "line"),
        Key("ghost", "prediction, where it began", "dotted"),
        Key("inlier", "accepted range, and a sign within it", "line"),
    ),
    handles=HANDLES,
    tape=(({}, ("next", "next", "next")), ({}, ("finish",))),
    motion=motion,
    python=python,
    lead=Lead(
        panels=("main",),
        readouts=("verdict", "rotation_error", "translation_error"),
        controls=("scene",),
        buttons=("next", "finish", "reset"),
    ),
)
