"""The server's own address, as shown to the person who opens it."""

from __future__ import annotations

from pathlib import Path

import pytest

from sitegen.serve.static_files import StaticServer


@pytest.mark.parametrize(
    ("pair", "origin"),
    [
        (("127.0.0.1", 8000), "http://127.0.0.1:8000"),
        (("0.0.0.0", 8000), "http://127.0.0.1:8000"),
        (("::1", 8000, 0, 0), "http://[::1]:8000"),
        (("::", 8000, 0, 0), "http://[::1]:8000"),
    ],
)
def test_the_address_to_open_is_one_that_a_browser_takes(pair: tuple[object, ...], origin: str, tmp_path: Path) -> None:
    """Brackets around an IPv6 address; the wildcards of both families become this machine."""
    with StaticServer(tmp_path, ("127.0.0.1", 0)) as server:
        server.server_address = pair  # type: ignore[assignment]
        assert server.origin == origin
