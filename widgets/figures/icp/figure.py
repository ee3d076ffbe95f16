"""Rung 3: pairs of nearest points. Match, move, match again: what must fall, what may rise, and where a run stops."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from solvers.core.amounts import amount
from solvers.scenes.rooms import room, room_start
from widgets.drawing.chart import WIDTH, Axis, Series, chart, steps_axis
from widgets.drawing.picture import Array, Mark, Panel, Picture, Points, Readout, degrees, number
from widgets.engine.contract import ITERATED, Action, Key, Lead, Motion, Widget
from widgets.engine.controls import choice, slider
from widgets.engine.script import called, named
from widgets.figures.icp.run import Rule, Run, begun
from widgets.parts.placing import HANDLES, place, written
from widgets.parts.room import (
    ANCHOR,
    BRINGS,
    PLACING,
    SETTINGS,
    VIEW,
    error_chart,
    outline,
    pair_lines,
    source,
    start_choice,
    start_offset,
    start_turn,
    still,
    with_marks,
)

STEPS = 40
OPEN = 3.0  # u: the slider's maximum, which turns the gate off
TOPS = (0.25, 0.5, 0.75, 1.25, 2.5, 5.0, 10.0)  # u: the RMS chart ends at the first of these that is large enough


@dataclass(frozen=True)
class Controls:
    """The reader's settings. A scene sets its noise and outliers, a start its turn and offset, an objective its gate
    and trim."""

    scene: str = choice("clean", "Room", SETTINGS, sets=BRINGS, keeps="pose")
    start: str = start_choice("near")
    turn: float = start_turn("near")
    offset: float = start_offset("near")
    objective: str = choice(
        "plain",
        "Objective",
        {"plain": "Plain", "count": "Fixed count", "capped": "Capped"},
        sets={
            "plain": {"gate": OPEN, "trim": 0.0},
            "count": {"gate": OPEN, "trim": 20.0},
            "capped": {"gate": 0.6, "trim": 0.0},
        },
        keeps="pose",
    )
    gate: float = slider(OPEN, "Gate", 0.1, OPEN, 0.05, "u", "Also the cap, if capped; off at 3\u00a0u", "pose")
    trim: float = slider(0.0, "Trim", 0.0, 60.0, 5.0, "%", "Farthest pairs, discarded", "pose")
    noise: float = slider(0.02, "Noise σ", 0.0, 0.3, 0.01, "u", keeps="pose")
    outliers: float = slider(0.0, "Outliers", 0.0, 50.0, 5.0, "%", "Of each cloud, at random", "pose")
    overlap: float = slider(100.0, "Target seen", 30.0, 100.0, 5.0, "%", "The part of the room in the target", "pose")


def rule(c: Controls) -> Rule:
    """The method and options for the controls."""
    gated, trimmed = c.gate < OPEN, c.trim > 0.0
    if c.objective == "count":
        return Rule("trimmed-icp", {"keep": round(1.0 - c.trim / 100.0, 6)}, True, True)
    if c.objective == "capped":
        return Rule("capped-icp", {"cap": c.gate if gated else np.inf}, True, not gated)
    options = {**({"gate": c.gate} if gated else {}), **({"trim": c.trim / 100.0} if trimmed else {})}
    # Trimming a fraction of all pairs leaves a fixed number; trimming those within a gate does not.
    return Rule("icp", options, not gated, not gated)


@dataclass(frozen=True, eq=False)
class State:
    """The controls and the run that they began. backdrop: the marks that no step moves."""

    controls: Controls
    run: Run
    backdrop: tuple[Mark, ...]


def start(controls: Controls, seed: int) -> State:
    """The scene, with a run from the start that the two sliders give."""
    c = controls
    scene = room(c.scene, seed=seed, noise=c.noise, outliers=c.outliers / 100.0, overlap=c.overlap / 100.0)
    return State(c, begun(rule(c), scene, room_start(c.turn, c.offset), STEPS), still(scene))


def act(state: State, action: Action) -> State:
    """Take one step, take all remaining steps, or begin from another start."""
    run = state.run
    if action.kind == "drag":
        start = PLACING.act(run.pose, ANCHOR, action)
        return replace(state, run=begun(run.rule, run.scene, start, STEPS, run.truth))
    run = run.step()
    while action.name == "finish" and not run.done:
        run = run.step()
    return replace(state, run=run)


def motion(before: State, after: State) -> Motion | None:
    """The move of one step; the picture before it already shows the pairs that it fits."""
    if after.run.steps != before.run.steps + 1:
        return None
    return PLACING.motion(before.run.pose, after.run.pose, ANCHOR)


def draw(state: State) -> Picture:
    """The room with the pairs at the current pose, and charts of the run so far."""
    run = state.run
    now, moved = run.now, run.now.pairing.moved[0]
    partners, used = now.index.points[0, now.pairing.rows[0]], now.pairing.used[0]
    gated = ~used & (now.pairing.distances[0] > now.reach[0])
    marks = (
        *(outline(run.scene, run.began, "ghost") if run.steps else ()),
        *state.backdrop,
        *pair_lines(moved, partners, used, gated),
        source(run.scene, run.pose, used),
    )
    return Picture(
        (
            Panel("main", "The two scans in the target’s coordinates, with pairs of nearest points", VIEW, marks),
            _rms_chart(run),
            _used_chart(run),
            error_chart([e.rotation for e in run.course], [e.translation for e in run.course], STEPS),
        ),
        _readouts(run),
        _description(state.controls, run, int(gated.sum())),
        PLACING.handles(run.pose, ANCHOR),
        _note(state.controls, run),
        frozenset({"step", "finish"} if run.done else ()),
    )


def _rms_chart(run: Run) -> Panel:
    """Two lines per step: the move, during which the pairs stay, and the matching, during which nothing moves.

    Both axes are in fractions of their spans, labelled in steps and u, so that the panel's window does not change.
    """
    span, axis = steps_axis(run.steps, STEPS)
    k, step = np.arange(len(run.course)) / span, 1.0 / span
    rms, moved, mean = (np.array([getattr(e, name) for e in run.course]) for name in ("rms", "moved", "mean"))
    truth, falls = float(run.truth.rms[0]), run.rule.objective_falls and not run.rule.rms_falls
    most = max(truth, float(rms.max()), float(mean.max()) if falls else 0.0)
    top = next((top for top in TOPS if most <= top), TOPS[-1])
    rms, moved, mean = (np.minimum(v / top, 1.0) for v in (rms, moved, mean))
    series = [Series([0.0, 1.0], [truth / top] * 2, "truth", "at the truth", dashed=True)]
    if falls:
        series.append(Series(k, mean, "accent", "√(objective/n)", dashed=True))
    half, gap = k[1:] - 0.5 * step, np.full(len(k) - 1, np.nan)
    series += [
        Series(_interleave(half, k[1:], gap), _interleave(moved[1:], rms[1:], gap), "target"),
        Series(_interleave(k[:-1], half, gap), _interleave(rms[:-1], moved[1:], gap), "source"),
    ]
    panel = chart(
        "rms",
        "RMS over the pairs used, over the steps: each move, then each matching",
        series,
        axis,
        Axis("RMS over the pairs used, u", 0.0, 1.0, tuple((i / 5, number(i / 5 * top)) for i in range(6))),
        now=run.steps * step,
        size=(WIDTH, 170.0),
    )
    dots, up = np.stack([k, rms], axis=1), np.isin(np.arange(len(k)), run.rises)
    paired = np.array([e.used > 0 for e in run.course])  # without a pair there is no RMS
    return with_marks(
        panel, Points(dots[~up & paired], "source", radius=2.5), Points(dots[up], "outlier", "diamond", radius=4.0)
    )


def _interleave(*columns: Array) -> Array:
    """The columns interleaved: the first value of each, then the second of each, …"""
    return np.stack(columns, axis=1).reshape(-1)


def _used_chart(run: Run) -> Panel:
    span, axis = steps_axis(run.steps, STEPS)
    return chart(
        "used",
        "Pairs used, over the steps",
        [Series(np.arange(len(run.course)) / span, [e.used for e in run.course], "source", dots=True)],
        axis,
        Axis("Pairs used", 0.0, 160.0),
        now=run.steps / span,
        size=(WIDTH, 115.0),
    )


def _readouts(run: Run) -> tuple[Readout, ...]:
    last = run.course[-1]
    falls = {(True, True): "RMS and objective", (True, False): "the objective", (False, False): "neither"}
    return (
        Readout("rms", "RMS over the pairs used", *((number(last.rms, 3), "u") if last.used else ("–", "")), "source"),
        Readout("rms_truth", "RMS at the truth, same rule", number(float(run.truth.rms[0]), 3), "u", "truth"),
        Readout("used", "Pairs used", f"{last.used} of {len(run.scene.source)}"),
        Readout("objective", "Objective", number(float(run.batch.objective()[0]), 3), "u²"),
        Readout("falls", "Can never rise here", falls[run.rule.objective_falls, run.rule.rms_falls]),
        Readout("rises", "Steps at which the RMS rose", f"{len(run.rises)} of {run.steps}"),
        Readout("rotation_error", "Rotation error", number(last.rotation, 1), "°"),
        Readout("translation_error", "Translation error", number(last.translation), "u"),
        Readout("stop", "Stopped", f"{run.status.label}, step {run.steps}" if run.done else "no"),
    )


def _note(c: Controls, run: Run) -> str:
    if run.done:
        return f"Stopped at step {run.steps}: {run.reason}."
    if run.steps == 0:
        if c.objective == "count" and c.gate < OPEN:
            return "The gate has no effect when the count is fixed."
        if c.objective == "capped" and c.trim > 0.0:
            return "Trimming has no effect when distances are capped."
        return ""
    before, last = run.course[-2:]
    rise = ", a rise" if run.steps in run.rises else ""
    return (
        f"Step {run.steps}. Move: {amount(before.used, 'pair')}, {number(before.rms, 3)} → {number(last.moved, 3)} u."
        f" Match: {last.changed} changed, {number(last.rms, 3)} u{rise}."
    )


def _description(c: Controls, run: Run, gated: int) -> str:
    n, last = len(run.scene.source), run.course[-1]
    (x, y), heading = place(run.pose, ANCHOR)
    words = [
        f"{n} source points and {len(run.scene.target)} target points of one room, {SETTINGS[c.scene].lower()}:"
        f" noise of σ = {number(c.noise)} u, {number(c.outliers, 0)} % outliers, the target sees"
        f" {number(c.overlap, 0)} % of the room.",
        f"After {amount(run.steps, 'step')} the source is turned by {degrees(heading)}°, with its"
        f" origin at ({number(x)}, {number(y)}) u.",
        f"A line joins each source point to its nearest target point; {last.used} of {n} pairs are used"
        + (f", at an RMS of {number(last.rms, 3)} u." if last.used else ".")
        + f" By the same rule it is {number(float(run.truth.rms[0]), 3)} u at the true pose.",
    ]
    if gated:
        words.append(f"{amount(gated, 'pair lies', 'pairs lie')} farther apart than {number(c.gate)} u.")
    if n - last.used - gated:
        words.append(f"{amount(n - last.used - gated, 'pair is', 'pairs are')} trimmed.")
    words += [
        f"The pose is {number(last.rotation, 1)}° and {number(last.translation)} u from the truth.",
        _promise(run.rule),
        f"So far the RMS rose at {len(run.rises)} of {amount(run.steps, 'step')}.",
    ]
    if run.done:
        words.append(f"The run has stopped: {run.reason}.")
    return " ".join(words)


def _promise(active: Rule) -> str:
    if active.rms_falls:
        return "The number of pairs is fixed: neither the sum of squares nor the RMS can rise."
    if active.objective_falls:
        return "The capped sum of squares cannot rise; the RMS over the pairs used can."
    return "With the gate the number of pairs varies: both the sum of squares and the RMS can rise."


def python(state: State) -> str:
    """A script that computes the same numbers with the solvers package alone."""
    c, run = state.controls, state.run
    lines = [
        "import numpy as np",
        "from solvers import Pose, register",
        "from solvers.metrics import rre, rte",
        "from solvers.scenes import room",
        "",
        f'scene = room("{c.scene}", seed={run.scene.seed}, noise={c.noise!r}, outliers={c.outliers / 100!r}, '
        f"overlap={c.overlap / 100!r})",
        f"start = {written(run.began)}",
        *called(
            "result = register", "scene.source", "scene.target", f'"{run.rule.method}"', "start=start",
            f"max_steps={run.steps}", *named(run.rule.options),
        ),
        'pairs = result.detail("pairing")',
        "",
        *(['print("rms", pairs.rms)'] if run.course[-1].used else []),
        'print("objective", result.objective)',
        'print("rotation_error", np.degrees(rre(result.pose, scene.truth)))',
        'print("translation_error", rte(result.pose, scene.truth))',
    ]  # fmt: skip
    return "\n".join(lines) + "\n"


PRESETS: dict[str, dict[str, Any]] = {
    "default": {},
    "far": {"start": "far"},
    "gated": {"start": "midway", "gate": 1.0},
    "striped": {"scene": "striped", "objective": "count"},
    "outliers": {"scene": "outliers"},
    "overlap": {"scene": "noise", "overlap": 35.0, "gate": 0.6},
}

WIDGET = Widget(
    name="icp",
    title="Nearest points: match, move, repeat",
    controls=Controls,
    presets=PRESETS,
    start=start,
    act=act,
    draw=draw,
    buttons=ITERATED,
    legend=(
        Key("source", "source, which moves"),
        Key("target", "target", "square"),
        Key("pair", "pair used", "line"),
        Key("outlier", "not used: beyond the gate or cap", "dashed"),
        Key("weak", "not used: trimmed", "dashed"),
        Key("truth", "the room, source at the true pose", "line"),
        Key("ghost", "where the run began", "dotted"),
        Key("source", "RMS along a move", "line"),
        Key("target", "RMS along a matching", "line"),
        Key("outlier", "a rise", "diamond"),
    ),
    handles=HANDLES,
    tape=(({}, ("step",) * 16), ({}, ("finish",)), ({"start": "far"}, ("step",) * 3)),
    motion=motion,
    python=python,
    lead=Lead(
        panels=("main", "rms"),
        readouts=("rms", "rotation_error", "translation_error"),
        controls=("start",),
        buttons=("step", "run", "finish", "reset"),
    ),
)
