"""Rung 5a: probabilities take the place of matches. CPD, FilterReg and GMMReg on one scene, thread by thread."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from solvers.core.amounts import amount
from solvers.scenes.bird import AREA, SHAPE, bird, bird_start
from solvers.scenes.rooms import Scene
from widgets.drawing.chart import Axis, Series, chart, steps_axis, ticks
from widgets.drawing.picture import (
    Array,
    Group,
    Mark,
    Panel,
    Path,
    Picture,
    Points,
    Readout,
    Role,
    View,
    degrees,
    number,
)
from widgets.engine.contract import ITERATED, Action, Key, Lead, Motion, Widget
from widgets.engine.controls import choice, slider
from widgets.engine.script import called, named
from widgets.figures.soft_family.links import Links, circles, crosses, links, targets, threads
from widgets.figures.soft_family.run import Rule, Run, begun
from widgets.parts.placing import HANDLES, Placing, place, written

VIEW = View(-5.4, 5.4, -3.7, 3.7)
PLACING = Placing(VIEW, limit=(3.7, 2.1), reach=3.2, least=1.5)
ANCHOR = SHAPE.mean(axis=0)
STEPS = 40
NATS = (2.5, 4.5)  # the chart's range of the negative log-likelihood per point, extended if the run leaves it
DECADES = 3.0  # range of the MMD² chart, below 1
LEAST = 1e-6  # FilterReg's clutter weight in place of zero, which it rejects

METHODS = {
    "cpd-rigid": "CPD, rigid",
    "cpd-similarity": "CPD, similarity",
    "filterreg": "FilterReg",
    "gmmreg": "GMMReg",
}


@dataclass(frozen=True)
class Controls:
    """The reader's settings. σ is held at `sigma`, or starts there."""

    method: str = choice("cpd-rigid", "Method", METHODS, keeps="pose")
    width: str = choice(
        "estimated",
        "σ is",
        {"held": "held by hand", "estimated": "estimated", "scheduled": "scheduled"},
        keeps="pose",
    )
    sigma: float = slider(1.1, "σ, or its first value", 0.04, 2.0, 0.02, "u", keeps="pose")
    clutter: float = slider(0.1, "Clutter weight w", 0.0, 0.9, 0.01, "", keeps="pose")
    density: str = choice(
        "area", "Clutter density", {"area": "1/V, V = 64 u²", "count": "1/N, the paper’s"}, keeps="pose"
    )
    filter: str = choice(
        "exact", "FilterReg’s sums", {"exact": "Exact", "grid": "Grid", "lattice": "Lattice"}, keeps="pose"
    )
    turn: float = slider(-40.0, "Start: turn", -180.0, 180.0, 5.0, "°", keeps="nothing")
    offset: float = slider(1.6, "Start: offset", 0.0, 3.0, 0.1, "u", keeps="nothing")
    noise: float = slider(0.1, "Noise", 0.0, 0.3, 0.02, "u", "On both clouds", "pose")
    junk: float = slider(4.0, "Clutter points", 0.0, 10.0, 1.0, "", "In each cloud", "pose")


def rule(c: Controls, scene: Scene) -> Rule:
    """The method and options for the controls; the paper's V is the number of observations."""
    width = "scheduled" if c.method == "gmmreg" and c.width == "estimated" else c.width
    w = max(c.clutter, LEAST) if c.method == "filterreg" else c.clutter
    volume = AREA if c.density == "area" else float(len(getattr(scene, observed(c.method))))
    return Rule(c.method, width, c.sigma, w, volume, c.filter)


def observed(method: str) -> str:
    """The cloud of the observations, which may be clutter."""
    return "source" if method == "filterreg" else "target"


@dataclass(frozen=True, eq=False)
class State:
    """The controls and the run that they began."""

    controls: Controls
    run: Run


def start(controls: Controls, seed: int) -> State:
    """The scene, with a run from the start that the two sliders give."""
    c = controls
    scene = bird(seed=seed, noise=c.noise, clutter=round(c.junk))
    return State(c, begun(rule(c, scene), scene, bird_start(c.turn, c.offset), STEPS))


