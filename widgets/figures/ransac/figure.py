"""Chapter 2: corrupted pairs. Of forty proposed matches, two at a time propose a pose, and all forty judge it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from solvers import Pose, Status
from solvers.core.amounts import amount
from solvers.core.arrays import BoolArray
from solvers.core.method import Problem
from solvers.core.stepper import advance, begin
from solvers.methods.pairs.ransac import RANSAC, RansacOptions, RansacState
from solvers.metrics import rre, rte
from solvers.scenes.facade import facade_scene
from solvers.scenes.rooms import Scene
from widgets.drawing.picture import Array, Picture, Readout, number
from widgets.engine.contract import UNDONE, Action, Button, Key, Lead, Widget
from widgets.engine.controls import choice, slider
from widgets.engine.script import called
from widgets.figures.ransac.budget_chart import budget_chart, whole
from widgets.figures.ransac.match_view import HANDLE, PULLED, Shown, match_handle, match_panel, pulled_to

MOST = 300  # most trials
SEPARATION = 0.7  # u, the least distance between the two points of a trial in both views
STEPS = 500  # more than any run takes
BLOCK = 64  # trials at once, when all are requested
HOME = 1e-3  # u: a partner dragged back to where it was measured is this near; handles have four decimals


@dataclass(frozen=True)
class Controls:
    """The reader's settings."""

    scene: str = choice(
        "occluded",
        "Why pairs are wrong",
        {"occluded": "Occlusion", "repeated": "Repeated pattern"},
        "Hidden corners paired at random, or all one window off",
        keeps="log",
    )
    outliers: float = slider(0.45, "Wrong fraction", 0.0, 0.8, 0.05, "", "Of the 40 pairs")
    noise: float = slider(0.06, "Noise σ", 0.0, 0.3, 0.01, "u", "Scales the same noise draw on the target")
    epsilon: float = slider(0.25, "Threshold ε", 0.02, 1.6, 0.01, "u", "Pairs within ε support a pose")
    confidence: str = choice(
        "0.99",
        "Confidence p",
        {"0.5": "50 %", "0.9": "90 %", "0.99": "99 %", "0.999": "99.9 %"},
        "That some trial has two right pairs",
        keeps="log",
    )


@dataclass(frozen=True, eq=False)
class State:
    """steps: the trials and refits that the reader has requested; None for all.

    pulled: where the reader has dragged one partner, (2,) in target coordinates; None if it is where it was measured.
    """

    controls: Controls
    scene: Scene
    steps: int | None = 0
    pulled: Array | None = None

    @property
    def target(self) -> Array:
        """The target points (40, 2), with the pulled one where it was dragged."""
        points = self.scene.target.copy()
        if self.pulled is not None:
            points[PULLED] = self.pulled
        return points

    @property
    def wrong(self) -> BoolArray:
        """Which pairs are wrong, (40,), including the pulled one."""
        wrong = self.scene.target_outlier.copy()
        wrong[PULLED] |= self.pulled is not None
        return wrong

    @cached_property
    def run(self) -> Run:
        """The solver's run of these steps."""
        return _run(self)


@dataclass(frozen=True, eq=False)
class Run:
    """The solver after the requested steps.

    now: its state. searched: its state after the last trial, None while trials are still due. before: its state before
    the last refit, None if the last step was not one.
    """

    now: RansacState
    searched: RansacState | None
    before: RansacState | None

    @property
    def found(self) -> bool:
        """Whether any trial found a consensus."""
        return bool(self.now.found[0])

    @property
    def over(self) -> bool:
        """Whether the run has stopped."""
        return bool(self.now.status[0] != Status.RUNNING)

    @property
    def share(self) -> float:
        """The estimate of the fraction of right pairs."""
        return int(self.now.count[0]) / int(self.now.residuals.shape[1])


def start(controls: Controls, seed: int) -> State:
    """Forty pairs, before any trial."""
    return State(controls, facade_scene(controls.scene, seed=seed, noise=controls.noise, outliers=controls.outliers))


def act(state: State, action: Action) -> State:
    """Take one more step or all the rest, or move one partner; all trials so far are then repeated with it."""
    if action.kind == "drag":
        to = pulled_to(action.x, action.y)
        at_home = np.abs(to - state.scene.target[PULLED]).max() < HOME
        return replace(state, pulled=None if at_home else to)
    if action.name == "finish" or state.steps is None:
        return replace(state, steps=None)
    return replace(state, steps=min(state.steps + 1, STEPS))


