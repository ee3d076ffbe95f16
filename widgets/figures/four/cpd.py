"""The walkthrough's first panel: one EM step of similarity CPD in five stages."""

from __future__ import annotations

import numpy as np

from solvers.methods.soft import cpd
from solvers.methods.soft.cpd import STAGES as STAGES
from widgets.drawing.picture import Array, Arrow, Mark, Path, Points, Ring, Segments, degrees, number
from widgets.figures.four.run import Look, Shown, arc, carried, cloud, fixed

NAME = "Similarity CPD"
SOME = slice(12, None, 25)  # the fixed points whose shares are drawn, and the moving points whose circles are
PARTNERS = slice(None, None, 3)  # the moving points to which shares are drawn
FAINTEST = 0.25  # fraction of an observation's largest share: smaller shares are not drawn


def shown(look: Look) -> Shown:
    """The marks and the words of the current stage."""
    if look.walk.stage == 1:
        return _responsibilities(look)
    draw = (_centring, _rotation, _translation, _variance)[look.walk.stage - 2]
    return draw(look, cpd.stages(look.before))


def kept(look: Look) -> str:
    """How many responsibilities a pose has."""
    scene = look.walk.scene
    return f"{len(scene.source) * len(scene.target):,}"


def _responsibilities(look: Look) -> Shown:
    scene, P = look.walk.scene, cpd.responsibilities(look.before)
    clutter = 1.0 - look.before.row[0]
    rows = np.arange(len(scene.target))[SOME]
    shares = P[PARTNERS][:, rows]
    relative = shares / np.maximum(P[:, rows].max(axis=0), 1e-300)
    i, j = np.nonzero(relative > FAINTEST)
    marks: list[Mark] = [
        *fixed(scene),
        Segments(look.moved[PARTNERS][i], scene.target[rows[j]], "pair", weight=relative[i, j]),
        Points(scene.target, "outlier", "cross", radius=4.0, weight=clutter),
        Points(scene.target[rows], "target", "square", radius=4.5),
        cloud(look.moved),
    ]
    words = (
        f"{P.shape[0]} × {P.shape[1]} shares at σ = {number(float(look.before.sigma[0]))} u;"
        f" clutter takes {number(float(clutter.sum()), 1)} fixed points."
    )
    return Shown(tuple(marks), words)


def _centring(look: Look, step: cpd.Stages) -> Shown:
    weight = look.before.column[0]
    marks = (
        Points(step.centred_fixed, "target", "square", radius=2.5, weight=look.before.row[0]),
        cloud(step.centred_moving, weight / max(float(weight.max()), 1e-300)),
        *_cross(),
    )
    words = f"Weighted means at the cross: fixed {_place(step.mean_fixed)}, moving {_place(step.mean_moving)}\u00a0u."
    return Shown(marks, words)


def _rotation(look: Look, step: cpd.Stages) -> Shown:
    angle = float(np.arctan2(step.rotation[1, 0], step.rotation[0, 0]))
    first = float(look.walk.start.angle)
    sweep = arc(angle, first, 1.9)
    marks: list[Mark] = [
        Points(step.centred_fixed, "target", "square", radius=2.5),
        Points(step.centred_moving, "ghost", radius=2.5, weight=np.full(len(step.centred_moving), 0.5)),
        cloud(step.centred_moving @ step.rotation.T),
        Path(sweep, "accent", thick=True),
        Arrow(sweep[-2], sweep[-1], "accent"),
        *_cross(),
    ]
    large, small = np.linalg.svd(step.correlation, compute_uv=False).tolist()
    sizes = f"{number(large, 1)} and {number(small, 1)} u²"
    words = f"R turns the original cloud by {degrees(angle, 1)}°; H’s singular values {sizes}."
    return Shown(tuple(marks), words)


def _translation(look: Look, step: cpd.Stages) -> Shown:
    marks = (*carried(look), Arrow(look.came.t, look.went.t, "accent"))
    return Shown(marks, f"Scale {number(step.scale, 3)} and t = {_place(step.translation)} u: the new pose.")


def _variance(look: Look, step: cpd.Stages) -> Shown:
    scene = look.walk.scene
    moved = look.went.apply(scene.source)
    marks: list[Mark] = [*fixed(scene), cloud(moved)]
    for centre in moved[SOME]:
        marks += [Ring(centre, "ghost", reach=step.sigma_before, dashed=True), Ring(centre, "accent", reach=step.sigma)]
    widths = f"{number(step.sigma_before, 3)} → {number(step.sigma, 3)} u"
    return Shown(tuple(marks), f"σ {widths}, from the remaining weighted distances; dashed: before.")


def _cross() -> tuple[Mark, ...]:
    """A cross at the origin, where both clouds are centred."""
    return (Points([[0.0, 0.0]], "ink", "cross", radius=6.0),)


def _place(xy: Array) -> str:
    return f"({number(float(xy[0]))},\u00a0{number(float(xy[1]))})"
