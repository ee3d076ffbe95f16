"""The normal equations of a graph, assembled from its edges and solved by eliminating nodes.

Eliminating a node joins its neighbours, so the order matters; it is chosen by least degree. Along a chain with few
loops there is hardly any fill-in, and the work grows with the number of nodes, not with its cube. From `SPARSE` nodes
on, scipy's sparse factorisation does the same if scipy is installed.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from solvers.core import validate
from solvers.core.arrays import BoolArray, FloatArray, IntArray

SPARSE = 300
MOST_DENSE = 3000
Solve = Callable[[FloatArray], FloatArray]


@dataclass(frozen=True, eq=False)
class Plan:
    """The unknowns of a graph and the order in which they are eliminated.

    place: (n,) each node's place in the order, −1 for a fixed one. later: for each place, the places that its
    elimination touches, ascending. sparse: whether scipy solves the system.
    """

    place: IntArray
    later: tuple[IntArray, ...]
    sparse: bool

    @property
    def size(self) -> int:
        """The number of nodes that are not fixed."""
        return int(self.place.max(initial=-1)) + 1


def plan(count: int, i: IntArray, j: IntArray, fixed: BoolArray, sparse: bool | None = None) -> Plan:
    """The order in which the free nodes of a graph are eliminated. `sparse=None` uses scipy if the graph is large and
    scipy is installed; True without scipy raises ValueError.
    """
    free = np.flatnonzero(~fixed)
    if sparse is None:
        sparse = free.size >= SPARSE and _has_scipy()
    elif validate.flag(sparse, "sparse") and not _has_scipy():
        raise ValueError("sparse: True takes scipy; install it, or pass sparse=None")
    place = np.full(count, -1, dtype=np.int64)
    if sparse:
        place[free] = np.arange(free.size)
        return Plan(place, (), True)
    if free.size > MOST_DENSE:
        hint = "pass sparse=None" if _has_scipy() else "install it"
        raise ValueError(f"poses: {free.size} free nodes are more than {MOST_DENSE}, which take scipy; {hint}")
    beside: dict[int, set[int]] = {int(k): set() for k in free}
    for a, b in zip(i.tolist(), j.tolist(), strict=True):
        if not fixed[a] and not fixed[b]:
            beside[a].add(b)
            beside[b].add(a)
    neighbours: list[set[int]] = []
    while beside:
        k = min(beside, key=lambda node: (len(beside[node]), node))
        around = beside.pop(k)
        for node in around:
            beside[node] |= around
            beside[node] -= {k, node}
        place[k] = len(neighbours)
        neighbours.append(around)
    later = tuple(np.sort(place[sorted(around)]).astype(np.int64) for around in neighbours)
    return Plan(place, later, False)


def blocks(
    by_i: FloatArray, by_j: FloatArray, weighted: FloatArray, errors: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray, FloatArray]:
    """Each edge's contribution to JᵀΩJ and JᵀΩe: the blocks ii, ij, jj (e, 3, 3) and the gradients by i and by j (e,
    3), for weighted information matrices (e, 3, 3).
    """
    left, right = by_i.swapaxes(1, 2) @ weighted, by_j.swapaxes(1, 2) @ weighted
    column = errors[..., None]
    return left @ by_i, left @ by_j, right @ by_j, (left @ column)[..., 0], (right @ column)[..., 0]


def diagonal(count: int, i: IntArray, j: IntArray, ii: FloatArray, jj: FloatArray) -> FloatArray:
    """The diagonal of the whole matrix, (n, 3)."""
    entries = np.zeros((count, 3))
    np.add.at(entries, i, np.diagonal(ii, axis1=1, axis2=2))
    np.add.at(entries, j, np.diagonal(jj, axis1=1, axis2=2))
    return entries


def factor(
    plan: Plan, i: IntArray, j: IntArray, ii: FloatArray, ij: FloatArray, jj: FloatArray, damping: FloatArray
) -> Solve:
    """A function that solves `(H + diag(damping)) x = b` for b (n, 3, k). Rows of b at fixed nodes are ignored, and x
    is 0 there. damping: (n, 3).

    Raises numpy.linalg.LinAlgError if the matrix is singular.
    """
    if not plan.size:
        return np.zeros_like  # every node is fixed
    at_i, at_j = plan.place[i], plan.place[j]
    free_edges = (at_i >= 0) & (at_j >= 0)
    low, high = np.minimum(at_i, at_j)[free_edges], np.maximum(at_i, at_j)[free_edges]
    # Below the diagonal, row `high` and column `low`: the block ij or its transpose.
    cross = np.where((at_i > at_j)[free_edges][:, None, None], ij[free_edges], ij[free_edges].swapaxes(1, 2))
    own_i, own_j = at_i >= 0, at_j >= 0
    rows = np.concatenate([at_i[own_i], at_j[own_j], high])
    columns = np.concatenate([at_i[own_i], at_j[own_j], low])
    values = np.concatenate([ii[own_i], jj[own_j], cross])
    free = plan.place >= 0
    spread = np.zeros((plan.size, 3))
    spread[plan.place[free]] = damping[free]
    inner = (_sparse if plan.sparse else _eliminated)(plan, rows, columns, values, spread)

    def solve(b: FloatArray) -> FloatArray:
        y = np.zeros((plan.size, *b.shape[1:]))
        y[plan.place[free]] = b[free]
        solution = inner(y.reshape(3 * plan.size, -1)).reshape(y.shape)
        x = np.zeros(b.shape)
        x[free] = solution[plan.place[free]]
        return x

    return solve


def _eliminated(plan: Plan, rows: IntArray, columns: IntArray, values: FloatArray, spread: FloatArray) -> Solve:
    """Solve by a block LDLᵀ factorisation that visits only the blocks filled in this order."""
    m = plan.size
    whole = np.zeros((m, m, 3, 3))
    np.add.at(whole, (rows, columns), values)
    whole[np.arange(m)[:, None], np.arange(m)[:, None], np.arange(3), np.arange(3)] += spread
    H = whole.swapaxes(1, 2).reshape(3 * m, 3 * m)
    fill = [(3 * later[:, None] + np.arange(3)).reshape(-1) for later in plan.later]
    inverses, factors = [], []
    for k, at in enumerate(fill):
        own = slice(3 * k, 3 * k + 3)
        inverse = np.linalg.inv(H[own, own])
        inverses.append(inverse)
        below = H[at, own]
        factors.append(below @ inverse)
        if at.size:
            H[np.ix_(at, at)] -= factors[k] @ below.T

    def solve(b: FloatArray) -> FloatArray:
        x = b.copy()
        for k, at in enumerate(fill):
            x[at] -= factors[k] @ x[3 * k : 3 * k + 3]
        for k in range(m - 1, -1, -1):
            own = slice(3 * k, 3 * k + 3)
            x[own] = inverses[k] @ x[own] - factors[k].T @ x[fill[k]]
        return x

    return solve


def _sparse(plan: Plan, rows: IntArray, columns: IntArray, values: FloatArray, spread: FloatArray) -> Solve:
    from scipy.sparse import csc_matrix, diags  # type: ignore[import-untyped]
    from scipy.sparse.linalg import splu  # type: ignore[import-untyped]

    inside = np.arange(3)
    r = np.broadcast_to((3 * rows)[:, None, None] + inside[:, None], values.shape)
    c = np.broadcast_to((3 * columns)[:, None, None] + inside, values.shape)
    off = rows != columns
    entries = np.concatenate([values.ravel(), values[off].ravel()])
    at = (np.concatenate([r.ravel(), c[off].ravel()]), np.concatenate([c.ravel(), r[off].ravel()]))
    H = csc_matrix((entries, at), shape=(3 * plan.size, 3 * plan.size)) + diags(spread.ravel(), format="csc")
    try:
        factors = splu(H, permc_spec="MMD_AT_PLUS_A", options={"SymmetricMode": True}, diag_pivot_thresh=0.0)
    except RuntimeError as singular:
        raise np.linalg.LinAlgError(str(singular)) from None

    def solve(b: FloatArray) -> FloatArray:
        x: FloatArray = factors.solve(b)
        return x

    return solve


def _has_scipy() -> bool:
    try:
        import scipy.sparse.linalg  # type: ignore[import-untyped]  # noqa: F401
    except ImportError:
        return False
    return True
