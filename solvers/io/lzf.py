"""LZF, the compression of PCD files: literal runs, and copies of what was decompressed before."""

from __future__ import annotations

DAMAGE = "the compressed points are damaged"


def decompress(data: bytes, size: int) -> bytes:
    """Decompress an LZF stream of `size` bytes; raise ValueError if it is damaged.

    A control byte below 32 begins a literal run, one byte longer than it says. In any other the upper three bits are a
    copy's length, 7 if the next byte adds to it, less two; the lower five bits and the byte after that are the distance
    back to the copy's beginning, less one.
    """
    out = bytearray()
    at = 0
    while at < len(data) and len(out) <= size:
        control = data[at]
        if control < 32:
            out += data[at + 1 : at + control + 2]
            at += control + 2
            continue
        longer = control >> 5 == 7
        if at + 1 + longer >= len(data):
            raise ValueError(DAMAGE)
        length = (control >> 5) + 2 + (data[at + 1] if longer else 0)
        start = len(out) - ((control & 31) << 8) - data[at + 1 + longer] - 1
        if start < 0:
            raise ValueError(DAMAGE)
        copy = bytes(out[start : start + length])  # shorter than `length` if it overlaps itself: it then repeats
        out += (copy * (length // len(copy) + 1))[:length]
        at += 2 + longer
    if at != len(data) or len(out) != size:
        raise ValueError(DAMAGE)
    return bytes(out)
