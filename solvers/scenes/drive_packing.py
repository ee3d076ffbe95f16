"""The file of a recorded drive: its ranges as differences along the beams, most of them in one byte."""

from __future__ import annotations

import numpy as np

from solvers.core.arrays import FloatArray

ESCAPE = 255
"""Takes the place of a difference that follows in two bytes."""


def packed(seconds: FloatArray, motion: FloatArray, centimetres: FloatArray) -> bytes:
    """Encode a recorded drive as its file stores it.

    The numbers of scans n and beams k, two bytes each; n rows of milliseconds and of
    the motion dx, dy, dφ in 1e-6 m and rad, four bytes each; then each beam's
    difference from the beam before, zigzag-encoded, in one byte or, after `ESCAPE`, in
    two.

    Parameters
    ----------
    seconds : ndarray of shape (n,)
        Times.
    motion : ndarray of shape (n, 3)
        dx, dy in metres and dφ in radians.
    centimetres : ndarray of shape (n, k)
        Whole numbers below 65536; neighbours differ by less than 32768, and the first
        of a row is below 32768.

    Returns
    -------
    bytes
        What `solvers.scenes.drive.telecom_loop` reads.
    """
    n, k = centimetres.shape
    table = np.rint(np.column_stack([seconds * 1e3, motion * 1e6])).astype("<i4")
    step = np.diff(centimetres.astype(np.int64), axis=1, prepend=0).ravel()
    out = bytearray(np.array([n, k], "<u2").tobytes() + table.tobytes())
    for v in np.where(step < 0, -2 * step - 1, 2 * step).tolist():
        out += bytes([v]) if v < ESCAPE else bytes([ESCAPE, v & 255, v >> 8])
    return bytes(out)


def unpacked(data: bytes, n: int, k: int) -> FloatArray:
    """The centimetres (n, k) of `packed`'s last part. Raises ValueError if its length is wrong."""
    raw = np.frombuffer(data, np.uint8)
    # The two bytes after an escape do not begin beams of their own.
    begins = np.ones(len(raw), dtype=np.bool_)
    for at in np.flatnonzero(raw == ESCAPE).tolist():
        if begins[at]:
            if at + 2 >= len(raw):
                raise ValueError("scans: the data end within a difference of two bytes")
            begins[at + 1 : at + 3] = False
    first = np.flatnonzero(begins)
    if len(first) != n * k:
        raise ValueError(f"scans: {len(first)} beams, and {n} scans of {k} need {n * k}")
    long = raw[first] == ESCAPE
    value = raw[first].astype(np.int64)
    value[long] = raw[first[long] + 1] + 256 * raw[first[long] + 2].astype(np.int64)
    step = np.where(value % 2, -(value + 1) // 2, value // 2)
    return np.asarray(np.cumsum(step.reshape(n, k), axis=1), dtype=np.float64)
