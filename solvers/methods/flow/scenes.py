"""The synthetic scenes that the learned flow is trained on, and held-out scenes that show where it fails."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from solvers.core.arrays import FloatArray

MODES = 6


@dataclass(frozen=True)
class Kind:
    """A family of scenes. turn: the range of |rotation| in degrees. noise: the range of
    σ in RMS radii.

    clutter: the range of the share of each cloud replaced by junk. scale: of the moving cloud. shape: "waves" (closed
    curves of random harmonics, as in training) or "corners" (closed polygons).
    """

    name: str
    turn: tuple[float, float] = (0.0, 90.0)
    noise: tuple[float, float] = (0.0, 0.03)
    clutter: tuple[float, float] = (0.0, 0.1)
    scale: float = 1.0
    shape: str = "waves"


TRAINING = Kind("in distribution")
HELD_OUT = (
    Kind("in distribution"),
    Kind("rotation 90–135°", turn=(90.0, 135.0)),
    Kind("rotation 135–180°", turn=(135.0, 180.0)),
    Kind("unseen shapes", shape="corners"),
    Kind("noise 0.1", noise=(0.1, 0.1)),
    Kind("clutter 30 %", clutter=(0.3, 0.3)),
    Kind("source 15 % smaller", scale=0.85),
)


@dataclass(frozen=True, eq=False)
class Draw:
    """b scenes: source and target (b, n, 2), each in its own coordinates; angle (b,)
    and shift (b, 2) of the true motion from source to target coordinates.
    """

    source: FloatArray
    target: FloatArray
    angle: FloatArray
    shift: FloatArray


def draw(kind: Kind, count: int, points: int, seed: int) -> Draw:
    """Draw `count` scenes of `points` points per cloud, both clouds sampled from the curve independently."""
    random = np.random.default_rng(seed)
    curve = _waves if kind.shape == "waves" else _corners
    outline = curve(random, count)  # (b, K, 2), dense and closed
    outline = outline - outline.mean(axis=1, keepdims=True)
    outline /= np.sqrt((outline**2).sum(-1).mean(-1))[:, None, None]
    # start from a random orientation: the target's frame is the scanner's, not the shape's
    outline = outline @ _turn(random.uniform(-np.pi, np.pi, count))
    clouds = []
    sigma = random.uniform(*kind.noise, size=count)
    share = random.uniform(*kind.clutter, size=count)
    for _ in range(2):
        jitter = random.uniform(0, 1, (count, 1)) + random.uniform(-0.35, 0.35, (count, points))
        at = (np.arange(points) + jitter) / points
        cloud = _along(outline, at % 1.0) + sigma[:, None, None] * random.standard_normal((count, points, 2))
        junk = random.uniform(-2.0, 2.0, (count, points, 2))
        order = random.permuted(np.tile(np.arange(points), (count, 1)), axis=1)
        cloud = np.where((order < np.round(share * points)[:, None])[..., None], junk, cloud)
        clouds.append(cloud)
    angle = np.radians(random.uniform(*kind.turn, size=count)) * random.choice([-1.0, 1.0], count)
    shift = random.uniform(-1.0, 1.0, (count, 2))
    # source = R⁻¹ (x − t), then its own scale about its centroid
    source = (clouds[0] - shift[:, None]) @ _turn(angle)
    if kind.scale != 1.0:
        middle = source.mean(axis=1, keepdims=True)
        source = middle + kind.scale * (source - middle)
    return Draw(source, clouds[1], angle, shift)


def _turn(angle: FloatArray) -> FloatArray:
    """Matrices M (b, 2, 2) such that `rows @ M` turns row vectors back by the angle, giving rows of R⁻¹ p."""
    c, s = np.cos(angle), np.sin(angle)
    return np.stack([np.stack([c, -s], -1), np.stack([s, c], -1)], -2)


def _waves(random: np.random.Generator, count: int, dense: int = 240) -> FloatArray:
    u = np.linspace(0, 2 * np.pi, dense, endpoint=False)
    k = np.arange(1, MODES + 1)
    size = random.uniform(0.0, 0.42, (count, MODES)) / k**0.7
    phase = random.uniform(0, 2 * np.pi, (count, MODES))
    radius = 1 + (size[:, :, None] * np.cos(k[:, None] * u + phase[:, :, None])).sum(1)
    radius = np.maximum(radius, 0.15)
    stretch = random.uniform(0.55, 1.0, (count, 1))
    return np.stack([radius * np.cos(u), stretch * radius * np.sin(u)], -1)


def _corners(random: np.random.Generator, count: int, dense: int = 240) -> FloatArray:
    """Closed polygons of 5 to 8 corners at random radii."""
    polygons = []
    for _ in range(count):
        n = int(random.integers(5, 9))
        angle = 2 * np.pi * (np.arange(n) + random.uniform(-0.35, 0.35, n)) / n
        corner = random.uniform(0.35, 1.3, n)[:, None] * np.stack([np.cos(angle), np.sin(angle)], -1)
        closed = np.concatenate([corner, corner[:1]])
        length = np.concatenate([[0.0], np.linalg.norm(np.diff(closed, axis=0), axis=1).cumsum()])
        at = np.linspace(0, length[-1], dense, endpoint=False)
        polygons.append(np.stack([np.interp(at, length, closed[:, i]) for i in range(2)], -1))
    return np.stack(polygons)


def _along(outline: FloatArray, share: FloatArray) -> FloatArray:
    """Points at fractions `share` (b, n) of the way along the outline (b, K, 2), interpolated linearly between its
    samples.
    """
    dense = outline.shape[1]
    at = share * dense
    low = np.floor(at).astype(np.int64) % dense
    rest = (at - np.floor(at))[..., None]
    rows = np.arange(outline.shape[0])[:, None]
    places: FloatArray = (1 - rest) * outline[rows, low] + rest * outline[rows, (low + 1) % dense]
    return places