def act(state: State, action: Action) -> State:
    """Take one step, take all remaining steps, or begin from another start."""
    run = state.run
    if action.kind == "drag":
        return replace(state, run=begun(run.rule, run.scene, PLACING.act(run.pose, ANCHOR, action), STEPS))
    run = run.step()
    while action.name == "finish" and not run.done:
        run = run.step()
    return replace(state, run=run)


def motion(before: State, after: State) -> Motion | None:
    """The move of one step; a change of scale is not a motion."""
    a, b = before.run, after.run
    if b.steps != a.steps + 1 or abs(b.course[-1].scale - a.course[-1].scale) > 1e-9:
        return None
    return PLACING.motion(a.pose, b.pose, ANCHOR)


def draw(state: State) -> Picture:
    """The two clouds with the shares between their points, and charts of the run so far."""
    c, run = state.controls, state.run
    linkage = links(run.rule.method, run.now)
    return Picture(
        (
            Panel("main", f"{METHODS[c.method]}: the clouds, and what links them", VIEW, _marks(run, linkage)),
            _objective_chart(run),
            _sigma_chart(run),
        ),
        _readouts(run, linkage),
        _description(c, run, linkage),
        PLACING.handles(run.pose, ANCHOR),
        _note(c, run),
        frozenset({"step", "finish"} if run.done else ()),
    )


def _marks(run: Run, linkage: Links) -> tuple[Mark, ...]:
    scene, method = run.scene, run.rule.method
    moved = run.pose.apply(scene.source)
    marks: list[Mark] = []
    if run.steps:
        marks += [Path(run.began.apply(line), "ghost", dotted=True) for line in scene.outline]
    marks += [Path(scene.truth.apply(line), "truth", thick=True) for line in scene.outline]
    for side, centres in (("source", moved), ("target", scene.target)):
        if method == "gmmreg" or linkage.side == side:
            role: Role = "source" if side == "source" else "target"
            marks.append(circles(centres, run.sigma, role, VIEW))
    marks.append(threads(moved, scene.target, linkage))
    marks.append(Points(scene.target, "target", "square", radius=4.0))
    if linkage.side == "source":
        marks.append(crosses(scene.target, linkage.clutter))
    own: list[Mark] = [PLACING.stalk(run.pose, ANCHOR), Points(moved, "source", radius=4.0)]
    if linkage.side == "target":
        own.append(crosses(moved, linkage.clutter))
        marks += targets(moved, run.now)
    return (*marks, Group("source", tuple(own)))


def _objective_chart(run: Run) -> Panel:
    """The negative log-likelihood per point, or the MMD² over three decades."""
    log = run.rule.method == "gmmreg"
    span, axis = steps_axis(run.steps, STEPS)
    k = np.arange(len(run.course)) / span
    values = [[getattr(e, name) for e in run.course] for name in ("objective", "truth")]
    least, most = float(np.min(values)), float(np.max(values))
    low, top = min(NATS[0], np.floor(2.0 * least) / 2.0), max(NATS[1], np.ceil(2.0 * most) / 2.0)
    objective, truth = (_decades(v) if log else (np.array(v) - low) / (top - low) for v in values)
    cuts = np.array([e.staged for e in run.course])
    x, y = (np.insert(v, np.flatnonzero(cuts), np.nan) for v in (k, objective))
    decades = tuple((i / 3, name) for i, name in enumerate(("0.001", "0.01", "0.1", "1")))
    nats = tuple(((v - low) / (top - low), number(v, 1)) for v in ticks(low, top, about=5))
    label = f"{'MMD²' if log else 'mean −log likelihood'}; no dots: truth"
    panel = chart(
        "objective",
        "The objective over the steps",
        [
            Series(k, truth, "truth", dashed=True),
            Series(x, y, "ink", dashed=run.rule.promise == "none"),
        ],
        axis,
        Axis(label, 0.0, 1.0, decades if log else nats),
        now=run.steps / span,
    )
    up = np.isin(np.arange(len(k)), run.rises)
    dots = np.stack([k, objective], axis=1)
    marks = (Points(dots[~up], "ink", radius=2.5), Points(dots[up], "outlier", "diamond", radius=4.0))
    return replace(panel, marks=(*panel.marks, *marks))


def _decades(values: list[float]) -> Array:
    """An MMD² as heights in the chart, from 0 to 1."""
    return np.asarray(np.clip(1.0 + np.log10(np.maximum(values, 1e-12)) / DECADES, 0.0, 1.0))


