"""Chapter 1: known pairs. Put the source anywhere and press Solve: the closed form finds the same pose every time."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from solvers import Fit, Pose, fit_rigid
from solvers.metrics import rms, rre, rte
from solvers.scenes.rooms import Scene, kabsch_scene
from widgets.drawing.picture import (
    Array,
    Group,
    Label,
    Mark,
    Panel,
    Path,
    Picture,
    Points,
    Readout,
    Role,
    Segments,
    View,
    degrees,
    number,
    small,
)
from widgets.engine.contract import UNDONE, Action, Button, Key, Lead, Motion, Widget
from widgets.engine.controls import choice, slider, toggle
from widgets.parts.placing import HANDLES, Placing, place, written

VIEW = View(-6.0, 6.0, -4.0, 4.0)
PLACING = Placing(VIEW, limit=(4.25, 2.25), reach=2.4, least=1.4)
GHOSTS = 6
SCENE_NAMES = {"clean": "clean", "noisy": "noisy", "outliers": "outliers", "reflect": "would-reflect"}


@dataclass(frozen=True)
class Controls:
    """The reader's settings. A scene sets its own noise and wrong pairs, which the sliders can then change."""

    scene: str = choice(
        "clean",
        "Scene",
        {"clean": "Clean", "noisy": "Noisy", "outliers": "Outliers", "reflect": "Would reflect"},
        sets={
            "clean": {"noise": 0.0, "wrong": 0.0},
            "noisy": {"noise": 0.12, "wrong": 0.0},
            "outliers": {"noise": 0.0, "wrong": 3.0},
            "reflect": {"noise": 0.12, "wrong": 0.0},
        },
    )
    noise: float = slider(0.0, "Noise σ", 0.0, 0.6, 0.02, "u", "Scales the same noise draw on the target")
    wrong: float = slider(0.0, "Wrong pairs", 0.0, 6.0, 1.0, "", "How many of the 13 points have a wrong partner")
    correct: bool = toggle(True, "Keep to rotations", "The determinant correction")


@dataclass(frozen=True, eq=False)
class State:
    """pose: that of the source as drawn. start: that before the last Solve, or the current one if unsolved.

    free: the fit over all orthogonal matrices. starts and solutions: one of each for every Solve so far.
    spread: the largest distance, in u, between the places that two solutions give the same point.
    """

    controls: Controls
    scene: Scene
    free: Fit
    pose: Pose
    start: Pose
    solved: bool = False
    starts: tuple[Pose, ...] = ()
    solutions: tuple[Pose, ...] = ()
    spread: float = 0.0

    @property
    def centroid(self) -> Array:
        """The centroid of the source points, in their own coordinates."""
        return np.asarray(self.scene.source.mean(axis=0))

    @property
    def mirrored(self) -> bool:
        """Whether the source is drawn as its mirror image."""
        return bool(np.linalg.det(self.pose.R) < 0)


def start(controls: Controls, seed: int) -> State:
    """The scene with the source at its first start, unsolved."""
    name = SCENE_NAMES[controls.scene]
    scene = kabsch_scene(name, seed=seed, noise=controls.noise, outliers=round(controls.wrong))
    free = fit_rigid(scene.source, scene.target, proper=False)
    return State(controls, scene, free, scene.start, scene.start)


def act(state: State, action: Action) -> State:
    """Solve, or move the source to another start."""
    if action.kind == "press":
        return _solved(state)
    pose = PLACING.act(state.pose, state.centroid, action)
    return replace(state, pose=pose, start=pose, solved=False)


def _solved(state: State) -> State:
    """The state after Solve. The fit gets the source as it lies now and knows nothing of how it came there."""
    if state.solved:
        return state
    scene = state.scene
    fit = fit_rigid(state.pose.apply(scene.source), scene.target, proper=state.controls.correct)
    pose = fit.pose.compose(state.pose)
    ends = pose.apply(scene.source)
    distances = [np.linalg.norm(ends - solution.apply(scene.source), axis=1).max() for solution in state.solutions]
    return replace(
        state,
        pose=pose,
        solved=True,
        starts=(*state.starts, state.start),
        solutions=(*state.solutions, pose),
        spread=max([state.spread, *map(float, distances)]),
    )


def motion(before: State, after: State) -> Motion | None:
    """The rigid motion of a Solve, about the source's centroid; a reflection is not a motion."""
    if before.solved or not after.solved or after.mirrored:
        return None
    return PLACING.motion(before.pose, after.pose, after.centroid)


