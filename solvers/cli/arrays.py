"""Clouds from files as they are read on a command line: NumPy's own beside all that `solvers.io` knows."""

from __future__ import annotations

import io
import math
import zipfile
from dataclasses import replace

import numpy as np

from solvers.core import validate
from solvers.core.arrays import AnyArray
from solvers.io import clouds
from solvers.io.clouds import CloudText

NPY, ZIP = b"\x93NUMPY", b"PK\x03\x04"


def read(data: bytes) -> CloudText:
    """The points of a file's bytes. Raises ValueError where they cannot be read."""
    if data.startswith(NPY):
        return _cloud(_array(data), "a NumPy array")
    if data.startswith(ZIP):
        return _from_archive(data)
    return clouds.read(data)


def _from_archive(data: bytes) -> CloudText:
    """The array called points of an .npz, or its only one."""
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            names = [name for name in archive.namelist() if name.endswith(".npy")]
            name = "points.npy" if "points.npy" in names else names[0] if len(names) == 1 else ""
            if not name:
                held = ", ".join(each[:-4] for each in names[:9]) or "none"
                raise ValueError(f"expected one array or one called points, got: {held}")
            if archive.getinfo(name).file_size > clouds.MOST_BYTES:
                raise ValueError(f"{name} unpacks to more than the {clouds.MOST_BYTES / 1e6:.0f} MB that are read")
            return _cloud(_array(archive.read(name)), f"the NumPy array {name[:-4]}")
    except (zipfile.BadZipFile, NotImplementedError, RuntimeError, EOFError) as error:
        raise ValueError(f"a broken archive of NumPy arrays: {error}") from None


def _array(data: bytes) -> AnyArray:
    """An array of numbers; the header is held to the size of the data before anything is made of it."""
    file = io.BytesIO(data)
    try:
        version = np.lib.format.read_magic(file)
        if version not in ((1, 0), (2, 0)):
            raise ValueError(f"version {version} of NumPy's format")
        header = np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
        shape, fortran, kind = header(file)
    except ValueError as error:
        raise ValueError(f"a broken NumPy array: {error}") from None
    if kind.kind not in "fiu":
        raise ValueError(f"a NumPy array of {kind}; expected numbers")
    if math.prod(shape) * kind.itemsize != len(data) - file.tell():
        raise ValueError(f"a broken NumPy array: the header says {shape}, the data are {len(data) - file.tell()} bytes")
    return np.frombuffer(data, kind, offset=file.tell()).reshape(shape, order="F" if fortran else "C")


def _cloud(values: AnyArray, what: str) -> CloudText:
    """The rows that are finite, with a notice on the others."""
    if values.ndim != 2 or values.shape[1] not in (2, 3):
        raise ValueError(f"{what} of shape {values.shape}; expected (n, 2) or (n, 3)")
    if len(values) > clouds.MOST_POINTS:
        raise ValueError(f"{len(values)} points are more than the {clouds.MOST_POINTS} that are read")
    points = values.astype(np.float64)
    whole = np.isfinite(points).all(axis=1)
    left = int((~whole).sum())
    if left == len(points):
        raise ValueError(f"{what} contains no points")
    found = CloudText(validate.cloud(points[whole], "points"), what)
    rows = "row" if left == 1 else "rows"
    return replace(found, notices=(f"{left} {rows} with NaN or infinity left out",)) if left else found
