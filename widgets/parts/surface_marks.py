"""The marks for surface residuals: pulls, normals, covariances, the weak direction, the weight function."""

from __future__ import annotations

from functools import cache, lru_cache

import numpy as np

from solvers.core.arrays import BoolArray
from solvers.methods.icp.gicp import GicpOptions
from solvers.numerics import robust
from widgets.drawing.chart import WIDTH, Axis, Series, chart
from widgets.drawing.picture import (
    Array,
    Arrow,
    Ellipses,
    Group,
    Label,
    Mark,
    Panel,
    Path,
    Points,
    Role,
    Segments,
    Ticks,
    View,
    number,
)
from widgets.parts.placing import Placing
from widgets.parts.room import ANCHOR, PLACING, outline, still, with_marks
from widgets.parts.surface_run import Run

FAINTEST = 1.0 / 6.0  # the least weight of a used pair, so that it is drawn however little it pulls
SIGMAS = 0.4  # standard deviations at which covariances are drawn: at one, they would be as long as a wall
EVERY = 9  # one covariance is drawn for so many points
SLIDE = 0.1  # turning part of a unit direction below which it looks like a slide, as in gauss_newton.freedom
BESIDE = 0.75  # u from the cloud's centre to the arrow, so that it is not in the wall or under a handle
GAP = 1.2  # least ratio of the second eigenvalue to the first for there to be a weakest direction
FARTHEST = 8.0  # r / s
HIGHEST = 2.2
LEAVES = 1.5  # where the line of an unbounded pull ends, so that its label stays below that of s


def pairs(run: Run) -> tuple[Mark, ...]:
    """The residual of each used pair, from the moved point to its partner, or in plane mode to its foot on the line
    through the partner; a line's strength is the pair's pull relative to the strongest."""
    used = run.used
    share = run.pull[used] / max(float(run.pull.max()), 1e-12)
    return (Segments(run.moved[used], _ends(run)[used], "pair", weight=np.maximum(share, FAINTEST)),)


def _ends(run: Run) -> Array:
    if run.ask.residual != "plane":
        return run.partners
    # precision is n nᵀ here: it keeps the part of the offset along the normal.
    return np.asarray(run.moved - np.einsum("mij,mj->mi", run.precision, run.moved - run.partners))


@lru_cache(maxsize=12)
def fixed(run: Run) -> tuple[Mark, ...]:
    """What does not move in any run of the scene: the walls, the target, and its normals or covariances. Given the run
    from `kept`, it is the same for all starts, and is rendered once."""
    return (*still(run.scene), *surfaces(run))


def ghost(run: Run) -> tuple[Mark, ...]:
    """The walls where the run began, once it has taken a step."""
    return outline(run.scene, run.began, "ghost") if run.steps else ()


def surfaces(run: Run) -> tuple[Mark, ...]:
    """The target's normals as ticks, or some of its covariances as ellipses; nothing for point pairs."""
    state = run.state
    if run.ask.residual == "plane":
        known = ~state.normals.flagged[0]
        return (Ticks(state.index.points[0, known], state.normals.vectors[0, known], "normal", length=13.0),)
    if run.ask.residual == "gicp":
        every = slice(None, None, EVERY)
        covariance = state.covariances[1][0, every]
        return (Ellipses(state.index.points[0, every], covariance, "normal", SIGMAS, filled=True),)
    return ()


