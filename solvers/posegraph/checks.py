"""Checks of the arguments of pose graphs, which raise a ValueError that names the argument."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from solvers.core.arrays import BoolArray
from solvers.core.edges import Edges, graph, within
from solvers.core.numbers import array
from solvers.core.pose import Pose


def held(poses: Pose, edges: Edges, nodes: int | Sequence[int]) -> BoolArray:
    """Which nodes of a graph are fixed, (n,); a ValueError if its edges do not join every node to one of them."""
    n = graph(poses, edges)
    if not n:
        raise ValueError("poses: is empty; at least one node is needed")
    mask = fixed(nodes, n)
    joined(edges, mask)
    return mask


def fixed(nodes: int | Sequence[int], count: int) -> BoolArray:
    """Which of `count` nodes are fixed, (n,)."""
    rows = np.atleast_1d(array(nodes, "fixed"))
    if rows.size == 0:
        raise ValueError("fixed: is empty; poses relative to each other leave the whole graph free to move")
    if rows.ndim != 1 or rows.dtype.kind not in "iu":
        raise ValueError(f"fixed: expected a node or a sequence of nodes, got {nodes!r}")
    within(rows.astype(np.int64), count, "fixed")
    mask = np.zeros(count, dtype=np.bool_)
    mask[rows] = True
    return mask


def joined(edges: Edges, fixed: BoolArray) -> None:
    """Raise ValueError if the edges do not join every node to a fixed one."""
    neighbours: list[list[int]] = [[] for _ in range(fixed.size)]
    for a, b in zip(edges.i.tolist(), edges.j.tolist(), strict=True):
        neighbours[a].append(b)
        neighbours[b].append(a)
    queue = np.flatnonzero(fixed).tolist()
    reached = set(queue)
    while queue:
        for node in neighbours[queue.pop()]:
            if node not in reached:
                reached.add(node)
                queue.append(node)
    rest = fixed.size - len(reached)
    if rest:
        first = min(set(range(fixed.size)) - reached)
        count = "1 node is" if rest == 1 else f"{rest} nodes are"
        raise ValueError(f"edges: {count} joined to no fixed node, the first of them {first}")


def mask(values: ArrayLike | None, count: int, name: str, what: str = "an edge") -> BoolArray:
    """`values` as a mask of `count` edges or loops, (count,); None selects all."""
    if values is None:
        return np.ones(count, dtype=np.bool_)
    flags = array(values, name)
    if flags.shape != (count,) or (count and flags.dtype != np.bool_):  # an empty list becomes an array of floats
        raise ValueError(f"{name}: expected one bool {what}, shape ({count},), got {flags.dtype} of {flags.shape}")
    return flags.astype(np.bool_)