def draw(state: State) -> Picture:
    """The panel, the readouts and the words."""
    scene, stats = state.scene, _numbers(state)
    moved, wrong = state.pose.apply(scene.source), scene.target_outlier
    names: tuple[Mark, ...] = ()  # drawn last, so that nothing covers them
    marks: list[Mark] = [
        *(path for pose in state.starts[-GHOSTS:] for path in _outline(scene, pose, "ghost")),
        *_outline(scene, scene.truth, "truth"),
    ]
    if state.solved and stats.det < 0 and not state.mirrored:
        marks += _outline(scene, state.free.pose, "ghost", dashed=True)
        names = (_reflection_label(state),)
    marks += [
        Segments(moved[~wrong], scene.target[~wrong], "pair"),
        Segments(moved[wrong], scene.target[wrong], "outlier", dashed=True),
        Points(scene.target[~wrong], "target", "square", radius=5.0),
        Points(scene.target[wrong], "outlier", "cross", radius=6.0),
        Group(
            "source",
            (
                PLACING.stalk(state.pose, state.centroid),
                *_outline(scene, state.pose, "source"),
                Points(moved, "source"),
            ),
        ),
        *names,
    ]
    return Picture(
        (Panel("main", "Source and target in the target’s coordinates", VIEW, tuple(marks)),),
        _readouts(state, stats),
        _description(state, stats),
        PLACING.handles(state.pose, state.centroid),
        _note(state, stats),
        frozenset({"solve"} if state.solved else ()),
    )


def _outline(scene: Scene, pose: Pose, role: Role, dashed: bool = False) -> tuple[Path, ...]:
    thick = role == "truth"  # shows as a rim under a source that lies on it
    dotted = role == "ghost" and not dashed
    return tuple(Path(pose.apply(line), role, dashed=dashed, thick=thick, dotted=dotted) for line in scene.outline)


def _reflection_label(state: State) -> Label:
    """A label below the reflected outline's corner that is farthest from the true one: the tip of the pennant."""
    rim = np.concatenate(state.scene.outline)
    reflected = state.free.pose.apply(rim)
    apart = np.linalg.norm(reflected - state.scene.truth.apply(rim), axis=1)
    tip = reflected[np.argmax(np.round(apart, 6))]
    return Label(tip, "a reflection", "ghost", "middle", dy=18)


@dataclass(frozen=True)
class _Numbers:
    before: float
    now: float
    truth: float
    free: float
    turn: float
    shift: float
    det: int


def _numbers(state: State) -> _Numbers:
    scene, p, q = state.scene, state.scene.source, state.scene.target
    turn = float(np.degrees(rre(state.pose, scene.truth)))
    poses = (state.start, state.pose, scene.truth, state.free.pose)
    before, now, truth, free = (float(rms(pose, p, q)) for pose in poses)
    shift = float(rte(state.pose, scene.truth))
    return _Numbers(before, now, truth, free, turn, shift, int(state.free.determinant))


def _readouts(state: State, stats: _Numbers) -> tuple[Readout, ...]:
    mirrored, compared = state.mirrored, len(state.solutions) > 1
    return (
        Readout("rms_before", "RMS residual at the start", number(stats.before, 3), "u", "ghost"),
        Readout("rms", "RMS residual now", number(stats.now, 3), "u", "source"),
        Readout("rms_truth", "RMS residual at the truth", number(stats.truth, 3), "u", "truth"),
        Readout(
            "rotation_error",
            "Rotation error",
            "not a rotation" if mirrored else number(stats.turn, 1),
            "" if mirrored else "°",
        ),
        Readout(
            "translation_error",
            "Translation error",
            "–" if mirrored else number(stats.shift),
            "" if mirrored else "u",
        ),
        Readout("determinant", "det VUᵀ", {1: "+1", -1: "−1", 0: "0"}[stats.det]),
        Readout(
            "spread",
            "Largest difference between solutions",
            small(state.spread) if compared else "–",
            "u" if compared else "",
        ),
    )


def _note(state: State, stats: _Numbers) -> str:
    if not state.solved:
        return ""
    # A note must fit two lines on a phone.
    residual = f"residual {number(stats.before, 3)} → {number(stats.now, 3)} u"
    if state.mirrored:
        return f"Solved uncorrected: {residual}, by a reflection, not a motion."
    if stats.det < 0:
        difference = small(stats.now - stats.free)
        return f"Solved in closed form: {residual}. A reflection would leave {difference} u less."
    return f"Solved in closed form: {residual}; the start played no part."


