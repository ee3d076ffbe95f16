"""Options of `ndt` that may be given as arrays."""

from __future__ import annotations

import numpy as np

from solvers.options import NdtOptions


def test_options_keep_what_they_were_given() -> None:
    """The caller's arrays may change later; equal options compare equal, and can be keys."""
    cells, corner = np.array([1.0, 0.5]), np.zeros(2)
    options = NdtOptions(cells=cells, offset=corner)  # type: ignore[arg-type]
    cells[:], corner[:] = -1.0, 9.0
    assert (options.cells, options.offset) == ((1.0, 0.5), (0.0, 0.0))
    assert options == NdtOptions(cells=[1.0, 0.5], offset=[0.0, 0.0])
    assert len({options, NdtOptions(cells=(1.0, 0.5))}) == 1
    assert NdtOptions(cells=1.0).cells == 1.0