def _sigma_chart(run: Run) -> Panel:
    span, axis = steps_axis(run.steps, STEPS)
    return chart(
        "sigma",
        "σ over the steps",
        [Series(np.arange(len(run.course)) / span, [e.sigma for e in run.course], "ink", dots=True)],
        axis,
        Axis("σ, u", 0.03, 3.0, log=True),
        now=run.steps / span,
    )


RISES = {"never rises": "never", "within a stage": "when σ changes", "none": "at any step"}


def _readouts(run: Run, linkage: Links) -> tuple[Readout, ...]:
    last, shared = run.course[-1], len(linkage.clutter) > 0
    unit, places = ("", 4) if run.rule.method == "gmmreg" else ("nats/point", 3)
    return (
        Readout("objective", "Objective", number(last.objective, places), unit),
        Readout("objective_truth", "At the truth, same σ", number(last.truth, places), unit, "truth"),
        Readout("promise", "Can rise", RISES[run.rule.promise]),
        Readout("rises", "Steps at which the objective rose", f"{len(run.rises)} of {run.steps}"),
        Readout("sigma", "σ", number(last.sigma, 3), "u"),
        Readout("partners", "Effective partners of a point", number(linkage.partners, 1) if shared else "–"),
        Readout(
            "clutter",
            "Given to clutter, on average",
            number(100.0 * float(linkage.clutter.mean()), 1) if shared else "–",
            "%" if shared else "",
            "outlier",
        ),
        Readout("scale", "Scale", number(last.scale, 3)),
        Readout("rotation_error", "Rotation error", number(last.rotation, 1), "°"),
        Readout("translation_error", "Translation error", number(last.translation), "u"),
        Readout("stop", "Stopped", f"step {run.steps}" if run.done else "no"),
    )


def _note(c: Controls, run: Run) -> str:
    if run.done:
        return f"Stopped at step {run.steps}: {run.stop}."
    if run.steps:
        a, b = run.course[-2:]
        places = 4 if c.method == "gmmreg" else 3
        rise = ", a rise" if run.steps in run.rises else ", another function" if b.staged else ""
        return (
            f"Step {run.steps}: objective {number(a.objective, places)} → {number(b.objective, places)}{rise};"
            f" σ {number(a.sigma, 3)} → {number(b.sigma, 3)} u."
        )
    if c.method == "gmmreg":
        suffix = "" if c.width != "estimated" else " Its σ follows a schedule."
        return f"GMMReg has no clutter term: w and its density have no effect.{suffix}"
    if c.method == "filterreg" and c.clutter < LEAST:
        return _ABOVE_ZERO
    if c.method != "filterreg" and c.filter != "exact":
        return "CPD sums exactly: the filter is not used."
    return ""


_ABOVE_ZERO = "FilterReg needs w above zero: here it is 10⁻⁶."
_WHO = {
    "source": "Each moving point is a Gaussian; each fixed point is shared out among them",
    "target": "Each fixed point is a Gaussian; each moving point asks them where it belongs",
    "pair": "Every point of both clouds is a Gaussian, and threads join those that overlap",
}


def _description(c: Controls, run: Run, linkage: Links) -> str:
    scene, last = run.scene, run.course[-1]
    (x, y), heading = place(run.pose, ANCHOR)
    words = [
        f"{METHODS[c.method]}: {len(scene.source)} moving and {len(scene.target)} fixed points on the outline of a"
        f" bird, with noise of σ = {number(c.noise)} u and {amount(round(c.junk), 'clutter point')} in each cloud.",
        f"{_WHO[linkage.side]}, with a width of {number(last.sigma, 3)} u.",
        f"After {amount(run.steps, 'step')} the moving bird is centred at ({number(x, 1)},"
        f" {number(y, 1)}) u, turned by {degrees(heading)}° and scaled by {number(last.scale, 3)}:"
        f" {number(last.rotation, 1)}° and {number(last.translation)} u from the truth.",
    ]
    if len(linkage.clutter):
        strays = int((linkage.clutter > 0.5).sum())
        words.append(
            f"A point has {number(linkage.partners, 1)} effective partners and gives"
            f" {number(100.0 * float(linkage.clutter.mean()), 1)} % to the clutter on average;"
            f" {strays} {'point gives' if strays == 1 else 'points give'} more than half."
        )
    promises = {
        "never rises": "The objective is guaranteed not to rise at any step.",
        "within a stage": "The objective cannot rise while σ stays fixed; a new σ makes it another function.",
        "none": "Nothing prevents the objective from rising here.",
    }
    words.append(f"{promises[run.rule.promise]} So far it rose at {len(run.rises)} of {amount(run.steps, 'step')}.")
    if c.method == "filterreg" and c.clutter < LEAST:
        words.append(_ABOVE_ZERO)
    if run.done:
        words.append(f"The run has stopped: {run.stop}.")
    return " ".join(words)


