"""Arguments as arrays: what would lose a mask, or is no array, is refused by name."""

import sys
from types import ModuleType

import numpy as np
import pytest

from solvers import Pose, register
from solvers.core.numbers import numbers
from solvers.uncertainty import exp


@pytest.mark.parametrize("sequence", [list, tuple])
def test_a_sequence_of_masked_rows_is_refused(sequence):
    """numpy would make a plain array of them, with the numbers that the masks hide."""
    rows = sequence([np.ma.array([1.0, 2.0], mask=[False, True]), np.ma.array([3.0, 4.0], mask=[True, False])])
    with pytest.raises(ValueError, match=r"^source: a masked array hides 1 number; leave its row out"):
        register(rows, np.eye(2), "icp")
    assert numbers(sequence([np.ma.array([1.0, 2.0]), [3.0, 4.0]]), "source").tolist() == [[1.0, 2.0], [3.0, 4.0]]


@pytest.mark.parametrize("kind", [TypeError, RuntimeError])
def test_an_object_that_gives_no_array_is_refused_by_name(kind):
    """Such as a tensor on a graphics card; its own words say what to do."""

    class Tensor:
        def __array__(self, dtype=None, copy=None):
            raise kind("copy it to the host first")

    with pytest.raises(ValueError, match=r"^target: Tensor gives no array: copy it to the host first$"):
        register(np.eye(2), Tensor(), "icp")


class Table:
    """A table that is an array of objects to numpy, like a data frame with a column of text."""

    def __init__(self, rows):
        self.rows = rows

    def __array__(self, dtype=None, copy=None):
        return np.array(self.rows, dtype=object)


@pytest.mark.parametrize(
    ("rows", "where"),
    [
        ([[1.0, 2], [np.float32(3), "wall"]], ", where row 1, column 1 is 'wall'"),
        ([[None, 1], [2, 3]], ", where row 0, column 0 is None"),
        ([[1, 2], [3, 4]], ""),
        ([1.0, "wall"], ""),
    ],
)
def test_a_table_is_told_where_it_has_no_number(rows, where):
    with pytest.raises(ValueError, match=f"^source: expected real numbers, got Table{where}$"):
        register(Table(rows), np.eye(2), "icp")


@pytest.mark.parametrize("name", ["numpy.ma", "logging"])
def test_a_module_that_another_thread_is_importing_is_not_used(name, monkeypatch):
    """It is listed before its content is there; numpy.ma comes with scipy, at a process's first large cloud."""
    monkeypatch.setitem(sys.modules, name, ModuleType(name))
    cloud = np.array([[0.0, 0.0], [2.0, 0.0], [0.0, 1.0]])
    assert register(cloud, cloud + 0.1, "icp").status


def test_what_underflows_is_zero_even_if_the_caller_has_numpy_raise():
    tiny = 1e-155 * np.array([[0.0, 0.0], [2.0, 0.0], [0.0, 1.0]])
    result = register(tiny, 1.001 * tiny, "icp")
    with np.errstate(all="raise"):
        assert result.rmse < 1e-155
        assert exp([1e-200, 1e-200, 0.0]).t.tolist() == [1e-200, 0.0]
        assert Pose.from_rotvec([1e-200, 0.0, 0.0]).R.diagonal().tolist() == [1.0, 1.0, 1.0]
