"""Rung 9: four kinds of state. CPD, FilterReg, MMD-Reg and a learned flow on one scene, in step, stage by stage."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

from solvers import Pose
from solvers.core.amounts import amount
from solvers.scenes.fish import FISH_SETTINGS, START_DEGREES, fish, fish_start
from solvers.studies.benchmark import CLOSE_DEGREES, CLOSE_DISTANCE, is_close
from widgets.drawing.picture import Handle, Panel, Picture, Readout, degrees, number
from widgets.engine.contract import Action, Button, Key, Lead, Widget
from widgets.engine.controls import choice, slider, toggle
from widgets.engine.script import named
from widgets.figures.four import cpd, filterreg, flow, mmd
from widgets.figures.four.run import ANCHOR, PLACING, STAGES, VIEW, Look, Shown, Walk, begun, carried
from widgets.parts.placing import HANDLES, written

PARTS: dict[str, Any] = {"cpd": cpd, "filterreg": filterreg, "mmd": mmd, "flow": flow}
SHORT = {"cpd": "CPD", "filterreg": "FilterReg", "mmd": "MMD", "flow": "Flow"}


@dataclass(frozen=True)
class Controls:
    """The reader's settings."""

    scene: str = choice("clean", "Scene", {name: name.capitalize() for name in FISH_SETTINGS}, keeps="pose")
    turn: float = slider(START_DEGREES, "Start: turned by", -180.0, 180.0, 5.0, "°", keeps="nothing")
    smaller: bool = toggle(False, "Moving cloud 15 % smaller", "Only CPD estimates scale; ideal 1/0.85")
    project: bool = toggle(True, "Flow: rigid projection", "Endpoints become rigid copies of the clouds")


@dataclass(frozen=True, eq=False)
class State:
    """The controls and the walk that they began; `walk.start` may have been set by a drag."""

    controls: Controls
    walk: Walk


def start(controls: Controls, seed: int) -> State:
    """All four at their first stage, with the moving cloud turned as the slider says."""
    scene = fish(controls.scene, seed=seed, smaller=controls.smaller)
    return State(controls, begun(scene, fish_start(controls.turn), controls.project))


def act(state: State, action: Action) -> State:
    """Go to another stage, to the next iteration, to the end, or to another start."""
    walk = state.walk
    if action.kind == "drag":
        pose = PLACING.act(walk.start, ANCHOR, action)
        return replace(state, walk=begun(walk.scene, pose, state.controls.project))
    if action.name.startswith("stage-"):
        return replace(state, walk=walk.at(int(action.name.removeprefix("stage-"))))
    actions = {"next": walk.next, "iterate": walk.iterated, "finish": walk.finished}
    return replace(state, walk=actions[action.name]())


def draw(state: State) -> Picture:
    """The four panels at the same stage."""
    walk = state.walk
    looks = walk.looks()
    first = walk.iteration == 1 and walk.stage == 1
    panels = tuple(_panel(look) for look in looks)
    disabled = {f"stage-{walk.stage}"} | ({"next", "iterate", "finish"} if walk.ended else set())
    return Picture(
        panels,
        _readouts(looks),
        _description(state, panels),
        _handles(walk.start, panels) if first else (),
        _note(walk, looks),
        frozenset(disabled),
    )


def _panel(look: Look) -> Panel:
    """A method at the current stage; one that has stopped shows where, also if it did so in the last iteration."""
    walk, part = look.walk, PARTS[look.track.name]
    at = min(walk.stage, len(part.STAGES))
    waits = walk.stage > at
    if look.track.rests or (walk.ended and waits):
        stage, content = "ended", Shown(carried(look), f"Stopped after {amount(look.steps, 'step')}: {look.stopped}.")
    else:
        stage, content = f"{at} of {len(part.STAGES)} · {part.STAGES[at - 1]}", part.shown(look)
    suffix = ", held" if waits and stage != "ended" else ""
    rotation, translation, _ = look.errors()
    errors = f"Off the truth by {number(rotation, 1)}° and {number(translation)} u after {amount(look.steps, 'step')}"
    # The short name, so that the stage fits below a thumbnail on a phone.
    caption = "\n".join((f"{SHORT[look.track.name]}: {stage}{suffix}", content.words, errors))
    label = f"{part.NAME}, {stage}"
    return Panel(look.track.name, label, VIEW, content.marks, grid=content.grid, caption=caption)


def _handles(begins: Pose, panels: tuple[Panel, ...]) -> tuple[Handle, ...]:
    """The two handles of the start, available in all panels."""
    first, *others = (panel.name for panel in panels)
    return tuple(replace(handle, panel=first, also=tuple(others)) for handle in PLACING.handles(begins, ANCHOR))


def _readouts(looks: tuple[Look, ...]) -> tuple[Readout, ...]:
    """The readouts method by method, so that those of a method stay together in any number of columns."""
    return tuple(readout for look in looks for readout in _method_readouts(look))


