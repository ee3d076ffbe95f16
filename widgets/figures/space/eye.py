"""The eye that sees a scene in space: it projects points onto the picture and tells how near each is.

The projection is orthographic, as if the eye were far away: nearer things are drawn larger and stronger, not elsewhere.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from widgets.drawing.picture import Array, Handle, View, move_keys, number

VIEW = View(-2.65, 3.15, -2.3, 2.1)
"""A window around the mug's centre at the origin; wider on the right, where its handle is at first."""
REST = (0.25, -1.76)
"""The first place of the knob that turns the view."""
LOW, HIGH = (-2.2, -2.06), (2.7, -1.06)
"""The knob's limits: once round, and from 47° above to 43° below."""
ROUND, OVER = np.radians(180.0) / (HIGH[0] - REST[0]), np.radians(90.0)
"""Radians by which the view turns per unit that the knob moves across, and down."""
AZIMUTH, ELEVATION = np.radians(-72.0), np.radians(20.0)
LEVELS = 5
"""Levels of nearness."""
DEPTH = 1.9
"""u in front of and behind the centre, over which nearness goes from its most to its least."""


@dataclass(frozen=True)
class Eye:
    """x, y: the knob's place in the panel. Moving it right or down moves the front of the scene right or down."""

    x: float = REST[0]
    y: float = REST[1]

    @property
    def azimuth(self) -> float:
        """The azimuth of the direction to the eye, radians from the x axis."""
        return float(AZIMUTH - ROUND * (self.x - REST[0]))

    @property
    def elevation(self) -> float:
        """The elevation above the horizon, radians."""
        return float(ELEVATION - OVER * (self.y - REST[1]))

    @cached_property
    def axes(self) -> Array:
        """The directions to the right, up, and towards the eye, as the rows of a rotation (3, 3)."""
        (c, s), (e, f) = ((np.cos(a), np.sin(a)) for a in (self.azimuth, self.elevation))
        return np.array([(-s, c, 0.0), (-f * c, -f * s, e), (e * c, e * s, f)])

    def seen(self, points: Array) -> Array:
        """The places (n, 2) of points (n, 3) on the picture."""
        return np.asarray(points @ self.axes[:2].T)

    def level(self, points: Array) -> Array:
        """How near each point (n, 3) is: whole numbers from 0, far, to LEVELS − 1."""
        near = (points @ self.axes[2]) / (2.0 * DEPTH) + 0.5
        return np.asarray(np.clip(np.floor(near * LEVELS + 1e-6), 0, LEVELS - 1))

    def sides(self, turn: Array) -> Array:
        """The azimuths (2,), in the body's own coordinates, at which the wall of an upright cylinder is seen edge on.
        turn: the body's rotation (3, 3)."""
        x, y, _ = turn.T @ self.axes[2]
        return np.asarray(np.arctan2(y, x) + np.array([0.5, -0.5]) * np.pi)

    def at(self, x: float, y: float) -> Eye:
        """The eye with its knob at a place, clipped to the limits."""
        return Eye(float(np.clip(x, LOW[0], HIGH[0])), float(np.clip(y, LOW[1], HIGH[1])))

    def handle(self) -> Handle:
        """The knob as a handle."""
        keys = move_keys(self.x, self.y, leap=0.25)
        return Handle("view", "Turn the view", (self.x, self.y), self.words, keys, "orbit", radius=34.0)

    @property
    def words(self) -> str:
        """The eye's azimuth and elevation as text."""
        around, above = float(np.degrees(self.azimuth)) % 360.0, float(np.degrees(self.elevation))
        return f"{round(around) % 360}° round, {number(above, 0)}° up"
