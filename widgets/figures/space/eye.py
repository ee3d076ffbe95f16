"""Where a scene in space is seen from: its places on the picture and how near each is to the eye.

The projection is orthographic: the eye is far away, and what is nearer is drawn larger and stronger, not elsewhere.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from widgets.drawing.picture import Array, Handle, View, move_keys, number

VIEW = View(-2.65, 3.15, -2.3, 2.1)
"""About the mug's middle at the origin; wider on the right, where its handle is at first."""
REST = (0.25, -1.76)
"""Where the knob of the view lies at first."""
LOW, HIGH = (-2.2, -2.06), (2.7, -1.06)
"""How far it goes: once round, and from 47° above to 43° below."""
ROUND, OVER = np.radians(180.0) / (HIGH[0] - REST[0]), np.radians(90.0)
"""A unit of the knob's way, across and down, turns the view by this much."""
AZIMUTH, ELEVATION = np.radians(-72.0), np.radians(20.0)
LEVELS = 5
"""Of nearness."""
DEPTH = 1.9
"""u before and behind the middle, over which nearness goes from its least to its most."""


@dataclass(frozen=True)
class Eye:
    """x, y: the place of the knob in the panel. To the right, the front of the scene goes right; down, down."""

    x: float = REST[0]
    y: float = REST[1]

    @property
    def azimuth(self) -> float:
        """Of the direction to the eye, radians from the x axis."""
        return float(AZIMUTH - ROUND * (self.x - REST[0]))

    @property
    def elevation(self) -> float:
        """Above the horizon, radians."""
        return float(ELEVATION - OVER * (self.y - REST[1]))

    @cached_property
    def axes(self) -> Array:
        """To the right, up, and towards the eye: the rows of a rotation (3, 3)."""
        (c, s), (e, f) = ((np.cos(a), np.sin(a)) for a in (self.azimuth, self.elevation))
        return np.array([(-s, c, 0.0), (-f * c, -f * s, e), (e * c, e * s, f)])

    def seen(self, points: Array) -> Array:
        """Places (n, 2) of points (n, 3) on the picture."""
        return np.asarray(points @ self.axes[:2].T)

    def level(self, points: Array) -> Array:
        """How near each of (n, 3) is: whole numbers from 0, far, to LEVELS − 1."""
        near = (points @ self.axes[2]) / (2.0 * DEPTH) + 0.5
        return np.asarray(np.clip(np.floor(near * LEVELS + 1e-6), 0, LEVELS - 1))

    def sides(self, turn: Array) -> Array:
        """Azimuths (2,) in a body's own coordinates at which an upright cylinder's wall is seen edge on, the body
        turned by (3, 3)."""
        x, y, _ = turn.T @ self.axes[2]
        return np.asarray(np.arctan2(y, x) + np.array([0.5, -0.5]) * np.pi)

    def at(self, x: float, y: float) -> Eye:
        """The eye whose knob is put at a place, or as near to it as it goes."""
        return Eye(float(np.clip(x, LOW[0], HIGH[0])), float(np.clip(y, LOW[1], HIGH[1])))

    def handle(self) -> Handle:
        """The knob."""
        keys = move_keys(self.x, self.y, leap=0.25)
        return Handle("view", "Turn the view", (self.x, self.y), self.words, keys, "orbit", radius=34.0)

    @property
    def words(self) -> str:
        """Where the eye is."""
        around, above = float(np.degrees(self.azimuth)) % 360.0, float(np.degrees(self.elevation))
        return f"{number(around, 0)}° round, {number(above, 0)}° up"