def _run(state: State) -> Run:
    """Run the solver from its start, with trials in one block or a few, since the block size changes nothing."""
    c, scene = state.controls, state.scene
    steps = STEPS if state.steps is None else state.steps
    block = BLOCK if state.steps is None else max(1, min(steps, MOST))
    options = RansacOptions(c.epsilon, float(c.confidence), MOST, block, SEPARATION)
    source, target = scene.source[None], state.target[None]
    problem = Problem(source, target, np.ones((1, len(state.target))), Pose.identity(2, (1,)), np.array([scene.seed]))
    batch = begin(RANSAC, problem, options, STEPS)
    now, searched, before = batch.state(), None, None
    while not batch.done and now.trials[0] + now.refits[0] < steps:
        if searched is not None:
            before = now
        batch = advance(batch)
        now = batch.state()
        if searched is None and now.trials[0] >= min(now.budget[0], now.drawn[0]):
            searched = now
    return Run(now, searched, before)


def draw(state: State) -> Picture:
    """The matches between the two views, the trials needed over the fraction of right pairs, and the words."""
    c, run = state.controls, state.run
    now = run.now
    content = Shown(
        state.scene,
        state.target,
        state.wrong,
        now.inliers[0],
        now.pose[0] if run.found else None,
        now.ghost[0],
        (now.last_sample[0], now.last_pose[0]) if _trying(state, run) else None,
        c.epsilon,
    )
    chart = budget_chart(float(c.confidence), 2, MOST, run.share if run.found else None)
    return Picture(
        (match_panel(content), chart),
        _readouts(state, run),
        _description(state, run),
        (match_handle(state.target),),
        _note(state, run),
        frozenset({"step", "finish"} if run.over else ()),
    )


def _trying(state: State, run: Run) -> bool:
    """Whether the last step was a trial."""
    return bool(state.steps) and run.before is None


def _errors(pose: Pose, truth: Pose) -> tuple[str, str]:
    return number(float(np.degrees(rre(pose, truth))), 1), number(float(rte(pose, truth)))


def _readouts(state: State, run: Run) -> tuple[Readout, ...]:
    now, has_pose = run.now, run.found
    inliers, wrong = now.inliers[0], state.wrong
    turn, shift = _errors(now.pose[0], state.scene.truth) if has_pose else ("–", "–")
    ghost_turn, ghost_shift = _errors(now.ghost[0], state.scene.truth)

    def or_dash(value: str) -> str:
        return value if has_pose else "–"

    return (
        Readout("trials", "Trials made", str(int(now.trials[0]))),
        Readout("budget", "Budget N", or_dash(whole(float(now.budget[0])))),
        Readout("trial_count", "This trial, within ε", str(int(now.last_count[0])) if _trying(state, run) else "–"),
        Readout("count", "Best so far, within ε", or_dash(str(int(now.count[0]))), "of 40" * has_pose, "inlier"),
        Readout("share", "Estimated right fraction w", or_dash(number(run.share, 3)), "", "inlier"),
        Readout("capped_sum", "Capped sum of squares", or_dash(number(float(now.objective[0]), 3)), "u²" * has_pose),
        Readout("admitted", "Wrong pairs counted", or_dash(str(int((inliers & wrong).sum()))), "", "outlier"),
        Readout("lost", "Right pairs left out", or_dash(str(int((~inliers & ~wrong).sum()))), "", "truth"),
        Readout("rotation_error", "Rotation error, consensus", turn, "°" * has_pose, "source"),
        Readout("translation_error", "Translation error, consensus", shift, "u" * has_pose, "source"),
        Readout("ghost_rotation", "Rotation error, all pairs", ghost_turn, "°", "ghost"),
        Readout("ghost_translation", "Translation error, all pairs", ghost_shift, "u", "ghost"),
    )


def _runs(now: RansacState) -> str:
    return f"{amount(int(now.trials[0]), 'trial')}, {amount(int(now.refits[0]), 'refit')}"


def _note(state: State, run: Run) -> str:
    now = run.now
    if state.steps == 0:
        return ""
    if now.status[0] == Status.DEGENERATE:
        return f"No pose: {now.reason[0]}."
    if _trying(state, run):
        i, j = (now.last_sample[0] + 1).tolist()
        text = f"Trial {int(now.trials[0])}: pairs {i} and {j}, {int(now.last_count[0])} of 40 within ε"
        best = (now.last_sample[0] == now.sample[0]).all()
        ends = " The last one: refits follow." if run.searched is not None else ""
        return f"{text}{', the best so far' * bool(best)}.{ends}"
    previous = run.searched if state.steps is None else run.before
    assert previous is not None
    previous_count, count = int(previous.count[0]), int(now.count[0])
    refits = int(now.refits[0])
    name = _runs(now) if state.steps is None else f"Refit {refits}"
    sums = f"capped sum {number(float(previous.objective[0]), 2)} → {number(float(now.objective[0]), 2)} u²"
    hint = " (the count may fall)" if count < previous_count else ""
    ends = " Capped short of N." if now.status[0] == Status.CAPPED else " Stable." * run.over
    return f"{name}: {sums}, {previous_count} → {count} within ε{hint}.{ends}"  # must fit two lines on a phone


