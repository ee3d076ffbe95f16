"""The walkthrough's second panel: one step of a FilterReg-inspired method in four stages."""

from __future__ import annotations

import numpy as np

from solvers.methods.soft.filterreg import STAGES as STAGES
from solvers.numerics.kernel_filters import Sparse
from widgets.drawing.picture import Array, Heat, Mark, Points, Segments, degrees, number
from widgets.figures.four.run import VIEW, Look, Shown, carried, cloud, fixed

NAME = "FilterReg-inspired"
DRAWN = slice(None, None, 3)  # the queries, with their targets, that are drawn
CELL = 0.12  # u: finer lattices are drawn in cells of at least this size, each with its largest value


def shown(look: Look) -> Shown:
    """The marks and the words of the current stage."""
    return (_density, _filter, _query, _twist, _pause)[look.walk.stage - 1](look)


def kept(look: Look) -> str:
    """How many moments the current filter holds: four per vertex."""
    return f"{4 * len(_grid(look).codes):,}"


def _grid(look: Look) -> Sparse:
    state = look.before if look.walk.stage < 4 else look.after
    grid: Sparse = state.filters[0]
    return grid


def _density(look: Look) -> Shown:
    grid = _grid(look)
    heat = _heat(grid, grid.places(grid.splat_codes), grid.splat[:, 0])
    marks = (heat, *fixed(look.walk.scene), cloud(look.moved))
    words = (
        f"1, y and ‖y‖² of {len(look.walk.scene.target)} fixed points on {len(grid.splat_codes):,}"
        f" vertices {number(grid.side)} u apart."
    )
    return Shown(marks, words)


def _filter(look: Look) -> Shown:
    grid = _grid(look)
    heat = _heat(grid, grid.places(grid.codes), grid.values[:, 0])
    words = f"Blurred to σ = {number(grid.sigma)} u: {len(grid.codes):,} vertices, four moments each."
    return Shown((heat, cloud(look.moved)), words)


def _query(look: Look) -> Shown:
    scene, state, moved = look.walk.scene, look.before, look.moved
    weight, to = state.weights[0], state.targets[0]
    marks = (
        *fixed(scene),
        Segments(moved[DRAWN], to[DRAWN], "accent", weight=weight[DRAWN]),
        Points(to[DRAWN], "accent", "diamond", radius=3.5, weight=weight[DRAWN]),
        cloud(moved),
        Points(moved, "outlier", "cross", radius=4.0, weight=1.0 - weight),
    )
    pull = float(np.sqrt((weight * np.square(to - moved).sum(axis=1)).sum() / max(float(weight.sum()), 1e-300)))
    words = f"Mean confidence {number(float(weight.mean()))}; targets pull over {number(pull)} u, weighted RMS."
    return Shown(marks, words)


def _twist(look: Look) -> Shown:
    x, y, turn = look.after.twist[0].tolist()
    words = (
        f"Twist: ({number(x)}, {number(y)}) u and {degrees(turn, 1)}°; then"
        f" σ = {number(float(look.after.sigma[0]), 3)} u."
    )
    return Shown(_motion_marks(look), words)


def _pause(look: Look) -> Shown:
    return Shown(_motion_marks(look), "Held: this stage is CPD’s, for its variance; here it came with the twist.")


def _motion_marks(look: Look) -> tuple[Mark, ...]:
    rows = slice(None, None, 6)
    before, after = look.moved[rows], look.went.apply(look.walk.scene.source)[rows]
    return (*carried(look), Segments(before, after, "accent", weight=np.full(len(after), 0.7)))


def _heat(grid: Sparse, places: Array, values: Array) -> Heat:
    """A lattice's values in square cells around its vertices, or in coarser cells, each with its largest value."""
    side = grid.side * max(1.0, np.ceil(CELL / grid.side))
    first = np.floor((np.array([VIEW.x0, VIEW.y0]) - grid.centre) / side + 0.5).astype(int)
    last = np.floor((np.array([VIEW.x1, VIEW.y1]) - grid.centre) / side + 0.5).astype(int)
    at = np.floor((places - grid.centre) / side + 0.5 + 1e-9).astype(int)
    inside = ((at >= first) & (at <= last)).all(axis=1)
    across, up = (last - first + 1).tolist()
    field = np.full((up, across), -1.0)
    np.maximum.at(field, (at[inside, 1] - first[1], at[inside, 0] - first[0]), values[inside])
    top = float(values.max())
    field[field < 0.02 * top] = np.nan
    x0, y0 = (grid.centre + (first - 0.5) * side).tolist()
    x1, y1 = (grid.centre + (last + 0.5) * side).tolist()
    return Heat(field, (x0, x1, y0, y1), 0.0, top)
