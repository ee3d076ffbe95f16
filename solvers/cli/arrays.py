"""Read clouds from files for the command line: NumPy's formats as well as those of `solvers.io`."""

from __future__ import annotations

import io
import math
import warnings
import zipfile
import zlib

import numpy as np

from solvers.core import validate
from solvers.core.arrays import AnyArray
from solvers.io import clouds
from solvers.io.clouds import CloudText
from solvers.io.text import told

NPY, ZIP = b"\x93NUMPY", b"PK\x03\x04"
PACKED = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)  # those that NumPy writes
BROKEN = (zipfile.BadZipFile, zlib.error, EOFError, NotImplementedError, OverflowError, RuntimeError, ValueError)
"""What zipfile raises if an archive is damaged, encrypted or of a later version."""


def read(data: bytes) -> CloudText:
    """Read the points from a file's bytes. Raises ValueError if they cannot be read."""
    if data.startswith(NPY):
        return _cloud(data, "a NumPy array")
    if data.startswith(ZIP):
        return _from_archive(data)
    return clouds.read(data)


def _from_archive(data: bytes) -> CloudText:
    """The array called "points" in an .npz, or its only array."""
    try:
        archive = zipfile.ZipFile(io.BytesIO(data))
    except BROKEN as error:
        raise _broken(error) from None
    names = [name for name in archive.namelist() if name.endswith(".npy")]
    name = "points.npy" if "points.npy" in names else names[0] if len(names) == 1 else ""
    if not name:
        contents = ", ".join(told(entry[:-4]) for entry in names[:9]) or "none"
        raise ValueError(f"expected one array or one called points, got: {contents}")
    if archive.getinfo(name).compress_type not in PACKED:
        raise ValueError(f"{told(name)} has a compression that NumPy never writes; save it with numpy.savez_compressed")
    if archive.getinfo(name).file_size > clouds.MOST_BYTES:
        raise ValueError(f"{told(name)} unpacks to more than the limit of {clouds.MOST_BYTES / 1e6:.0f} MB")
    try:
        member = archive.read(name)
    except BROKEN as error:
        raise _broken(error) from None
    return _cloud(member, f"the NumPy array {told(name[:-4])}")


def _broken(error: Exception) -> ValueError:
    return ValueError(f"a broken archive of NumPy arrays: {str(error) or 'it ends too early'}")


def _array(data: bytes, what: str) -> AnyArray:
    """Rows of two or three numbers, or records with fields x and y, and z if there is one. The header is checked
    against the size of the data before an array is made.
    """
    file = io.BytesIO(data)
    try:
        version = np.lib.format.read_magic(file)
    except ValueError as error:
        raise ValueError(f"a broken NumPy array: {error}") from None
    if version not in ((1, 0), (2, 0)):
        raise ValueError(f"a NumPy array of format version {version}; expected (1, 0) or (2, 0)")
    header = np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
    try:
        with warnings.catch_warnings(action="ignore"):
            shape, fortran, kind = header(file)
    except Exception:  # a header is a Python literal: from a damaged one NumPy raises almost anything
        raise ValueError("a broken NumPy array: its header cannot be read") from None
    axes = [axis for axis in "xyz" if axis in (kind.names or ())]
    if axes[:2] == ["x", "y"]:
        columns = [kind[axis].kind for axis in axes]
    else:
        axes, columns = [], [kind.kind]
    if kind.hasobject or not all(column in "fiu" for column in columns):
        raise ValueError(f"a NumPy array of {kind}; expected numbers, or records with numbers x and y")
    size = len(data) - file.tell()
    if not axes and (len(shape) != 2 or shape[1] not in (2, 3)):
        raise ValueError(f"{what} of shape {shape}; expected (n, 2) or (n, 3)")
    if math.prod(shape) * kind.itemsize != size:
        raise ValueError(f"a broken NumPy array: the header says {shape}, the data are {size} bytes")
    count = math.prod(shape) if axes else shape[0]
    if count > clouds.MOST_POINTS:
        raise ValueError(f"{count} points are more than the limit of {clouds.MOST_POINTS}")
    values = np.frombuffer(data, kind, offset=file.tell())
    if axes:  # a scan's rows one after the other
        return np.stack([values[axis] for axis in axes], axis=1, dtype=np.float64, casting="unsafe")
    return values.reshape(shape, order="F" if fortran else "C")


def _cloud(data: bytes, what: str) -> CloudText:
    """The finite rows, with a notice about the others."""
    with np.errstate(over="ignore", invalid="ignore"):  # numbers beyond float64 are left out below
        points = _array(data, what).astype(np.float64)
    points, notices, gaps = clouds.finite_rows(points)
    if not len(points):
        raise ValueError(f"{what} contains no points")
    return CloudText(validate.cloud(points, "points"), what, notices, gaps)