def _description(state: State, run: Run) -> str:
    c, now, truth = state.controls, run.now, state.scene.truth
    wrong = int(state.scene.target_outlier.sum())
    kind = "scattered over windows on the right" if c.scene == "occluded" else "all one window to the side"
    partners = amount(wrong, "partner is wrong", f"partners are wrong, {kind}") if wrong else "no partner is wrong"
    words = [
        f"Forty lines join window corners of a façade on the left to proposed partners in a second view on the"
        f" right; {partners}, the noise is σ = {number(c.noise)} u, and a circle of"
        f" ε = {number(c.epsilon)} u surrounds each partner."
    ]
    if state.pulled is not None:
        words.append("One partner has been pulled away by hand.")
    turn, shift = _errors(now.ghost[0], truth)
    words.append(f"The grey least-squares fit of all pairs is {turn}° and {shift} u from the true pose.")
    if not run.found:
        words.append("No trial has been made." if not state.steps and state.steps is not None else "No consensus yet.")
        return " ".join(words)
    turn, shift = _errors(now.pose[0], truth)
    wrong_inliers = int((now.inliers[0] & state.wrong).sum())
    budget = float(now.budget[0])
    words.append(
        f"After {_runs(now)} the best pose has {int(now.count[0])} pairs within ε, {wrong_inliers} of them wrong, and"
        f" is {turn}° and {shift} u from the truth; at an estimated fraction of {number(run.share, 3)} the formula asks"
        f" for {whole(budget)} trial{'s' * (budget > 1.0)} at {100 * float(c.confidence):g} % confidence, of at most"
        f" {MOST}."
    )
    return " ".join(words)


def python(state: State) -> str:
    """A script that computes the same numbers with the solvers package alone."""
    c, s = state.controls, state.scene
    run = state.run
    steps = int(run.now.trials[0] + run.now.refits[0])
    lines = [
        "import numpy as np",
        "from solvers import fit_rigid, register",
        "from solvers.match_scenes import facade_scene",
        "from solvers.metrics import rre, rte",
        "",
        f'scene = facade_scene("{s.name}", seed={s.seed}, noise={c.noise!r}, outliers={c.outliers!r})',
        f"target = scene.target{'' if state.pulled is None else '.copy()'}",
    ]
    if state.pulled is not None:
        at = tuple(round(v, 6) for v in state.pulled.tolist())
        lines.append(f"target[{PULLED}] = {at}  # pulled by hand")
    lines += [
        *called(
            "result = register", "scene.source", "target", '"ransac"', f"seed={s.seed}", f"inlier={c.epsilon!r}",
            f"confidence={c.confidence}", f"most={MOST}", f"separation={SEPARATION}", "per_step=1",
            f"max_steps={steps if not run.over else STEPS}",
        ),
        "ghost = fit_rigid(scene.source, target).pose  # of all pairs, right and wrong",
        "",
        'print("trials", result.detail("trials"))',
    ]  # fmt: skip
    if run.found:
        lines += [
            'print("count", result.detail("count"))',
            'print("capped_sum", result.objective)',
            'print("rotation_error", np.degrees(rre(result.pose, scene.truth)))',
            'print("translation_error", rte(result.pose, scene.truth))',
        ]
    lines += [
        'print("ghost_rotation", np.degrees(rre(ghost, scene.truth)))',
        'print("ghost_translation", rte(ghost, scene.truth))',
    ]
    return "\n".join(lines) + "\n"


WIDGET = Widget(
    name="ransac",
    title="Corrupted pairs: propose from two, judge by all",
    controls=Controls,
    presets={
        "default": {},
        "repeated": {"scene": "repeated"},
        "wide": {"scene": "repeated", "outliers": 0.25, "epsilon": 1.25},
        "tight": {"epsilon": 0.04},
    },
    start=start,
    act=act,
    draw=draw,
    buttons=(
        Button("run", "Run", "run", primary=True, repeats="step"),
        Button("step", "Step"),
        Button("finish", "To the end"),
        *UNDONE,
    ),
    legend=(
        Key("inlier", "match within ε of the best pose", "line"),
        Key("outlier", "match outside", "dashed"),
        Key("pair", "match, before there is a pose", "dashed"),
        Key("source", "source; its façade at the best pose", "line"),
        Key("target", "target", "square"),
        Key("target", "partner outside ε", "ring"),
        Key("outlier", "wrong, yet within ε", "ring"),
        Key("truth", "right, yet outside", "ring"),
        Key("accent", "this trial and its pose", "dashed"),
        Key("ghost", "least squares on all pairs", "line"),
        Key("truth", "true pose", "line"),
        Key("ghost", "ε round a partner", "ring"),
    ),
    handles=(HANDLE,),
    tape=(({}, ("finish",)), ({}, ("step",) * 14)),
    python=python,
    lead=Lead(
        readouts=("count", "rotation_error", "ghost_rotation"),
        controls=("epsilon",),
        buttons=("run", "step", "finish", "reset"),
    ),
)
