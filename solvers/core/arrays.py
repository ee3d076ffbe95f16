"""The array types used in signatures: float64 for geometry, int64 wherever an integer's
width matters (wasm is 32-bit).
"""

from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

FloatArray: TypeAlias = NDArray[np.float64]
IntArray: TypeAlias = NDArray[np.int64]
BoolArray: TypeAlias = NDArray[np.bool_]
StatusArray: TypeAlias = NDArray[np.int8]
# Reasons in words: an object array, so that they are indexed, taken and put back like
# any other row.
ReasonArray: TypeAlias = NDArray[np.object_]
AnyArray: TypeAlias = NDArray[Any]


def leading(index: Any, axes: tuple[int, ...]) -> Any:
    """`index`, confined to the leading axes `axes`: a tuple or `...` becomes one integer array per axis, so that it
    cannot reach the axes after them; anything else is returned unchanged.
    """
    if not isinstance(index, tuple) and index is not Ellipsis:
        return index
    return np.unravel_index(np.arange(np.prod(axes, dtype=np.int64)).reshape(axes)[index], axes)


def restored(record: Any, state: dict[str, Any]) -> None:
    """`__setstate__` of a record with read-only arrays: pickle and deepcopy bring them back writable."""
    for name, value in state.items():
        for array in value if isinstance(value, tuple) else (value,):
            if isinstance(array, np.ndarray):
                array.flags.writeable = False
        object.__setattr__(record, name, value)