def python(state: State) -> str:
    """A script that computes the same numbers with the solvers package alone."""
    c, run = state.controls, state.run
    r = run.rule
    options = named({name: value for name, value in r.options(r.sigma).items() if name != "sigma"})
    if c.density == "count":
        options = [f"volume=len(scene.{observed(r.method)})" if o.startswith("volume=") else o for o in options]
    lines = [
        "import numpy as np",
        "from solvers import Pose, register",
        "from solvers.bird_scene import bird",
        "from solvers.metrics import rre, rte",
        "",
        f"scene = bird(seed={run.scene.seed}, noise={c.noise!r}, clutter={round(c.junk)})",
        f"pose = {written(run.began)}",
    ]
    call = "scene.source", "scene.target", f'"{r.method}"', "start=pose"
    if r.restarts:  # to set σ, the script restarts at every step
        after = f"max(0.9 * sigma, {r.last!r})" if r.width == "scheduled" else "sigma"
        lines += [
            f"sigma = {r.sigma!r}",
            f"for _ in range({run.steps}):",
            *called("    pose = register", *call, "sigma=sigma", *options, "max_steps=1", after=".pose"),
            *([f"    sigma = {after}"] if after != "sigma" else []),
            *called("result = register", *call, "sigma=sigma", *options, "max_steps=0"),
        ]
    else:
        first = [f"sigma={r.sigma!r}"] if r.method.startswith("cpd") else []
        lines += called("result = register", *call, *first, *options, f"max_steps={run.steps}")
    per = {"gmmreg": "* 4 * np.pi * sigma**2", "filterreg": "/ len(scene.source)"}.get(r.method, "/ len(scene.target)")
    lines += [
        'sigma = result.detail("sigma")',
        "",
        f'print("objective", result.objective {per})',
        'print("sigma", sigma)',
        'print("scale", float(result.pose.scale))',
        'print("rotation_error", np.degrees(rre(result.pose, scene.truth)))',
        'print("translation_error", rte(result.pose, scene.truth))',
    ]
    return "\n".join(lines) + "\n"


PRESETS: dict[str, dict[str, Any]] = {
    "default": {},
    "by-hand": {"width": "held"},
    "similarity": {"method": "cpd-similarity", "turn": -60.0, "sigma": 2.0},
    "filterreg": {"method": "filterreg"},
    "gmmreg": {"method": "gmmreg"},
}

WIDGET = Widget(
    name="soft-family",
    title="Shares instead of matches",
    controls=Controls,
    presets=PRESETS,
    start=start,
    act=act,
    draw=draw,
    buttons=ITERATED,
    legend=(
        Key("source", "source, which moves"),
        Key("target", "target", "square"),
        Key("source", "circle of radius σ round a component, in its colour; threads are shares", "ring"),
        Key("outlier", "share given to clutter", "cross"),
        Key("accent", "soft target (FilterReg)", "diamond"),
        Key("pair", "overlap (GMMReg)", "line"),
        Key("truth", "the bird, source at the true pose", "line"),
        Key("ghost", "where the run began", "dotted"),
    ),
    handles=HANDLES,
    tape=(
        ({}, ("step",) * 4),
        ({}, ("finish",)),
        ({"method": "filterreg"}, ("finish",)),
        ({"method": "gmmreg"}, ("finish",)),
    ),
    motion=motion,
    python=python,
    lead=Lead(
        panels=("main", "objective"),
        readouts=("partners", "sigma", "rotation_error"),
        controls=("method",),
        buttons=("step", "run", "finish", "reset"),
    ),
)
