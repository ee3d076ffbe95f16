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
    callback. A status is a number: comparing it with a string raises a TypeError, since
    the answer could only be False.

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
    """No pose in the searched region has an objective lower by more than the gap (`Result.gap`); it may still not be
    the true pose."""
    FINISHED = 6
    """The method took all of its steps: it has no convergence test."""

    @property
    def label(self) -> str:
        """The status in lower case, as it is shown: 'running', 'converged' and so on."""
        return self.name.lower()

    def __bool__(self) -> bool:
        """Whether the method stopped of its own accord: true for `CONVERGED`, `STALLED`, `PROVED` and
        `FINISHED`.
        """
        return self in ENDED

    def __str__(self) -> str:
        return self.label

    def __format__(self, spec: str) -> str:
        """As its label, also with a width; as its number with a format of numbers, such as `d`."""
        return format(int(self) if spec[-1:].isalpha() and spec[-1:] != "s" else self.label, spec)

    # Being equal to its label would not help: the array of numbers of a batch never is, and would silently say False.
    def __eq__(self, other: object) -> bool:
        _refuse_text(other)
        return super().__eq__(other)

    def __ne__(self, other: object) -> bool:
        _refuse_text(other)
        return super().__ne__(other)

    __hash__ = int.__hash__


def _refuse_text(value: object) -> None:
    if isinstance(value, str):
        name = value.upper() if value.upper() in Status.__members__ else Status.CONVERGED.name
        raise TypeError(
            f"a status is never equal to a text, here {str(value)!r}: compare it with Status.{name}, or its label with"
            f" {name.lower()!r}"
        )


RULED = (Status.CONVERGED, Status.PROVED)
"""The statuses that mean a stopping rule was met."""
ENDED = (*RULED, Status.STALLED, Status.FINISHED)
"""The statuses that mean the method stopped of its own accord."""


def ended(status: StatusArray | Status) -> BoolArray | bool:
    """Whether a run, or each of a batch, stopped of its own accord."""
    return status in ENDED if isinstance(status, Status) else np.isin(status, ENDED)


def statuses(batch: tuple[int, ...], status: Status = Status.RUNNING) -> StatusArray:
    """An array of one status, of shape `batch`."""
    return np.full(batch, status, dtype=np.int8)


def reasons(batch: tuple[int, ...]) -> ReasonArray:
    """An array of empty reasons, of shape `batch`."""
    return np.full(batch, "", dtype=object)


def mark(
    status: StatusArray, reason: ReasonArray, where: BoolArray, new: Status, words: str | ReasonArray = ""
) -> tuple[StatusArray, ReasonArray]:
    """`status` and `reason` with `new` and `words` (one for all problems, or one for each) at the running problems
    where `where` is true; copies if that changes anything. A problem that has stopped keeps its status and reason.
    """
    where = where & (status == Status.RUNNING)
    if not where.any():
        return status, reason
    return np.where(where, np.int8(new), status), np.where(where, np.asarray(words, dtype=object), reason)