def _method_readouts(look: Look) -> tuple[Readout, ...]:
    """A method's errors, and how many numbers it keeps."""
    key, name, (rotation, translation, scale) = look.track.name, SHORT[look.track.name], look.errors()
    units = {"cpd": "shares", "filterreg": "moments", "mmd": "means", "flow": "coordinates"}
    return (
        Readout(f"{key}_rotation", f"{name}: rotation", number(rotation, 1), "°"),
        Readout(f"{key}_translation", f"{name}: translation", number(translation), "u"),
        Readout(f"{key}_scale", f"{name}: scale", number(scale, 1), "%"),
        Readout(f"{key}_keeps", f"{name} keeps", PARTS[key].kept(look), units[key]),
    )


def _close(look: Look) -> bool:
    rotation, translation, _ = look.errors()
    return bool(is_close(rotation, translation))


def _note(walk: Walk, looks: tuple[Look, ...]) -> str:
    if walk.ended:
        close = sum(map(_close, looks))
        return (
            f"All four have stopped by iteration {walk.iteration}, {close} of 4 within {CLOSE_DEGREES:g}° and"
            f" {CLOSE_DISTANCE:g} u. Stopping certifies nothing."
        )
    if walk.stage == STAGES and not next(look for look in looks if look.track.name == "cpd").track.rests:
        return "Only CPD has a fifth stage; the others hold their fourth."
    if walk.iteration == 1 and walk.stage == 1:
        return ""
    return f"Iteration {walk.iteration}, stage {walk.stage} of {STAGES}."


def _description(state: State, panels: tuple[Panel, ...]) -> str:
    c, walk = state.controls, state.walk
    scene = walk.scene
    noise, clutter = FISH_SETTINGS[c.scene]
    x, y = walk.start.t.tolist()
    words = [
        f"Four small pictures of one scene: a fish-like curve, {len(scene.target)} fixed and {len(scene.source)} moving"
        f" points, noise of σ = {number(noise)} u, {number(100 * clutter, 0)} % clutter in each cloud. The moving cloud"
        f" {'is 15 % smaller and ' if c.smaller else ''}is turned by {degrees(float(walk.start.angle))}°"
        f" and shifted by ({number(x)}, {number(y)}) u.",
        f"Iteration {walk.iteration}, stage {walk.stage} of {STAGES}.",
    ]
    for panel in panels:
        caption = panel.caption.replace(SHORT[panel.name], PARTS[panel.name].NAME, 1)
        words.append(". ".join(line.rstrip(".") for line in caption.split("\n")) + ".")
    if not c.project:
        words.append("The flow’s endpoints are used as they are, not made rigid.")
    return " ".join(words)


def python(state: State) -> str:
    """A script that computes the same numbers with the solvers package alone."""
    c, walk = state.controls, state.walk
    steps = {look.track.name: look.steps for look in walk.looks()}
    return "\n".join(
        [
            "import numpy as np",
            "from solvers import Pose",
            "from solvers.metrics import rre, rte",
            "from solvers.stepper import advance",
            "from solvers.walk_scenes import fish",
            "from solvers.walkthrough import begin_walk, scene_poses",
            "",
            f'scene = fish("{c.scene}", seed={walk.scene.seed}, smaller={c.smaller})',
            f"start = {written(walk.start)}",
            f"steps = dict({', '.join(named(steps))})",
            "for name, count in steps.items():  # begin_walk knows each method's options",
            f"    run = begin_walk(name, [scene], [start], project={c.project})",
            "    for _ in range(count):",
            "        run = advance(run)",
            "    pose = scene_poses(run, [start])[0]",
            '    print(f"{name}_rotation", np.degrees(rre(pose, scene.truth)))',
            '    print(f"{name}_translation", rte(pose, scene.truth))',
            '    print(f"{name}_scale", 100 * (pose.scale / scene.truth.scale - 1))',
            "",
        ]
    )


WIDGET = Widget(
    name="four",
    title="Four representations of one registration, stage by stage",
    controls=Controls,
    presets={"default": {}, "clutter": {"scene": "clutter"}},
    start=start,
    act=act,
    draw=draw,
    buttons=(
        Button("next", "Next", primary=True),
        Button("back", "Back", "back"),
        Button("auto", "Auto", "run", repeats="next"),
        *(Button(f"stage-{k}", f"Stage {k}") for k in range(1, STAGES + 1)),
        Button("iterate", "Next iteration"),
        Button("finish", "To the end"),
        Button("reset", "Reset", "reset"),
        Button("new", "New draw", "reseed"),
    ),
    legend=(
        Key("source", "moving cloud"),
        Key("target", "fixed cloud", "square"),
        Key("truth", "where the moving cloud belongs", "line"),
        Key("ghost", "before this step", "dotted"),
        Key("accent", "what the stage found", "line"),
        Key("pair", "responsibilities of six fixed points", "line"),
        Key("outlier", "share given to clutter", "cross"),
    ),
    handles=HANDLES,
    tape=(({}, ("next",) * (2 * STAGES - 1)), ({}, ("finish",))),
    python=python,
    lead=Lead(readouts=(), controls=("scene",), buttons=("next", "auto", "iterate", "finish", "reset")),
)
