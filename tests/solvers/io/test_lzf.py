"""LZF streams: what was compressed comes back, and damage is a ValueError."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from solvers.io.lzf import decompress
from tests.solvers.io.compression import compress

patterns = st.lists(st.tuples(st.binary(min_size=1, max_size=9), st.integers(1, 400)), max_size=6)


@pytest.mark.parametrize(
    ("stream", "data"),
    [
        ("", b""),
        ("0261 6263", b"abc"),
        ("03 61626361 e01502 e01000 01 6161", b"abc" * 11 + b"a" * 28),  # as liblzf writes it
        ("0061 2000", b"aaaa"),  # three copies of a byte, from the one before
        ("00 61 e0ff 00", b"a" * 265),  # the longest copy
    ],
)
def test_a_stream_is_what_the_format_says(stream: str, data: bytes) -> None:
    """Literal runs, copies that overlap themselves, short and long ones, byte by byte."""
    assert decompress(bytes.fromhex(stream), len(data)) == data


@given(patterns)
def test_what_is_compressed_comes_back(parts: list[tuple[bytes, int]]) -> None:
    data = b"".join(pattern * times for pattern, times in parts)
    assert decompress(compress(data), len(data)) == data


@pytest.mark.parametrize(
    ("stream", "size"),
    [
        ("02 6162", 3),  # a literal run cut short
        ("00 61 20", 4),  # a copy without its distance
        ("00 61 e0", 9),
        ("00 61 e000", 10),
        ("00 61 2001", 4),  # a copy from before the beginning
        ("2000", 3),
        ("00 61", 2),  # fewer bytes than promised
        ("01 6161", 1),  # and more
        ("01 6161 e0ff 00", 2),
    ],
)
def test_damage_is_a_value_error(stream: str, size: int) -> None:
    with pytest.raises(ValueError, match=r"^the compressed points are damaged$"):
        decompress(bytes.fromhex(stream), size)


@given(st.binary(max_size=60), st.integers(0, 400))
def test_any_bytes_are_decompressed_or_refused(stream: bytes, size: int) -> None:
    """Never more than was asked for, and never another error."""
    try:
        data = decompress(stream, size)
    except ValueError:
        return
    assert len(data) == size
