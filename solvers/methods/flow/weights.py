"""The trained weights of the learned flows, one byte each, in small files beside this module.

Each column of an array is stored as whole numbers from −127 to 127 and one float32 factor. `pack` and `unpack` define
the format; `params` reads a method's file, which `python3 build.py train` writes.
"""

from __future__ import annotations

import os
from functools import cache

import numpy as np

from solvers.core.arrays import FloatArray
from solvers.methods.flow.network import shapes

FOLDER = os.path.join(os.path.dirname(__file__), "trained")
LEVELS = 127


def pack(arrays: dict[str, FloatArray]) -> bytes:
    """The network's arrays as bytes, in the order of `network.shapes`: for each, the factors of its columns, then its
    numbers.
    """
    parts = []
    for shape in shapes():
        values = np.asarray(arrays[shape.name], dtype=np.float64).reshape(-1, shape.size[-1])
        factor = (np.abs(values).max(axis=0) / LEVELS).astype("<f4")
        whole = np.rint(values / np.where(factor > 0, factor, 1).astype(np.float64)).clip(-LEVELS, LEVELS)
        parts += [factor.tobytes(), whole.astype(np.int8).tobytes()]
    return b"".join(parts)


def unpack(data: bytes) -> dict[str, FloatArray]:
    """The arrays of a packed network. Raises ValueError if the length does not match the network."""
    expected = sum(4 * shape.size[-1] + shape.count for shape in shapes())
    if len(data) != expected:
        raise ValueError(f"weights: {len(data)} bytes, and the network needs {expected}")
    arrays, at = {}, 0
    for shape in shapes():
        columns = shape.size[-1]
        factor = np.frombuffer(data, "<f4", columns, at).astype(np.float64)
        whole = np.frombuffer(data, np.int8, shape.count, at + 4 * columns)
        arrays[shape.name] = (whole.reshape(-1, columns) * factor).reshape(shape.size)
        at += 4 * columns + shape.count
    return arrays


@cache
def params(name: str, folder: str = FOLDER) -> dict[str, FloatArray]:
    """The network's arrays for the method `name`, read once."""
    with open(os.path.join(folder, f"{name}.int8"), "rb") as file:
        return unpack(file.read())