def _description(state: State, stats: _Numbers) -> str:
    scene = state.scene
    n, wrong = len(scene.source), int(scene.target_outlier.sum())
    (x, y), heading = place(state.pose, state.centroid)
    figure = "a mast with a pennant" if scene.name == "would-reflect" else "a bird"
    position = f"centred at ({number(x, 1)}, {number(y, 1)}) u"
    orientation = "mirrored" if state.mirrored else f"turned by {degrees(heading)}°"
    noise = f"noise of σ = {number(state.controls.noise)} u" if state.controls.noise else "no noise"
    partners = {0: "no partner is wrong", 1: "one partner is wrong"}.get(wrong, f"{wrong} partners are wrong")
    words = [
        f"{n} source points on the outline of {figure} lie {position}, {orientation}; a line joins each to its target"
        f" point. The targets have {noise} and {partners}."
    ]
    error = "" if state.mirrored else f", {number(stats.turn, 1)}° and {number(stats.shift)} u from the true pose"
    if not state.solved:
        words.append(f"The residual is {number(stats.now, 3)} u RMS{error}.")
    else:
        words.append(
            f"Solve took the residual from {number(stats.before, 3)} to {number(stats.now, 3)} u RMS{error};"
            f" at the truth it is {number(stats.truth, 3)} u."
        )
    if state.mirrored:
        words.append("The source is now its mirror image: the answer is a reflection, not a rotation.")
    elif state.solved and stats.det < 0:
        words.append(
            f"A dashed grey outline shows the unconstrained optimum, a mirror image with a residual of"
            f" {number(stats.free, 3)} u."
        )
    if len(state.solutions) > 1:
        words.append(
            f"Solutions from {len(state.solutions)} starts, the latest shown as grey outlines,"
            f" differ by {small(state.spread).replace('< ', 'less than ')} u."
        )
    return " ".join(words)


def python(state: State) -> str:
    """A script that computes the same numbers with the solvers package alone."""
    c, s = state.controls, state.scene
    lines = [
        "import numpy as np",
        "from solvers import Pose, fit_rigid",
        "from solvers.metrics import rms, rre, rte",
        "from solvers.scenes import kabsch_scene",
        "",
        f'scene = kabsch_scene("{s.name}", seed={s.seed}, noise={c.noise!r}, outliers={round(c.wrong)})',
        f"start = {written(state.start)}",
        "moved = start.apply(scene.source)",
        f"fit = fit_rigid(moved, scene.target{'' if c.correct else ', proper=False'})",
        f"pose = {'fit.pose.compose(start)' if state.solved else 'start  # once solved: fit.pose.compose(start)'}",
        "",
        'print("rms_before", rms(start, scene.source, scene.target))',
        'print("rms", rms(pose, scene.source, scene.target))',
        'print("rms_truth", rms(scene.truth, scene.source, scene.target))',
        'print("determinant", fit.determinant)',
    ]
    if not state.mirrored:
        lines += [
            'print("rotation_error", np.degrees(rre(pose, scene.truth)))',
            'print("translation_error", rte(pose, scene.truth))',
        ]
    return "\n".join(lines) + "\n"


WIDGET = Widget(
    name="kabsch",
    title="Known pairs: one step to the optimum",
    controls=Controls,
    presets={"default": {}} | {scene: {"scene": scene} for scene in ("noisy", "outliers", "reflect")},
    start=start,
    act=act,
    draw=draw,
    buttons=(
        Button("solve", "Solve", primary=True),
        *UNDONE,
    ),
    legend=(
        Key("source", "source, which moves"),
        Key("target", "target", "square"),
        Key("pair", "known pair", "line"),
        Key("outlier", "wrong partner", "cross"),
        Key("truth", "source at the true pose", "line"),
        Key("ghost", "where it started", "dotted"),
    ),
    handles=HANDLES,
    tape=(
        ({"scene": "clean"}, ("solve",)),
        ({"scene": "noisy"}, ("solve",)),
        ({"scene": "outliers"}, ("solve",)),
        ({"scene": "reflect"}, ("solve",)),
        ({"scene": "reflect", "correct": False}, ("solve",)),
    ),
    motion=motion,
    python=python,
    lead=Lead(
        readouts=("rms", "rotation_error", "determinant"),
        controls=("noise",),
        buttons=("solve", "reset", "new"),
    ),
)
