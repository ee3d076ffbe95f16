"""Two views side by side, like two photographs, with their proposed matches between them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from solvers import Pose
from solvers.core.arrays import BoolArray, IntArray
from solvers.scenes.rooms import Scene
from widgets.drawing.picture import (
    FAINT,
    Array,
    Handle,
    Label,
    Mark,
    Panel,
    Path,
    Points,
    Role,
    Segments,
    View,
    move_keys,
    number,
)

VIEW = View(-6.5, 7.5, -3.3, 3.3)
LEFT, RIGHT = np.array([-3.4, -0.1]), np.array([2.75, 0.15])  # where each view's origin is drawn
HANDLE = "partner"
PULLED = 18  # the pair whose partner the reader can drag: the top right corner of the lower right window
LOW, HIGH = (-6.1, -2.9), (7.1, 2.9)  # where it can be put


@dataclass(frozen=True, eq=False)
class Shown:
    """What is drawn over the two views.

    target: (n, 2) as measured or dragged. wrong, inliers: (n,). pose: the best so far, or None. ghost: the
    least-squares pose of all pairs. trial: rows (2,) and pose of the last trial, or None. epsilon: u.
    """

    scene: Scene
    target: Array
    wrong: BoolArray
    inliers: BoolArray
    pose: Pose | None
    ghost: Pose
    trial: tuple[IntArray, Pose] | None
    epsilon: float


def match_panel(content: Shown) -> Panel:
    """Both views, a line per match, ε round every target point, the poses as outlines of the façade."""
    scene, q = content.scene, content.target + RIGHT
    p = scene.source + LEFT
    front, has_pose = scene.outline[0], content.pose is not None
    faint = min(1.0, 0.3 / content.epsilon)  # wide rings overlap, and must not hide the façade
    inliers, outliers = content.inliers & has_pose, ~content.inliers & has_pose
    marks: list[Mark] = [Path(front + LEFT, "source"), _panes(scene, LEFT)]
    if has_pose:
        marks += [
            Segments(p[outliers], q[outliers], "outlier", weight=np.full(outliers.sum(), FAINT), dashed=True),
            Segments(p[inliers], q[inliers], "inlier", weight=np.full(inliers.sum(), 0.5)),
        ]
    else:
        marks.append(Segments(p, q, "pair", weight=np.full(len(p), 0.5), dashed=True))
    marks += [
        Points(q, "ghost", "ring", radius=content.epsilon * VIEW.scale, weight=np.full(len(q), faint)),
        Path(scene.truth.apply(front) + RIGHT, "truth", thick=True),
        Path(content.ghost.apply(front) + RIGHT, "ghost", thick=True),
    ]
    marks += [
        Points(q[~outliers], "target", "square", radius=4.0),
        Points(q[outliers], "target", "ring", radius=4.0),
        Points(p, "source", radius=4.0),
    ]
    if content.pose is not None:
        marks += [
            Path(content.pose.apply(front) + RIGHT, "source", thick=True),
            Points(content.pose.apply(scene.source) + RIGHT, "source", radius=2.5),
        ]
    if content.pose is not None and content.trial is None:  # a trial is judged by its count, a pose by its pairs
        wrong_inliers, right_outliers = inliers & content.wrong, outliers & ~content.wrong
        marks += [
            Points(q[wrong_inliers], "outlier", "ring", radius=8.0),
            Points(q[right_outliers], "truth", "ring", radius=8.0),
        ]
    if content.trial is not None:
        sample, pose = content.trial
        marks += [
            *(Path([p[i], q[i]], "accent", thick=True) for i in sample.tolist()),
            Path(pose.apply(front) + RIGHT, "accent", dashed=True, thick=True),
            Points(np.concatenate([p[sample], q[sample]]), "accent", "ring", radius=8.0),
        ]
    marks += [_name(-6.35, "source view", "source"), _name(7.35, "target view", "target")]
    return Panel("main", "Forty proposed matches between two views of a façade", VIEW, tuple(marks))


def _panes(scene: Scene, offset: Array) -> Segments:
    panes = np.stack(scene.outline[1:])
    a, b = panes[:, :-1].reshape(-1, 2), panes[:, 1:].reshape(-1, 2)
    return Segments(a + offset, b + offset, "source", weight=np.full(len(a), FAINT))


def _name(x: float, text: str, role: Role) -> Label:
    return Label([x, -3.1], text, role, "start" if x < 0 else "end")


def match_handle(target: Array) -> Handle:
    """The handle on one partner, to drag it away."""
    x, y = (target[PULLED] + RIGHT).tolist()
    value = f"partner at ({number(x - RIGHT[0], 1)}, {number(y - RIGHT[1], 1)}) u in the target view"
    return Handle(HANDLE, "Partner of one pair", (x, y), value, move_keys(x, y, 0.1, 0.5))


def pulled_to(x: float, y: float) -> Array:
    """A place in the panel, clipped to its inside, in target coordinates."""
    return np.asarray(np.clip([x, y], LOW, HIGH) - RIGHT)
