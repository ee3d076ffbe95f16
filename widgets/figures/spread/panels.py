"""The figure's drawings: the place from above with all ends, and the ends close to the true position."""

from __future__ import annotations

import numpy as np

from solvers import Pose
from solvers.core.arrays import BoolArray
from solvers.studies.redrawn import NO_ECHO, STANDS
from solvers.uncertainty import quantile
from widgets.drawing.picture import Array, Ellipses, Label, Mark, Panel, Path, Points, Role, Segments, View, number
from widgets.figures.spread.runs import FAR_OUT, STRAY, Ask, closed_forms, ends, scans_and_starts, true_mode
from widgets.parts.field import within
from widgets.parts.robot import disc

PLAN = View(-6.4, 6.4, -2.75, 2.75, width=480.0)
WINDOW = (-1.0, 1.0, -0.43, 0.43)
CLOSE = View(*WINDOW, width=480.0)
FINE = 0.01  # u: half the close view's width is the multiple of it that the closed forms' ellipses need
NEEDLE = np.array([2.1, 0.14])  # u: half sizes for a needle, which is drawn shorter so that it fits, but still flat
SPARE = np.array([1.6, 1.3 / CLOSE.y1])  # factors on those ellipses, across and upwards: the dots reach farther
BARS = (0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5)  # u
SEEN = 4.2  # u: end walls farther out are beyond the reach of one scan or both
GLYPH, NOSE = disc(0.42, 0.25), 0.34  # u


def plan(ask: Ask, drawn: int) -> Panel:
    """The place from above: its walls, the target scan, both robots, and where the draws so far end."""
    scans, _ = scans_and_starts(ask, 1)
    first, stand = (STANDS[ask.place][k] for k in (0, 1))
    echoes = scans.target[0][np.abs(scans.target[0]).max(axis=1) < NO_ECHO]
    marks: list[Mark] = [Path(wall, "ink") for wall in scans.walls]
    marks += [Points(stand.apply(echoes), "target", "square", radius=2.0), *_robot(stand, "target")]
    marks += _robot(first, "truth")
    if drawn:
        spread, _ = ends(ask, drawn)
        away = spread.mode != true_mode(spread, scans.truth)
        kinds: tuple[tuple[Role, BoolArray], ...] = (("outlier", away), ("source", ~away))
        for kind, mask in kinds:
            if mask.any():
                poses = spread.poses[mask]
                at, ahead = _places(poses, stand), (stand.R @ poses.R)[..., 0]
                marks += [Segments(at, at + NOSE * ahead, kind), Points(at, kind, radius=3.5)]
        if (spread.shares > STRAY).sum() > 1:
            at = _places(spread.poses, stand)
            marks.append(Ellipses(at.mean(axis=0), np.cov(at.T), "ghost", sigmas=quantile(0.95, 2) ** 0.5, dashed=True))
    marks.append(Points(first.t, "truth", "cross", radius=5.0))
    return Panel("plan", "The place from above, with all ends", PLAN, tuple(marks), caption="The place, from above")


def close_up(ask: Ask, drawn: int) -> Panel:
    """A window around the true position as large as the closed forms' ellipses need; needles are drawn shorter."""
    true, stand = (STANDS[ask.place][k] for k in (0, 1))
    ellipses = [stand.apply(covariance.ellipse(reach=FAR_OUT)) for covariance in closed_forms(ask)]
    needle, reach = ask.end > SEEN, np.abs(np.concatenate(ellipses) - true.t).max(axis=0)
    half = NEEDLE if needle else np.full(2, FINE * np.ceil(SPARE * reach / FINE).max())

    def near(places: Array) -> Array:
        return np.asarray((places - true.t) / half)

    marks: list[Mark] = []
    if drawn:
        spread, _ = ends(ask, drawn)
        mode = true_mode(spread, stand.inverse().compose(true))
        at = near(_places(spread.poses[spread.mode == mode], stand))
        marks.append(Points(at[np.abs(at).max(axis=1) < 1.0], "source", radius=2.5))
        if np.count_nonzero(spread.mode == mode) > 2:
            marks.append(Path(near(stand.apply(spread.modes[mode].ellipse())), "source"))
    hessian, censi = map(near, ellipses)
    marks += [Path(censi, "inlier", dashed=True), Path(hessian, "accent")]
    times = [number(PLAN.x1 / size, 0) for size in half]
    caption = f"About the truth, enlarged {times[1]} times" + (f" up and {times[0]} across" if needle else "")
    if not within(hessian, WINDOW) + within(censi, WINDOW):
        caption = "About the truth: the expected regions lie outside"
    marks += [Points([(0.0, 0.0)], "truth", "cross", radius=6.0), *_scale_bars(half)]
    return Panel("close", "The ends about the true position", CLOSE, tuple(marks), grid=False, caption=caption)


def _scale_bars(half: Array) -> list[Mark]:
    """One across and one upwards, as long as their labels say. half: of the window, across and upwards, u."""
    corner = np.array([-0.94, -0.36])
    lengths = [max(bar for bar in BARS if bar <= 0.4 * size) for size in half.tolist()]
    tips = corner + np.diag(lengths / half)
    return [
        Segments(np.tile(corner, (2, 1)), tips, "guide"),
        Label(tips[0], f"{lengths[0]:g} u", "guide", dx=6, dy=4),
        Label(tips[1], f"{lengths[1]:g} u", "guide", dx=6, dy=6),
    ]


def _places(pose: Pose, stand: Pose) -> Array:
    """The scanner's places at the source scans, in room coordinates, (n, 2)."""
    return np.asarray(stand.apply(pose.t.reshape(-1, 2)))


def _robot(pose: Pose, role: Role) -> tuple[Mark, ...]:
    return (Path(pose.apply(GLYPH), role, closed=True, filled=True),)
