"""How a run stopped. No stop is called a success: only the error against a known truth
can show that.
"""

from enum import IntEnum

import numpy as np

from solvers.core.arrays import BoolArray, ReasonArray, StatusArray


class Status(IntEnum):
    """The status of one problem; a batch holds these numbers in an int8 array.

    No stop is called a success: only the error against a known truth can show that.
    `RUNNING` is a problem that has not stopped, including one whose run was ended by a
    callback. A status is a number: compared with a text it raises a TypeError, since the
    answer could only be False.

    Examples
    --------
    >>> from solvers import Status, register
    >>> result = register([[0.0, 0.0], [0.0, 0.0]], [[1.0, 0.0], [2.0, 0.0]], "kabsch")
    >>> result.status is Status.DEGENERATE
    True
    >>> print(result.status.label, "-", result.reason)
    degenerate - all source points with weight are equal: the rotation is undefined
    >>> result.status.label == "degenerate"
    True
    """

    RUNNING = 0
    CONVERGED = 1
    """The method's own stopping rule was met (a closed form meets it in one step)."""
    STALLED = 2
    """No further step helps: none that was tried improves the objective, or the run cycles through a few poses."""
    CAPPED = 3
    """The allowed number of steps was used up, or of boxes in a search."""
    DEGENERATE = 4
    """The geometry does not determine the answer; the reason says why, in words."""
    PROVED = 5
    """No pose in the searched region has an objective lower by more than the gap (`Result.gap`); not that the pose is
    the true one."""
    FINISHED = 6
    """All steps that the method takes were taken: it has no test of rest."""

    @property
    def label(self) -> str:
        """The status in lower case, as it is shown: 'running', 'converged' and so on.
        """
        return self.name.lower()

    def __bool__(self) -> bool:
        """Whether the method came to an end of its own: true for `CONVERGED`, `STALLED`, `PROVED` and
        `FINISHED`.
        """
        return self in ENDED

    def __str__(self) -> str:
        return self.label

    # To equal its label as well would be no help: no batch's array of numbers does, and nothing would say so there.
    def __eq__(self, other: object) -> bool:
        _refuse_text(other)
        return super().__eq__(other)

    def __ne__(self, other: object) -> bool:
        _refuse_text(other)
        return super().__ne__(other)

    __hash__ = int.__hash__


def _refuse_text(other: object) -> None:
    if isinstance(other, str):
        name = other.upper() if other.upper() in Status.__members__ else Status.CONVERGED.name
        raise TypeError(
            f"a status is never equal to a text, here {str(other)!r}: compare it with Status.{name}, or its label with"
            f" {name.lower()!r}"
        )


RULED = (Status.CONVERGED, Status.PROVED)
"""The statuses of a stopping rule that was met."""
ENDED = (*RULED, Status.STALLED, Status.FINISHED)
"""The statuses of a method that came to an end of its own."""


def ended(status: StatusArray | Status) -> BoolArray | bool:
    """Whether a run, or each of a batch, came to an end of its own."""
    return status in ENDED if isinstance(status, Status) else np.isin(status, ENDED)


def statuses(batch: tuple[int, ...], status: Status = Status.RUNNING) -> StatusArray:
    """An array of one status, of shape `batch`."""
    return np.full(batch, status, dtype=np.int8)


def reasons(batch: tuple[int, ...], words: str = "") -> ReasonArray:
    """An array of one reason, of shape `batch`; an empty text where there is nothing to
    say.
    """
    return np.full(batch, words, dtype=object)


def mark(
    status: StatusArray, reason: ReasonArray, where: BoolArray, new: Status, words: str | ReasonArray = ""
) -> tuple[StatusArray, ReasonArray]:
    """`status` and `reason` with `new` and `words`, one for all or one for each, at the problems
    where `where` is true, copies where that changes anything; the first mark stays: a problem that is no
    longer running keeps its status and reason.
    """
    where = where & (status == Status.RUNNING)
    if not where.any():
        return status, reason
    return np.where(where, np.int8(new), status), np.where(where, np.asarray(words, dtype=object), reason)
