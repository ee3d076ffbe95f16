"""LZF as other programs write it: greedy, with copies as long as they can be."""

from __future__ import annotations

MOST_LITERALS, LONGEST, FARTHEST = 32, 264, 8192


def compress(data: bytes) -> bytes:
    """The LZF stream of these bytes."""
    out, literals, at = bytearray(), bytearray(), 0
    last: dict[bytes, int] = {}

    def flush() -> None:
        for begin in range(0, len(literals), MOST_LITERALS):
            run = literals[begin : begin + MOST_LITERALS]
            out.append(len(run) - 1)
            out.extend(run)
        literals.clear()

    while at < len(data):
        start = last.get(data[at : at + 3], -1)
        last[data[at : at + 3]] = at
        distance = at - start - 1
        length = 0
        if start >= 0 and distance < FARTHEST:
            while length < LONGEST and at + length < len(data) and data[start + length] == data[at + length]:
                length += 1
        if length < 3:
            literals.append(data[at])
            at += 1
            continue
        flush()
        code = length - 2
        out.append(min(code, 7) << 5 | distance >> 8)
        if code >= 7:
            out.append(code - 7)
        out.append(distance & 255)
        at += length
    flush()
    return bytes(out)
