"""A pose with its spread: the matrix, the frame in which it acts, its regions and its directions."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import sqrt
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from solvers.core import validate
from solvers.core.arrays import BoolArray, FloatArray, leading
from solvers.core.brief import brief
from solvers.core.pose import Pose
from solvers.uncertainty import se2
from solvers.uncertainty.chi_square import quantile
from solvers.uncertainty.words import said

FRAMES = ("target", "source")
_EPS = float(np.finfo(np.float64).eps)


@dataclass(frozen=True, eq=False)
class Covariance:
    """How far, and in which directions, poses spread about a mean.

    The true pose is modelled as `exp(ξ) ∘ mean` in the frame "target" (the small motion happens in target coordinates,
    after the pose) and `mean ∘ exp(ξ)` in the frame "source", with ξ normal, of mean zero. The spread is stored as
    eigen-directions of the twist about the cloud's centre with its angle multiplied by the cloud's RMS radius: then all
    components are lengths, and their order depends neither on units nor on the origin. If the data do not determine a
    direction, its deviation is infinite.

    Attributes
    ----------
    mean : Pose
        Rigid motions of the plane, of shape (...).
    deviations : ndarray of shape (..., 3)
        Standard deviations along the directions, largest first, world units; infinite where a direction is free.
    directions : ndarray of shape (..., 3, 3)
        Unit vectors (radius · angle, x, y) of the motions, one per column.
    centre : ndarray of shape (..., 2)
        The centre of the motions' turns, in the frame's coordinates.
    radius : ndarray of shape (...)
        RMS radius of the cloud, world units.
    frame : str
        "target" or "source".
    made_by : str
        "hessian", "censi", "sampled", "starts", or "given" as a matrix.

    Examples
    --------
    >>> import numpy as np
    >>> from solvers import Pose
    >>> from solvers.uncertainty import from_matrix
    >>> spread = from_matrix(np.diag([0.01, 0.04, 0.01]) ** 2, Pose.identity(), radius=3.0)
    >>> spread.deviations.round(3)
    array([0.04, 0.03, 0.01])
    >>> spread.covers(Pose.from_angle(0.02)), spread.covers(Pose.from_angle(0.04))
    (np.True_, np.False_)
    >>> spread.matrix.diagonal().round(6), spread.information.diagonal().round(3), spread.free.any()
    (array([0.0001, 0.0016, 0.0001]), array([10000.,   625., 10000.]), np.False_)
    >>> far = spread.to("source").poses([[0.08, 0.0, 0.0]])  # two deviations along the widest direction
    >>> spread.distance(far).round(6), np.abs(spread.along(far)).round(6)
    (array([4.]), array([[0.08, 0.  , 0.  ]]))
    >>> spread.point_covariance((3.0, 0.0)).diagonal().round(6), "σ = 0.04 u" in spread.words()
    (array([0.0016, 0.001 ]), True)
    >>> turning = from_matrix(np.diag([0.5, 0.0, 0.0]) ** 2, Pose.from_angle(0.0, (2.0, 0.0)))
    >>> np.linalg.norm(np.concatenate([turning.sample(200).t, turning.ellipse()]), axis=1).round(9).max()  # a circle
    np.float64(2.0)
    """

    mean: Pose
    deviations: FloatArray
    directions: FloatArray
    centre: FloatArray
    radius: FloatArray
    frame: str
    made_by: str

    __repr__ = brief

    def __post_init__(self) -> None:
        validate.one_of(self.frame, FRAMES, "frame")

    @property
    def free(self) -> BoolArray:
        """Which directions are free, (..., 3)."""
        return np.isinf(self.deviations)

    @property
    def matrix(self) -> FloatArray:
        """The covariance (..., 3, 3) over (angle, x, y), about the frame's origin; a filter's is `state_covariance`.

        rad², rad·u and u². Free directions are left out, as if they had no spread: no finite matrix can hold them.
        """
        finite = np.where(self.free, 0.0, self.deviations)
        half = self._basis() * finite[..., None, :]
        return half @ half.swapaxes(-1, -2)

    @property
    def information(self) -> FloatArray:
        """The information matrix (..., 3, 3) over (angle, x, y), about the frame's origin.

        The inverse of the covariance, zero along free directions. For pose graphs use `edge_information`.

        Raises
        ------
        ValueError
            If a deviation is zero: certainty has no finite information.
        """
        if np.any(self.deviations == 0.0):
            raise ValueError("information: a deviation is zero, so it would be infinite")
        out = self._towards()
        half = out.swapaxes(-1, -2) @ (self.directions / self.deviations[..., None, :])
        return half @ half.swapaxes(-1, -2)

    def edge_information(self) -> FloatArray:
        """The information of edges that measure these poses, in the form of `solvers.posegraph.Edges`.

        `information` in the frame "source", over (x, y, angle): the source is the measured node j, the target i.

        Returns
        -------
        ndarray of shape (..., 3, 3)
            1/u², 1/(u rad) and 1/rad². `Edges` rejects it if a direction is free.

        Raises
        ------
        ValueError
            If a deviation is zero: certainty has no finite information.

        Examples
        --------
        >>> import numpy as np
        >>> from solvers import Pose
        >>> from solvers.uncertainty import from_matrix
        >>> spread = from_matrix(np.diag([0.05, 0.1, 0.2]) ** 2, Pose.from_angle(np.pi / 2))
        >>> spread.edge_information().diagonal().round(6)  # y of the target is x of the source
        array([ 25., 100., 400.])
        """
        return self.to("source").information[..., [1, 2, 0], :][..., [1, 2, 0]]

    def to(self, frame: str) -> Covariance:
        """The same spread with its small motion on the other side of the pose: `Ad(T) Σ Ad(T)ᵀ` from source to target.

        Parameters
        ----------
        frame : str
            "target" or "source".

        Returns
        -------
        Covariance
            In that frame.

        Raises
        ------
        ValueError
            If there is no such frame.
        """
        if validate.one_of(frame, FRAMES, "frame") == self.frame:
            return self
        pose = self.mean if frame == "target" else self.mean.inverse()
        turn = np.zeros((*pose.batch, 3, 3))
        turn[..., 0, 0], turn[..., 1:, 1:] = 1.0, pose.R
        centre = pose.apply(self.centre[..., None, :])[..., 0, :]
        return replace(self, directions=turn @ self.directions, centre=centre, frame=frame)

    def distance(self, pose: Pose) -> FloatArray:
        """The squared Mahalanobis distance of poses from the mean.

        Free directions do not count; a motion along a direction without spread is infinitely far.

        Parameters
        ----------
        pose : Pose
            Of a shape that broadcasts against the mean's.

        Returns
        -------
        ndarray of shape (...)
            Dimensionless; χ² distributed if the model is right, with one degree of freedom per determined direction.
        """
        along = np.abs(self.along(pose))
        size = np.abs(self.centre).sum(axis=-1) + np.abs(self.mean.t).sum(axis=-1) + self.radius
        # Along a direction without spread, a distance of zero up to rounding counts as zero.
        rest = (self.deviations == 0.0) & (along <= 64.0 * _EPS * np.asarray(size)[..., None])
        with np.errstate(divide="ignore", invalid="ignore"):
            ratio = np.where(rest, 0.0, along / self.deviations)
        square: FloatArray = np.square(ratio).sum(axis=-1)
        return square[()]

    def along(self, pose: Pose) -> FloatArray:
        """How far poses lie from the mean along each direction.

        Parameters
        ----------
        pose : Pose
            Of a shape that broadcasts against the mean's.

        Returns
        -------
        ndarray of shape (..., 3)
            World units.
        """
        back = self.mean.inverse()
        rigid = se2.rigid(pose)
        validate.batch_shape(pose=rigid.batch, mean=back.batch)
        apart = rigid.compose(back) if self.frame == "target" else back.compose(rigid)
        shift = Pose.trusted(np.eye(2), self.centre)
        twist = se2.log(shift.inverse().compose(apart).compose(shift))
        scaled = twist * self._scale()
        along: FloatArray = (scaled[..., None, :] @ self.directions)[..., 0, :]
        return along

    def covers(self, pose: Pose, level: float = 0.95) -> BoolArray:
        """Whether poses lie in the region that should hold the truth with a given probability.

        Parameters
        ----------
        pose : Pose
            Of a shape that broadcasts against the mean's.
        level : float, default 0.95
            The probability.

        Returns
        -------
        ndarray of bool, shape (...)
            True where they do; always true if all directions are free.

        Raises
        ------
        ValueError
            If the level is not a probability.
        """
        limits = np.array([np.inf, *(quantile(level, k) for k in (1, 2, 3))])
        within: BoolArray = self.distance(pose) <= limits[3 - self.free.sum(axis=-1)]
        return within

    def point_covariance(self, point: ArrayLike = (0.0, 0.0), reach: float | None = None) -> FloatArray:
        """The covariance (..., 2, 2) of a moved source point's position, in u².

        Parameters
        ----------
        point : array_like of shape (2,), default (0.0, 0.0)
            In source coordinates; the origin is the scanner's position.
        reach : float, optional
            The deviation to assume for a free direction, world units.

        Returns
        -------
        ndarray of shape (..., 2, 2)
            In target coordinates.

        Raises
        ------
        ValueError
            If a direction is free and no reach is given.
        """
        half = self.to("target")._lever(point) * self._finite(reach)[..., None, :]
        return half @ half.swapaxes(-1, -2)

    def ellipse(
        self, level: float = 0.95, point: ArrayLike = (0.0, 0.0), count: int = 72, reach: float | None = None
    ) -> FloatArray:
        """The curve that encloses a moved source point with a given probability.

        For each point on the ellipse of the linearised spread, the most likely motion to it is carried through the
        exponential map, so that a spread of angles bends the curve.

        Parameters
        ----------
        level : float, default 0.95
            The probability.
        point : array_like of shape (2,), default (0.0, 0.0)
            In source coordinates; the origin is the scanner's position.
        count : int, default 72
            The number of points on the curve.
        reach : float, optional
            The deviation to assume for a free direction, world units.

        Returns
        -------
        ndarray of shape (count + 1, 2)
            Closed, in target coordinates.

        Raises
        ------
        ValueError
            If this is a batch, if a direction is free and no reach is given, or if the point, the level (a
            probability) or the count (1 or more) is invalid.
        """
        self._single("ellipse")
        spread = self.to("target")
        half = spread._lever(point) * spread._finite(reach)
        # A triangular root, which unlike eigenvectors is continuous where the ellipse is round.
        C = half @ half.T
        a = sqrt(C[0, 0])
        b = C[0, 1] / a if a > 0.0 else 0.0
        root = np.array([[a, 0.0], [b, sqrt(max(C[1, 1] - b * b, 0.0))]])
        turn = np.linspace(0.0, 2.0 * np.pi, validate.count(count, "count", 1) + 1)
        curve = np.stack([np.cos(turn), np.sin(turn)], axis=-1) @ root.T * sqrt(quantile(level, 2))
        motions = spread._motions(curve @ np.linalg.pinv(half).T * spread._finite(reach))
        points: FloatArray = motions.compose(spread.mean).apply(np.asarray(point, dtype=np.float64)[None])[:, 0]
        return points

    def sample(self, count: int, seed: int = 0, reach: float | None = None) -> Pose:
        """Poses drawn from the normal distribution through the exponential map.

        Parameters
        ----------
        count : int
            How many.
        seed : int, default 0
            The seed of the random numbers.
        reach : float, optional
            The deviation to assume for a free direction, world units.

        Returns
        -------
        Pose
            Of shape (count,).

        Raises
        ------
        ValueError
            If this is a batch, or if a direction is free and no reach is given.
        """
        self._single("sample")
        rng = np.random.default_rng(validate.count(seed, "seed"))
        return self.poses(rng.standard_normal((validate.count(count, "count", 1), 3)) * self._finite(reach))

    def poses(self, along: ArrayLike) -> Pose:
        """The poses at the given distances along each direction: the inverse of `along`.

        Parameters
        ----------
        along : array_like of shape (n, 3)
            World units.

        Returns
        -------
        Pose
            Of shape (n,).

        Raises
        ------
        ValueError
            If this is a batch, or if `along` is not rows of three finite numbers.
        """
        self._single("poses")
        motions = self._motions(se2.triples(along, "along"))
        return motions.compose(self.mean) if self.frame == "target" else self.mean.compose(motions)

    def words(self) -> str:
        """The free directions, the widest one, or how many are equally wide, in words, for a single pose."""
        self._single("words")
        return said(self.directions[:, 0], self.centre, float(self.radius), self.deviations)

    def __getitem__(self, rows: Any) -> Covariance:
        """The entries at `rows` of the batch: any numpy index of the leading axes."""
        at, names = leading(rows, self.mean.batch), ("mean", "deviations", "directions", "centre", "radius")
        return replace(self, **{name: getattr(self, name)[at] for name in names})

    def _single(self, name: str) -> None:
        if self.mean.batch:
            raise ValueError(f"{name}: of a batch of shape {self.mean.batch}, choose one by its index")

    def _finite(self, reach: float | None) -> FloatArray:
        if reach is not None:
            return np.where(self.free, validate.number(reach, "reach", 0.0), self.deviations)
        if self.free.any():
            direction = "" if self.mean.batch else f": {self.words()}"
            raise ValueError(f"reach: a direction has no finite spread{direction}; say how far to take it")
        return self.deviations

    def _scale(self) -> FloatArray:
        return np.stack([self.radius, *(np.ones_like(self.radius) for _ in "xy")], axis=-1)

    def _towards(self) -> FloatArray:
        """The matrix from a twist about the origin to scaled coordinates about the centre."""
        return self._scale()[..., :, None] * se2.shifted(self.centre)

    def _basis(self) -> FloatArray:
        """The directions as twists (angle, x, y) about the frame's origin, one per column."""
        return se2.shifted(-self.centre) @ (self.directions / self._scale()[..., :, None])

    def _lever(self, point: ArrayLike) -> FloatArray:
        """The velocity of a moved source point along each direction, (..., 2, 3), in target coordinates."""
        arm = self.mean.apply(se2.place(point)[None])[..., 0, :] - self.centre
        J = np.zeros((*self.mean.batch, 2, 3))
        J[..., 0, 1] = J[..., 1, 2] = 1.0
        J[..., 0, 0], J[..., 1, 0] = -arm[..., 1] / self.radius, arm[..., 0] / self.radius
        return J @ self.directions

    def _motions(self, along: FloatArray) -> Pose:
        """The motions at the given distances along each direction, (n, 3)."""
        shift = Pose.trusted(np.eye(2), self.centre)
        return shift.compose(se2.exp((along @ self.directions.T) / self._scale())).compose(shift.inverse())