def own_surfaces(run: Run) -> tuple[Mark, ...]:
    """Some of the source's covariances at its pose, turned with it."""
    if run.ask.residual != "gicp":
        return ()
    every, R = slice(EVERY // 2, None, EVERY), run.pose.R
    covariance = R @ run.state.covariances[0][0, every] @ R.T
    return (Ellipses(run.moved[every], covariance, "source", SIGMAS, filled=True),)


Carried = tuple[tuple[Mark, ...], tuple[Mark, ...]]


def carried(run: Run, placing: Placing = PLACING) -> Carried:
    """What moves with the source whatever it is paired with, so that runs at one pose can share it. Below: the stalk of
    its turning handle and its walls. Above: its points, with crosses for outliers that the simulation misplaced."""
    wrong = run.scene.source_outlier
    stalk = placing.stalk(run.pose, ANCHOR)
    points = (
        Points(run.moved[~wrong], "source", radius=2.5),
        Points(run.moved[wrong], "outlier", "cross", radius=3.0),
    )
    return (stalk, *outline(run.scene, run.pose, "source")), points


def moving(run: Run, shared: Carried | None = None) -> Group:
    """Everything that moves with the source: what `carried` returns, its covariances, and a ring around each point
    whose pair is unused. shared: the result of `carried` for another run at the same pose."""
    below, above = shared or carried(run)
    return Group("source", (*below, *own_surfaces(run), *above, unused(run)))


def unused(run: Run) -> Points:
    """A ring around each moved point whose pair is unused."""
    return Points(run.moved[~run.used], "ghost", "ring", radius=5.5)


def weak_direction(run: Run) -> tuple[Mark, ...]:
    """The motion that the pairs constrain least, in both directions: a straight arrow for a slide, an arc for a turn;
    longer and thicker if it is free. Nothing if two motions are constrained about equally."""
    if not _has_weakest(run):
        return ()
    free = bool(run.system.free[0, 0])
    half, head = (2.0, 11.0) if free else (1.1, 7.0)
    course = _course(run, half)
    reach = course[[0, -1]], course[[1, -2]]
    return (
        Path(course, "weak", thick=free),
        *(Arrow(before, end, "weak", head) for end, before in zip(*reach, strict=True)),
    )


def _has_weakest(run: Run) -> bool:
    """Whether one motion is clearly less constrained than the next; otherwise rounding decides the eigenvector."""
    first, second = run.system.eigenvalues[0, :2]
    return bool(second > GAP * max(float(first), 0.0))


def _course(run: Run, half: float) -> Array:
    """The places (n, 2) that a point passes under the weak motion, up to `half` u to either side of its own."""
    v, a = run.system.directions[0, :2, 0], float(run.system.directions[0, 2, 0])
    centre, radius = run.system.centre[0], float(run.system.radius[0])
    if abs(a) < SLIDE:
        along = v / np.linalg.norm(v)
        along = along if along[0] > 0 else -along
        beside = centre + BESIDE * np.array([along[1], -along[0]])
        return np.asarray(beside + np.linspace(-half, half, 3)[:, None] * along)
    about = centre + np.array([-v[1], v[0]]) * radius / a
    arm = centre - [0.0, BESIDE] - about
    length = float(np.hypot(*arm))
    if length < 0.35 * radius:  # a turn about the centre: drawn half a radius below it
        arm, length = np.array([0.0, -0.5 * radius]), 0.5 * radius
    angles = np.linspace(-half, half, 15) / max(length, half)
    c, s = np.cos(angles), np.sin(angles)
    return np.asarray(about + np.stack([c * arm[0] - s * arm[1], s * arm[0] + c * arm[1]], axis=1))


def left_free(run: Run) -> str:
    """The kind of motion that the pairs leave free: 'none', 'slide', 'turn', or how many of the three."""
    count = int(run.system.free[0].sum())
    return ("none", _kind(run), f"{count} of 3", "all")[min(count, 3)]


def _kind(run: Run) -> str:
    return "slide" if abs(float(run.system.directions[0, 2, 0])) < SLIDE else "turn"


def condition(run: Run) -> str:
    """The condition number as text, with as many digits as matter."""
    value = float(run.system.condition[0])
    if not np.isfinite(value) or value >= 1e6:
        return "> 10⁶"
    return number(value, 1) if value < 100 else f"{int(number(value, 0)):,}"


def weak_label(run: Run, view: View) -> Label:
    """A label with the weak direction in words, in the map's top left corner, where there are no points."""
    return Label([view.x0, view.y1], weak_words(run), "weak", dx=12, dy=24)


def weak_words(run: Run) -> str:
    """The weak direction and the condition number in words: 'weakest: slide, condition 6.3'."""
    how = "free" if run.system.free[0, 0] else "weakest"
    words = f"{how}: {_kind(run)}" if _has_weakest(run) else "no weakest direction"
    return f"{words}, condition {condition(run)}"


def weight_chart(run: Run) -> Panel:
    """w and the pull w r over the pair distance r in units of s, with a stroke below for every pair."""
    s = Label([1.0, HIGHEST], f"s = {number(run.scale, 3)} u", "guide", dx=4, dy=10)
    return with_marks(_kernel_chart(run.ask.weight), s, *_rug(run))


@cache
def _kernel_chart(kernel: str) -> Panel:
    """The chart of one weight function: the same for every pose, and rendered once."""
    k = 1.0 if kernel == "none" else robust.TUNING[kernel]
    r = np.linspace(0.0, FARTHEST, 161)
    w = robust.weights(kernel, r, k)
    pull = np.where(w * r <= LEAVES + 1e-9, w * r, np.nan)
    panel = chart(
        "weights",
        "The weight function, and the distances of the current pairs beneath it",
        [Series(r, pull, "ink", "pull, w·r / s", dashed=True), Series(r, w, "accent", "weight w")],
        Axis("distance r of the pair / s", 0.0, FARTHEST),
        Axis("Weight, and pull in units of s", -0.6, HIGHEST),
        size=(WIDTH, 0.82 * WIDTH),
    )
    panel = with_marks(panel, Segments([1.0, -0.6], [1.0, HIGHEST], "guide"))
    if kernel == "none":
        return panel
    top = HIGHEST - 0.3  # below the label of s, which the line at Huber's k would cross
    line = Segments([k, -0.6], [k, top], "guide", dashed=True)
    return with_marks(panel, line, Label([k, top], "k", "guide", dx=4, dy=10))


def _rug(run: Run) -> list[Mark]:
    """A stroke for each pair at its distance; pairs beyond the chart are counted at its edge."""
    wrong, used = run.scene.source_outlier, run.used
    x = run.pairing.distances[0] / run.scale
    inside = x <= FARTHEST
    kinds: tuple[tuple[BoolArray, Role, float, float], ...] = (
        (~wrong & used, "source", -0.06, -0.3),
        (wrong & used, "outlier", -0.32, -0.56),
        (~wrong & ~used, "ghost", -0.06, -0.3),
        (wrong & ~used, "ghost", -0.32, -0.56),
    )
    marks: list[Mark] = []
    for rows, role, top, bottom in kinds:
        at = x[rows & inside]
        ends = [np.stack([at, np.full_like(at, y)], axis=1) for y in (top, bottom)]
        marks.append(Segments(ends[0], ends[1], role))
    beyond = int((~inside).sum())
    if beyond:
        marks.append(Label([FARTHEST, HIGHEST], f"{beyond} beyond {FARTHEST:.0f} s", "guide", "end", dx=-2, dy=10))
    return marks


def residual_unit(residual: str) -> str:
    """The unit of the RMS: GICP's is in its covariances' standard deviations, the others' in u."""
    return "σ" if residual == "gicp" else "u"


def covariance_words() -> str:
    """The standard deviations of the surface model that GICP is run with."""
    own = GicpOptions()
    return f"{number(own.tangent**0.5, 1)} u along the surface and {number(own.normal**0.5, 1)} u across it"
