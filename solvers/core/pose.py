"""Poses: `T(p) = s R p + t`, one or a batch of them, in the plane or in space."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, DTypeLike

from solvers.core.arrays import FloatArray, leading, restored
from solvers.core.kinds import of_kind
from solvers.core.numbers import finite, moderate, numbers
from solvers.core.proper import apart, check, fits, identities, of_one_batch, rotation
from solvers.core.rotations import angle, planar, rotvec, spatial


@dataclass(frozen=True, eq=False)
class Pose:
    """A rigid motion or similarity `T(p) = s R p + t`.

    It maps source to target coordinates. The leading axes of R, t and scale are broadcast
    to one batch shape. The arrays are copied and read-only.

    Parameters
    ----------
    R : array_like of shape (..., d, d)
        Rotations: orthogonal matrices with det R = +1. Rounding to six digits or to float32 is corrected.
    t : array_like of shape (..., d)
        Translations, in world units.
    scale : array_like of shape (...), default 1.0
        Scales s, positive, 1 for a rigid motion.

    Raises
    ------
    ValueError
        If the shapes do not match, a number is not finite, R is not a rotation, or a scale is not positive.

    Examples
    --------
    >>> import numpy as np
    >>> from solvers import Pose
    >>> pose = Pose.from_angle(np.radians(90.0), (2.0, 0.0))
    >>> pose
    Pose(angle=90°, t=(2, 0), scale=1)
    >>> pose.apply([[1.0, 0.0]]).round(6)
    array([[2., 1.]])
    >>> np.degrees(pose.inverse().angle).round(6)
    np.float64(-90.0)

    `a @ b` is `a.compose(b)`, `pose(points)` is `pose.apply(points)`, and `np.asarray(pose)` is `pose.matrix`:

    >>> pose.compose(pose).matrix.round(6)
    array([[-1., -0.,  2.],
           [ 0., -1.,  2.],
           [ 0.,  0.,  1.]])

    Two poses are equal if all their numbers are. A batch has a length and is iterated along its first axis:

    >>> [p == pose for p in Pose.from_angle(np.radians([90.0, 80.0]), (2.0, 0.0))]
    [True, False]
    >>> Pose.identity(3, batch=(5,)).batch, Pose.trusted(np.eye(3), np.zeros(3)).dim
    ((5,), 3)
    >>> Pose.from_rotvec([0.0, 0.0, 0.5]).rotvec.round(6)
    array([0. , 0. , 0.5])
    """

    R: FloatArray
    t: FloatArray
    scale: FloatArray | float = 1.0

    __array_ufunc__ = None  # `array @ pose` is refused, too
    __setstate__ = restored

    if TYPE_CHECKING:

        def __init__(self, R: ArrayLike, t: ArrayLike, scale: ArrayLike = 1.0) -> None: ...

    def __post_init__(self) -> None:
        self._fill(*(numbers(getattr(self, name), name) for name in ("R", "t", "scale")))
        check(self.t, np.asarray(self.scale))
        object.__setattr__(self, "R", rotation(self.R))

    @classmethod
    def trusted(cls, R: ArrayLike, t: ArrayLike, scale: ArrayLike = 1.0) -> Pose:
        """The pose of parts taken as they are: shapes are broadcast, values not checked.

        For the results of computations: `fit_rigid(..., proper=False)` may return a
        reflection, and a step that overflows may return NaN.

        Parameters
        ----------
        R, t, scale : array_like of shapes (..., d, d), (..., d) and (...)
            Rotations, translations in world units, and scales.

        Returns
        -------
        Pose
            The poses, of the batch shape that the three broadcast to.

        Raises
        ------
        ValueError
            If the shapes do not fit together.
        """
        pose = object.__new__(cls)
        pose._fill(R, t, scale)
        return pose

    def _fill(self, R: ArrayLike, t: ArrayLike, scale: ArrayLike) -> None:
        """Broadcast the three to one batch shape, as read-only copies."""
        self.__dict__["R"], self.__dict__["t"], self.__dict__["scale"] = of_one_batch(R, t, scale)

    @classmethod
    def identity(cls, d: int = 2, batch: tuple[int, ...] = ()) -> Pose:
        """The pose that moves nothing.

        Parameters
        ----------
        d : int, default 2
            The dimension of the points.
        batch : tuple of int, default ()
            The leading axes over which it is repeated.

        Returns
        -------
        Pose
            Identities of shape `batch`.
        """
        return cls.trusted(identities(d, batch), np.zeros(d))

    @classmethod
    def from_angle(cls, theta: ArrayLike, t: ArrayLike = (0.0, 0.0), scale: ArrayLike = 1.0) -> Pose:
        """The planar pose that rotates about the origin, then translates.

        Parameters
        ----------
        theta : array_like of shape (...)
            The angle in radians, anticlockwise.
        t : array_like of shape (..., 2), default (0.0, 0.0)
            The translation, in world units.
        scale : array_like of shape (...), default 1.0
            The scale.

        Returns
        -------
        Pose
            The poses, of the batch shape that the three broadcast to.

        Raises
        ------
        ValueError
            If the shapes do not fit together, a number is not finite, or a scale is not positive.
        """
        return cls._from_rotation(planar(finite(numbers(theta, "theta"), "theta")), t, scale)

    @classmethod
    def from_rotvec(cls, rotvec: ArrayLike, t: ArrayLike = (0.0, 0.0, 0.0), scale: ArrayLike = 1.0) -> Pose:
        """The 3-D pose that rotates about an axis through the origin, then translates.

        Parameters
        ----------
        rotvec : array_like of shape (..., 3)
            The axis times the angle in radians, right-handed.
        t : array_like of shape (..., 3), default (0.0, 0.0, 0.0)
            The translation, in world units.
        scale : array_like of shape (...), default 1.0
            The scale.

        Returns
        -------
        Pose
            The poses, of the batch shape that the three broadcast to.

        Raises
        ------
        ValueError
            If the shapes do not fit together, a number is not finite or beyond 1e150, or a scale is not positive.

        Notes
        -----
        Rodrigues' formula, `R = I + sin θ [u]× + (1 − cos θ) [u]×²`, with coefficients accurate even at θ = 0.

        Examples
        --------
        >>> import numpy as np
        >>> from solvers import Pose
        >>> quarter = Pose.from_rotvec([0.0, 0.0, np.pi / 2])
        >>> quarter([[1.0, 0.0, 5.0]]).round(6)
        array([[0., 1., 5.]])
        """
        v = moderate(numbers(rotvec, "rotvec"), "rotvec")
        if v.ndim < 1 or v.shape[-1] != 3:
            raise ValueError(f"rotvec: expected shape (..., 3), got {v.shape}")
        return cls._from_rotation(spatial(v), t, scale)

    @classmethod
    def _from_rotation(cls, R: FloatArray, t: ArrayLike, scale: ArrayLike) -> Pose:
        """The pose of rotations computed here, with the caller's `t` and `scale`, which are checked."""
        pose = cls.trusted(R, numbers(t, "t"), numbers(scale, "scale"))
        check(pose.t, np.asarray(pose.scale))
        return pose

    @classmethod
    def from_matrix(cls, matrix: ArrayLike) -> Pose:
        """The pose given by homogeneous matrices.

        Parameters
        ----------
        matrix : array_like of shape (..., d + 1, d + 1)
            Matrices [[s R, t], [0, 1]].

        Returns
        -------
        Pose
            The poses, of shape (...).

        Raises
        ------
        ValueError
            If a matrix is not a rigid motion or similarity; the message names what is wrong with it.

        Examples
        --------
        >>> import numpy as np
        >>> from solvers import Pose
        >>> pose = Pose.from_angle(0.5, (1.0, 2.0), scale=3.0)
        >>> Pose.from_matrix(pose.matrix)
        Pose(angle=28.6479°, t=(1, 2), scale=3)
        """
        return cls.trusted(*apart(matrix))

    @property
    def dim(self) -> int:
        """d, the dimension of the points it moves."""
        return int(self.R.shape[-1])

    @property
    def batch(self) -> tuple[int, ...]:
        """The leading axes: () for a single pose."""
        return self.R.shape[:-2]

    @property
    def angle(self) -> FloatArray:
        """The rotation angle in radians, shape (...).

        Signed, in [−π, π], in the plane; in [0, π] in space. Both come from atan2, accurate at 0 and at π alike.

        Raises
        ------
        ValueError
            In other dimensions, where a rotation has more than one angle.
        """
        return angle(self.R)

    @property
    def rotvec(self) -> FloatArray:
        """The axis times the angle in radians, shape (..., 3), no longer than π.

        Raises
        ------
        ValueError
            In dimensions other than 3.
        """
        return rotvec(self.R)

    @property
    def matrix(self) -> FloatArray:
        """The homogeneous matrices [[s R, t], [0, 1]], shape (..., d + 1, d + 1)."""
        d = self.dim
        M = np.zeros((*self.batch, d + 1, d + 1))
        M[..., :d, :d] = np.asarray(self.scale)[..., None, None] * self.R
        M[..., :d, d] = self.t
        M[..., d, d] = 1.0
        return M

    def apply(self, points: ArrayLike) -> FloatArray:
        """Move points: `s R p + t`.

        Parameters
        ----------
        points : array_like of shape (..., n, d)
            The points; their leading axes broadcast against the pose's.

        Returns
        -------
        ndarray of shape (..., n, d)
            The moved points.

        Raises
        ------
        ValueError
            If the points are not rows of d numbers, or the leading axes do not broadcast.
        """
        p = numbers(points, "points")
        if p.ndim < 2 or p.shape[-1] != self.dim:
            raise ValueError(f"points: expected shape (..., n, {self.dim}), got {p.shape}")
        fits(p.shape[:-2], self.batch, "points")
        moved: FloatArray = p @ (np.asarray(self.scale)[..., None, None] * self.R).swapaxes(-1, -2)
        for k in range(self.dim):  # one broadcast addition would run numpy's inner loop over d numbers only
            moved[..., k] += self.t[..., k, None]
        return moved

    def compose(self, first: Pose) -> Pose:
        """The pose `self ∘ first`: apply `first`, then this one.

        Parameters
        ----------
        first : Pose
            Of the same dimension, with leading axes that broadcast against this one's.

        Returns
        -------
        Pose
            The composition.

        Raises
        ------
        ValueError
            If `first` is not a Pose, or the two do not fit together.
        """
        of_kind(first, Pose, "first")
        if first.dim != self.dim:
            raise ValueError(f"first: moves points in {first.dim} dimensions, this pose in {self.dim}")
        fits(first.batch, self.batch, "first")
        s = np.asarray(self.scale)
        rotated = (self.R @ first.t[..., None])[..., 0]
        return Pose.trusted(self.R @ first.R, s[..., None] * rotated + self.t, s * first.scale)

    def inverse(self) -> Pose:
        """The pose that undoes this one: `T⁻¹(q) = Rᵀ (q − t) / s`.

        Returns
        -------
        Pose
            The inverse.

        Raises
        ------
        ValueError
            If a scale is zero.
        """
        s = np.asarray(self.scale)
        if np.any(s == 0.0):
            raise ValueError("scale: a pose with scale 0 has no inverse")
        Rt = self.R.swapaxes(-1, -2)
        return Pose.trusted(Rt, -(Rt @ self.t[..., None])[..., 0] / s[..., None], 1.0 / s)

    def __matmul__(self, first: object) -> Pose:
        """`self ∘ first`, as `compose`. Only a pose is accepted: three points could pass for the rows of a matrix."""
        if not isinstance(first, Pose):
            raise TypeError("@: joins two poses; pose(points) moves points, pose.matrix is the matrix")
        return self.compose(first)

    def __call__(self, points: ArrayLike) -> FloatArray:
        """Move points, as `apply`."""
        return self.apply(points)

    def __array__(self, dtype: DTypeLike | None = None, copy: bool | None = None) -> FloatArray:
        """The homogeneous matrices, as a new array."""
        if copy is False:
            raise ValueError("copy: a pose's matrix is made when it is asked for, which takes a copy")
        return self.matrix if dtype is None else self.matrix.astype(dtype)

    def __getitem__(self, rows: Any) -> Pose:
        """The poses at `rows` of the batch: any numpy index of the leading axes."""
        if not self.batch:
            raise TypeError("a single pose has no rows")
        rows = leading(rows, self.batch)
        return Pose.trusted(self.R[rows], self.t[rows], np.asarray(self.scale)[rows])

    def __iter__(self) -> Iterator[Pose]:
        """The poses along a batch's first axis."""
        return map(self[:].__getitem__, range(self.batch[0]))

    def __len__(self) -> int:
        """The size of a batch's first axis."""
        return len(self[:].t)

    def __bool__(self) -> bool:
        return True  # otherwise Python would call __len__, which raises for a single pose

    def __eq__(self, other: object) -> bool:
        """Whether both are poses of one shape with equal numbers, none NaN; for closeness see `solvers.metrics`."""
        if not isinstance(other, Pose):
            return NotImplemented
        return all(np.array_equal(getattr(self, part), getattr(other, part)) for part in ("R", "t", "scale"))

    def __hash__(self) -> int:
        # Adding 0.0 turns −0 into 0: they are equal, but their bytes differ.
        return hash((self.R.shape, *((np.asarray(part) + 0.0).tobytes() for part in (self.R, self.t, self.scale))))

    def __repr__(self) -> str:
        if self.batch:
            return f"Pose(batch={self.batch}, dim={self.dim})"
        t = ", ".join(f"{x:.6g}" for x in self.t)
        turn = f"angle={np.degrees(self.angle):.6g}°, " if self.dim in (2, 3) else ""
        return f"Pose({turn}t=({t}), scale={float(self.scale):.6g})"
