"""The drive's stored results are the solvers', and a damaged file is refused."""

from __future__ import annotations

import numpy as np
import pytest

from widgets.parts import drive_solved
from widgets.parts import drive_table as table


@pytest.mark.native
def test_the_table_is_what_the_solvers_find() -> None:
    """Recomputed from the scans, every pose agrees to half a centimetre, with the same loops
    and the same weights left to the wrong one.

    To write the file again: python -c "from widgets.parts import drive_solved; drive_solved.write()".
    """
    cached, result = table.table(), table.read(drive_solved.made())
    assert np.array_equal(cached.later, result.later)
    assert np.array_equal(cached.earlier, result.earlier)
    assert cached.ways.keys() == result.ways.keys()
    for name, way in result.ways.items():
        assert np.abs(way.t - cached.ways[name].t).max() < 0.005, name
        assert np.abs(way.R - cached.ways[name].R).max() < 0.001, name
    assert np.abs(result.loops.t - cached.loops.t).max() < 0.005
    assert cached.kept == pytest.approx(result.kept, abs=0.001)


def test_a_table_of_another_shape_is_refused() -> None:
    with open(table.FILE, "rb") as file:
        data = file.read()
    with pytest.raises(ValueError, match="reshape"):
        table.read(data[:-4])
