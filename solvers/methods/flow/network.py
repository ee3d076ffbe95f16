"""The small network of the learned flow, which maps two clouds and a noisy placement of their points to where each
point belongs.

Every point of both clouds is a token. The encoder sees only the clouds: each point's coordinates and a
rotation-invariant description of how the rest of its own cloud lies around it; attention lets every token read every
other. The decoder sees the encoded tokens, the current coordinates and the time, and predicts each point's endpoint.

The forward pass uses only what numpy and PyTorch have in common (`xp` is either module), so training runs the same
code as the page. Everything is in units of the target's RMS radius, each cloud about its own centroid.

In the manner of Register Any Point (Pan et al. 2025) and Rectified Point Flow (Sun et
al. 2025), at a size that a page can carry; no part of either is used.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

WIDTH = 48
HEADS = 4
ENCODER = 3
DECODER = 2
BINS = 12
REACH = 2.75  # the end of the last distance bin, in RMS radii
WAVES = (0.5, 1.0, 2.0)  # of the coordinates' waves, in half turns per RMS radius
GIVEN = 3 * BINS + 2 + 4 * len(WAVES) + 1
PRESENT = 2 + 4 * len(WAVES) + 3

Params = Mapping[str, Any]


@dataclass(frozen=True)
class Shape:
    """The name and shape of one array of the network."""

    name: str
    size: tuple[int, ...]

    @property
    def count(self) -> int:
        return int(np.prod(self.size))


def shapes() -> list[Shape]:
    """Every array of the network, in the order in which they are stored."""
    w = WIDTH
    arrays = [Shape("given.w", (GIVEN, w)), Shape("given.b", (w,))]
    for i in range(ENCODER + DECODER):
        p = f"layer{i}."
        arrays += [
            Shape(p + "g1", (w,)),
            Shape(p + "qkv", (w, 3 * w)),
            Shape(p + "out", (w, w)),
            Shape(p + "g2", (w,)),
            Shape(p + "up", (w, 2 * w)),
            Shape(p + "upb", (2 * w,)),
            Shape(p + "down", (2 * w, w)),
        ]
    arrays += [Shape("present.w", (PRESENT, w)), Shape("present.b", (w,))]
    return [*arrays, Shape("last.g", (w,)), Shape("last.w", (w, 2))]


def invariants(points: Any, xp: Any = np) -> Any:
    """A rotation-invariant description of how the rest of a cloud lies around each of its points (…, n, 2): (…, n,
    3·BINS).

    For each soft distance bin: how many points lie there, how far outwards, and how far to the left.
    """
    apart = points[..., None, :, :] - points[..., :, None, :]
    distance = (apart**2).sum(-1) ** 0.5
    dot = (points[..., :, None, :] * apart).sum(-1)
    cross = points[..., :, None, 0] * apart[..., 1] - points[..., :, None, 1] * apart[..., 0]
    n = points.shape[-2]
    parts: list[Any] = []
    width = REACH / BINS
    for b in range(BINS):
        bump = xp.exp(-0.5 * ((distance - (b + 0.5) * width) / width) ** 2)
        parts += [bump.sum(-1) * (4.0 / n), (bump * dot).sum(-1) * (4.0 / n), (bump * cross).sum(-1) * (4.0 / n)]
    return xp.stack(parts, -1)


def waves(points: Any, xp: Any = np) -> Any:
    """Coordinates (…, 2) and their waves: (…, 2 + 4·len(WAVES))."""
    parts = [points]
    for k in WAVES:
        parts += [xp.sin(points * (np.pi * k)), xp.cos(points * (np.pi * k))]
    return xp.concatenate(parts, -1)


def given(points: Any, view: float, xp: Any = np) -> Any:
    """The encoder's input for one cloud (…, n, 2); view is 0 for the source, 1 for the target."""
    flag = points[..., :1] * 0.0 + view
    return xp.concatenate([invariants(points, xp), waves(points, xp), flag], -1)


def encode(params: Params, source: Any, target: Any, xp: Any = np) -> Any:
    """The tokens of both clouds (…, m + n, WIDTH) from source (…, m, 2) and target (…,
    n, 2).
    """
    tokens = xp.concatenate([given(source, 0.0, xp), given(target, 1.0, xp)], -2)
    h = tokens @ params["given.w"] + params["given.b"]
    for i in range(ENCODER):
        h = _layer(params, f"layer{i}.", h, xp)
    return h


def endpoint(params: Params, tokens: Any, present: Any, time: Any, xp: Any = np) -> Any:
    """The predicted endpoint of each point (…, m + n, 2), given the current coordinates (…, m + n, 2) at time (…, 1,
    1).
    """
    clock = present[..., :1] * 0.0 + time
    features = xp.concatenate([waves(present, xp), clock, xp.sin(np.pi * clock), xp.cos(np.pi * clock)], -1)
    h = tokens + features @ params["present.w"] + params["present.b"]
    for i in range(ENCODER, ENCODER + DECODER):
        h = _layer(params, f"layer{i}.", h, xp)
    return _normed(h, params["last.g"]) @ params["last.w"]


def _layer(params: Params, name: str, h: Any, xp: Any) -> Any:
    h = h + _attention(params, name, _normed(h, params[name + "g1"]), xp)
    up = _normed(h, params[name + "g2"]) @ params[name + "up"] + params[name + "upb"]
    return h + (0.5 * (up + abs(up))) @ params[name + "down"]


def _attention(params: Params, name: str, h: Any, xp: Any) -> Any:
    """Every token reads every token, in HEADS ways."""
    size = WIDTH // HEADS
    qkv = (h @ params[name + "qkv"]).reshape(*h.shape[:-1], 3, HEADS, size)
    q, k, v = (xp.swapaxes(qkv[..., i, :, :], -3, -2) for i in range(3))
    score = q @ xp.swapaxes(k, -1, -2) * size**-0.5
    score = xp.exp(score - _largest(score))
    heads = (score @ v) / score.sum(-1)[..., None]
    return xp.swapaxes(heads, -3, -2).reshape(*h.shape) @ params[name + "out"]


def _largest(score: Any) -> Any:
    largest = score.max(-1)
    return (largest if isinstance(largest, np.ndarray) else largest.values)[..., None]


def _normed(h: Any, gain: Any) -> Any:
    """h scaled to root mean square 1, times the gain."""
    return h * ((h * h).mean(-1)[..., None] + 1e-5) ** -0.5 * gain
