"""Placing a cloud by hand: a handle at its anchor moves it, one on a stalk along its heading turns it about that."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from solvers import Pose
from widgets.drawing.picture import Array, Handle, Segments, View, degrees, move_keys, number, turn_keys
from widgets.engine.contract import Action, Motion

HANDLES = ("source", "turn")


@dataclass(frozen=True)
class Placing:
    """How a cloud may be placed in one panel. Its anchor is a point (2,) in its own coordinates, such as its centroid.

    limit: how far from the world's origin, along x and y, the anchor may be put. reach: u from the anchor to the
    turning handle; near the window's border it is shorter, down to `least`, where two fingertips still fit.
    """

    view: View
    limit: tuple[float, float]
    reach: float
    least: float
    panel: str = "main"

    def act(self, pose: Pose, anchor: Array, action: Action) -> Pose:
        """The pose after a drag of one of the two handles: always a rotation, even if `pose` is a reflection."""
        centre, heading = self.held(pose, anchor)
        to = np.array([action.x, action.y])
        if action.name == "source":
            centre = np.clip(to, np.negative(self.limit), self.limit)
        elif np.hypot(*(to - centre)) > 1e-9:
            heading = float(np.arctan2(*(to - centre)[::-1]))
        rotation = Pose.from_angle(heading)
        return Pose(rotation.R, centre - rotation.R @ anchor)

    def held(self, pose: Pose, anchor: Array) -> tuple[Array, float]:
        """The place of the moving handle for a cloud at `pose`, clipped to the limit if a run or a start put the cloud
        beyond it, and the cloud's heading in radians."""
        centre, heading = place(pose, anchor)
        return np.clip(centre, np.negative(self.limit), self.limit), heading

    def grip(self, centre: Array, heading: float) -> Array:
        """The place of the turning handle."""
        along = np.array([np.cos(heading), np.sin(heading)])
        middle = np.array([self.view.x0 + self.view.x1, self.view.y0 + self.view.y1]) / 2
        half = np.array([self.view.x1 - self.view.x0, self.view.y1 - self.view.y0]) / 2 - 0.25
        room = (half - np.sign(along) * (centre - middle)) / np.maximum(np.abs(along), 1e-9)
        return np.asarray(centre + along * max(self.least, min(self.reach, float(room.min()))))

    def motion(self, before: Pose, after: Pose, anchor: Array) -> Motion:
        """The motion from one pose to the other: a turn about the anchor, then a shift."""
        turn = float(after.compose(before.inverse()).angle)
        (x, y), (u, v) = (place(pose, anchor)[0].tolist() for pose in (before, after))
        return Motion("source", turn, (x, y), (u - x, v - y), self.panel)

    def stalk(self, pose: Pose, anchor: Array) -> Segments:
        """The line between the two handles."""
        centre, heading = self.held(pose, anchor)
        return Segments(centre, self.grip(centre, heading), "guide")

    def handles(self, pose: Pose, anchor: Array) -> tuple[Handle, Handle]:
        """The two handles of the cloud at `pose`."""
        centre, heading = self.held(pose, anchor)
        x, y = centre.tolist()
        u, v = self.grip(centre, heading).tolist()
        where = f"x {number(x)}, y {number(y)} u"
        keys, text, angle = turn_keys(centre, self.reach, heading), f"{degrees(heading)}°", float(np.degrees(heading))
        return (
            Handle("source", "Move the source", (x, y), where, move_keys(x, y), "move", self.panel),
            Handle("turn", "Turn the source", (u, v), text, keys, "turn", self.panel, angle=angle),
        )


def place(pose: Pose, anchor: Array) -> tuple[Array, float]:
    """The anchor in world coordinates, and the direction of the cloud's own x axis in radians."""
    x, y = pose.R[:, 0]
    return pose.apply(anchor[None])[0], float(np.arctan2(y, x))


def written(pose: Pose) -> str:
    """The Python expression that makes this pose of the plane."""
    x, y, turn = (repr(round(float(v), 9) + 0.0) for v in (*pose.t, np.degrees(pose.angle)))
    return f"Pose.from_angle(np.radians({turn}), ({x}, {y}))"
