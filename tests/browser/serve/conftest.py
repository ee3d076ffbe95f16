"""The small site that the tests of `serve` show."""

from tests.sitegen.serve.conftest import live_site, small_checkout

__all__ = ["live_site", "small_checkout"]
