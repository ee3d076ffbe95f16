"""The edges of a pose graph: measured relative poses and their information matrices."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from solvers.core import validate
from solvers.core.arrays import FloatArray, IntArray, restored
from solvers.core.brief import brief
from solvers.core.kinds import of_kind, several
from solvers.core.numbers import array, numbers
from solvers.core.pose import Pose
from solvers.core.poses import concatenated


@dataclass(frozen=True, eq=False)
class Edges:
    """Measured relative poses between the nodes of a graph, in the plane.

    Edge k says that node j has the pose `relative[k]` in the frame of node i. With
    poses that map each node's own coordinates to the map's, it measures `Tᵢ⁻¹ Tⱼ`: what
    registering scan j (source) to scan i (target) yields. The arrays are copied and
    read-only.

    Parameters
    ----------
    i, j : array_like of int, shape (e,)
        The nodes that each edge joins, counted from 0.
    relative : Pose of shape (e,)
        The measured poses of j relative to i; rigid.
    information : array_like of shape (e, 3, 3) or (3, 3)
        Inverse covariances of the errors (x, y, angle), with x and y along the axes of
        the measured node: 1/u², 1/(u rad) and 1/rad². One matrix serves all edges.

    Raises
    ------
    ValueError
        If shapes do not fit, an edge joins a node to itself, or an information matrix
        is not symmetric and positive definite.

    Examples
    --------
    >>> import numpy as np
    >>> from solvers import Pose
    >>> from solvers.posegraph import Edges
    >>> side = Pose.from_angle(np.full(4, np.pi / 2), (1.0, 0.0))
    >>> square = Edges([0, 1, 2, 3], [1, 2, 3, 0], side, np.diag([100.0, 100.0, 400.0]))
    >>> len(square), square.information.shape
    (4, (4, 3, 3))
    >>> len(square[:3])
    3
    """

    i: IntArray
    j: IntArray
    relative: Pose
    information: FloatArray

    __repr__ = brief
    __setstate__ = restored

    if TYPE_CHECKING:

        def __init__(self, i: ArrayLike, j: ArrayLike, relative: Pose, information: ArrayLike) -> None: ...

    def __post_init__(self) -> None:
        ends = [row_numbers(getattr(self, name), name) for name in ("i", "j")]
        count = len(ends[0])
        if len(ends[1]) != count:
            raise ValueError(f"j: expected as many nodes as i has, {count}, got {len(ends[1])}")
        same = np.flatnonzero(ends[0] == ends[1])
        if same.size:
            raise ValueError(f"j: edge {same[0]} joins node {ends[0][same[0]]} to itself")
        relative = rigid(self.relative, "relative")
        if relative.batch != (count,):
            raise ValueError(f"relative: expected poses of shape ({count},), one per edge, got {relative.batch}")
        object.__setattr__(self, "i", ends[0])
        object.__setattr__(self, "j", ends[1])
        object.__setattr__(self, "relative", relative)
        object.__setattr__(self, "information", _positive(self.information, count))

    def __len__(self) -> int:
        return len(self.i)

    def __getitem__(self, rows: Any) -> Edges:
        """The edges at `rows`: a slice, a mask or an array of indices."""
        rows = np.arange(len(self))[rows].reshape(-1)
        return Edges(self.i[rows], self.j[rows], self.relative[rows], self.information[rows])

    @classmethod
    def between(cls, poses: Pose, i: ArrayLike, j: ArrayLike, information: ArrayLike) -> Edges:
        """Edges between given poses, which agree with them exactly.

        Parameters
        ----------
        poses : Pose of shape (n,)
            The nodes.
        i, j : array_like of int, shape (e,)
            The nodes that each edge joins.
        information : array_like of shape (e, 3, 3) or (3, 3)
            As for the class.

        Returns
        -------
        Edges
            The edges, free of error.

        Raises
        ------
        ValueError
            If a node does not exist, or the class rejects an argument.

        Examples
        --------
        >>> import numpy as np
        >>> from solvers import Pose
        >>> from solvers.posegraph import Edges
        >>> poses = Pose.from_angle(np.zeros(3), [[0.0, 0.0], [1.0, 0.0], [1.0, 2.0]])
        >>> Edges.between(poses, [0, 1], [1, 2], np.eye(3)).relative.t
        array([[1., 0.],
               [0., 2.]])
        """
        n = pose_count(poses)
        ends = [row_numbers(values, name) for values, name in ((i, "i"), (j, "j"))]
        for nodes, name in zip(ends, "ij", strict=True):
            within(nodes, n, name)
        if len(ends[0]) != len(ends[1]):
            raise ValueError(f"j: expected as many nodes as i has, {len(ends[0])}, got {len(ends[1])}")
        relative = poses[ends[0]].inverse().compose(poses[ends[1]])
        return cls(ends[0], ends[1], relative, numbers(information, "information"))

    @classmethod
    def joined(cls, parts: Sequence[Edges]) -> Edges:
        """All edges of several sets, in their order.

        Parameters
        ----------
        parts : sequence of Edges
            The sets, at least one.

        Returns
        -------
        Edges
            All edges in one set.

        Raises
        ------
        ValueError
            If `parts` is empty, or one of them is not Edges.

        Examples
        --------
        >>> import numpy as np
        >>> from solvers import Pose
        >>> from solvers.posegraph import Edges
        >>> poses = Pose.from_angle(np.zeros(3), [[0.0, 0.0], [1.0, 0.0], [1.0, 2.0]])
        >>> path, loop = Edges.between(poses, [0, 1], [1, 2], np.eye(3)), Edges.between(poses, [2], [0], np.eye(3))
        >>> Edges.joined([path, loop]).j
        array([1, 2, 0])
        """
        parts = [of_kind(part, Edges, f"parts[{k}]") for k, part in enumerate(several(parts, "parts", "Edges"))]
        if not parts:
            raise ValueError("parts: is empty; at least one set of edges is needed")
        names = ("i", "j", "information")
        i, j, information = (np.concatenate([getattr(part, name) for part in parts]) for name in names)
        return cls(i, j, concatenated([part.relative for part in parts]), information)


def rigid(pose: Pose, name: str) -> Pose:
    """Return `pose` if it is planar with scale 1, else raise a ValueError that names it."""
    pose = validate.pose(of_kind(pose, Pose, name), 2, name, "expected motions of the plane")
    return validate.unscaled(pose, name, "expected rigid motions, of scale 1")


def pose_count(poses: Pose) -> int:
    """The number n of poses; raises ValueError unless they are rigid motions of the plane of shape (n,)."""
    batch = rigid(poses, "poses").batch
    if len(batch) != 1:
        raise ValueError(f"poses: expected shape (n,), got {batch}")
    return batch[0]


def graph(poses: Pose, edges: Edges) -> int:
    """The number n of nodes; raises ValueError if an edge joins a node that has no pose."""
    n = pose_count(poses)
    if not isinstance(edges, Edges):
        raise ValueError(f"edges: expected Edges, got {type(edges).__name__}")
    for nodes, name in ((edges.i, "edges.i"), (edges.j, "edges.j")):
        within(nodes, n, name)
    return n


def within(nodes: IntArray, count: int, name: str, what: str = "node") -> None:
    """Raise ValueError if a node is not one of 0 … count − 1."""
    wrong = np.flatnonzero((nodes < 0) | (nodes >= count))
    if wrong.size:
        k = wrong[0]
        raise ValueError(f"{name}: entry {k} names {what} {nodes[k]}, but the {what}s go from 0 to {count - 1}")


def row_numbers(values: ArrayLike, name: str) -> IntArray:
    """`values` as a read-only int64 copy, (k,), possibly empty; raises ValueError if one is negative."""
    rows = array(values, name)
    if rows.ndim != 1 or (rows.size and rows.dtype.kind not in "iu"):
        raise ValueError(f"{name}: expected integers of shape (k,), got {rows.dtype} of shape {rows.shape}")
    if rows.size and (rows.min() < 0 or rows.max() > np.iinfo(np.int64).max):
        wrong = rows.min() if rows.min() < 0 else rows.max()
        raise ValueError(f"{name}: expected non-negative integers of at most 63 bits, but there is {wrong}")
    rows = rows.astype(np.int64)
    rows.flags.writeable = False
    return rows


def _positive(values: ArrayLike, count: int) -> FloatArray:
    blocks = numbers(values, "information")
    if blocks.shape not in ((3, 3), (count, 3, 3)):
        raise ValueError(f"information: expected shape ({count}, 3, 3) or (3, 3), got {blocks.shape}")
    matrices = np.array(np.broadcast_to(blocks, (count, 3, 3)))
    if not np.isfinite(matrices).all():
        raise ValueError("information: there is a number that is not finite")
    size = np.abs(matrices).max(axis=(1, 2), initial=0.0)
    if (size > validate.LARGEST).any():
        raise ValueError(f"information: beyond {validate.LARGEST:g} squares overflow, but there is {size.max():.3g}")
    skew = np.abs(matrices - matrices.swapaxes(1, 2)).max(axis=(1, 2), initial=0.0)
    for k in np.flatnonzero(skew > 1e-9 * size):
        raise ValueError(f"information: the matrix of edge {k} is not symmetric")
    matrices = 0.5 * (matrices + matrices.swapaxes(1, 2))
    # Scaled to a diagonal of ones: metres and radians may differ by orders of magnitude without the matrix being
    # singular.
    diagonal = np.diagonal(matrices, axis1=1, axis2=2)
    root = np.sqrt(np.where(diagonal > 0.0, diagonal, 1.0))
    least = np.linalg.eigvalsh(matrices / root[:, :, None] / root[:, None, :]).min(axis=1, initial=np.inf)
    for k in np.flatnonzero((diagonal <= 0.0).any(axis=1) | ~(least > 1e-12)):
        # Zero up to rounding: as of a covariance with a free direction, or about an origin thousands of kilometres off.
        singular = diagonal[k].min() >= 0.0 and least[k] > -1e-9
        hint = "; if a direction is free, add a little; if the origin is far away, shift the clouds" if singular else ""
        raise ValueError(f"information: the matrix of edge {k} is not positive definite{hint}")
    matrices.flags.writeable = False
    return matrices
